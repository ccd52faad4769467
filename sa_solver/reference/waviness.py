"""Contacts of wavy surfaces in plane strain: pressures with several peaks, in closed form.

Source for the periodic surface: Westergaard 1939, J. Appl. Mech. 6, A49, and Johnson 1985, *Contact
Mechanics*, section 13.2. The single contact follows from integrals of Chebyshev polynomials, with
ln|t - s| = -ln 2 - Σ (2/n) T_n(t) T_n(s):

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
    """Periodic surface Δ (1 - cos 2πx/λ) pressed on a flat by a mean pressure p̄.

    The solution is exact for a periodic solver. On a half-space it is the limit of many waves under
    a slowly varying mean pressure; the error is of the order λ/L, where L is the length over which
    the mean pressure varies. For a comparison use the middle waves of a long contact, and for p̄
    the local mean of the computed pressure.

    Parameters
    ----------
    amplitude
        Amplitude Δ [mm], half of the distance between peak and valley.
    wavelength
        Wavelength λ [mm].
    mean_pressure
        Mean pressure p̄ [MPa].
    contact_modulus
        Contact modulus E* [MPa].

    Raises
    ------
    InputError
        At or beyond p*, where contact is full and p = p̄ + p* cos 2πx/λ.
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
        """Mean pressure p* = π E* Δ / λ [MPa] at which contact is full."""
        return np.pi * self.contact_modulus * self.amplitude / self.wavelength

    @property
    def half_width(self) -> float:
        """Half-width a of each contact [mm], with p̄ / p* = sin²(π a / λ)."""
        ratio = self.mean_pressure / self.full_contact_pressure
        return self.wavelength / np.pi * float(np.arcsin(np.sqrt(ratio)))

    def gap(self, x: Array) -> Array:
        """Return the gap before loading [mm], which is 0 at the crests."""
        return 2.0 * self.amplitude * np.sin(np.pi * x / self.wavelength) ** 2

    def pressure(self, x: Array) -> Array:
        """Return the pressure 2 p* cos ψ sqrt(sin²ψa - sin²ψ) [MPa] with ψ = π x / λ.

        It is 0 outside the contacts.
        """
        angle = np.pi * x / self.wavelength
        edge = self.mean_pressure / self.full_contact_pressure
        inside = np.maximum(0.0, edge - np.sin(angle) ** 2)
        return 2.0 * self.full_contact_pressure * np.abs(np.cos(angle)) * np.sqrt(inside)


@dataclass(frozen=True)
class ChebyshevPunch:
    """Wavy line contact without gaps inside, on a half-plane, from a chosen pressure.

    The pressure is p0 sqrt(1 - t²) [1 + ε U_n(t)], t = x/a, with up to n/2 + 1 peaks. The profile
    with this pressure is a polynomial, which is continued outside the contact, where the gap grows
    away from both ends (ε >= 0). The profile belongs to one load only.

    Parameters
    ----------
    half_width
        Half-width a of the contact [mm].
    load
        Load P per length [N/mm].
    waviness
        Amplitude ε of the waves.
    order
        Order n of the Chebyshev polynomial, even and at least 2.
    contact_modulus
        Contact modulus E* [MPa].

    Raises
    ------
    InputError
        For another order, ε < 0, or an ε for which the pressure is negative.
    """

    half_width: float
    load: float
    waviness: float
    order: int
    contact_modulus: float

    def __post_init__(self) -> None:
        if self.order < 2 or self.order % 2:
            raise InputError(f"order is {self.order}: give an even number of at least 2")
        if not 0.0 <= self.waviness <= self.largest_waviness:
            raise InputError(
                f"waviness {self.waviness} must lie between 0 and {self.largest_waviness}"
            )

    @cached_property
    def largest_waviness(self) -> float:
        """Largest ε, at which the pressure is 0 at a point inside: -1 / min U_n."""
        # With U_n = T'_{n+1} / (n+1), roots in the Chebyshev basis are accurate for high orders.
        extremes = Chebyshev.basis(self.order + 1).deriv(2).roots()
        return -1.0 / float(np.min(eval_chebyu(self.order, extremes)))

    @property
    def mean_peak_pressure(self) -> float:
        """Hertz's peak pressure p0 = 2 P / π a [MPa]: the waves carry no load."""
        return 2.0 * self.load / (np.pi * self.half_width)

    def pressure(self, x: Array) -> Array:
        """Return the pressure [MPa], 0 outside the contact."""
        t = np.clip(x / self.half_width, -1.0, 1.0)
        waves: Array = 1.0 + self.waviness * eval_chebyu(self.order, t)
        return self.mean_peak_pressure * np.sqrt(1.0 - t**2) * waves

    def gap(self, x: Array) -> Array:
        """Return the gap before loading [mm]: 0 at x = 0 and negative where a wave is higher."""
        return self._potential(x / self.half_width) - self._potential(np.zeros(()))

    def approach(self, datum: float) -> float:
        """Return the approach δz [mm] of the point x = 0.

        The ``datum`` L [mm] is that of :meth:`.hertz.HertzCylinder.approach`.
        """
        point = 2.0 * self.load * float(np.log(datum / self.half_width))
        return point / (np.pi * self.contact_modulus) - float(self._potential(np.zeros(())))

    def _potential(self, t: Array) -> Array:
        """Return (2 p0 a / π E*) ∫ sqrt(1-s²) [1 + ε U_n(s)] ln|t-s| ds, a polynomial in t."""
        n = self.order
        even: Array = 0.5 * eval_chebyt(2, t) - np.log(2.0)
        waves: Array = eval_chebyt(n + 2, t) / (n + 2) - eval_chebyt(n, t) / n
        scale = self.mean_peak_pressure * self.half_width / self.contact_modulus
        return scale * (even + self.waviness * waves)
