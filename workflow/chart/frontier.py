"""What is worth its cost: efficient points, and the cheapest combination of several axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
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
    """A choice on every axis: names in their order, costs multiplied, errors added."""

    names: tuple[str, ...] = ()
    ratio: float = 1.0
    error: float = 0.0


def cheapest(axes: Sequence[Sequence[Option]], accuracy: float) -> Combination | None:
    """The cheapest choice on every axis whose errors add up to ``accuracy`` at most, if any.

    Each axis was varied alone: that errors add is a bound as far as they do not feed each other,
    and that costs multiply an estimate.
    """
    kept = [Combination()]
    for options in axes:
        grown = [
            Combination((*c.names, o.name), c.ratio * o.ratio, c.error + o.error)
            for c, o in product(kept, options)
        ]
        # What is no frontier point so far is none of any longer combination either.
        flags = efficient([choice.ratio for choice in grown], [choice.error for choice in grown])
        kept = [choice for choice, flag in zip(grown, flags, strict=True) if flag]
    met = [choice for choice in kept if isfinite(choice.error) and choice.error <= accuracy]
    return min(met, key=lambda choice: choice.ratio, default=None)
