"""Wear against cycles: the linear regime after running-in, and its extrapolation.

Any smooth curve looks straight over a short stretch, and steps chosen by an error estimate may be
of very unequal length. A regime must therefore cover at least the last half of the run. It is
judged by mean slopes over intervals of a minimum length, so that rounding and the solver's
tolerance in a jump of a few cycles do not count, and many short jumps next to a long one are not
taken for evidence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array

# Slopes that differ from the mean slope of the regime by less than this share count as equal.
SLOPE_SPREAD = 0.02
# A regime has at least this number of intervals.
FEWEST_INTERVALS = 4
# Intervals shorter than this share of the regime are merged with the next one. Where every jump is
# twice as long as the one before, the fourth last jump is 1/15 of the last four together: such runs
# still give four intervals.
SHORTEST_INTERVAL = 1.0 / 32.0
# A regime must begin before this share of the computed cycles. Growth as N^m then passes for linear
# only if m is within 0.08 of 1.
LATEST_START = 0.5


@dataclass(frozen=True)
class LinearRegime:
    """A range of cycles over which a quantity grows at a constant rate.

    Parameters
    ----------
    start
        Cycles at which the regime begins.
    rate
        Growth of the quantity per cycle.
    last_cycles, last_value
        Cycles and value at the end of the computation.
    trend
        Remaining change of the rate per cycle, by least squares over the intervals of the regime.
    scatter
        Largest deviation of an interval's slope from that trend line, per cycle.
    """

    start: float
    rate: float
    last_cycles: float
    last_value: float
    trend: float
    scatter: float

    def extrapolate(self, cycles: Array) -> Array:
        """Return the extrapolated quantity at ``cycles`` beyond those computed."""
        return self.last_value + self.rate * (cycles - self.last_cycles)

    def uncertainty(self, cycles: Array) -> Array:
        """Return the one-sided bound of the error of :meth:`extrapolate` at ``cycles``.

        The mean rate is taken to hold in the middle N0 of the regime, and to go on changing by
        ``trend`` per cycle::

            U(N) = |trend| ∫ (N' - N0) dN' + scatter (N - N_last),  N' from N_last to N.

        This is a bound while the rate drifts no faster than it did in the regime, as it does while
        running-in dies away. It does not cover new events (the contact reaches an edge, a coating
        is worn through), nor the errors of grid and wear step, which the computed values share.
        """
        ahead = cycles - self.last_cycles
        from_middle = 0.5 * (self.last_cycles - self.start)
        bound: Array = abs(self.trend) * ahead * (from_middle + 0.5 * ahead) + self.scatter * ahead
        return bound


def linear_regime(cycles: Array, values: Array) -> LinearRegime | None:
    """Return the longest stretch up to the end in which all slopes agree, or None if there is none.

    Running-in ends where the regime starts.

    Parameters
    ----------
    cycles, values
        Cycles, ascending, and the quantity at these cycles, both ``(n,)``.

    Raises
    ------
    InputError
        If cycles do not ascend, or values are not equally many.

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
        raise InputError("cycles must ascend: give each once, the smallest first")
    for first in range(len(cycles) - FEWEST_INTERVALS):
        if cycles[first] > LATEST_START * cycles[-1]:
            return None
        regime = _regime(cycles[first:], values[first:])
        if regime is not None:
            return regime
    return None


def _regime(cycles: Array, values: Array) -> LinearRegime | None:
    """Return the stretch as a regime, or None if it is not straight or has too few intervals."""
    ends = _interval_ends(cycles)
    lengths = np.diff(cycles[ends])
    length = float(cycles[-1] - cycles[0])
    rate = float(values[-1] - values[0]) / length
    slopes = np.diff(values[ends]) / lengths
    if len(slopes) < FEWEST_INTERVALS or not rate > 0.0:
        return None
    if np.abs(slopes - rate).max() > SLOPE_SPREAD * rate:
        return None
    # Weighted by the lengths of the intervals, the fitted line has the mean rate at the middle of
    # the regime.
    middles = 0.5 * (cycles[ends][1:] + cycles[ends][:-1]) - 0.5 * (cycles[0] + cycles[-1])
    trend = float(np.sum(lengths * middles * (slopes - rate)) / np.sum(lengths * middles**2))
    scatter = float(np.abs(slopes - rate - trend * middles).max())
    return LinearRegime(
        float(cycles[0]), rate, float(cycles[-1]), float(values[-1]), trend, scatter
    )


def _interval_ends(cycles: Array) -> list[int]:
    """Return the indices of the ends of intervals of sufficient length, from 0 to the last."""
    shortest = SHORTEST_INTERVAL * (cycles[-1] - cycles[0])
    ends = [0]
    for place in range(1, len(cycles)):
        if cycles[place] - cycles[ends[-1]] >= shortest:
            ends.append(place)
    # A remainder at the end is merged with the last interval.
    if len(ends) > 1:
        ends.pop()
    return [*ends, len(cycles) - 1]
