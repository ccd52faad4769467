"""Masing's rule: any loading history from the curve of first loading.

Where the normal load is constant, a reversal starts a curve that is the first one doubled in both
directions, since every point must first unload twice its friction; a loop once closed is forgotten.
It holds for tractions and for rigid motions of any contact whose stuck zone shrinks steadily on
first loading, which is so for one tangential load, one moment, or loads in proportion.

Source: Mindlin & Deresiewicz 1953, J. Appl. Mech. 20, 327, doi:10.1115/1.4010702 (sphere); Johnson
1985, *Contact Mechanics*, section 7.4.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypeVar

from sa_solver.errors import InputError
from sa_solver.types import Array

_Response = TypeVar("_Response", float, Array)


def superpose(first_loading: Callable[[float], _Response], loads: Sequence[float]) -> _Response:
    """Response after ``loads``, the turning points of the load in order up to the present one.

    ``first_loading(load)`` is the response on first loading, an odd function of the load: a float
    or an array of any shape. The body starts unloaded. Points on the way from one turning point to
    the next may be listed too. Raises ``InputError`` if ``loads`` is empty.
    """
    if not loads:
        raise InputError("a loading history needs at least one load")
    remembered = _remembered(loads)
    total = first_loading(remembered[1])
    for start, end in pairwise(remembered[1:]):
        total = total + 2.0 * first_loading(0.5 * (end - start))
    return total


def _remembered(loads: Sequence[float]) -> list[float]:
    """Turning points that still matter, from the unloaded state 0 to the present load."""
    points = [0.0]
    for load in loads:
        if len(points) > 1 and (load - points[-1]) * (points[-1] - points[-2]) >= 0.0:
            points.pop()  # the load went on in the same direction
        while len(points) > 1 and abs(load - points[-1]) >= _reach(points):
            # The loop is closed: back to the curve it left, or to that of first loading.
            del points[-1 if len(points) == 2 else -2 :]
        points.append(load)
    return points


def _reach(points: list[float]) -> float:
    """How far the load may move from the last turning point without closing a loop."""
    last = abs(points[-1] - points[-2])
    return 2.0 * last if len(points) == 2 else last
