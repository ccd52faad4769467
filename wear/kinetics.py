"""Wear against cycles: the linear regime after running-in, and its extrapolation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array

# Slopes within this share of the mean slope of the regime count as equal.
SLOPE_SPREAD = 0.02
# Fewer intervals than this are no regime.
FEWEST_INTERVALS = 4


@dataclass(frozen=True)
class LinearRegime:
    """A quantity grows by ``rate`` per cycle from ``start`` cycles on."""

    start: float
    rate: float
    last_cycles: float
    last_value: float

    def extrapolate(self, cycles: Array) -> Array:
        """The quantity at ``cycles`` beyond those computed: an extrapolation, not a computation."""
        return self.last_value + self.rate * (cycles - self.last_cycles)


def linear_regime(cycles: Array, values: Array) -> LinearRegime | None:
    """The longest stretch up to the end in which all slopes agree, or None while there is none.

    ``cycles`` and ``values`` ``(n,)``, both ascending.
    """
    slopes = np.diff(values) / np.diff(cycles)
    for first in range(len(slopes) - FEWEST_INTERVALS + 1):
        rest = slopes[first:]
        rate = float((values[-1] - values[first]) / (cycles[-1] - cycles[first]))
        if rate > 0.0 and np.abs(rest - rate).max() <= SLOPE_SPREAD * rate:
            return LinearRegime(float(cycles[first]), rate, float(cycles[-1]), float(values[-1]))
    return None
