"""Comparison of finished runs: their main results, differences of their cases, and curves."""

from workflow.comparing.compared import Comparison, compare

__all__ = ["Comparison", "compare"]
