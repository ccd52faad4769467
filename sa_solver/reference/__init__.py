"""Closed-form solutions with which the solvers are compared, in tests and in reports."""
