"""Plane contact of a flat with rounded edges, and the error of its peak pressure on a grid.

The indenter is flat over ``|x| <= a`` and a parabola of radius R beyond. With the half-width b of
the contact, ``sin φ0 = a/b`` and ``sin φ = x/b``:

    2 P R / (a² E*) = (π - 2 φ0) / (2 sin² φ0) - cot φ0
    p = (2 P / π b) / (π - 2 φ0 - sin 2φ0) { (π - 2 φ0) cos φ
        + sin φ ln |sin(φ + φ0) / sin(φ - φ0)| + sin φ0 ln |tan((φ + φ0)/2) tan((φ - φ0)/2)| }

Source: Ciavarella, Hills & Monno 1998, Proc. Inst. Mech. Eng. C 212, 319,
doi:10.1243/0954406981521259. Their left side is twice this one because they define E* differently.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from sa_solver import checks
from sa_solver.types import Array

SMALLEST_ANGLE = 1e-6
"""Distance of the bracket of φ0 from both ends of (0, π/2): practical loads lie within it."""

SAMPLES_PER_CELL = 64
"""Midpoint samples in a cell average; 1024 change the estimated peak error by at most 3e-4."""

PHASES = 32
"""Number of positions of the end of the flat within a cell that are tried; the worst of 8 differs
from the true worst by up to 0.03."""


@dataclass(frozen=True)
class FlatRoundedPunch:
    """Flat punch with rounded edges.

    Parameters
    ----------
    half_width
        Half-width a of the flat [mm].
    radius
        Radius R of the edges [mm].
    load
        Load per length [N/mm].
    contact_modulus
        Contact modulus E* [MPa].
    """

    half_width: float
    radius: float
    load: float
    contact_modulus: float

    def __post_init__(self) -> None:
        checks.numbers(self, "half_width", "radius", "load", "contact_modulus", above=0.0)

    def gap(self, x: Array) -> Array:
        """Return the gap before loading [mm]."""
        return np.maximum(np.abs(x) - self.half_width, 0.0) ** 2 / (2.0 * self.radius)

    @cached_property
    def edge_angle(self) -> float:
        """Angle φ0 = asin(a/b) [rad]."""
        target = 2.0 * self.load * self.radius / (self.half_width**2 * self.contact_modulus)

        def excess(angle: float) -> float:
            wedge = (0.5 * np.pi - angle) / np.sin(angle) ** 2 - 1.0 / np.tan(angle)
            return float(wedge - target)

        return float(brentq(excess, SMALLEST_ANGLE, 0.5 * np.pi - SMALLEST_ANGLE, xtol=1e-15))

    @property
    def contact_half_width(self) -> float:
        """Half-width b of the contact [mm]."""
        return self.half_width / float(np.sin(self.edge_angle))

    def pressure(self, x: Array) -> Array:
        """Return the pressure [MPa] at ``x`` [mm] of any shape, 0 outside the contact."""
        edge = self.edge_angle
        ratio = np.clip(np.abs(np.asarray(x, dtype=np.float64)) / self.contact_half_width, 0.0, 1.0)
        angle = np.arcsin(ratio)
        # The two logarithms are infinite and cancel at the end of the flat, which is avoided.
        angle = np.where(angle == edge, edge * (1.0 - 1e-12), angle)
        through = np.log(np.abs(np.sin(angle + edge) / np.sin(angle - edge)))
        across = np.log(np.abs(np.tan(0.5 * (angle + edge)) * np.tan(0.5 * (angle - edge))))
        shape = (
            (np.pi - 2.0 * edge) * np.cos(angle) + np.sin(angle) * through + np.sin(edge) * across
        )
        scale = 2.0 * self.load / (np.pi * self.contact_half_width)
        scale /= np.pi - 2.0 * edge - np.sin(2.0 * edge)
        return np.where(ratio < 1.0, scale * shape, 0.0)

    @cached_property
    def peak(self) -> tuple[float, float]:
        """Largest pressure [MPa] and its position ``x`` >= 0 [mm]."""
        end = self.contact_half_width
        samples = np.linspace(0.0, end, 2001)
        highest = int(np.argmax(self.pressure(samples)))
        minimum = minimize_scalar(
            lambda x: -float(self.pressure(np.array(x))),
            bounds=(samples[max(highest - 1, 0)], samples[min(highest + 1, 2000)]),
            method="bounded",
            options={"xatol": 1e-10 * end},
        )
        return -float(minimum.fun), float(minimum.x)

    def cell_averages(self, pitch: float, cells: int) -> Array:
        """Return the mean pressure ``(cells,)`` [MPa] on cells of ``pitch`` [mm].

        The cells are centred on x = 0.
        """
        count = cells * SAMPLES_PER_CELL
        x = (np.arange(count, dtype=np.float64) + 0.5 - 0.5 * count) * (pitch / SAMPLES_PER_CELL)
        means: Array = self.pressure(x).reshape(cells, SAMPLES_PER_CELL).mean(axis=1)
        return means

    def peak_error(self, pitch: float) -> float:
        """Return the largest relative error of the peak pressure on cells of ``pitch`` [mm].

        The error is the largest cell average over the true peak, minus 1, for the worst position of
        the end of the flat within a cell. It is negative, because averaging lowers peaks. Use
        ``pitch <= 0.33 (b - a)`` for an error within 5 %. This holds for radii of 3 to 150 mm on a
        flat of 8 mm and loads of 20 to 1440 N/mm. Of 72 half-space solutions (four radii, six
        pitches, three loads) only two exceeded the returned error, by less than 2e-4.
        """
        reach = 2 + int(np.ceil((self.contact_half_width - self.half_width) / pitch))
        cell = np.arange(-reach, reach, dtype=np.float64)[:, None]
        sample = (np.arange(SAMPLES_PER_CELL, dtype=np.float64) + 0.5) / SAMPLES_PER_CELL
        highest = np.inf
        for phase in range(PHASES):
            x: Array = self.half_width + (cell + sample + phase / PHASES) * pitch
            highest = min(highest, float(self.pressure(x).mean(axis=1).max()))
        return highest / self.peak[0] - 1.0
