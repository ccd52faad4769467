"""Hertz contact of spheres and of parallel cylinders.

Source: Johnson 1985, *Contact Mechanics*, section 4.2, eqs 4.22-4.24 (point) and 4.43-4.46 (line).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array


@dataclass(frozen=True)
class Sphere:
    """Sphere of relative ``radius`` [mm] pressed with ``load`` [N] at E* ``contact_modulus``."""

    load: float
    radius: float
    contact_modulus: float

    @property
    def contact_radius(self) -> float:
        """a = (3 P R / 4 E*)^(1/3) [mm]."""
        return float(np.cbrt(0.75 * self.load * self.radius / self.contact_modulus))

    @property
    def peak_pressure(self) -> float:
        """p0 = 3 P / 2 π a² [MPa]."""
        return 1.5 * self.load / (np.pi * self.contact_radius**2)

    @property
    def approach(self) -> float:
        """δz = a² / R [mm]."""
        return self.contact_radius**2 / self.radius

    def gap(self, x: Array, y: Array) -> Array:
        """Gap before loading, ``(x² + y²) / 2 R`` [mm]."""
        return (x**2 + y**2) / (2.0 * self.radius)

    def pressure(self, x: Array, y: Array) -> Array:
        """p0 sqrt(1 - r²/a²), 0 outside the contact [MPa]; ``x`` and ``y`` broadcast [mm]."""
        inside = np.maximum(0.0, 1.0 - (x**2 + y**2) / self.contact_radius**2)
        return self.peak_pressure * np.sqrt(inside)


@dataclass(frozen=True)
class Cylinder:
    """Parallel cylinders of relative ``radius`` [mm] under ``load`` per length [N/mm], E* [MPa]."""

    load: float
    radius: float
    contact_modulus: float

    @property
    def half_width(self) -> float:
        """a = sqrt(4 P R / π E*) [mm]."""
        return float(np.sqrt(4.0 * self.load * self.radius / (np.pi * self.contact_modulus)))

    @property
    def peak_pressure(self) -> float:
        """p0 = 2 P / π a [MPa]."""
        return 2.0 * self.load / (np.pi * self.half_width)

    def pressure(self, x: Array) -> Array:
        """p0 sqrt(1 - x²/a²), 0 outside the contact [MPa]."""
        inside = np.maximum(0.0, 1.0 - (x / self.half_width) ** 2)
        return self.peak_pressure * np.sqrt(inside)
