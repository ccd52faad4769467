"""Shapes of unloaded contact faces."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array

PARTING_SLOPE = 1.0
"""Slope of the gap beyond rounded edges, where fillets and corners begin."""


def rounded_edge(distance: Array, half: float, width: float, radius: float) -> Array:
    """Return the gap [mm] of a face with rounded edges.

    The gap is zero on the flat, a circular arc at the edge, and has a constant slope in addition
    beyond the face.

    Parameters
    ----------
    distance
        Distance from the middle of the face [mm].
    half
        Half the size of the face [mm].
    width
        Width of the rounded edge, which ends at ``half`` [mm].
    radius
        Radius of the arc [mm].
    """
    into = np.clip(distance - (half - width), 0.0, width)
    beyond = np.maximum(distance - half, 0.0)
    return into**2 / (radius + np.sqrt(radius**2 - into**2)) + PARTING_SLOPE * beyond
