"""Hankel transforms of functions of the wave number, as smooth functions of the distance.

A function on the plane that depends on the wave number k as f(k) cos nθ depends on the distance r
as the integral of f(k) J_n(kr) dk, times cos nφ and a factor. The integrals are computed for all
distances at once by fast transforms on a logarithmic scale. That of exp(-k) is exact to 1e-13.

Source: Hamilton 2000, doi:10.1046/j.1365-8711.2000.03071.x (FFTLog).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.fft import fht, fhtoffset
from scipy.interpolate import BSpline, make_interp_spline

from sa_solver.types import Array

POINTS, DEGREE = 1024, 7
LONGEST, SHORTEST = 1e-30, 1e4
"""Number of wave numbers, and their range over one divided by the longest and the shortest length.
Functions that tend to a constant at k = 0 need this range: what is cut off counts with its root."""

BIAS = -0.5
"""Exponent of k for functions that are constant at k = 0."""


@dataclass(frozen=True)
class WaveNumbers:
    """Wave numbers that resolve functions with features of ``shortest`` to ``longest`` [mm]."""

    shortest: float
    longest: float

    @property
    def spacing(self) -> float:
        """Spacing of their natural logarithms."""
        return float(np.log(SHORTEST / LONGEST * self.longest / self.shortest) / (POINTS - 1))

    @property
    def values(self) -> Array:
        """Wave numbers ``(n,)`` [1/mm]."""
        return np.asarray(LONGEST / self.longest * np.exp(self.spacing * np.arange(POINTS)))

    def transform(self, function: Array, order: float, bias: float = BIAS) -> RadialFunction:
        """Return the integral of ``function`` ``(n,)`` times J_n(kr) dk, n the ``order``.

        The exponent ``bias`` of k makes the function vanish at both ends of the range.
        """
        offset = fhtoffset(self.spacing, mu=order, bias=bias)
        distances = np.exp(offset) / self.values[::-1]
        integrals = fht(function, self.spacing, mu=order, offset=offset, bias=bias)
        # Beyond the longest length integrals fall as 1/r; this product is smooth everywhere.
        scaled = integrals * np.hypot(1.0, self.longest / distances)
        return RadialFunction(make_interp_spline(np.log(distances), scaled, DEGREE), self.longest)

    def cosines(self, function: Array) -> Callable[[Array], Array]:
        """Return the integral of ``function`` ``(n,)`` times cos(kx) dk, for x above 0.

        The function tends to a constant at k = 0.
        """
        return self._waves(function, -0.5)

    def sines(self, function: Array) -> Callable[[Array], Array]:
        """Return the integral of ``function`` ``(n,)`` times sin(kx) dk, for x above 0.

        The function tends to a constant at k = 0.
        """
        return self._waves(function, 0.5)

    def _waves(self, function: Array, order: float) -> Callable[[Array], Array]:
        """Waves are Bessel's functions of order -1/2 and 1/2, times the root of πkx/2."""
        root = self.transform(function * np.sqrt(self.values), order, bias=0.0)
        return lambda x: np.sqrt(0.5 * np.pi * x) * root(x)


@dataclass(frozen=True)
class RadialFunction:
    """Function of the distance: the spline over its logarithm, over hypot(r, ``length``)."""

    spline: BSpline
    length: float

    def __call__(self, distance: Array) -> Array:
        """Return the values at a ``distance`` above 0, of any shape [mm]."""
        return np.asarray(self.spline(np.log(distance)) / np.hypot(distance, self.length))
