"""95 % bands of the results of a sample of runs, for numbers and for curves.

A band extends from the 2.5 to the 97.5 % quantile of the runs. The accuracy of a quantile is given
by two order statistics that enclose the quantile of all possible runs in at least 95 of 100
samples, whatever the distribution (David and Nagaraja 2003, *Order Statistics*, section 7.1). For
the outer limit of a band this takes 146 runs. The interval holds for independent draws; a Latin
hypercube is mostly more accurate.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sa_solver.types import Array

LOWER, UPPER = 0.025, 0.975
# Fewest runs for which the quantiles lie within the runs: the k-th run is at k/(n + 1).
FEWEST = 39
# Smaller steps backward, relative to the range of a curve, are rounding.
STILL = 1e-9
# Largest number of places in a piece of a band.
MOST_PLACES = 400


class Piece(NamedTuple):
    """Band between two turns of a curve: places ``(m,)``, lower side, median, and upper side."""

    places: Array
    lower: Array
    median: Array
    upper: Array


def band_of(values: Array) -> dict[str, object] | None:
    """Return the band of numbers ``(n,)`` and the intervals of its sides; None for too few.

    None in place of a limit means that more runs are needed to determine it.
    """
    known = np.sort(values[np.isfinite(values)])
    if len(known) < FEWEST:
        return None
    lower, upper = np.quantile(known, [LOWER, UPPER], method="weibull").tolist()
    return {
        "lower": lower,
        "upper": upper,
        "lower_within": _known_within(known, LOWER),
        "upper_within": _known_within(known, UPPER),
    }


def _known_within(ordered: Array, quantile: float) -> list[float | None]:
    """Return two of the numbers that enclose the quantile in 95 % of samples."""
    from scipy.stats import binom

    first, last = binom.ppf([LOWER, UPPER], len(ordered), quantile).astype(int)
    low = float(ordered[first - 1]) if first >= 1 else None
    high = float(ordered[last]) if last < len(ordered) else None
    return [low, high]


def quantiles(values: Array) -> Array:
    """Return lower side, median and upper side ``(3, m)`` of a sample of values ``(runs, m)``."""
    return np.quantile(values, [LOWER, 0.5, UPPER], axis=0, method="weibull")


def curve_band(
    curves: Sequence[tuple[Array, Array]],
    fewest: int = FEWEST,
    sides: Callable[[Array], Array] = quantiles,
) -> list[Piece]:
    """Return the band of curves, each x and y ``(n,)``, in pieces between their turns in x.

    ``sides`` maps the values at a place to the sides of the band. The result is empty if the curves
    have different numbers of turns, and so no common places, or if there are too few of them. A
    piece ends where the first curve ends: beyond it, as for runs that dissipate more, some are
    missing.
    """
    cut = [_pieces(x, y) for x, y in curves if len(x) > 1]
    if len(cut) < fewest or len({len(pieces) for pieces in cut}) > 1:
        return []
    return [_band(pieces, sides) for pieces in zip(*cut, strict=True)]


def _pieces(x: Array, y: Array) -> list[tuple[Array, Array]]:
    """Return the pieces of a curve between its turns in x, each with ascending x."""
    steps = np.diff(x)
    moving = np.flatnonzero(np.abs(steps) > STILL * max(float(np.ptp(x)), np.finfo(float).tiny))
    ways = np.sign(steps[moving])
    turns = moving[1:][ways[1:] != ways[:-1]]
    ends = [0, *turns.tolist(), len(x) - 1]
    parts = [slice(a, b + 1) for a, b in pairwise(ends)]
    return [_ascending(x[part], y[part]) for part in parts]


def _ascending(x: Array, y: Array) -> tuple[Array, Array]:
    return (x, y) if x[-1] >= x[0] else (x[::-1], y[::-1])


def _band(pieces: Sequence[tuple[Array, Array]], sides: Callable[[Array], Array]) -> Piece:
    first, last = max(x[0] for x, _ in pieces), min(x[-1] for x, _ in pieces)
    places = np.unique(np.concatenate([x for x, _ in pieces]))
    places = places[(places >= first) & (places <= last)]
    if len(places) > MOST_PLACES:
        places = places[np.linspace(0, len(places) - 1, MOST_PLACES).round().astype(int)]
    values = np.array([np.interp(places, x, y) for x, y in pieces])
    return Piece(places, *sides(values))
