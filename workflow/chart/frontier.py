"""Efficient points of error against cost, and the cheapest combination of several axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import compress, product
from math import inf, isfinite


def efficient(costs: Sequence[float], errors: Sequence[float]) -> list[bool]:
    """Return which points are efficient: none as cheap is more accurate, nor the reverse.

    Of points with equal cost and error, the first counts.
    """
    order = sorted(range(len(costs)), key=lambda k: (costs[k], errors[k], k))
    on_frontier, best = [False] * len(costs), inf
    for k in order:
        if errors[k] < best:
            on_frontier[k], best = True, errors[k]
    return on_frontier


@dataclass(frozen=True)
class Option:
    """Choice on one axis: its cost relative to that of the case's own settings, and its error."""

    name: str
    ratio: float
    error: float


@dataclass(frozen=True)
class Combination:
    """Choice on every axis: rungs by name of the axis, sum of the errors, product of the costs."""

    rungs: Mapping[str, str] = field(default_factory=dict)
    error: float = 0.0
    seconds_ratio: float = 1.0


def cheapest(axes: Mapping[str, Sequence[Option]], accuracy: float) -> Combination | None:
    """Return the cheapest choice on every axis whose errors add up to at most ``accuracy``.

    Returns None if there is none. Each axis was varied alone: the sum of the errors is a bound as
    far as the errors do not interact, and the product of the costs is an estimate.
    """
    kept = [Combination()]
    for axis, options in axes.items():
        grown = [
            Combination(
                {**choice.rungs, axis: option.name},
                choice.error + option.error,
                choice.seconds_ratio * option.ratio,
            )
            for choice, option in product(kept, options)
        ]
        # A combination that is not efficient so far cannot become part of an efficient one.
        ratios, errors = [c.seconds_ratio for c in grown], [c.error for c in grown]
        kept = list(compress(grown, efficient(ratios, errors)))
    met = [choice for choice in kept if isfinite(choice.error) and choice.error <= accuracy]
    return min(met, key=lambda choice: choice.seconds_ratio, default=None)
