"""95 % bands of what the runs of a sample give: of numbers, and of curves.

A band goes from the 2.5 to the 97.5 % quantile of the runs. How well these are known is told by
the order statistics between which the quantile of all possible runs lies in at least 95 of 100
samples, whatever the distribution (David and Nagaraja 2003, *Order Statistics*, section 7.1): for
the outer side of a band that takes 146 runs. It holds for independent draws; a Latin hypercube is
mostly better.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sa_solver.types import Array

LOWER, UPPER = 0.025, 0.975
# From here on the quantiles lie within the runs: k/(n + 1) for the k-th.
FEWEST = 39
# A step back of less, in what a curve spans, is rounding.
STILL = 1e-9
# Places of a piece of a band.
MOST_PLACES = 400


class Piece(NamedTuple):
    """A band from turn to turn: places ``(m,)``, its lower side, the median, its upper side."""

    places: Array
    lower: Array
    median: Array
    upper: Array


def band_of(values: Array) -> dict[str, object] | None:
    """The band of numbers ``(n,)``, and between what each side is known; None of too few.

    None in place of a number is one that so many runs cannot tell.
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
    """Two of the numbers between which the quantile lies in 95 % of samples."""
    from scipy.stats import binom

    first, last = binom.ppf([LOWER, UPPER], len(ordered), quantile).astype(int)
    low = float(ordered[first - 1]) if first >= 1 else None
    high = float(ordered[last]) if last < len(ordered) else None
    return [low, high]


def quantiles(values: Array) -> Array:
    """Lower side, median and upper side ``(3, m)`` of what a sample gives ``(runs, m)``."""
    return np.quantile(values, [LOWER, 0.5, UPPER], axis=0, method="weibull")


def curve_band(
    curves: Sequence[tuple[Array, Array]],
    fewest: int = FEWEST,
    sides: Callable[[Array], Array] = quantiles,
) -> list[Piece]:
    """The band of curves, each x and y ``(n,)``, piece by piece between their turns in x.

    ``sides`` are those of the values at a place. Empty where curves do not turn alike, or are too
    few: there is no place to compare them at. It ends where the first of them does: those that go
    on, as runs that dissipate more, are not all.
    """
    cut = [_pieces(x, y) for x, y in curves if len(x) > 1]
    if len(cut) < fewest or len({len(pieces) for pieces in cut}) > 1:
        return []
    return [_band(pieces, sides) for pieces in zip(*cut, strict=True)]


def _pieces(x: Array, y: Array) -> list[tuple[Array, Array]]:
    """A curve cut where it turns in x; each piece ascends."""
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
