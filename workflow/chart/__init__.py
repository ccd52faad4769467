"""Error against cost: each approximation of a case on a ladder of settings, and what to choose."""

from workflow.chart.run import Chart, accuracy_of, chart_case

__all__ = ["Chart", "accuracy_of", "chart_case"]
