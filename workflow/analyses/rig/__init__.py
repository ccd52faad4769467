"""Rigs and their joints, shared by all analyses with motion."""
