"""Shapes of unloaded contact faces."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array

PARTING_SLOPE = 1.0
"""Slope at which faces part beyond their rounded edges, where fillets and corners begin."""


def rounded_edge(distance: Array, half: float, width: float, radius: float) -> Array:
    """Gap [mm] at a ``distance`` [mm] from the middle of a face with rounded edges.

    Zero on the flat, a circular arc of ``radius`` that begins ``width`` before ``half`` the size of
    the face, and a slope beyond it.
    """
    into = np.clip(distance - (half - width), 0.0, width)
    beyond = np.maximum(distance - half, 0.0)
    return into**2 / (radius + np.sqrt(radius**2 - into**2)) + PARTING_SLOPE * beyond
