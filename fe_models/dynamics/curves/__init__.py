"""Curves of periodic motions: forced responses, backbones, nonlinear modes, bifurcations."""
