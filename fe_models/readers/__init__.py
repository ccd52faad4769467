"""Readers of mesh files written by other programs."""
