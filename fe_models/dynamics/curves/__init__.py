"""Curves of periodic motions: forced responses, nonlinear modes, bifurcations."""
