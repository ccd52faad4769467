"""Contacts with waves: pressures with several peaks, in closed form.

Plane strain. Source: Westergaard 1939, J. Appl. Mech. 6, A49 and Johnson 1985, *Contact Mechanics*,
section 13.2, for the periodic surface. For the single contact, the integrals of Chebyshev
polynomials, from ln|t - s| = -ln 2 - Σ (2/n) T_n(t) T_n(s):

    ∫ sqrt(1-s²) U_n(s) / (t-s) ds = π T_{n+1}(t)                          (principal value)
    ∫ sqrt(1-s²) U_n(s) ln|t-s| ds = (π/2) [T_{n+2}(t)/(n+2) - T_n(t)/n]               (n >= 1)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.special import eval_chebyt, eval_chebyu

from sa_solver.errors import InputError
from sa_solver.types import Array


@dataclass(frozen=True)
class WavySurface:
    """A periodic surface Δ (1 - cos 2πx/λ) pressed on a flat by a ``mean_pressure`` p̄ [MPa].

    ``amplitude`` Δ (half of peak to valley) and ``wavelength`` λ in mm, ``contact_modulus`` E* in
    MPa. Exact for a periodic solver. On a half-space it is the limit of many waves under a mean
    pressure that varies slowly, as λ/L for L the length over which it varies: compare the middle
    waves of a long contact, with p̄ the local mean of the computed pressure.

    Raises ``InputError`` at or beyond p*, where contact is full and p = p̄ + p* cos 2πx/λ.
    """

    amplitude: float
    wavelength: float
    mean_pressure: float
    contact_modulus: float

    def __post_init__(self) -> None:
        if not 0.0 < self.mean_pressure < self.full_contact_pressure:
            raise InputError(
                f"mean pressure {self.mean_pressure} MPa must lie between 0 and p* = "
                f"{self.full_contact_pressure} MPa, at which contact is full"
            )

    @property
    def full_contact_pressure(self) -> float:
        """p* = π E* Δ / λ [MPa]."""
        return np.pi * self.contact_modulus * self.amplitude / self.wavelength

    @property
    def half_width(self) -> float:
        """a [mm] of each contact, p̄ / p* = sin²(π a / λ)."""
        ratio = self.mean_pressure / self.full_contact_pressure
        return self.wavelength / np.pi * float(np.arcsin(np.sqrt(ratio)))

    def gap(self, x: Array) -> Array:
        """Gap before loading [mm], 0 at the crests."""
        return 2.0 * self.amplitude * np.sin(np.pi * x / self.wavelength) ** 2

    def pressure(self, x: Array) -> Array:
        """2 p* cos ψ sqrt(sin²ψa - sin²ψ) with ψ = π x / λ, 0 outside the contacts [MPa]."""
        angle = np.pi * x / self.wavelength
        edge = self.mean_pressure / self.full_contact_pressure
        inside = np.maximum(0.0, edge - np.sin(angle) ** 2)
        return 2.0 * self.full_contact_pressure * np.abs(np.cos(angle)) * np.sqrt(inside)


@dataclass(frozen=True)
class ChebyshevPunch:
    """One line contact, wavy and without gaps inside, on a half-plane: an inverse problem.

    The pressure p0 sqrt(1 - t²) [1 + ε U_n(t)], t = x/a, is chosen: ``half_width`` a [mm], ``load``
    per length P [N/mm], ``waviness`` ε and ``order`` n, even and at least 2. It has up to
    n/2 + 1 peaks. The profile that it fits is a polynomial, continued outside the contact, where
    the gap grows away from both ends (ε >= 0). ``contact_modulus`` is E* [MPa]. A profile fits one
    load only.

    Raises ``InputError`` for another order, ε < 0, or an ε for which the pressure is negative.
    """

    half_width: float
    load: float
    waviness: float
    order: int
    contact_modulus: float

    def __post_init__(self) -> None:
        if self.order < 2 or self.order % 2:
            raise InputError(f"order {self.order} is not even and at least 2")
        if not 0.0 <= self.waviness <= self.largest_waviness:
            raise InputError(
                f"waviness {self.waviness} must lie between 0 and {self.largest_waviness}"
            )

    @cached_property
    def largest_waviness(self) -> float:
        """ε at which the pressure first touches 0 inside, -1 / min U_n."""
        # U_n = T'_{n+1} / (n+1); roots in the Chebyshev basis stay accurate for high orders.
        extremes = Chebyshev.basis(self.order + 1).deriv(2).roots()
        return -1.0 / float(np.min(eval_chebyu(self.order, extremes)))

    @property
    def mean_peak_pressure(self) -> float:
        """p0 = 2 P / π a [MPa], Hertz's peak: waves carry no load."""
        return 2.0 * self.load / (np.pi * self.half_width)

    def pressure(self, x: Array) -> Array:
        """Pressure, 0 outside the contact [MPa]."""
        t = np.clip(x / self.half_width, -1.0, 1.0)
        waves: Array = 1.0 + self.waviness * eval_chebyu(self.order, t)
        return self.mean_peak_pressure * np.sqrt(1.0 - t**2) * waves

    def gap(self, x: Array) -> Array:
        """Gap before loading, 0 at x = 0 and negative where a wave stands higher [mm]."""
        return self._potential(x / self.half_width) - self._potential(np.zeros(()))

    def approach(self, datum: float) -> float:
        """δz [mm] of x = 0, for the ``datum`` L [mm] as in :meth:`hertz.HertzCylinder.approach`."""
        point = 2.0 * self.load * float(np.log(datum / self.half_width))
        return point / (np.pi * self.contact_modulus) - float(self._potential(np.zeros(())))

    def _potential(self, t: Array) -> Array:
        """(2 p0 a / π E*) ∫ sqrt(1-s²) [1 + ε U_n(s)] ln|t-s| ds, as a polynomial in t."""
        n = self.order
        even: Array = 0.5 * eval_chebyt(2, t) - np.log(2.0)
        waves: Array = eval_chebyt(n + 2, t) / (n + 2) - eval_chebyt(n, t) / n
        scale = self.mean_peak_pressure * self.half_width / self.contact_modulus
        return scale * (even + self.waviness * waves)
