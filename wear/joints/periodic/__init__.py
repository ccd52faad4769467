"""Joints over one period of a given motion."""
