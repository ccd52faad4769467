"""Errors of wear steps: their estimate, their bound, and the length of a step that meets it.

The error of a run is told by a companion: the same run, under the same loads, by steps of twice the
length. It goes its own way from the first cycle to the last, so that whatever wear does to an
error, pressing it away or letting it grow, it does to the difference of the two: global
extrapolation (Shampine & Watts 1976, doi:10.1145/355666.355671). Of steps of order p that is
2^p - 1 times the error of the shorter ones. It takes half as many contact problems again.

Errors count by their root mean square over the worn cells: the few at a moving contact edge are
worn by jumps however short the steps, and say little about depth or volume. The volume counts for
itself: where slip follows from wear, as in partial slip, no pressure corrects it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.types import Array
from wear.worn import WornState

GROWTH, SHRINKAGE, SAFETY = 8.0, 0.2, 0.8
"""Bounds of one change of an automatic step, and the share of its room that it aims at."""

EARLY = 0.3
"""Share of the error at the end of a run that it may have at once: much of what the first steps
miss, while the contact grows fastest, is pressed away later."""


@dataclass(frozen=True)
class ErrorControl:
    """What error the depth may have: the smaller of those given.

    ``relative`` is a share of the depth at the end of the run, ``absolute`` a depth [mm]; both
    bound the root mean square over the worn cells of either body.

    Examples
    --------
    1 % of the depth at the end, but 0.1 µm at most: where 20 µm are to come, the latter is 0.5 %.

    >>> import numpy as np
    >>> from wear import ErrorControl
    >>> control, depth = ErrorControl(relative=0.01, absolute=1e-4), np.full((4, 4), 0.01)
    >>> print(control.tolerance(depth, expected=2.0 * depth))
    0.005
    """

    relative: float | None = None
    absolute: float | None = None

    def __post_init__(self) -> None:
        checks.numbers(self, "relative", "absolute", above=0.0)

    def tolerance(self, depth: Array, expected: Array) -> float:
        """The bound for a body worn to ``depth``, as a share of the one ``expected`` to come."""
        scale = root_mean_square(expected, depth)
        bounds = [np.inf if self.relative is None else self.relative]
        if self.absolute is not None and scale > 0.0:
            bounds.append(self.absolute / scale)
        return min(bounds)


def root_mean_square(field: Array, depth: Array) -> float:
    """Of a ``field`` over the cells that have lost some ``depth``, both ``(nx, ny)``."""
    worn = max(int(np.count_nonzero(depth)), 1)
    return float(np.sqrt(np.vdot(field, field) / worn))


def step_errors(state: WornState, areas: Array | float = 1.0) -> dict[str, float] | None:
    """What wear steps leave of ``depth`` (root mean square) and ``volume``, relative.

    Those of the body with the larger error; None where nothing has worn or they are not known.
    ``areas`` are those of cells or nodes, if they differ.
    """
    bodies = [
        (error, depth)
        for error, depth in zip(state.errors, state.surfaces.depths, strict=True)
        if depth.any()
    ]
    if not bodies or state.coarse is None:
        return None
    return {
        "depth": max(root_mean_square(e, d) / root_mean_square(d, d) for e, d in bodies),
        "volume": max(abs(float((areas * e).sum())) / float((areas * d).sum()) for e, d in bodies),
    }


def steps_to_come(before: WornState, after: WornState, cycles: float, left: float) -> float:
    """Return how many steps like one of so many ``cycles`` wear as much as the ``left`` ones will.

    That step is included, which has led from the state ``before`` to the one ``after``. A rate that
    falls, as where what slips wears off, falls on as an exponential, which bounds what is to come.
    """
    count = max(left / cycles, 1.0)
    if not 0.0 < after.volume_rate < before.volume_rate:
        return count
    return min(count, 1.0 + 1.0 / float(np.log(before.volume_rate / after.volume_rate)))


def judged(
    control: ErrorControl, before: WornState, after: WornState, to_go: float
) -> tuple[bool, float]:
    """Return whether the error after a step will do, and the change of length that fills its room.

    ``to_go`` are the steps like this one that are to come, this one included. Of the tolerance the
    error of a body's depth may have the share :data:`EARLY` at once and the rest by and by, as the
    depth grows; that of its volume, which no pressure presses away, grows with it. Where a step
    wears little of what has worn so far it may be long: the error counts at the end of the run.
    """
    fits, changes, order = True, [GROWTH], after.order
    columns = (after.surfaces.depths, before.surfaces.depths, after.errors, before.errors)
    for depth, depth_before, error, error_before in zip(*columns, strict=True):
        worn, missed = depth - depth_before, error - error_before
        if not worn.any():
            continue
        expected = depth + worn * (to_go - 1.0)
        tolerance = control.tolerance(depth, expected)
        ahead, so_far, lost, total, added = (
            root_mean_square(field, depth) for field in (expected, depth, worn, error, missed)
        )
        share = (1.0 - EARLY) * tolerance
        room = EARLY * tolerance * ahead + share * so_far - total
        volume, volume_share = abs(float(missed.sum())), tolerance * float(worn.sum())
        volume_room = share * float(depth.sum()) - abs(float(error.sum()))
        fits = fits and (room >= 0.0 or added <= share * lost)
        fits = fits and (volume_room >= 0.0 or volume <= volume_share)
        if added > 0.0:
            # A share of the step shrinks with it; what is left of the whole does not.
            filling = (SAFETY * max(room, 0.0) / added) ** (1.0 / (order + 1.0))
            changes.append(max(filling, (SAFETY * share * lost / added) ** (1.0 / order)))
        if volume > 0.0:
            filling = (SAFETY * max(volume_room, 0.0) / volume) ** (1.0 / (order + 1.0))
            changes.append(max(filling, (SAFETY * volume_share / volume) ** (1.0 / order)))
    return fits, min(changes)
