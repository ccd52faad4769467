"""Test whether bodies with an imposed approach separate by turning freely."""

from __future__ import annotations

import numpy as np

from sa_solver.rigid_modes import NormalModes
from sa_solver.types import Array

CUTS = 200
"""Most points that bound the tilt; smooth surfaces take less than 10, rough ones less than 40."""

TOUCHING = 1e-12
"""Penetration, relative to the range of heights, that is rounding of the linear programme."""


def separating_tilt(height: Array, modes: NormalModes) -> Array | None:
    """Return free tilts ``(k,)`` at which the gap ``height`` ``(nx, ny)`` is nowhere negative.

    None is returned where there are none, so that the bodies press. Without a moment the bodies
    separate unless the lower convex envelope of the heights is negative at the origin. This is a
    linear programme, solved by adding the point that penetrates most until there is none.
    """
    if height.min() >= 0.0:
        return np.zeros(len(modes.free))
    if not modes.free:
        return None
    # Imported here because it is rarely needed and slow to import.
    import scipy.optimize

    shapes = modes.fields().reshape(len(modes.free), -1)
    heights, touching = height.ravel(), TOUCHING * float(np.ptp(height))
    columns = height.shape[1]
    points = [0, columns - 1, height.size - columns, height.size - 1]
    for _ in range(CUTS):
        # The programme maximises t such that t + tilt · shape <= height at the points.
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
