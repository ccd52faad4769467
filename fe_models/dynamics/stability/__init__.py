"""Stability of periodic motions, by Floquet multipliers."""
