"""Rigs and their joints: what analyses share that make them move."""
