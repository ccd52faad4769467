"""Wear against cycles: the linear regime after running-in, and its extrapolation.

A smooth curve is straight over any short stretch, and steps chosen by an error estimate may be very
unequal. So a regime must take up the last half of the run at least, and is judged by the mean
slopes of stretches that none of the jumps is too short for: rounding and solver tolerance do not
count in a jump of a few cycles, and many short jumps beside a long one do not count as evidence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array

# Slopes within this share of the mean slope of the regime count as equal.
SLOPE_SPREAD = 0.02
# Fewer intervals than this are no regime.
FEWEST_INTERVALS = 4
# Intervals shorter than this share of the regime are joined with what follows. Jumps that double
# make the fourth last 1/15 of all that follows its beginning: they still give four intervals.
SHORTEST_INTERVAL = 1.0 / 32.0
# A regime begins before this share of the computed cycles. Growth N^m then passes for linear only
# if m is within 0.08 of 1.
LATEST_START = 0.5


@dataclass(frozen=True)
class LinearRegime:
    """A quantity grows by ``rate`` per cycle from ``start`` cycles on.

    ``trend`` is the change of the rate per cycle that is left in the regime (least squares over its
    intervals), ``scatter`` the largest distance of an interval's slope from that line, per cycle.
    """

    start: float
    rate: float
    last_cycles: float
    last_value: float
    trend: float
    scatter: float

    def extrapolate(self, cycles: Array) -> Array:
        """The quantity at ``cycles`` beyond those computed: an extrapolation, not a computation."""
        return self.last_value + self.rate * (cycles - self.last_cycles)

    def uncertainty(self, cycles: Array) -> Array:
        """How far from ``extrapolate`` the quantity may be at ``cycles``, one-sided.

        With the mean rate holding in the middle N0 of the regime, and the rate going on to change
        by ``trend`` per cycle::

            U(N) = |trend| ∫ (N' - N0) dN' + scatter (N - N_last),  N' from N_last to N.

        A bound while the rate drifts no faster than it did in the regime, which is so where
        running-in dies away; not where something new happens later (the contact reaches an edge, a
        coating is worn through), and not for errors of grid and wear step, which the computed
        values share.
        """
        ahead = cycles - self.last_cycles
        from_middle = 0.5 * (self.last_cycles - self.start)
        bound: Array = abs(self.trend) * ahead * (from_middle + 0.5 * ahead) + self.scatter * ahead
        return bound


def linear_regime(cycles: Array, values: Array) -> LinearRegime | None:
    """The longest stretch up to the end in which all slopes agree, or None while there is none.

    ``cycles`` and ``values`` ``(n,)``, both ascending. Running-in ends where the regime starts.
    Raises InputError for cycles that do not ascend, or another number of values.

    Examples
    --------
    A volume that grows evenly once the contact has run in:

    >>> import numpy as np
    >>> from wear import linear_regime
    >>> cycles = np.linspace(0.0, 1e5, 21)
    >>> volume = 2e-7 * cycles + 1e-3 * (1.0 - np.exp(-cycles / 5e3))
    >>> regime = linear_regime(cycles, volume)
    >>> print(f"from {regime.start:.0f} cycles on {regime.rate:.3e} mm^3 a cycle")
    from 20000 cycles on 2.002e-07 mm^3 a cycle
    >>> print(f"{regime.extrapolate(2e5):.4f} +- {regime.uncertainty(2e5):.4f} mm^3 of 0.0410")
    0.0410 +- 0.0003 mm^3 of 0.0410
    """
    cycles = checks.array("cycles", cycles, (None,))
    values = checks.array("values", values, cycles.shape)
    if np.any(np.diff(cycles) <= 0.0):
        raise InputError("cycles that do not ascend: give each once, the smallest first")
    for first in range(len(cycles) - FEWEST_INTERVALS):
        if cycles[first] > LATEST_START * cycles[-1]:
            return None
        regime = _regime(cycles[first:], values[first:])
        if regime is not None:
            return regime
    return None


def _regime(cycles: Array, values: Array) -> LinearRegime | None:
    """The stretch as a regime, None if it is not straight, or not shown to be."""
    ends = _interval_ends(cycles)
    lengths = np.diff(cycles[ends])
    length = float(cycles[-1] - cycles[0])
    rate = float(values[-1] - values[0]) / length
    slopes = np.diff(values[ends]) / lengths
    if len(slopes) < FEWEST_INTERVALS or not rate > 0.0:
        return None
    if np.abs(slopes - rate).max() > SLOPE_SPREAD * rate:
        return None
    # Fitted to lengths as weights, the line has the mean rate in the middle of the regime.
    middles = 0.5 * (cycles[ends][1:] + cycles[ends][:-1]) - 0.5 * (cycles[0] + cycles[-1])
    trend = float(np.sum(lengths * middles * (slopes - rate)) / np.sum(lengths * middles**2))
    scatter = float(np.abs(slopes - rate - trend * middles).max())
    return LinearRegime(
        float(cycles[0]), rate, float(cycles[-1]), float(values[-1]), trend, scatter
    )


def _interval_ends(cycles: Array) -> list[int]:
    """Places of the ends of intervals that are not too short, from 0 to the last."""
    shortest = SHORTEST_INTERVAL * (cycles[-1] - cycles[0])
    ends = [0]
    for place in range(1, len(cycles)):
        if cycles[place] - cycles[ends[-1]] >= shortest:
            ends.append(place)
    # What is left over at the end belongs to the last interval.
    if len(ends) > 1:
        ends.pop()
    return [*ends, len(cycles) - 1]
