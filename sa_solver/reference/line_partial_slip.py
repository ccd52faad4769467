"""Partial slip of a line contact in plane strain, with or without a bulk stress in one body.

The bodies are elastically similar, so that pressure and shear do not influence each other. Shear on
body 2 strains the surface of body 2 relative to that of body 1 by

    du_x/dx = -(2 / π E*) ∫ q / (x - ξ) dξ     (principal value)

which for a traction sqrt(a² - x²) is -2 x / E*. The difference of two such tractions, with centres
at a distance e, therefore strains the zone covered by both uniformly. All formulas here follow from
this.

Source: Cattaneo 1938, Rend. Accad. Naz. Lincei 27, 342; Mindlin 1949, J. Appl. Mech. 16, 259;
Johnson 1985, *Contact Mechanics*, sections 7.2 and 7.4; bulk stress, Nowell & Hills 1987, Int. J.
Mech. Sci. 29, 355; any profile, Jäger 1998, J. Tribology 120, 677 and Ciavarella 1998, Int. J.
Solids Struct. 35, 2349.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sa_solver.errors import InputError
from sa_solver.reference.hertz import HertzCylinder
from sa_solver.reference.masing import superpose
from sa_solver.ties import exceeds
from sa_solver.types import Array

ROUNDING = 1e-12
"""Relative tolerance of the limits of validity, so that the limit itself is accepted."""


def ciavarella_jaeger(
    pressure: Callable[[float], Array], load: float, tangential: float, friction: float
) -> Array:
    """Return the shear on first loading of any plane contact [MPa].

    It is q = µ [p(P) - p(P - |Q|/µ)] sign(Q). The zone that sticks is the contact under the load
    P - |Q|/µ. The formula is valid for elastically similar half-planes that are pressed by P and
    then sheared.

    Parameters
    ----------
    pressure
        Function that returns the pressure at fixed points for a load per length [N/mm], an array of
        any shape, with the same tilt for all loads. It is not called with 0.
    load, tangential
        Normal load P and shear force Q per length [N/mm].
    friction
        Coefficient of friction µ.

    Raises
    ------
    InputError
        Beyond |Q| = µP.
    """
    reduced = load * reserve(tangential, friction * load)
    shear = friction * pressure(load)
    if reduced > 0.0:
        shear = shear - friction * pressure(reduced)
    return np.asarray(np.sign(tangential) * shear, dtype=np.float64)


@dataclass(frozen=True)
class ShearedCylinder:
    """Hertz line ``contact`` with ``friction`` µ under a constant load, sheared along x.

    Tangential loads per length [N/mm] act on body 2; displacements are those of body 1 relative to
    body 2. Methods raise ``InputError`` beyond |Q| = µP.
    """

    contact: HertzCylinder
    friction: float

    @property
    def sliding_force(self) -> float:
        """Sliding force µP [N/mm]."""
        return self.friction * self.contact.load

    def stick_half_width(self, tangential: float) -> float:
        """Return the stick half-width c = a sqrt(1 - |Q| / µP) [mm] on first loading."""
        return self.contact.half_width * float(np.sqrt(reserve(tangential, self.sliding_force)))

    def shear(self, x: Array, tangential: float) -> Array:
        """Return the shear q [MPa] on first loading to ``tangential``, at any points ``x`` [mm]."""
        stick = self.stick_half_width(tangential)
        sense = float(np.sign(tangential))
        return sense * _shear(self.contact, self.friction, x, stick, 0.0)

    def displacement(self, tangential: float, datum: float) -> float:
        """Return the displacement δx [mm] on first loading to ``tangential``.

        It is (2 / π E*) {Q [ln(2 L/a) + 1/2] + (1/2)(µP - Q) ln(1 - Q/µP)}, with the ``datum``
        L [mm] of :meth:`HertzCylinder.approach`.
        """
        unused = reserve(tangential, self.sliding_force)
        linear = abs(tangential) * (float(np.log(2.0 * datum / self.contact.half_width)) + 0.5)
        slipping = 0.5 * self.sliding_force * _x_log_x(unused)
        scale = 2.0 / (np.pi * self.contact.contact_modulus)
        return float(np.sign(tangential)) * scale * (linear + slipping)

    def shear_after(self, x: Array, loads: Sequence[float]) -> Array:
        """Return the shear q [MPa] after the turning points ``loads`` of the tangential load."""
        return superpose(lambda tangential: self.shear(x, tangential), loads)

    def displacement_after(self, loads: Sequence[float], datum: float) -> float:
        """Return the displacement δx [mm] after the turning points ``loads`` of the load."""
        return superpose(lambda tangential: self.displacement(tangential, datum), loads)

    def loop_energy(self, amplitude: float) -> float:
        """Return the energy ∮ Q dδx [N mm/mm] of one cycle between ±``amplitude`` [N/mm].

        It is (4 µ²P² / π E*) [v ln v + (1 - v²)/2] with v = 1 - Q/µP, by :meth:`displacement` and
        Masing's rule. No datum is needed, because its contribution to δx is linear in Q.
        """
        unused = reserve(amplitude, self.sliding_force)
        shape = _x_log_x(unused) + 0.5 * (1.0 - unused**2)
        return 4.0 * self.sliding_force**2 / (np.pi * self.contact.contact_modulus) * shape


@dataclass(frozen=True)
class BulkStressedCylinder:
    """Hertz line contact that is first loaded by a shear force and a bulk stress.

    The bulk stress σ acts along x. The surface of its body stretches by σ(1 - ν²)/E = σ/2E*
    (similar bodies), so that body 2's surface stretches relative to body 1's by ε = +σ/2E* if σ is
    in body 2, and -σ/2E* if it is in body 1. The sticking zone keeps its width and moves off centre
    by

        e = sign(Q) ε E* a / 2 µ p0 = ± sign(Q) a σ / 4 µ p0

    which is towards +x for Q > 0 with tension in body 2.

    The solution holds for a moderate bulk stress: slip has the same direction at both edges,
    |e| + c <= a, or |σ|/µp0 <= 4 (1 - sqrt(1 - |Q|/µP)). In addition, the sticking zone must shrink
    along the whole path, so that no slipping point sticks again. This is so for σ in proportion to
    Q if |σ|/µp0 <= 2 |Q|/µP, which lies within the first limit and is not checked. It is not so if
    Q is applied first and σ afterwards, which leads to another state. The same holds on the way
    back, for the changes of σ and Q. A stress that was present before the bodies touched has no
    effect; only its later change has.

    Parameters
    ----------
    contact
        Hertz contact.
    friction
        Coefficient of friction µ.
    tangential
        Shear force Q [N/mm].
    bulk_stress
        Bulk stress σ [MPa], tension positive.
    bulk_body
        Body that carries σ.

    Raises
    ------
    InputError
        If the bulk stress is not moderate or |Q| > µP.
    """

    contact: HertzCylinder
    friction: float
    tangential: float
    bulk_stress: float
    bulk_body: Literal[1, 2]

    def __post_init__(self) -> None:
        traction = self.friction * self.contact.peak_pressure
        moderate = 4.0 * (1.0 - self.stick_half_width / self.contact.half_width)
        if abs(self.bulk_stress) > (moderate + ROUNDING) * traction:
            raise InputError(
                f"bulk stress {self.bulk_stress} MPa reverses slip at one edge: this solution "
                "needs |σ|/µp0 <= 4 (1 - sqrt(1 - |Q|/µP)), so lower σ or raise Q"
            )

    @property
    def mismatch_strain(self) -> float:
        """Strain ε by which the bulk stress stretches body 2's surface relative to body 1's."""
        return self._mismatch(self.bulk_stress)

    @property
    def stick_half_width(self) -> float:
        """Stick half-width c = a sqrt(1 - |Q| / µP) [mm], as without bulk stress."""
        return ShearedCylinder(self.contact, self.friction).stick_half_width(self.tangential)

    @property
    def offset(self) -> float:
        """Centre e of the sticking zone [mm]."""
        return self._offset(self.tangential, self.mismatch_strain)

    def shear(self, x: Array) -> Array:
        """Return the shear q [MPa] at the end of first loading, at ``x`` of any shape [mm]."""
        shear = _shear(self.contact, self.friction, x, self.stick_half_width, self.offset)
        shear *= np.sign(self.tangential)
        return shear

    def reversed_zone(self, tangential: float, bulk_stress: float) -> tuple[float, float]:
        """Return the half-width and centre [mm] of the sticking zone after the first reversal.

        The load has returned to ``tangential`` and ``bulk_stress``. If Q has changed by ΔQ and σ by
        Δσ, they are c' = a sqrt(1 - |ΔQ|/2µP) and e' = ± sign(ΔQ) a Δσ / 8 µ p0. With a constant
        stress the zone is centred; with a stress that cycles with Q its centre is e at the other
        end of the cycle.

        Raises ``InputError`` if Q does not turn back, if ΔQ is beyond 2µP, or if the zone leaves
        the contact or does not contain that of first loading, because superposition does not hold
        then. A constant stress therefore limits how far Q may return.
        """
        change = tangential - self.tangential
        if change * self.tangential >= 0.0:
            raise InputError(
                f"Q = {tangential} N/mm does not turn back from {self.tangential} N/mm: give a "
                "value on the other side of 0, or nearer to it"
            )
        line = ShearedCylinder(self.contact, self.friction)
        stick = line.stick_half_width(0.5 * change)
        strain = self._mismatch(bulk_stress) - self.mismatch_strain
        centre = self._offset(change, 0.5 * strain)
        slack = ROUNDING * self.contact.half_width
        if abs(centre) + stick > self.contact.half_width + slack:
            raise InputError("the change of bulk stress reverses slip at one edge: lower it")
        if abs(centre - self.offset) + self.stick_half_width > stick + slack:
            raise InputError(
                "slip on the way back reaches the zone that stuck on first loading: turn back less"
            )
        return stick, centre

    def reversed_shear(self, x: Array, tangential: float, bulk_stress: float) -> Array:
        """Return the shear q [MPa] after the reversal: see :meth:`reversed_zone`."""
        stick, centre = self.reversed_zone(tangential, bulk_stress)
        sense = float(np.sign(tangential - self.tangential))
        return self.shear(x) + 2.0 * sense * _shear(self.contact, self.friction, x, stick, centre)

    def _mismatch(self, bulk_stress: float) -> float:
        """Return the mismatch strain ε due to a bulk stress."""
        strain = bulk_stress / (2.0 * self.contact.contact_modulus)
        return strain if self.bulk_body == 2 else -strain

    def _offset(self, tangential: float, strain: float) -> float:
        """Return the centre e of the zone in which shear must cancel a mismatch ``strain``.

        The shear in slip has the sign of ``tangential``.
        """
        gradient = 2.0 * self.friction * self.contact.peak_pressure / self.contact.half_width
        return float(np.sign(tangential)) * strain * self.contact.contact_modulus / gradient


def _shear(contact: HertzCylinder, friction: float, x: Array, stick: float, offset: float) -> Array:
    """Return ``(µ p0 / a) [sqrt(a² - x²) - sqrt(c² - (x - e)²)]`` [MPa].

    c is ``stick`` and e is ``offset``; each root is 0 outside its zone.
    """
    sliding = np.sqrt(np.maximum(0.0, contact.half_width**2 - x**2))
    stuck = np.sqrt(np.maximum(0.0, stick**2 - (x - offset) ** 2))
    return friction * contact.peak_pressure / contact.half_width * (sliding - stuck)


def reserve(tangential: float, sliding_force: float, unit: str = "N/mm") -> float:
    """Return the unused share 1 - |Q| / µP of the sliding force.

    ``sliding_force`` is µP. Raises ``InputError`` beyond |Q| = µP.
    """
    if exceeds(abs(tangential), sliding_force):
        raise InputError(
            f"Q = {tangential} {unit} slides, because it is beyond µP = {sliding_force} {unit}: "
            "lower Q, or raise P or µ"
        )
    return max(0.0, 1.0 - abs(tangential) / sliding_force)


def _x_log_x(x: float) -> float:
    """Return ``x ln x``, which is 0 at 0."""
    return x * float(np.log(x)) if x > 0.0 else 0.0
