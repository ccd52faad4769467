"""Torsion of the contact of a sphere under a constant normal load (Lubkin 1951).

A twist displaces points along circles only, with the same traction for any ν, and displaces nothing
along the normal. With Hertz's pressure, and µp in the slip annulus, the solution is exact, except
for the radial slip by pressure between dissimilar bodies. A torsional potential φ(t) on 0 < t < a
gives in each body

    u_θ = (1/r) ∫_0^r φ t dt / sqrt(r² - t²)          q_θ = -G d/dr ∫_r^a φ dt / sqrt(t² - r²)

The traction in the annulus determines φ for t > c by Abel's inversion, and rigid rotation
determines it for t < c. φ must be continuous at c for q_θ to be finite. With m = 1 - c²/a²,
n = (a² - c²)/(a² - r²) and complete elliptic integrals of the parameter m:

    φz = (µ p0 / 2) (1/G1 + 1/G2) [K(m) - E(m)]
    q_θ = (2 µ p0 / π) (r sqrt(c² - r²) / a²) [Π(n | m) - K(m)]   for r < c,   µ p beyond
    Mz = (8 µ p0 / 3) ∫_c^a t² E(1 - t²/a²) dt

The differences of elliptic integrals are computed as Carlson's R_D and R_J, without cancellation.

Source: Lubkin 1951, J. Appl. Mech. 18, 183 (the solution, here derived in another way); Johnson
1985, *Contact Mechanics*, section 7.5; Jäger 1998, J. Tribology 120, 677, among others (the Abel
transforms).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipe, elliprd, elliprj

from sa_solver.errors import InputError
from sa_solver.reference.hertz import FrictionalSphere
from sa_solver.reference.masing import superpose
from sa_solver.ties import exceeds
from sa_solver.types import Array

ROUNDING = 1e-12
"""Relative distance from the sliding moment within which a moment slides: the quadrature is not
more accurate than this."""


class TwistedSphere(FrictionalSphere):
    """Sphere under a constant load, twisted about its normal.

    Moments act on body 2; twists are those of body 1 relative to body 2. They have the same sign on
    first loading. Methods raise ``InputError`` beyond the sliding moment.
    """

    @property
    def sliding_moment(self) -> float:
        """Sliding moment 3 π µ P a / 16 [N mm], which is reached at infinite twist only."""
        return 3.0 * np.pi * self.friction * self.load * self.contact.contact_radius / 16.0

    @property
    def torsional_stiffness(self) -> float:
        """Torsional stiffness dMz/dφz without slip, ``(16/3) a³ / (1/G1 + 1/G2)`` [N mm]."""
        return 16.0 * self.contact.contact_radius**3 / (3.0 * self.pair.shear)

    def no_slip_shear(self, radius: Array, moment: float) -> Array:
        """Return q_θ = 3 Mz r / (4 π a³ sqrt(a² - r²)) [MPa], the shear for infinite friction.

        It is 0 outside the contact.
        """
        a = self.contact.contact_radius
        r = np.asarray(radius, dtype=np.float64)
        inside = r < a
        root = np.sqrt(np.where(inside, a**2 - r**2, 1.0))
        return np.where(inside, 3.0 * moment * r / (4.0 * np.pi * a**3 * root), 0.0)

    def stick_radius(self, moment: float) -> float:
        """Return the stick radius c [mm] on first loading to ``moment`` [N mm]."""
        target = abs(moment)
        if exceeds(target, self.sliding_moment):
            raise InputError(
                f"Mz = {moment} N mm slides, because it is beyond 3πµPa/16 = "
                f"{self.sliding_moment} N mm: lower Mz, or raise P or µ"
            )

        def excess(ratio: float) -> float:
            return self._moment(ratio) / self.sliding_moment - target / self.sliding_moment

        if target == 0.0:
            return self.contact.contact_radius
        if excess(0.0) <= ROUNDING:
            return 0.0
        return self.contact.contact_radius * float(brentq(excess, 0.0, 1.0, xtol=1e-14))

    def twist(self, moment: float) -> float:
        """Return the twist φz [rad] on first loading to ``moment`` [N mm].

        It is infinite at the sliding moment.
        """
        ratio = self.stick_radius(moment) / self.contact.contact_radius
        return float(np.sign(moment)) * self._twist(ratio)

    def shear(self, radius: Array, moment: float) -> Array:
        """Return the shear q_θ [MPa] on first loading to ``moment`` [N mm].

        ``radius`` [mm] may have any shape.
        """
        r = np.asarray(radius, dtype=np.float64)
        stick_radius = self.stick_radius(moment)
        stuck = r < stick_radius
        shear = np.asarray(self.friction * self.contact.pressure(r, np.zeros_like(r)))
        shear[stuck] = self._stuck_shear(r[stuck], stick_radius)
        return np.asarray(np.sign(moment) * shear)

    def shear_after(self, radius: Array, moments: Sequence[float]) -> Array:
        """Return the shear q_θ [MPa] after the turning points ``moments`` [N mm]."""
        return superpose(lambda moment: self.shear(radius, moment), moments)

    def twist_after(self, moments: Sequence[float]) -> float:
        """Return the twist φz [rad] after the turning points ``moments`` [N mm]."""
        return superpose(self.twist, moments)

    def loop_energy(self, amplitude: float) -> float:
        """Return the energy ∮ Mz dφz [N mm] of one cycle between ±``amplitude`` [N mm].

        It is 4 Mz φz - 8 ∫ φz dMz along first loading, by quadrature over the stick radius. It is
        infinite at the sliding moment.
        """
        ratio = self.stick_radius(amplitude) / self.contact.contact_radius
        complement = quad(
            lambda s: self._twist(s) * self._moment_rate(s), ratio, 1.0, epsrel=1e-12, epsabs=0.0
        )[0]
        return float(4.0 * abs(amplitude) * self._twist(ratio) - 8.0 * complement)

    def _stuck_shear(self, r: Array, c: float) -> Array:
        """Return q_θ inside the sticking circle, with Π - K = (n/3) R_J(0, 1 - m, 1, 1 - n)."""
        a = self.contact.contact_radius
        within, depth = c**2 - r**2, a**2 - r**2
        integral: Array = elliprj(0.0, (c / a) ** 2, 1.0, within / depth)
        scale = 2.0 * self.friction * self.contact.peak_pressure / (np.pi * a**2)
        return scale * r * np.sqrt(within) * (a**2 - c**2) / (3.0 * depth) * integral

    def _twist(self, ratio: float) -> float:
        """Return φz at the stick ratio c/a, with K - E = (m/3) R_D(0, 1 - m, 1)."""
        if ratio == 0.0:
            return float(np.inf)
        difference = (1.0 - ratio**2) / 3.0 * float(elliprd(0.0, ratio**2, 1.0))
        traction = self.friction * self.contact.peak_pressure
        return 0.5 * traction * self.pair.shear * difference

    def _moment_rate(self, ratio: float) -> float:
        """Return -dMz/d(c/a) [N mm] at the stick ratio c/a."""
        traction = self.friction * self.contact.peak_pressure
        volume = self.contact.contact_radius**3 * ratio**2
        return 8.0 / 3.0 * traction * volume * float(ellipe(1.0 - ratio**2))

    def _moment(self, ratio: float) -> float:
        """Return |Mz| [N mm] at the stick ratio c/a."""
        return float(quad(self._moment_rate, ratio, 1.0, epsrel=1e-13, epsabs=0.0)[0])
