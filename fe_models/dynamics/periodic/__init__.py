"""Periodic motions by harmonic balance."""
