"""Surface displacements of half-spaces under uniform pressure and shear.

They check influence coefficients, with which all but Love's logarithms share nothing. With r the
distance from a force on body 2 (equal and opposite on body 1) the surface of body 2 moves relative
to that of body 1 by

    pressure p:   u_z = p / π E* r                    u_x = -κ p x / r²     u_y = -κ p y / r²
    shear qx:     u_x = qx Σ [(1-ν) + ν x²/r²]/G / 2 π r     u_y = qx Σ (ν/G) x y / 2 π r³
                  u_z = κ qx x / r²
    κ = [(1 - 2ν2)/G2 - (1 - 2ν1)/G1] / 4 π

These Green's functions g are homogeneous of degree -1, so that div(x g) = g and their integral over
a rectangle is that of g (x·n) along its edges: a smooth one-dimensional quadrature, for points
inside too. It takes about two milliseconds per point.

Source: Johnson 1985, *Contact Mechanics*, sections 3.2, 3.3 (eq. 3.25: Love 1929, Phil. Trans. R.
Soc. A 228, 377, doi:10.1098/rsta.1929.0009) and 3.6 (Cerruti); sections 2.2 to 2.5 for strips.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad_vec

from sa_solver.types import Array, ElasticPair, Material

GreensFunction = Callable[[float, float], Array]
"""Displacement (3,) at ``(x, y)`` from a unit force at the origin, homogeneous of degree -1."""


def love_displacement(
    x: Array, y: Array, half_sides: tuple[float, float], contact_modulus: float
) -> Array:
    """Return u_z per unit pressure on ``|x| <= a, |y| <= b`` [mm/MPa], Johnson's eq. 3.25.

    ``x`` and ``y`` broadcast [mm], ``half_sides`` is (a, b) [mm], ``contact_modulus`` E* [MPa]. Do
    not use it at points on the lines of the rectangle's edges, where two of the logarithms are
    infinite or cancel to zero.
    """
    a, b = half_sides
    left, right, below, above = x - a, x + a, y - b, y + b
    total = (
        right * _log_ratio(above, below, right)
        + above * _log_ratio(right, left, above)
        + left * _log_ratio(below, above, left)
        + below * _log_ratio(left, right, below)
    )
    return total / (np.pi * contact_modulus)


def _log_ratio(top: Array, bottom: Array, other: Array) -> Array:
    """Return ``ln [(t + sqrt(t² + s²)) / (b + sqrt(b² + s²))]``."""
    numerator = top + np.sqrt(top**2 + other**2)
    ratio: Array = np.log(numerator / (bottom + np.sqrt(bottom**2 + other**2)))
    return ratio


@dataclass(frozen=True)
class UniformRectangle:
    """Two half-spaces loaded uniformly over ``|x| <= a, |y| <= b``, ``half_sides`` (a, b) [mm].

    Displacements are those of body 2's surface relative to body 1's, ``(3,)`` ordered x, y, z, at
    one point anywhere on the surface, edges and corners included. Shear along y follows by exchange
    of the axes.
    """

    half_sides: tuple[float, float]
    body_1: Material
    body_2: Material

    def pressed(self, x: float, y: float) -> Array:
        """Return the displacement per unit pressure at ``(x, y)`` [mm/MPa]."""
        normal = 1.0 / (np.pi * ElasticPair(self.body_1, self.body_2).contact_modulus)
        cross = _cross_compliance(self.body_1, self.body_2) / np.pi

        def kernel(x: float, y: float) -> Array:
            square = x * x + y * y
            return np.array([-cross * x / square, -cross * y / square, normal / np.sqrt(square)])

        return _over_rectangle(kernel, x, y, self.half_sides)

    def sheared(self, x: float, y: float) -> Array:
        """Return the displacement per unit shear along x at ``(x, y)`` [mm/MPa]."""
        bodies = (self.body_1, self.body_2)
        even = sum((1.0 - m.poisson) / m.shear_modulus for m in bodies) / (2.0 * np.pi)
        odd = sum(m.poisson / m.shear_modulus for m in bodies) / (2.0 * np.pi)
        cross = _cross_compliance(self.body_1, self.body_2) / np.pi

        def kernel(x: float, y: float) -> Array:
            square = x * x + y * y
            r = np.sqrt(square)
            along = (even + odd * x * x / square) / r
            return np.array([along, odd * x * y / (square * r), cross * x / square])

        return _over_rectangle(kernel, x, y, self.half_sides)


@dataclass(frozen=True)
class UniformStrip:
    """Two half-planes in plane strain, loaded uniformly over ``|x| <= half_width`` [mm].

    Displacements are those of body 2's surface relative to body 1's, per unit traction [mm/MPa], at
    ``x`` of any shape [mm]. ``datum`` L [mm] is where a line load's own displacement is 0.
    """

    half_width: float
    body_1: Material
    body_2: Material
    datum: float

    def pressed(self, x: Array) -> tuple[Array, Array]:
        """Return (u_x, u_z) under unit pressure."""
        return -self._step(x), self._logarithm(x)

    def sheared(self, x: Array) -> tuple[Array, Array]:
        """Return (u_x, u_z) under unit shear along x."""
        return self._logarithm(x), self._step(x)

    def _logarithm(self, x: Array) -> Array:
        """Return -(2 / π E*) ∫ ln(|x - ξ| / L) dξ."""
        compliance = 2.0 / (np.pi * ElasticPair(self.body_1, self.body_2).contact_modulus)
        ends = _x_log(x + self.half_width, self.datum) - _x_log(x - self.half_width, self.datum)
        return compliance * (2.0 * self.half_width - ends)

    def _step(self, x: Array) -> Array:
        """Return π κ ∫ sign(x - ξ) dξ: uniform stretching below the strip, constant outside."""
        cross = _cross_compliance(self.body_1, self.body_2)
        return 2.0 * cross * np.clip(x, -self.half_width, self.half_width)


def _cross_compliance(body_1: Material, body_2: Material) -> float:
    """Return π κ = [(1 - 2ν2)/G2 - (1 - 2ν1)/G1] / 4 [1/MPa], 0 for similar bodies."""
    below, above = ((1.0 - 2.0 * m.poisson) / m.shear_modulus for m in (body_1, body_2))
    return 0.25 * (above - below)


def _x_log(x: Array, datum: float) -> Array:
    """Return ``x ln(|x| / L)``, 0 at 0."""
    distance = np.abs(x)
    return x * np.log(np.where(distance > 0.0, distance, datum) / datum)


def _over_rectangle(
    kernel: GreensFunction, x: float, y: float, half_sides: tuple[float, float]
) -> Array:
    """Integrate ``kernel`` over the rectangle, from its points to ``(x, y)``, ``(3,)``."""
    a, b = half_sides
    left, right, below, above = x - a, x + a, y - b, y + b
    across = _along_edge(kernel, right, below, above) - _along_edge(kernel, left, below, above)

    def turned(y: float, x: float) -> Array:
        return kernel(x, y)

    along = _along_edge(turned, above, left, right) - _along_edge(turned, below, left, right)
    return across + along


def _along_edge(kernel: GreensFunction, distance: float, start: float, end: float) -> Array:
    """Return ``d ∫ kernel(d, t) dt`` from ``start`` to ``end``, which tends to 0 with d, ``(3,)``.

    With t = |d| sinh s and homogeneity of degree -1 the integrand is smooth, however near the edge.
    """
    if distance == 0.0:
        return np.zeros(3)
    side, scale = float(np.sign(distance)), abs(distance)
    limits = np.arcsinh(start / scale), np.arcsinh(end / scale)
    integral: Array = quad_vec(
        lambda s: kernel(side, np.sinh(s)) * np.cosh(s), *limits, epsrel=1e-11, epsabs=1e-300
    )[0]
    return distance * integral
