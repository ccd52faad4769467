"""Influence coefficients: stress in a half-space under uniform traction on a rectangle or strip.

The half-space is z >= 0 and the traction (tx, ty, tz) acts on it; tz > 0 presses. Stress has six
components xx, yy, zz, xy, yz, zx, tension positive. With Ω = z ln(ρ + z) - ρ, L = Ω_z = ln(ρ + z)
and V = Ω_zz = 1/ρ, where subscripts are derivatives and ρ is the distance, unit point forces give

         under tz                           under tx
    xx   2ν V_z - (1-2ν) L_xx - z V_xx      2(1+ν) V_x + 2ν Ω_xxx - z L_xxx
    yy   2ν V_z - (1-2ν) L_yy - z V_yy      2ν V_x + 2ν Ω_xyy - z L_xyy
    zz   V_z - z V_zz                       -z V_xz
    xy   -(1-2ν) L_xy - z V_xy              V_y + 2ν Ω_xxy - z L_xxy
    yz   -z V_yz                            -z V_xy
    zx   -z V_xz                            V_z - z V_xx

all divided by 2π; under ty, x and y are exchanged. Ω, L and V are harmonic, so that second
derivatives with respect to z follow from those with respect to x and y. Integrals over a rectangle
are differences of closed forms between its corners. Terms that cancel in these differences are left
out, so that no digits are lost where ρ + x or ρ + y tends to 0.

Source: Johnson 1985, *Contact Mechanics*, eqs 3.6 to 3.10 (Boussinesq and Cerruti's potentials) and
Hooke's law; rectangles, Love 1929, doi:10.1098/rsta.1929.0009, and Ahmadi, Keer & Mura 1983, Int.
J. Solids Struct. 19, 357.
"""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array

XX, YY, ZZ, XY, YZ, ZX = range(6)
"""Indices of the components of stress."""

INDICES = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
"""The two directions of each component of stress."""

EXCHANGED = [YY, XX, ZZ, XY, ZX, YZ]
"""Order of the components of stress when x and y are exchanged."""


def rectangle_stress(edges_x: Array, edges_y: Array, depth: float, poisson: float) -> Array:
    """Return the stress at a point below the surface from unit tractions on rectangles.

    Parameters
    ----------
    edges_x, edges_y
        Coordinates of the point minus those of the edges of the rectangles, in ascending order:
        ``(n + 1,)`` along x and ``(m + 1,)`` along y [mm].
    depth
        Depth of the point [mm]. At depth 0 the stress is the limit from inside the body. The point
        must then not lie on an edge, where the stress is infinite.
    poisson
        Poisson's ratio.

    Returns
    -------
    Array
        Stress ``(6, 3, n, m)`` [1] for six components and three tractions.
    """
    x, y = np.asarray(edges_x)[:, None], np.asarray(edges_y)[None, :]
    corner = np.stack(
        [
            _sheared(x, y, depth, poisson),
            _sheared(y, x, depth, poisson)[EXCHANGED],
            _pressed(x, y, depth, poisson),
        ],
        axis=1,
    )
    return np.diff(np.diff(corner, axis=2), axis=3) / (2.0 * np.pi)


def strip_stress(edges: Array, depth: float, poisson: float) -> Array:
    """Return the stress ``(6, 3, n)`` [1] at a point from unit tractions on infinite strips.

    The strips are in plane strain: they are the limit of rectangles that are infinite along y. The
    arguments are those of :func:`rectangle_stress`, with ``edges`` ``(n + 1,)`` [mm].
    """
    x, z = np.asarray(edges), depth
    square = x**2 + z**2
    v_x, v_z = -np.log(square), -2.0 * np.arctan2(x, z)
    z_v_xx, z_v_xz = -2.0 * z * x / square, -2.0 * z**2 / square
    corner = np.zeros((6, 3, len(x)))
    corner[XX] = 2.0 * v_x + z_v_xz, 0.0 * x, v_z - z_v_xx
    corner[YY] = 2.0 * poisson * v_x, 0.0 * x, 2.0 * poisson * v_z
    corner[ZZ] = -z_v_xz, 0.0 * x, v_z + z_v_xx
    corner[XY, 1] = v_x
    corner[YZ, 1] = v_z
    corner[ZX] = v_z - z_v_xx, 0.0 * x, -z_v_xz
    return np.diff(corner, axis=2) / (2.0 * np.pi)


def _pressed(x: Array, y: Array, z: float, poisson: float) -> Array:
    """Return ``∬ stress dx dy`` under tz as a function of one corner, ``(6, ...)``, times 2π."""
    r = np.sqrt(x**2 + y**2 + z**2)
    v_z = _v_z(x, y, z)
    z_v_xx, z_v_yy = _z_v_xx(x, y, z), _z_v_xx(y, x, z)
    k = 1.0 - 2.0 * poisson
    return np.stack(
        [
            2.0 * poisson * v_z - k * _l_xx(x, y, z) - z_v_xx,
            2.0 * poisson * v_z - k * _l_xx(y, x, z) - z_v_yy,
            v_z + z_v_xx + z_v_yy,
            -k * np.log(r + z) - z / r,
            -_z_v_xz(y, x, z),
            -_z_v_xz(x, y, z),
        ]
    )


def _sheared(x: Array, y: Array, z: float, poisson: float) -> Array:
    """Return ``∬ stress dx dy`` under tx as a function of one corner, ``(6, ...)``, times 2π."""
    r = np.sqrt(x**2 + y**2 + z**2)
    v_x, v_y = _v_x(x, y, z), _v_x(y, x, z)
    z_v_xz = _z_v_xz(x, y, z)
    omega_xxy, omega_xyy = -x / (r + z), -y / (r + z)
    z_l_xxy, z_l_xyy = z * x / (r * (r + z)), z * y / (r * (r + z))
    return np.stack(
        [
            2.0 * v_x - 2.0 * poisson * omega_xyy + z_l_xyy + z_v_xz,
            2.0 * poisson * (v_x + omega_xyy) - z_l_xyy,
            -z_v_xz,
            v_y + 2.0 * poisson * omega_xxy - z_l_xxy,
            -z / r,
            _v_z(x, y, z) - _z_v_xx(x, y, z),
        ]
    )


def _v_x(x: Array, y: Array, z: float) -> Array:
    """Return ``∬ V_x``: ln(y + ρ) minus a function of x alone."""
    return np.arcsinh(y / np.hypot(x, z))


def _v_z(x: Array, y: Array, z: float) -> Array:
    """Return ``∬ V_z``: -atan(xy / zρ), which tends to ∓π/2 as z tends to 0."""
    return -np.arctan2(x * y, z * np.sqrt(x**2 + y**2 + z**2))


def _z_v_xx(x: Array, y: Array, z: float) -> Array:
    """Return ``∬ z V_xx``: zx / ρ(ρ + y) minus a function of x alone."""
    return -z * x * y / (np.sqrt(x**2 + y**2 + z**2) * (x**2 + z**2))


def _z_v_xz(x: Array, y: Array, z: float) -> Array:
    """Return ``∬ z V_xz``: z² / ρ(ρ + y) minus a function of x alone."""
    return -(z**2) * y / (np.sqrt(x**2 + y**2 + z**2) * (x**2 + z**2))


def _l_xx(x: Array, y: Array, z: float) -> Array:
    """Return ``∬ L_xx = atan(y/x) - atan(zy / xρ)`` as one arctangent, continuous at x = 0."""
    return np.arctan(x * y / (x**2 + z * (np.sqrt(x**2 + y**2 + z**2) + z)))
