"""The smallest circles around many paths in the plane at once."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from sa_solver.errors import ConvergenceError
from sa_solver.types import Array

Places = NDArray[np.intp]

OUTSIDE = 1e-10
"""Relative distance beyond the circle at which a point counts as outside, above rounding."""

ROUNDING = 1e-14
"""The same tolerance relative to the largest coordinate, for paths that hardly move."""

MAX_ROUNDS = 100
"""Limit of iterations: 20 000 random paths of 22 points took 5 at most."""

SUPPORTS = ((0, 3, 3), (1, 3, 3), (2, 3, 3), (0, 1, 3), (0, 2, 3), (1, 2, 3))
"""Points that may determine the circle around three points and a fourth outside their circle."""


_taken = partial(np.take_along_axis, axis=0)  # values (t, n) at places (k, n)


def smallest_circle(x: Array, y: Array) -> Array:
    """Return the radius ``(n,)`` of the smallest circle around the points ``x``, ``y`` ``(t, n)``.

    Two or three points determine a circle. As long as points lie outside, the farthest enters and
    the smallest circle around the four takes over. The radius grows each time, so that the
    iteration ends with the exact result. Raise ConvergenceError if it has not ended after 100
    iterations.

    Source: Elzinga & Hearn 1972, Transp. Sci. 6, 379, doi:10.1287/trsc.6.4.379.
    """
    radius = np.zeros(x.shape[1])
    left = np.arange(x.shape[1])
    slack = ROUNDING * np.maximum(np.abs(x), np.abs(y)).max(axis=0, initial=0.0)
    held, circle = _start(x, y)
    for _ in range(MAX_ROUNDS):
        distance = np.hypot(x - circle[0], y - circle[1])
        farthest = distance.argmax(axis=0)[None]
        outside = _taken(distance, farthest)[0] > circle[2] * (1.0 + OUTSIDE) + slack
        radius[left[~outside]] = circle[2, ~outside]
        if not outside.any():
            return radius
        left, x, y, slack = left[outside], x[:, outside], y[:, outside], slack[outside]
        four = np.concatenate([held, farthest])[:, outside]
        held, circle = _round_four(four, _taken(x, four), _taken(y, four))
    raise ConvergenceError(
        f"{len(left)} smallest circles were not found in {MAX_ROUNDS} iterations"
    )


def _start(x: Array, y: Array) -> tuple[Places, Array]:
    """Return circles ``(x, y, r)`` on two distant points, and the indices of their points."""
    first = np.hypot(x - x.mean(axis=0), y - y.mean(axis=0)).argmax(axis=0)[None]
    second = np.hypot(x - _taken(x, first), y - _taken(y, first)).argmax(axis=0)[None]
    held = np.concatenate([first, second, second])
    return held, np.stack(_circle(_taken(x, held), _taken(y, held)))


def _round_four(four: Places, x: Array, y: Array) -> tuple[Places, Array]:
    """Return the smallest circle around four points, determined by the fourth and others.

    ``x`` and ``y`` are ``(4, n)``.
    """
    circles = []
    for support in SUPPORTS:
        centre_x, centre_y, _ = _circle(x[list(support)], y[list(support)])
        reach = np.hypot(x - centre_x, y - centre_y).max(axis=0)
        circles.append(np.stack([centre_x, centre_y, reach]))
    candidates = np.stack(circles)
    best = candidates[:, 2].argmin(axis=0)
    points = np.array(SUPPORTS).T[:, best]
    return np.take_along_axis(four, points, axis=0), candidates[best, :, np.arange(len(best))].T


def _circle(x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Return centre and radius of the circle through three points ``(3, n)``.

    Points on a line give the circle on the first and last of them as a diameter.
    """
    ax, ay, bx, by = x[0] - x[2], y[0] - y[2], x[1] - x[2], y[1] - y[2]
    twice = 2.0 * (ax * by - ay * bx)
    flat = np.abs(twice) <= ROUNDING * np.hypot(ax, ay) * np.hypot(bx, by)
    divisor = np.where(flat, 1.0, twice)
    a, b = ax**2 + ay**2, bx**2 + by**2
    centre_x = np.where(flat, 0.5 * ax, (by * a - ay * b) / divisor)
    centre_y = np.where(flat, 0.5 * ay, (ax * b - bx * a) / divisor)
    return centre_x + x[2], centre_y + y[2], np.hypot(centre_x, centre_y)
