"""Loops, bolts and the structure on worn surfaces."""
