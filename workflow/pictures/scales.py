"""Factors from the units of results to those of figures."""

# Factors from mm to µm, from N/mm to N/µm, and from N mm to J.
TO_MICRONS, PER_MICRON, TO_JOULES = 1e3, 1e-3, 1e-3
