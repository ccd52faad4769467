"""Steady vibration of structures with joints, by harmonic balance."""
