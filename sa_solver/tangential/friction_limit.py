"""The largest shear force that friction can carry: limit analysis of a contact that slides."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array

ITERATIONS = 200
ACCURACY = 1e-12
"""Relative fall of the bound in one iteration at which reweighting stops."""

SMALLEST_SPEED = 1e-9
"""Relative speed below which a cell counts as the centre of rotation, where any weight will do."""

UNFELT = 1e-6
"""Relative part of a load from which cells, one or in a line of strips, cannot carry it at all."""


def largest_share(
    limit: Array,
    shapes: Array,
    target: Array,
    *,
    accuracy: float = ACCURACY,
    enough: float = 0.0,
) -> float:
    """The largest factor λ such that shear within ``limit`` has the resultants λ ``target``.

    ``limit`` µp ``(m,)`` [MPa], ``shapes`` ``(k, 2, m)`` of the rigid motions and ``target``
    ``(k,)`` [MPa] their resultants, not all 0. The factor is the least dissipation Σ µp |R v| of a
    sliding velocity v on which the target does unit work (upper bound theorem; Goyal, Ruina &
    Papadopoulos 1991, Wear 143, 307, doi:10.1016/0043-1648(91)90104-3), found by reweighted least
    squares, which lower it at every step until it falls by less than ``accuracy`` in one, or is
    down to ``enough``.
    """
    modes = np.tensordot(shapes * limit, shapes, axes=([1, 2], [1, 2]))
    unfelt = target - modes @ (np.linalg.pinv(modes, hermitian=True) @ target)
    if np.abs(unfelt).max() > UNFELT * np.abs(target).max():
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
