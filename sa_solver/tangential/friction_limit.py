"""Largest shear load that friction can carry, by limit analysis of the sliding contact."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array

ITERATIONS = 200
ACCURACY = 1e-12
"""Relative decrease of the bound in one iteration below which the iteration stops."""

SMALLEST_SPEED = 1e-9
"""Relative speed below which a cell counts as the centre of rotation, where the weight does not
matter."""

UNSUPPORTED = 1e-6
"""Relative part of a load in directions without resistance above which cells cannot carry the load
at all. A single cell, for example, has no resistance to a moment."""


def largest_share(
    limit: Array,
    shapes: Array,
    target: Array,
    *,
    accuracy: float = ACCURACY,
    enough: float = 0.0,
) -> float:
    """Return the largest factor λ for which shear within ``limit`` has the resultants λ ``target``.

    The factor is the least dissipation Σ µp |R v| of a sliding velocity v on which the target does
    unit work (upper bound theorem; Goyal, Ruina & Papadopoulos 1991, Wear 143, 307,
    doi:10.1016/0043-1648(91)90104-3). It is found by reweighted least squares, which lower the
    bound in every step.

    Parameters
    ----------
    limit
        Friction limit µp of m cells ``(m,)`` [MPa].
    shapes
        Displacements ``(k, 2, m)`` of the cells in k rigid motions.
    target
        Resultants ``(k,)`` [MPa] conjugate to these motions, not all 0.
    accuracy
        Relative decrease in one step below which the iteration stops.
    enough
        Factor at or below which the iteration stops.
    """
    modes = np.tensordot(shapes * limit, shapes, axes=([1, 2], [1, 2]))
    unsupported = target - modes @ (np.linalg.pinv(modes, hermitian=True) @ target)
    if np.abs(unsupported).max() > UNSUPPORTED * np.abs(target).max():
        return 0.0
    speed = np.ones_like(limit)
    bound = np.inf
    for _ in range(ITERATIONS):
        fastest = float(speed.max())
        if not fastest > 0.0:
            return 0.0
        weights = limit / np.maximum(speed / fastest, SMALLEST_SPEED)
        metric = np.tensordot(shapes * weights, shapes, axes=([1, 2], [1, 2]))
        velocity = np.linalg.pinv(metric, hermitian=True) @ target
        velocity /= target @ velocity
        field = np.tensordot(velocity, shapes, 1)
        speed = np.hypot(field[0], field[1])
        previous, bound = bound, float(limit @ speed)
        if bound <= enough or bound >= previous * (1.0 - accuracy):
            break
    return bound
