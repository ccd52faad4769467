"""Partial slip of a line contact in plane strain, alone or with a bulk stress in one body.

Elastically similar bodies, so that pressure and shear do not disturb each other. Shear on body 2
strains the surface of body 2 relative to that of body 1 by

    du_x/dx = -(2 / π E*) ∫ q / (x - ξ) dξ     (principal value)

which for a traction sqrt(a² - x²) is -2 x / E*: the difference of two such tractions, centred e
apart, strains the zone that both cover uniformly. That carries all the formulas here.

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
"""Relative slack in the limits of validity, so that the limit itself is accepted."""


def ciavarella_jaeger(
    pressure: Callable[[float], Array], load: float, tangential: float, friction: float
) -> Array:
    """Shear on first loading of any plane contact, q = µ [p(P) - p(P - |Q|/µ)] sign(Q) [MPa].

    ``pressure(load)`` is the normal solution at fixed points for a load per length [N/mm], an array
    of any shape; it is not called with 0. ``load`` and ``tangential`` in N/mm. What sticks is the
    contact zone of the load P - |Q|/µ. Valid for elastically similar half-planes pressed by P,
    then sheared, ``pressure`` being that of one tilt for all loads. Raises ``InputError`` beyond
    |Q| = µP.
    """
    left = load * reserve(tangential, friction * load)
    shear = friction * pressure(load)
    if left > 0.0:
        shear = shear - friction * pressure(left)
    return np.asarray(np.sign(tangential) * shear, dtype=np.float64)


@dataclass(frozen=True)
class ShearedCylinder:
    """Hertz line ``contact`` under a constant load, with ``friction`` µ, sheared along x.

    Tangential loads per length [N/mm] are those on body 2, displacements those of body 1 relative
    to body 2. Methods raise ``InputError`` beyond |Q| = µP.
    """

    contact: HertzCylinder
    friction: float

    @property
    def sliding_force(self) -> float:
        """µP [N/mm]."""
        return self.friction * self.contact.load

    def stick_half_width(self, tangential: float) -> float:
        """c = a sqrt(1 - |Q| / µP) [mm] on first loading."""
        return self.contact.half_width * float(np.sqrt(reserve(tangential, self.sliding_force)))

    def shear(self, x: Array, tangential: float) -> Array:
        """q on first loading to ``tangential``, at ``x`` of any shape [mm] [MPa]."""
        stick = self.stick_half_width(tangential)
        sense = float(np.sign(tangential))
        return sense * _shear(self.contact, self.friction, x, stick, 0.0)

    def displacement(self, tangential: float, datum: float) -> float:
        """δx [mm] on first loading, for the ``datum`` L [mm] of :meth:`HertzCylinder.approach`.

        (2 / π E*) {Q [ln(2 L/a) + 1/2] + (1/2)(µP - Q) ln(1 - Q/µP)}.
        """
        left = reserve(tangential, self.sliding_force)
        linear = abs(tangential) * (float(np.log(2.0 * datum / self.contact.half_width)) + 0.5)
        slipping = 0.5 * self.sliding_force * _x_log_x(left)
        scale = 2.0 / (np.pi * self.contact.contact_modulus)
        return float(np.sign(tangential)) * scale * (linear + slipping)

    def shear_after(self, x: Array, loads: Sequence[float]) -> Array:
        """q [MPa] after the turning points ``loads`` of the tangential load."""
        return superpose(lambda tangential: self.shear(x, tangential), loads)

    def displacement_after(self, loads: Sequence[float], datum: float) -> float:
        """δx [mm] after the turning points ``loads`` of the tangential load."""
        return superpose(lambda tangential: self.displacement(tangential, datum), loads)

    def loop_energy(self, amplitude: float) -> float:
        """Energy per length of one cycle between ±``amplitude``, ∮ Q dδx [N mm/mm].

        (4 µ²P² / π E*) [v ln v + (1 - v²)/2] with v = 1 - Q/µP: no datum is needed, since what it
        adds to δx is linear in Q. Follows from :meth:`displacement` and Masing's rule.
        """
        left = reserve(amplitude, self.sliding_force)
        shape = _x_log_x(left) + 0.5 * (1.0 - left**2)
        return 4.0 * self.sliding_force**2 / (np.pi * self.contact.contact_modulus) * shape


@dataclass(frozen=True)
class BulkStressedCylinder:
    """Hertz line ``contact`` first loaded to ``tangential`` Q and ``bulk_stress`` σ [N/mm, MPa].

    ``bulk_body`` is the body that carries σ, tension positive, along x. Its surface then stretches
    by σ(1 - ν²)/E = σ/2E* (similar bodies), so that body 2's surface stretches relative to body 1's
    by ε = +σ/2E* if it is body 2 and -σ/2E* if it is body 1. The stuck zone moves off centre by

        e = sign(Q) ε E* a / 2 µ p0 = ± sign(Q) a σ / 4 µ p0

    so towards +x for Q > 0 with tension in body 2, and keeps its width. Moderate bulk stress only:
    slip is in one sense at both edges, |e| + c <= a, or |σ|/µp0 <= 4 (1 - sqrt(1 - |Q|/µP)). The
    stuck zone must also have shrunk all along the path, for what slipped must not stick again: so
    it has for σ in proportion to Q while |σ|/µp0 <= 2 |Q|/µP, which is within the former limit and
    is not checked; it has not for Q first and σ after it, which ends elsewhere. The same holds on
    the way back, for the changes of σ and Q.
    A stress that was there before the bodies touched does not count: only its change since does.

    Raises ``InputError`` where the bulk stress is not moderate or |Q| > µP.
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
                "needs |σ|/µp0 <= 4 (1 - sqrt(1 - |Q|/µP))"
            )

    @property
    def mismatch_strain(self) -> float:
        """ε, by which the bulk stress stretches body 2's surface relative to body 1's."""
        return self._mismatch(self.bulk_stress)

    @property
    def stick_half_width(self) -> float:
        """c = a sqrt(1 - |Q| / µP) [mm], as without bulk stress."""
        return ShearedCylinder(self.contact, self.friction).stick_half_width(self.tangential)

    @property
    def offset(self) -> float:
        """e, the centre of the stuck zone [mm]."""
        return self._offset(self.tangential, self.mismatch_strain)

    def shear(self, x: Array) -> Array:
        """q at the end of first loading, at ``x`` of any shape [mm] [MPa]."""
        shear = _shear(self.contact, self.friction, x, self.stick_half_width, self.offset)
        shear *= np.sign(self.tangential)
        return shear

    def reversed_zone(self, tangential: float, bulk_stress: float) -> tuple[float, float]:
        """Half-width and centre [mm] of what sticks on the way back from the first turning point.

        To ``tangential`` and ``bulk_stress``: with Q changed by ΔQ and σ by Δσ, c' = a sqrt(1 -
        |ΔQ|/2µP) and e' = ± sign(ΔQ) a Δσ / 8 µ p0. So a stress that is held leaves it centred,
        and one that cycles with Q brings it to e at the other end of the cycle.

        Raises ``InputError`` if Q does not turn back, if ΔQ is beyond 2µP, or if the zone leaves
        the contact or does not contain the one of first loading: then no superposition holds. A
        held stress so restricts how far Q may come back.
        """
        change = tangential - self.tangential
        if change * self.tangential >= 0.0:
            raise InputError(f"Q = {tangential} N/mm does not turn back from {self.tangential}")
        line = ShearedCylinder(self.contact, self.friction)
        stick = line.stick_half_width(0.5 * change)
        strain = self._mismatch(bulk_stress) - self.mismatch_strain
        centre = self._offset(change, 0.5 * strain)
        slack = ROUNDING * self.contact.half_width
        if abs(centre) + stick > self.contact.half_width + slack:
            raise InputError("the change of bulk stress reverses slip at one edge")
        if abs(centre - self.offset) + self.stick_half_width > stick + slack:
            raise InputError("slip on the way back reaches what stuck on first loading")
        return stick, centre

    def reversed_shear(self, x: Array, tangential: float, bulk_stress: float) -> Array:
        """q [MPa] on the way back to ``tangential`` and ``bulk_stress``; see ``reversed_zone``."""
        stick, centre = self.reversed_zone(tangential, bulk_stress)
        sense = float(np.sign(tangential - self.tangential))
        return self.shear(x) + 2.0 * sense * _shear(self.contact, self.friction, x, stick, centre)

    def _mismatch(self, bulk_stress: float) -> float:
        """ε of a bulk stress."""
        strain = bulk_stress / (2.0 * self.contact.contact_modulus)
        return strain if self.bulk_body == 2 else -strain

    def _offset(self, tangential: float, strain: float) -> float:
        """e of a traction ±µp of ``tangential``'s sense that must undo ``strain`` where stuck."""
        gradient = 2.0 * self.friction * self.contact.peak_pressure / self.contact.half_width
        return float(np.sign(tangential)) * strain * self.contact.contact_modulus / gradient


def _shear(contact: HertzCylinder, friction: float, x: Array, stick: float, offset: float) -> Array:
    """µ p less its like on ``|x - offset| < stick``, ``(µ p0 / a) [sqrt(a² - x²) - ...]``."""
    sliding = np.sqrt(np.maximum(0.0, contact.half_width**2 - x**2))
    stuck = np.sqrt(np.maximum(0.0, stick**2 - (x - offset) ** 2))
    return friction * contact.peak_pressure / contact.half_width * (sliding - stuck)


def reserve(tangential: float, sliding_force: float, unit: str = "N/mm") -> float:
    """1 - |Q| / µP, what is left before sliding. Raises ``InputError`` beyond |Q| = µP."""
    if exceeds(abs(tangential), sliding_force):
        raise InputError(
            f"Q = {tangential} {unit} slides: it is beyond µP = {sliding_force} {unit}"
        )
    return max(0.0, 1.0 - abs(tangential) / sliding_force)


def _x_log_x(x: float) -> float:
    """``x ln x``, 0 at 0."""
    return x * float(np.log(x)) if x > 0.0 else 0.0
