"""Tangential contact of spheres under constant normal load (Cattaneo 1938, Mindlin 1949).

The sticking circle is concentric with the contact. Outside it the shear is µ p, and

    c = a (1 - |Q| / µP)^(1/3)
    qx = (µ p0 / a) [sqrt(a² - r²) - sqrt(c² - r²)]          (the second root for r < c only)
    δx = (3 µP / 16 a) Σ (2 - ν)/G [1 - (1 - |Q| / µP)^(2/3)]

qy = 0 is assumed. The sticking circle then moves rigidly for any ν. In the slip annulus, slip is
exactly opposite to the shear only for ν = 0, for which the solution is exact. For dissimilar bodies
the tangential displacement by pressure is neglected (small Dundurs' β).

Source: Cattaneo 1938, Rend. Accad. Naz. Lincei 27, 342; Mindlin 1949, J. Appl. Mech. 16, 259;
Mindlin & Deresiewicz 1953, J. Appl. Mech. 20, 327, doi:10.1115/1.4010702; Johnson 1985, *Contact
Mechanics*, sections 7.2 and 7.4.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sa_solver.reference.hertz import FrictionalSphere
from sa_solver.reference.line_partial_slip import reserve
from sa_solver.reference.masing import superpose
from sa_solver.types import Array


class ShearedSphere(FrictionalSphere):
    """Sphere under a constant load, sheared along x.

    Tangential forces act on body 2; displacements are those of body 1 relative to body 2, far from
    the contact. They have the same sign on first loading. Methods raise ``InputError`` beyond
    |Q| = µP.
    """

    @property
    def sliding_force(self) -> float:
        """Sliding force µP [N]."""
        return self.friction * self.load

    @property
    def tangential_compliance(self) -> float:
        """Compliance dδx/dQ without slip, ``Σ (2 - ν)/G / 8 a`` [mm/N]."""
        compliance = 2.0 * self.pair.shear - self.pair.poisson
        return compliance / (8.0 * self.contact.contact_radius)

    def stick_radius(self, tangential: float) -> float:
        """Return the stick radius c [mm] on first loading to ``tangential`` [N]."""
        return self.contact.contact_radius * float(
            np.cbrt(reserve(tangential, self.sliding_force, "N"))
        )

    def shear(self, x: Array, y: Array, tangential: float) -> Array:
        """Return the shear qx [MPa] on first loading to ``tangential`` [N].

        ``x`` and ``y`` [mm] broadcast.
        """
        a, c = self.contact.contact_radius, self.stick_radius(tangential)
        radius_squared = x**2 + y**2
        sliding = np.sqrt(np.maximum(0.0, a**2 - radius_squared))
        stuck = np.sqrt(np.maximum(0.0, c**2 - radius_squared))
        scale = float(np.sign(tangential)) * self.friction * self.contact.peak_pressure / a
        return scale * (sliding - stuck)

    def displacement(self, tangential: float) -> float:
        """Return the displacement δx [mm] on first loading to ``tangential`` [N]."""
        share = 1.0 - float(np.cbrt(reserve(tangential, self.sliding_force, "N"))) ** 2
        return float(np.sign(tangential)) * self._sliding_displacement * share

    def shear_after(self, x: Array, y: Array, loads: Sequence[float]) -> Array:
        """Return the shear qx [MPa] after the turning points ``loads`` of the force [N]."""
        return superpose(lambda tangential: self.shear(x, y, tangential), loads)

    def displacement_after(self, loads: Sequence[float]) -> float:
        """Return the displacement δx [mm] after the turning points ``loads`` of the force [N].

        The turning points of a loop between ±Q are ±``displacement(Q)``. This is the amplitude of
        the loop, half of the distance between its ends.
        """
        return superpose(self.displacement, loads)

    def loop_energy(self, amplitude: float) -> float:
        """Return the energy ∮ Q dδx [N mm] of one cycle between ±``amplitude`` [N].

        It is 4 µP δ1 [(6/5)(1 - v^(5/3)) - (Q/µP)(1 + v^(2/3))], with v = 1 - Q/µP and the
        displacement δ1 at the onset of sliding.
        """
        left = reserve(amplitude, self.sliding_force, "N")
        power = float(np.cbrt(left)) ** 2
        shape = 1.2 * (1.0 - left * power) - (1.0 - left) * (1.0 + power)
        return 4.0 * self.sliding_force * self._sliding_displacement * shape

    @property
    def _sliding_displacement(self) -> float:
        """Displacement δ1 at the onset of sliding [mm], 3/2 of that without slip."""
        return 1.5 * self.sliding_force * self.tangential_compliance
