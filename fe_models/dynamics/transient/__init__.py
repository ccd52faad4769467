"""Time integration of structures with joints, and evaluation of measured motions."""
