"""Influence coefficients of uniformly loaded rectangles on an elastic half-space."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array


def normal_influence(
    x: Array, y: Array, pitch: tuple[float, float], contact_modulus: float
) -> Array:
    """Normal displacement at ``(x, y)`` from the centre of a uniformly pressed rectangle.

    ``x`` and ``y`` broadcast against each other [mm], ``pitch`` is ``(dx, dy)`` [mm] and
    ``contact_modulus`` is E* [MPa], so that the displacement is that of both bodies together.
    Returns the displacement per unit pressure [mm/MPa].

    Source: Love 1929, Phil. Trans. R. Soc. A 228, 377, doi:10.1098/rsta.1929.0009, as in Johnson
    1985, *Contact Mechanics*, eq. 3.25, with (1-ν²)/E → 1/E*.
    """
    a, b = 0.5 * pitch[0], 0.5 * pitch[1]
    corners = (
        _corner(x + a, y + b)
        - _corner(x - a, y + b)
        - _corner(x + a, y - b)
        + _corner(x - a, y - b)
    )
    return corners / (np.pi * contact_modulus)


def _corner(x: Array, y: Array) -> Array:
    """``∬ dx dy / r`` as a function of one corner: ``x asinh(y/|x|) + y asinh(x/|y|)``."""
    return _x_asinh_ratio(x, y) + _x_asinh_ratio(y, x)


def _x_asinh_ratio(x: Array, y: Array) -> Array:
    """``x asinh(y / |x|)``, which tends to 0 with x.

    Johnson's logarithms are the same function; asinh does not cancel where ``y < 0``.
    """
    distance = np.abs(x)
    safe = np.where(distance > 0.0, distance, 1.0)
    return np.where(distance > 0.0, x * np.arcsinh(y / safe), 0.0)
