"""Periodic motions of structures with joints, by harmonic balance."""
