"""Masing's rule: the response to any loading history from the curve of first loading.

Under a constant normal load, the curve after a reversal is that of first loading, enlarged by 2 in
both directions, because every point must first unload twice its friction. A closed loop has no
effect on the later response. The rule holds for tractions and for rigid motions of any contact
whose sticking zone shrinks steadily on first loading. This is so for one tangential load, for one
moment, and for proportional loads.

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
    """Return the response after the turning points ``loads``, in order up to the present load.

    ``first_loading(load)`` is the response on first loading: an odd function of the load that
    returns a float or an array of any shape. The body starts unloaded. ``loads`` may contain points
    between turning points. Raises ``InputError`` if ``loads`` is empty.
    """
    if not loads:
        raise InputError("a loading history is empty: give at least one load")
    remembered = _remembered(loads)
    total = first_loading(remembered[1])
    for start, end in pairwise(remembered[1:]):
        total = total + 2.0 * first_loading(0.5 * (end - start))
    return total


def _remembered(loads: Sequence[float]) -> list[float]:
    """Return the turning points that affect the response, from the unloaded state 0 on."""
    points = [0.0]
    for load in loads:
        if len(points) > 1 and (load - points[-1]) * (points[-1] - points[-2]) >= 0.0:
            points.pop()  # The load continued in the same direction.
        while len(points) > 1 and abs(load - points[-1]) >= _reach(points):
            # The loop is closed: the response is on the curve before it, or on first loading.
            del points[-1 if len(points) == 2 else -2 :]
        points.append(load)
    return points


def _reach(points: list[float]) -> float:
    """Return how far the load may move from the last turning point without closing a loop."""
    last = abs(points[-1] - points[-2])
    return 2.0 * last if len(points) == 2 else last
