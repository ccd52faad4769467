"""Closed forms that the solvers are measured against, in tests and in reports."""
