"""Names of the sources of error and of the results whose errors are estimated."""

from __future__ import annotations

# Sources of error, in the order of their datasets.
PARTS = ("link", "mesh", "slot", "increments", "grid", "steps", "coupling", "solver")
# Results with estimated errors, by name and in words: wear, and pressures.
WORN = {"depth": "depth", "volume": "volume"}
PRESSURES = {
    "peak_pressure": "unworn peak pressure",
    "worn_peak_pressure": "worn peak pressure",
}
