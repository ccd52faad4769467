"""Finished runs side by side: their main results, what differs in their cases, their curves."""

from workflow.comparing.compared import Comparison, compare

__all__ = ["Comparison", "compare"]
