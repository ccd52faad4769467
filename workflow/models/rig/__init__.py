"""Vibrating structures with joints, and the laws of their joints."""
