"""Fourier transforms of zero-padded fields, and compiled loops over grids."""
