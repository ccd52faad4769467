"""Error-cost charts: the settings of each approximation of a case, and which of them to choose."""

from workflow.chart.run import Chart, accuracy_of, chart_case

__all__ = ["Chart", "accuracy_of", "chart_case"]
