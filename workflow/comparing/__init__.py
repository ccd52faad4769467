"""Comparison of finished runs: their main results, differences of their cases, and curves."""

from workflow.comparing.compared import ComparedRuns, compare

__all__ = ["ComparedRuns", "compare"]
