"""From the units of results to those that are shown."""

# mm to µm, N/mm to N/µm, N mm to J.
TO_MICRONS, PER_MICRON, TO_JOULES = 1e3, 1e-3, 1e-3
