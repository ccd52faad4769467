"""Stress inside a half-space z >= 0 under point forces and under Hertz contacts, sliding or not.

Forces and tractions act on the half-space, and positive tz or p presses on it, so that it is body 2
of :mod:`sa_solver.types`. Stress has six components xx, yy, zz, xy, yz, zx, tension positive.

Source: Johnson 1985, *Contact Mechanics*, eqs 3.18 (Boussinesq) and 3.76 (Cerruti), 3.42 to 3.45
and 3.91 (sphere), 4.49 (McEwen 1949, Phil. Mag. 40, 454) and 7.8 (sliding cylinder). The component
xy of eq. 3.18 has a factor 2 in its first term here, which follows from xx and yy by rotating the
axes.
"""

from __future__ import annotations

import numpy as np

from sa_solver.half_space.subsurface_influence import EXCHANGED
from sa_solver.reference.hertz import HertzCylinder, HertzSphere
from sa_solver.types import Array


def point_force_stress(x: Array, y: Array, z: Array, poisson: float) -> Array:
    """Return the stress ``(6, 3, ...)`` [1/mm²] from unit forces along x, y and z at the origin.

    The coordinates have the same shape ``(...)`` [mm]. Points on the axis x = y = 0 are not
    allowed.
    """
    along_y = _cerruti(y, x, z, poisson)[EXCHANGED]
    forces = [_cerruti(x, y, z, poisson), along_y, _boussinesq(x, y, z, poisson)]
    return np.stack(forces, axis=1) / (2.0 * np.pi)


def _cerruti(x: Array, y: Array, z: Array, poisson: float) -> Array:
    """Return the stress under a force along x, times 2π."""
    r = np.sqrt(x**2 + y**2 + z**2)
    k = 1.0 - 2.0 * poisson
    first, second, third = (
        1.0 / (r * (r + z) ** 2),
        1.0 / (r**3 * (r + z) ** 2),
        r**2 * (r + z) ** 3,
    )
    bracket = second + 2.0 / third
    return np.stack(
        [
            -3.0 * x**3 / r**5 + k * x * (1.0 / r**3 - 3.0 * first + x**2 * bracket),
            -3.0 * x * y**2 / r**5 + k * x * (1.0 / r**3 - first + y**2 * bracket),
            -3.0 * x * z**2 / r**5,
            -3.0 * x**2 * y / r**5 + k * y * (x**2 * bracket - first),
            -3.0 * x * y * z / r**5,
            -3.0 * x**2 * z / r**5,
        ]
    )


def _boussinesq(x: Array, y: Array, z: Array, poisson: float) -> Array:
    """Return the stress under a force along z, times 2π."""
    square = x**2 + y**2
    r = np.sqrt(square + z**2)
    scale = (1.0 - 2.0 * poisson) / square
    cap, dip = (1.0 - z / r) / square, z / r**3
    return np.stack(
        [
            scale * (cap * (x**2 - y**2) + dip * y**2) - 3.0 * z * x**2 / r**5,
            scale * (cap * (y**2 - x**2) + dip * x**2) - 3.0 * z * y**2 / r**5,
            -3.0 * z**3 / r**5,
            scale * x * y * (2.0 * cap - dip) - 3.0 * x * y * z / r**5,
            -3.0 * y * z**2 / r**5,
            -3.0 * x * z**2 / r**5,
        ]
    )


def cylinder_stress(
    contact: HertzCylinder, friction: float, x: Array, z: Array, poisson: float
) -> Array:
    """Return the stress ``(6, ...)`` [MPa] under a sliding cylinder, in plane strain.

    The tractions are Hertz's pressure p and a shear q = ``friction`` p along x. ``x`` and ``z``
    [mm] broadcast to ``(...)``. At the trailing edge, which is x = -a for shear towards +x, the
    surface carries xx = 2 µ p0.
    """
    x, z = np.broadcast_arrays(x, z)
    a, p0 = contact.half_width, contact.peak_pressure
    # McEwen's m and n: n + i m = sqrt((x + i z)² - a²), the root with the sign of x.
    inner, product = a**2 - x**2 + z**2, 2.0 * x * z
    modulus = np.hypot(inner, product)
    m, n = np.sqrt(0.5 * (modulus + inner)), np.sign(x) * np.sqrt(0.5 * (modulus - inner))
    # The modulus is m² + n², which is 0 at the edges.
    square = np.where(modulus > 0.0, modulus, 1.0)
    xx = -(p0 / a) * (m * (1.0 + (z**2 + n**2) / square) - 2.0 * z)
    zz = -(p0 / a) * m * (1.0 - (z**2 + n**2) / square)
    zx = -(p0 / a) * n * (m**2 - z**2) / square
    # Shear causes the same stresses as pressure, shifted by one component: only xx is new.
    xx_shear = friction * (p0 / a) * (n * (2.0 - (z**2 - m**2) / square) - 2.0 * x)
    xx, zz, zx = xx + xx_shear, zz + friction * zx, zx + friction * xx
    zero = np.zeros_like(xx)
    return np.stack([xx, poisson * (xx + zz), zz, zero, zero, zx])


def sphere_axis_stress(contact: HertzSphere, z: Array, poisson: float) -> Array:
    """Return the stress ``(6, ...)`` [MPa] on the axis at depths ``z`` > 0 under a sphere."""
    ratio = z / contact.contact_radius
    fall = 1.0 / (1.0 + ratio**2)
    radial = -(1.0 + poisson) * (1.0 - ratio * np.arctan(1.0 / ratio)) + 0.5 * fall
    zero = np.zeros_like(ratio)
    return contact.peak_pressure * np.stack([radial, radial, -fall, zero, zero, zero])


def sphere_surface_stress(
    contact: HertzSphere, friction: float, x: Array, y: Array, poisson: float
) -> Array:
    """Return the surface stress ``(6, ...)`` [MPa] in the contact of a sliding sphere.

    The tractions are Hertz's pressure p and a shear ``friction`` p along x. ``x`` and ``y`` [mm]
    broadcast to ``(...)``, with 0 < r <= a. Pressure causes a radial tension (1-2ν) p0 / 3 at the
    edge; shear adds xx = (4+ν) π µ p0 / 8 at the trailing edge x = -a.
    """
    x, y = np.broadcast_arrays(x, y)
    a, p0 = contact.contact_radius, contact.peak_pressure
    square = (x**2 + y**2) / a**2
    pressure = p0 * np.sqrt(np.maximum(0.0, 1.0 - square))
    bulge = (1.0 - 2.0 * poisson) / 3.0 * p0 * (1.0 - np.maximum(0.0, 1.0 - square) ** 1.5) / square
    radial, hoop = bulge - pressure, -bulge - 2.0 * poisson * pressure
    cos_2, sin_2 = (x**2 - y**2) / (x**2 + y**2), 2.0 * x * y / (x**2 + y**2)
    mean, half = 0.5 * (radial + hoop), 0.5 * (radial - hoop)
    # The displacements by shear are quadratic in x and y (eq. 3.91); these are their strains.
    slope = np.pi * friction * p0 / (8.0 * a)
    xx = mean + half * cos_2 - slope * (4.0 + poisson) * x
    yy = mean - half * cos_2 - slope * 3.0 * poisson * x
    xy = half * sin_2 - slope * (2.0 - poisson) * y
    return np.stack([xx, yy, -pressure, xy, np.zeros_like(x), -friction * pressure])
