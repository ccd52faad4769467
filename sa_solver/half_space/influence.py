"""Influence coefficients: surface displacement under uniform traction on a rectangle or a strip.

They hold for both bodies together: ``u = u_2 - u_1`` is the displacement of body 2's surface
relative to body 1's under the tractions that body 1 exerts on body 2 (frames and signs are those of
:mod:`sa_solver.types`).
With the compliances of :class:`~sa_solver.types.ElasticPair` and ``r² = x² + y²``, a unit point
force gives

    u_x = [(s - v)/r + v x²/r³] qx + v xy/r³ qy - c x/r² p      all over 2π
    u_y = v xy/r³ qx + [(s - v)/r + v y²/r³] qy - c y/r² p
    u_z = c x/r² qx + c y/r² qy + n/r p

and a unit line force in plane strain, at depth datum L below which both bodies are held,

    u_x = -n/π ln(|x|/L) qx - c/2 sgn(x) p
    u_y = -s/π ln(|x|/L) qy
    u_z = c/2 sgn(x) qx - n/π ln(|x|/L) p

Sources: Johnson 1985, *Contact Mechanics*, eqs 3.18 (Boussinesq), 3.75 (Cerruti), 2.19 and 2.22
(lines); Love 1929, doi:10.1098/rsta.1929.0009 (rectangle). The matrix is symmetric in the sense of
Betti: the normal displacement under shear has the kernel of minus the shear displacement under
pressure.
"""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array, ElasticPair

X, Y, Z = range(3)
"""Indices of the components of tractions and displacements."""


def rectangle_influence(
    edges_x: Array, edges_y: Array, pair: ElasticPair, row: int, column: int
) -> Array:
    """Return the displacement at a point from unit traction on each of several rectangles.

    Parameters
    ----------
    edges_x, edges_y
        Coordinates of the point minus those of the edges of the rectangles, in ascending order:
        ``(n + 1,)`` along x and ``(m + 1,)`` along y [mm].
    pair
        Elastic constants of the bodies.
    row, column
        Components of the displacement and of the traction: ``X``, ``Y`` or ``Z``.

    Returns
    -------
    Array
        Influence coefficients ``(n, m)`` [mm/MPa].
    """
    x, y = np.asarray(edges_x)[:, None], np.asarray(edges_y)[None, :]
    corner = _corner_function(x, y, pair, row, column)
    return np.diff(np.diff(corner, axis=0), axis=1) / (2.0 * np.pi)


def strip_influence(edges: Array, pair: ElasticPair, row: int, column: int, datum: float) -> Array:
    """Return the displacement at a point from unit traction on infinitely long strips.

    The strips are in plane strain. ``datum`` L [mm] is the distance from a line force at which its
    displacement vanishes; the other arguments are those of :func:`rectangle_influence`, with
    ``edges`` ``(n + 1,)`` [mm]. The coefficients are ``(n,)`` [mm/MPa].
    """
    x = np.asarray(edges)
    if row == column:
        compliance = pair.shear if row == Y else pair.normal
        return -compliance / np.pi * np.diff(_integrated_logarithm(x / datum) * datum)
    if Y in (row, column) or pair.coupling == 0.0:
        return np.zeros(len(x) - 1)
    sign = 1.0 if row == Z else -1.0
    return sign * 0.5 * pair.coupling * np.diff(np.abs(x))


def _corner_function(x: Array, y: Array, pair: ElasticPair, row: int, column: int) -> Array:
    """Return ``∬ kernel dx dy`` as a function of one corner, without the factor 1/2π."""
    if row == column == Z:
        return pair.normal * (_y_asinh(x, y) + _y_asinh(y, x))
    if Z in (row, column):
        if pair.coupling == 0.0:
            return np.zeros(np.broadcast_shapes(x.shape, y.shape))
        sign = 1.0 if row == Z else -1.0
        along, across = (x, y) if X in (row, column) else (y, x)
        return sign * pair.coupling * _gradient_corner(along, across)
    if row != column:
        return -pair.poisson * np.hypot(x, y)
    along, across = (x, y) if row == X else (y, x)
    # The integral ∬ along²/r³ is across asinh(along/|across|); its sum over both directions is
    # ∬ 1/r.
    return pair.shear * _y_asinh(along, across) + (pair.shear - pair.poisson) * _y_asinh(
        across, along
    )


def _y_asinh(x: Array, y: Array) -> Array:
    """Return ``y asinh(x / |y|)``, the integral of ``x²/r³``, which tends to 0 with y.

    It equals Johnson's logarithms, but does not suffer from cancellation where ``x < 0``.
    """
    distance = np.abs(y)
    safe = np.where(distance > 0.0, distance, 1.0)
    return np.where(distance > 0.0, y * np.arcsinh(x / safe), 0.0)


def _gradient_corner(x: Array, y: Array) -> Array:
    """Return ``∬ x/r² = y ln r + x atan(y/x)``, which tends to ``y ln |y|`` as x tends to 0."""
    squares = x**2 + y**2
    logarithm = 0.5 * np.log(np.where(squares > 0.0, squares, 1.0))
    safe = np.where(x != 0.0, x, 1.0)
    return y * logarithm + np.where(x != 0.0, x * np.arctan(y / safe), 0.0)


def _integrated_logarithm(t: Array) -> Array:
    """Return ``∫ ln|t| dt = t ln|t| - t``, which is 0 at 0."""
    return t * np.log(np.where(t != 0.0, np.abs(t), 1.0)) - t
