"""Hertz contact of spheres, of general quadratic surfaces and of parallel cylinders.

The solutions are valid for frictionless or elastically similar half-spaces, and for contacts that
are small compared with the radii.

Source: Johnson 1985, *Contact Mechanics*, section 4.2, eqs 4.22-4.24 (point) and 4.43-4.46 (line);
section 3.5 for the displacements inside an ellipse.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq
from scipy.special import elliprd, elliprf

from sa_solver import checks
from sa_solver.types import Array, ElasticPair, Material


@dataclass(frozen=True)
class HertzSphere:
    """Contact of a sphere with the relative ``radius`` [mm] under a ``load`` [N].

    ``contact_modulus`` is E* [MPa]. InputError is raised for values that are not above 0, as by all
    classes here.
    """

    load: float
    radius: float
    contact_modulus: float

    def __post_init__(self) -> None:
        checks.numbers(self, "load", "radius", "contact_modulus", above=0.0)

    @property
    def contact_radius(self) -> float:
        """Radius of the contact a = (3 P R / 4 E*)^(1/3) [mm]."""
        return float(np.cbrt(0.75 * self.load * self.radius / self.contact_modulus))

    @property
    def peak_pressure(self) -> float:
        """Peak pressure p0 = 3 P / 2 π a² [MPa]."""
        return 1.5 * self.load / (np.pi * self.contact_radius**2)

    @property
    def approach(self) -> float:
        """Approach δz = a² / R [mm]."""
        return self.contact_radius**2 / self.radius

    def gap(self, x: Array, y: Array) -> Array:
        """Return the gap before loading, ``(x² + y²) / 2 R`` [mm]."""
        return (x**2 + y**2) / (2.0 * self.radius)

    def pressure(self, x: Array, y: Array) -> Array:
        """Return the pressure p0 sqrt(1 - r²/a²) [MPa], 0 outside the contact.

        ``x`` and ``y`` [mm] broadcast.
        """
        inside = np.maximum(0.0, 1.0 - (x**2 + y**2) / self.contact_radius**2)
        return self.peak_pressure * np.sqrt(inside)


@dataclass(frozen=True)
class FrictionalSphere:
    """Sphere with the relative ``radius`` [mm] and ``friction`` µ under a constant ``load`` [N]."""

    load: float
    radius: float
    body_1: Material
    body_2: Material
    friction: float

    def __post_init__(self) -> None:
        checks.numbers(self, "friction", least=0.0)

    @cached_property
    def pair(self) -> ElasticPair:
        """Elastic constants of both bodies."""
        return ElasticPair(self.body_1, self.body_2)

    @cached_property
    def contact(self) -> HertzSphere:
        """Normal contact, which does not depend on shear or twist."""
        return HertzSphere(self.load, self.radius, self.pair.contact_modulus)


@dataclass(frozen=True)
class HertzEllipse:
    """Elliptic contact of surfaces with two relative radii under a load.

    Inside the ellipse with the semi-axes a along x and b along y, the pressure
    p0 sqrt(1 - x²/a² - y²/b²) displaces the surface by

        u_z = (p0 a b / E*) [R_F(0, a², b²) - (x²/3) R_D(0, b², a²) - (y²/3) R_D(0, a², b²)]

    with Carlson's complete elliptic integrals R_F and R_D, which are Johnson's integrals of section
    3.5 without his modulus. The condition u_z = δz - gap determines the ratio b/a (as a root), then
    a and δz, exactly.

    Parameters
    ----------
    load
        Load [N].
    radius_x, radius_y
        Relative radii of curvature [mm] in the principal sections y = 0 and x = 0, of any ratio.
    contact_modulus
        Contact modulus E* [MPa].
    """

    load: float
    radius_x: float
    radius_y: float
    contact_modulus: float

    def __post_init__(self) -> None:
        names = "load", "radius_x", "radius_y", "contact_modulus"
        checks.numbers(self, *names, above=0.0)

    @cached_property
    def axis_ratio(self) -> float:
        """Ratio b/a of the semi-axes, the root κ of R_D(0, κ², 1) / R_D(0, 1, κ²) = Ry / Rx."""
        target = float(np.log(self.radius_y / self.radius_x))

        def excess(log_ratio: float) -> float:
            square = np.exp(2.0 * log_ratio)
            return float(np.log(elliprd(0.0, square, 1.0) / elliprd(0.0, 1.0, square))) - target

        # The ratio lies between the square root of Ry/Rx and Ry/Rx; 1 is added for the circle.
        reach = abs(target) + 1.0
        return float(np.exp(brentq(excess, -reach, reach, xtol=1e-15)))

    @cached_property
    def semi_axes(self) -> tuple[float, float]:
        """Semi-axes (a, b) along x and y [mm], with a³ = (P Rx / π E*) R_D(0, (b/a)², 1)."""
        volume = self.load * self.radius_x / (np.pi * self.contact_modulus)
        a = float(np.cbrt(volume * elliprd(0.0, self.axis_ratio**2, 1.0)))
        return a, self.axis_ratio * a

    @property
    def peak_pressure(self) -> float:
        """Peak pressure p0 = 3 P / 2 π a b [MPa]."""
        a, b = self.semi_axes
        return 1.5 * self.load / (np.pi * a * b)

    @property
    def approach(self) -> float:
        """Approach δz = (3 P / 2 π E*) R_F(0, a², b²) [mm]."""
        a, b = self.semi_axes
        integral = float(elliprf(0.0, a**2, b**2))
        return 1.5 * self.load * integral / (np.pi * self.contact_modulus)

    def gap(self, x: Array, y: Array) -> Array:
        """Return the gap before loading, ``x² / 2 Rx + y² / 2 Ry`` [mm]."""
        return x**2 / (2.0 * self.radius_x) + y**2 / (2.0 * self.radius_y)

    def pressure(self, x: Array, y: Array) -> Array:
        """Return the pressure p0 sqrt(1 - x²/a² - y²/b²) [MPa], 0 outside the contact.

        ``x`` and ``y`` [mm] broadcast.
        """
        a, b = self.semi_axes
        inside = np.maximum(0.0, 1.0 - (x / a) ** 2 - (y / b) ** 2)
        return self.peak_pressure * np.sqrt(inside)


@dataclass(frozen=True)
class HertzCylinder:
    """Contact of parallel cylinders with the relative ``radius`` [mm].

    ``load`` is per length [N/mm] and ``contact_modulus`` is E* [MPa].
    """

    load: float
    radius: float
    contact_modulus: float

    def __post_init__(self) -> None:
        checks.numbers(self, "load", "radius", "contact_modulus", above=0.0)

    @property
    def half_width(self) -> float:
        """Half-width of the contact a = sqrt(4 P R / π E*) [mm]."""
        return float(np.sqrt(4.0 * self.load * self.radius / (np.pi * self.contact_modulus)))

    @property
    def peak_pressure(self) -> float:
        """Peak pressure p0 = 2 P / π a [MPa]."""
        return 2.0 * self.load / (np.pi * self.half_width)

    def approach(self, datum: float) -> float:
        """Return the approach δz = (2 P / π E*) [ln(2 L / a) + 1/2] [mm] for the ``datum`` L [mm].

        The approach of a line contact is defined only up to a constant. This one belongs to
        u_z = -(2 / π E*) ∫ p ln(|x - ξ| / L) dξ, where the displacement by a line load is 0 at the
        distance L.
        """
        logarithm = float(np.log(2.0 * datum / self.half_width))
        return 2.0 * self.load * (logarithm + 0.5) / (np.pi * self.contact_modulus)

    def gap(self, x: Array) -> Array:
        """Return the gap before loading, ``x² / 2 R`` [mm]."""
        return x**2 / (2.0 * self.radius)

    def pressure(self, x: Array) -> Array:
        """Return the pressure p0 sqrt(1 - x²/a²) [MPa], 0 outside the contact."""
        inside = np.maximum(0.0, 1.0 - (x / self.half_width) ** 2)
        return self.peak_pressure * np.sqrt(inside)
