"""Solvers for the linear systems of structures, and for complementarity."""
