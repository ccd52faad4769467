"""Whether bodies whose approach is imposed, but not all their tilts, come apart."""

from __future__ import annotations

import numpy as np

from sa_solver.rigid_modes import NormalModes
from sa_solver.types import Array

CUTS = 200
"""Cap on the points that bound the tilt; smooth surfaces take under 10, rough ones under 40."""

TOUCHING = 1e-12
"""Penetration taken for touching, over the range of heights: rounding of the linear programme."""


def separating_tilt(height: Array, modes: NormalModes) -> Array | None:
    """Coefficients ``(k,)`` of the free tilts that leave ``height`` ``(nx, ny)`` nowhere negative.

    None where there are none, and the bodies press. Without moment the bodies come apart unless
    the lower convex envelope of the heights is negative at the origin: a linear programme, solved
    by adding the point that penetrates most until none does.
    """
    if height.min() >= 0.0:
        return np.zeros(len(modes.free))
    if not modes.free:
        return None
    # Rarely needed, and slow to import: where it is used.
    import scipy.optimize

    shapes = modes.fields().reshape(len(modes.free), -1)
    heights, touching = height.ravel(), TOUCHING * float(np.ptp(height))
    columns = height.shape[1]
    points = [0, columns - 1, height.size - columns, height.size - 1]
    for _ in range(CUTS):
        # Largest t with t + tilt · shape <= height at the points.
        matrix = np.column_stack([np.ones(len(points)), shapes[:, points].T])
        objective = np.r_[-1.0, np.zeros(len(modes.free))]
        programme = scipy.optimize.linprog(objective, matrix, heights[points], bounds=(None, None))
        if not programme.success or programme.x[0] < -touching:
            return None
        tilt: Array = programme.x[1:]
        gap = heights - tilt @ shapes
        lowest = int(np.argmin(gap))
        if gap[lowest] >= -touching:
            return tilt
        points.append(lowest)
    return None
