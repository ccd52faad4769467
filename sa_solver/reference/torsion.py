"""Twisting of a sphere's contact under constant normal load (Lubkin 1951).

Twist moves points along circles only, by the same traction for any ν, and moves nothing along the
normal: with p Hertz and µp in the slip annulus the solution is exact (for unlike bodies, apart from
the radial slip that pressure makes). A torsional potential φ(t) on 0 < t < a gives in each body

    u_θ = (1/r) ∫_0^r φ t dt / sqrt(r² - t²)          q_θ = -G d/dr ∫_r^a φ dt / sqrt(t² - r²)

The annulus fixes φ for t > c by Abel's inversion, rigid rotation fixes it for t < c, and φ must be
continuous at c for q_θ to be finite. With m = 1 - c²/a², n = (a² - c²)/(a² - r²) and complete
elliptic integrals of parameter m:

    φz = (µ p0 / 2) (1/G1 + 1/G2) [K(m) - E(m)]
    q_θ = (2 µ p0 / π) (r sqrt(c² - r²) / a²) [Π(n | m) - K(m)]   for r < c,   µ p beyond
    Mz = (8 µ p0 / 3) ∫_c^a t² E(1 - t²/a²) dt

The differences of elliptic integrals are Carlson's R_D and R_J, which do not cancel.

Source: Lubkin 1951, J. Appl. Mech. 18, 183, whose solution this is, by another way; Johnson 1985,
*Contact Mechanics*, section 7.5 ; the Abel transforms are those of Jäger 1998, J. Tribology 120,
677, among others.
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
"""Moments this close to sliding, relative to it, slide: the quadrature is not better than that."""


class TwistedSphere(FrictionalSphere):
    """A sphere under a constant load, twisted about its normal.

    Moments are those on body 2, twists those of body 1 relative to body 2: they
    have the same sign on first loading. Methods raise ``InputError`` beyond the sliding moment.
    """

    @property
    def sliding_moment(self) -> float:
        """3 π µ P a / 16 [N mm], reached at infinite twist only."""
        return 3.0 * np.pi * self.friction * self.load * self.contact.contact_radius / 16.0

    @property
    def torsional_stiffness(self) -> float:
        """dMz/dφz where nothing slips, ``(16/3) a³ / (1/G1 + 1/G2)`` [N mm]."""
        return 16.0 * self.contact.contact_radius**3 / (3.0 * self.pair.shear)

    def no_slip_shear(self, radius: Array, moment: float) -> Array:
        """q_θ = 3 Mz r / (4 π a³ sqrt(a² - r²)) if friction were infinite, 0 outside [MPa]."""
        a = self.contact.contact_radius
        r = np.asarray(radius, dtype=np.float64)
        inside = r < a
        root = np.sqrt(np.where(inside, a**2 - r**2, 1.0))
        return np.where(inside, 3.0 * moment * r / (4.0 * np.pi * a**3 * root), 0.0)

    def stick_radius(self, moment: float) -> float:
        """c [mm] on first loading to ``moment`` [N mm]."""
        target = abs(moment)
        if exceeds(target, self.sliding_moment):
            raise InputError(
                f"Mz = {moment} N mm slides: it is beyond 3πµPa/16 = {self.sliding_moment} N mm"
            )

        def excess(ratio: float) -> float:
            return self._moment(ratio) / self.sliding_moment - target / self.sliding_moment

        if target == 0.0:
            return self.contact.contact_radius
        if excess(0.0) <= ROUNDING:
            return 0.0
        return self.contact.contact_radius * float(brentq(excess, 0.0, 1.0, xtol=1e-14))

    def twist(self, moment: float) -> float:
        """φz [rad] on first loading to ``moment`` [N mm], infinite at the sliding moment."""
        ratio = self.stick_radius(moment) / self.contact.contact_radius
        return float(np.sign(moment)) * self._twist(ratio)

    def shear(self, radius: Array, moment: float) -> Array:
        """q_θ at ``radius`` of any shape [mm] on first loading to ``moment`` [N mm] [MPa]."""
        r = np.asarray(radius, dtype=np.float64)
        stick_radius = self.stick_radius(moment)
        stuck = r < stick_radius
        shear = np.asarray(self.friction * self.contact.pressure(r, np.zeros_like(r)))
        shear[stuck] = self._stuck_shear(r[stuck], stick_radius)
        return np.asarray(np.sign(moment) * shear)

    def shear_after(self, radius: Array, moments: Sequence[float]) -> Array:
        """q_θ [MPa] after the turning points ``moments`` [N mm]."""
        return superpose(lambda moment: self.shear(radius, moment), moments)

    def twist_after(self, moments: Sequence[float]) -> float:
        """φz [rad] after the turning points ``moments`` [N mm]."""
        return superpose(self.twist, moments)

    def loop_energy(self, amplitude: float) -> float:
        """Energy of one cycle between ±``amplitude`` [N mm], the loop's area ∮ Mz dφz [N mm].

        4 Mz φz - 8 ∫ φz dMz along first loading, by quadrature over the stick radius. Infinite at
        the sliding moment.
        """
        ratio = self.stick_radius(amplitude) / self.contact.contact_radius
        complement = quad(
            lambda s: self._twist(s) * self._moment_rate(s), ratio, 1.0, epsrel=1e-12, epsabs=0.0
        )[0]
        return float(4.0 * abs(amplitude) * self._twist(ratio) - 8.0 * complement)

    def _stuck_shear(self, r: Array, c: float) -> Array:
        """q_θ inside the stuck circle; Π - K = (n/3) R_J(0, 1 - m, 1, 1 - n)."""
        a = self.contact.contact_radius
        within, depth = c**2 - r**2, a**2 - r**2
        integral: Array = elliprj(0.0, (c / a) ** 2, 1.0, within / depth)
        scale = 2.0 * self.friction * self.contact.peak_pressure / (np.pi * a**2)
        return scale * r * np.sqrt(within) * (a**2 - c**2) / (3.0 * depth) * integral

    def _twist(self, ratio: float) -> float:
        """φz at stick ratio c/a; K - E = (m/3) R_D(0, 1 - m, 1)."""
        if ratio == 0.0:
            return float(np.inf)
        difference = (1.0 - ratio**2) / 3.0 * float(elliprd(0.0, ratio**2, 1.0))
        traction = self.friction * self.contact.peak_pressure
        return 0.5 * traction * self.pair.shear * difference

    def _moment_rate(self, ratio: float) -> float:
        """-dMz/d(c/a) [N mm]."""
        traction = self.friction * self.contact.peak_pressure
        volume = self.contact.contact_radius**3 * ratio**2
        return 8.0 / 3.0 * traction * volume * float(ellipe(1.0 - ratio**2))

    def _moment(self, ratio: float) -> float:
        """|Mz| at stick ratio c/a."""
        return float(quad(self._moment_rate, ratio, 1.0, epsrel=1e-13, epsabs=0.0)[0])
