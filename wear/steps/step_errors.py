"""Errors of wear steps: their estimate, their bound, and the length of a step that meets it.

The error of wear steps is estimated by a coarse companion: the same run, under the same loads, by
steps of twice the length. It is continued separately from the first cycle to the last. Wear may
press an error away or let it grow; it does the same to the difference of both runs: global
extrapolation (Shampine & Watts 1976, doi:10.1145/355666.355671). For steps of order p the
difference is 2^p - 1 times the error of the shorter steps. The companion takes half as many contact
problems again.

Errors count by their root mean square over the worn cells: the few cells at a moving contact edge
wear abruptly however short the steps are, and say little about depth or volume. The volume counts
separately: where slip follows from wear, as in partial slip, pressure does not correct its error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.types import Array
from wear.worn import WornState

GROWTH, SHRINKAGE, SAFETY = 8.0, 0.2, 0.8
"""Bounds of one change of the length of an automatic step, and the share of the allowed error that
it aims at.
"""

EARLY_SHARE = 0.3
"""Share of the error allowed at the end of a run that may be used at once. Much of the error of the
first steps, while the contact grows fastest, is pressed away later.
"""


@dataclass(frozen=True)
class ErrorControl:
    """Allowed error of the worn depth: the smaller of the bounds given.

    ``relative`` is a share of the depth at the end of the run, ``absolute`` a depth [mm]. Both
    bound the root mean square over the worn cells of either body.

    Examples
    --------
    The bound is 1 % of the final depth, but 0.1 µm at most; at a final depth of
    20 µm that is 0.5 %:

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
        """Return the bound for a body worn to ``depth`` as a share of the ``expected`` depth."""
        scale = root_mean_square(expected, depth)
        bounds = [np.inf if self.relative is None else self.relative]
        if self.absolute is not None and scale > 0.0:
            bounds.append(self.absolute / scale)
        return min(bounds)


def root_mean_square(field: Array, depth: Array) -> float:
    """Return the root mean square of ``field`` over the cells that have lost any ``depth``."""
    worn = max(int(np.count_nonzero(depth)), 1)
    return float(np.sqrt(np.vdot(field, field) / worn))


def step_errors(state: WornState, areas: Array | float = 1.0) -> dict[str, float] | None:
    """Return the relative errors of ``depth`` (root mean square) and ``volume`` due to wear steps.

    They are those of the body with the larger error, or None where nothing has worn or they are
    unknown. ``areas`` are those of cells or nodes, if they differ.
    """
    bodies = [
        (error, depth)
        for error, depth in zip(state.errors, state.surfaces.depths, strict=True)
        if root_mean_square(depth, depth) > 0.0
    ]
    if not bodies or state.coarse is None:
        return None
    return {
        "depth": max(root_mean_square(e, d) / root_mean_square(d, d) for e, d in bodies),
        "volume": max(abs(float((areas * e).sum())) / float((areas * d).sum()) for e, d in bodies),
    }


def steps_to_come(before: WornState, after: WornState, cycles: float, left: float) -> float:
    """Return how many steps of this kind wear as much as the ``left`` cycles will.

    The step of ``cycles`` from ``before`` to ``after`` is included. A falling wear rate, as where
    slipping cells wear off, is taken to go on falling exponentially, which bounds the wear to come.
    """
    count = max(left / cycles, 1.0)
    if not 0.0 < after.volume_rate < before.volume_rate:
        return count
    return min(count, 1.0 + 1.0 / float(np.log(before.volume_rate / after.volume_rate)))


def assess(
    control: ErrorControl, before: WornState, after: WornState, to_go: float
) -> tuple[bool, float]:
    """Return whether the error after a step is acceptable, and the factor of the next length.

    ``to_go`` is the number of such steps that are left, this one included. The error of a body's
    depth may use the share :data:`EARLY_SHARE` of the tolerance at once, and the rest as the depth
    grows. The error of the volume, which no pressure corrects, may only grow with the volume. A
    step that wears little compared with the depth so far may be long: the error counts at the end
    of the run.
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
        share = (1.0 - EARLY_SHARE) * tolerance
        room = EARLY_SHARE * tolerance * ahead + share * so_far - total
        volume, volume_share = abs(float(missed.sum())), tolerance * float(worn.sum())
        volume_room = share * float(depth.sum()) - abs(float(error.sum()))
        fits = fits and (room >= 0.0 or added <= share * lost)
        fits = fits and (volume_room >= 0.0 or volume <= volume_share)
        if added > 0.0:
            # The error allowed per step shrinks with the step, the remaining total does not.
            filling = (SAFETY * max(room, 0.0) / added) ** (1.0 / (order + 1.0))
            changes.append(max(filling, (SAFETY * share * lost / added) ** (1.0 / order)))
        if volume > 0.0:
            filling = (SAFETY * max(volume_room, 0.0) / volume) ** (1.0 / (order + 1.0))
            changes.append(max(filling, (SAFETY * volume_share / volume) ** (1.0 / order)))
    return fits, min(changes)
