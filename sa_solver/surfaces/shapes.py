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


def sphere(x: Array, y: Array, radius: float) -> Array:
    """Return Hertz's paraboloid (x² + y²) / 2 R [mm]; 1/R is the sum of both curvatures."""
    return (x**2 + y**2) / (2.0 * radius)


def ellipsoid(x: Array, y: Array, radius_x: float, radius_y: float) -> Array:
    """Return the paraboloid x² / 2 Rx + y² / 2 Ry [mm]."""
    return x**2 / (2.0 * radius_x) + y**2 / (2.0 * radius_y)


def cylinder(x: Array, y: Array, radius: float) -> Array:
    """Return the parabola x² / 2 R [mm] of a line contact."""
    return x**2 / (2.0 * radius)


def rounded_flat(x: Array, y: Array, half_width: float, edge_radius: float) -> Array:
    """Return a flat with a parabola beyond either end [mm], constant along y."""
    beyond = np.maximum(np.abs(x) - half_width, 0.0)
    return beyond**2 / (2.0 * edge_radius)


def rectangle(x: Array, y: Array, half_width: float, half_length: float, step: float) -> Array:
    """Return a flat rectangle with sharp edges on a ``step`` [mm]."""
    on_top = (np.abs(x) < half_width) & (np.abs(y) < half_length)
    return np.where(on_top, 0.0, step)


def strip(x: Array, y: Array, half_width: float, step: float) -> Array:
    """Return a flat strip along y with sharp edges on a ``step`` [mm]."""
    return np.where(np.abs(x) < half_width, 0.0, step)


def plane(x: Array, y: Array) -> Array:
    """Return zeros: a plane all over the face."""
    return np.zeros_like(x + y)
