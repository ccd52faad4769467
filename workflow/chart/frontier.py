"""What is worth its cost: efficient points, and the cheapest combination of several axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import compress, product
from math import inf, isfinite


def efficient(costs: Sequence[float], errors: Sequence[float]) -> list[bool]:
    """Which points are on the frontier: nothing as cheap is more accurate, nor the reverse.

    Of points alike in both the first counts.
    """
    order = sorted(range(len(costs)), key=lambda k: (costs[k], errors[k], k))
    on_frontier, best = [False] * len(costs), inf
    for k in order:
        if errors[k] < best:
            on_frontier[k], best = True, errors[k]
    return on_frontier


@dataclass(frozen=True)
class Option:
    """A choice on one axis: its cost over that of the case's own settings, and its error."""

    name: str
    ratio: float
    error: float


@dataclass(frozen=True)
class Combination:
    """A choice on every axis: rungs by the axis' name, errors added, costs multiplied."""

    rungs: Mapping[str, str] = field(default_factory=dict)
    error: float = 0.0
    seconds_ratio: float = 1.0


def cheapest(axes: Mapping[str, Sequence[Option]], accuracy: float) -> Combination | None:
    """The cheapest choice on every axis whose errors add up to ``accuracy`` at most, if any.

    Each axis was varied alone: that errors add is a bound as far as they do not feed each other,
    and that costs multiply an estimate.
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
        # What is no frontier point so far is none of any longer combination either.
        ratios, errors = [c.seconds_ratio for c in grown], [c.error for c in grown]
        kept = list(compress(grown, efficient(ratios, errors)))
    met = [choice for choice in kept if isfinite(choice.error) and choice.error <= accuracy]
    return min(met, key=lambda choice: choice.seconds_ratio, default=None)
