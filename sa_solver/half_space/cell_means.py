"""Integrals over cells of functions that are smooth but for what happens near a point.

A function that changes over the distance to the origin, or over a length near it, is interpolated
by polynomials on intervals that double in length away from the origin. Their integrals over cells
of any size are exact, so that the number of points depends on the extent of a grid and not on the
number of its cells.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from sa_solver.types import Array

POINTS = 16
"""Points of an interval. The error falls by (3 + √8)² with each, to 1e-12 of the function."""


class CellIntegrals:
    """Integrals along one axis between neighbouring edges, from values at a few points.

    ``points`` ``(m,)`` are the places, above 0, at which a function must be known, and ``weights``
    ``(n, m)`` those of its values in the integrals over n cells. Functions are even, or ``odd``.
    """

    def __init__(self, edges: Array, smooth: float, odd: bool) -> None:
        """Prepare the integrals between ascending ``edges`` ``(n + 1,)`` [mm].

        ``smooth`` is the length [mm] over which the function changes near 0.
        """
        reach = np.abs(edges)
        starts = _starts(smooth, float(reach.max()))
        nodes, gauss = legendre.leggauss(POINTS)
        halves = 0.5 * np.diff(starts)[:, None]
        self.points = (starts[:-1, None] + halves * (1.0 + nodes)).ravel()
        # Integrals from 0 to each edge: those of whole intervals, and of the part of the last one.
        last = np.clip(np.searchsorted(starts, reach, side="left") - 1, 0, len(halves) - 1)
        integrals = (halves * gauss) * (np.arange(len(halves)) < last[:, None])[:, :, None]
        part = (reach - starts[last]) / halves[last, 0] - 1.0
        rows = np.arange(len(edges))
        integrals[rows, last] = halves[last] * _integrals(part, nodes, gauss)
        whole = integrals.reshape(len(edges), -1)
        if not odd:
            whole *= np.sign(edges)[:, None]
        self.weights = np.diff(whole, axis=0)


def _starts(smooth: float, reach: float) -> Array:
    """Return the borders of intervals from 0 to ``reach`` or beyond."""
    doublings = max(0, int(np.ceil(np.log2(reach / smooth))))
    return np.array([0.0, *(smooth * 2.0 ** np.arange(doublings + 1))])


def _integrals(ends: Array, nodes: Array, gauss: Array) -> Array:
    """Return the weights ``(n, m)`` of values at ``nodes`` in the integrals from -1 to ``ends``.

    The values are interpolated by Legendre's polynomials.
    """
    degrees = np.arange(POINTS)
    coefficients = (legendre.legvander(nodes, POINTS - 1) * gauss[:, None]) * (degrees + 0.5)
    polynomials = legendre.legvander(ends, POINTS)
    integrated = np.empty((len(ends), POINTS))
    integrated[:, 0] = ends + 1.0
    integrated[:, 1:] = (polynomials[:, 2:] - polynomials[:, :-2]) / (2.0 * degrees[1:] + 1.0)
    return np.asarray(integrated @ coefficients.T)
