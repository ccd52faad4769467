"""A contact moved to and fro along one axis under a constant load, from normal problems alone.

Between alike bodies shear moves the surfaces along as pressure moves them apart, κ times as far. So
if p(P) presses under P, and the shear force has grown from 0, then

    q = µ [p(P) - p(P*)],   T = µ (P - P*),   δ = κ µ (δz - δz*),   s = κ µ g*

with P* < P at the same tilt: where p(P*) presses the surfaces stick, elsewhere in the contact they
slip, by κ µ times the gap g* that P* leaves there. When P* has come down to 0 the contact slides.
After a reversal everything follows the same curve doubled (Masing): a closed loop of amplitude A
has slipped by 4 s(A) in every place and has lost 4 µ Σ p s(A) S.

Without Poisson's ratio this is the discrete solution itself; with one it neglects the shear across
the motion and takes for κ the ratio of the stiffnesses of the pressed cells, normal to tangential,
which between spheres is Mindlin's (2 - ν)/(2 - 2ν).

To a structure such a contact is so many sliders in parallel. They are not its cells: what gives way
when a ring of cells slips is the support that it gave to all others. Cells taken each for itself,
with its share of the stuck stiffness and its own µp, do not know each other: on a sphere they would
follow T = µP (3 s - 2 s^1.5) with s = kt δ/(3 µP), and half way to full slip carry 23 % less than
Mindlin's T = µP (1 - (1 - 2 s)^1.5) and lose 37 % more in a loop.

Sources: Ciavarella 1998, J. Appl. Mech. 65, 998 (contacts over an area); Jäger 1997, J. Tribol.
119, 401; the sliders, Iwan 1966, J. Appl. Mech. 33, 893.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import get_args

import numpy as np

from sa_solver import checks
from sa_solver.cycles.tangential_loop import (
    LoopFailure,
    LoopPath,
    stuck_stiffness,
    tractions_of_motion,
)
from sa_solver.errors import InputError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact, NormalStart, NormalState, checked_heights
from sa_solver.ties import SAME
from sa_solver.types import Array, Tilt

STAGES = 24
"""Reduced loads. The energies of loops between spheres then differ from those of the whole
tangential problem by less than 2 %, from a quarter of the amplitude at which all slides."""

DENSER = 1.5
"""Stages go with this power of their number: closer to each other where little has slipped yet,
since the energy of small loops goes with the cube of their amplitude."""

FEWEST_STAGES = 2
"""Between rest and sliding: the first of them bends the curve."""

ROUNDING = 1e-9
"""Share of the stuck stiffness below which a slope has not changed."""


class PartialSlipError(InputError):
    """A contact that cannot be moved to and fro in this way."""


@dataclass(frozen=True)
class PartialSlip:
    """What a contact does when it is moved, for a coefficient of friction of 1.

    ``normal`` is the state at rest. Moved by ``shift`` ``(k,)`` [mm], ascending from 0 to where all
    of it slides, it carries ``force`` ``(k,)`` [N], and its cells have slipped by ``slip``
    ``(k, nx, ny)`` [mm]. With the coefficient µ all three are µ times as large. In between they are
    taken for straight; the first slope is ``stiffness`` [N/mm], that of the stuck contact.
    """

    normal: NormalState
    stiffness: float
    shift: Array
    force: Array
    slip: Array

    @cached_property
    def _slopes(self) -> Array:
        return np.append(np.diff(self.force) / np.diff(self.shift), 0.0)

    @property
    def reach(self) -> Array:
        """Shifts at which the sliders of :attr:`slider_stiffness` give way, ``(n,)`` [mm]."""
        return self.shift[1:]

    @property
    def slider_stiffness(self) -> Array:
        """Springs ``(n,)`` [N/mm] of sliders in parallel that follow the curve."""
        return -np.diff(self._slopes)

    @property
    def slider_load(self) -> Array:
        """What presses each slider ``(n,)`` [N]; their sum is the load of the contact."""
        return self.slider_stiffness * self.reach

    def travelled(self, travel: Array) -> Array:
        """Path ``(nx, ny)`` [mm] of every cell while the sliders travel by ``travel`` ``(n,)``.

        A slider of reach d travels by 4 (A - d) in a closed loop of amplitude A, which is the
        second integral of where the loop ends: the same sum, with the sliders' own kinks, gives the
        path of a cell. Loops within the loop add up.
        """
        kinks = np.diff(self.slip, axis=0) / np.diff(self.shift)[:, None, None]
        # Beyond the last shift all cells in contact slide by what is moved.
        sliding = (self.normal.pressure > 0.0).astype(float)
        kinks = np.diff(np.concatenate([kinks, sliding[None]]), axis=0)
        path: Array = np.einsum("n,nij->ij", travel, kinks)
        return np.maximum(path, 0.0)

    @property
    def onset(self) -> Array:
        """Shift up to which every cell sticks ``(nx, ny)`` [mm]; 0 off the contact.

        The last of a symmetric contact to part do so together, but for rounding.
        """
        sticking = np.count_nonzero(self.slip <= SAME * self.slip.max(), axis=0) - 1
        return np.where(self.normal.pressure > 0.0, self.shift[sticking], 0.0)


def partial_slip_curve(
    contact: NormalContact,
    height: Array,
    P: float,
    *,
    stages: int = STAGES,
    tolerance: float,
    start: NormalStart | None = None,
    tilt: Tilt = "held",
) -> PartialSlip:
    """What a contact of alike bodies does when it is moved along x under a load ``P`` [N].

    ``height`` ``(nx, ny)`` [mm] is the gap of the unloaded bodies, infinite or masked where a body
    has no surface. Their ``tilt`` under P is held, or free of moments. Raises PartialSlipError for
    bodies that are not alike or a load that is not above 0, LoopFailure where a normal problem does
    not converge.

    Examples
    --------
    A sphere moved along a flat, against Mindlin. Forces and motions are those of a coefficient of
    friction of 1:

    >>> import numpy as np
    >>> from sa_solver import ElasticPair, Grid, HalfSpace, Material, NormalContact
    >>> from sa_solver import partial_slip_curve
    >>> from sa_solver.reference.mindlin import ShearedSphere
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.covering((0.5, 0.5), (32, 32))
    >>> sphere = ShearedSphere(load=50.0, radius=10.0, friction=0.5, body_1=steel, body_2=steel)
    >>> contact = NormalContact(HalfSpace(grid, ElasticPair(steel, steel)))
    >>> height = sphere.contact.gap(grid.x, grid.y)
    >>> curve = partial_slip_curve(contact, height, 50.0, tolerance=1e-8)
    >>> print(f"{curve.stiffness:.0f} N/mm, Mindlin {1.0 / sphere.tangential_compliance:.0f} N/mm")
    27954 N/mm, Mindlin 28150 N/mm
    >>> half = np.interp(12.5, 0.5 * curve.force, 0.5 * curve.shift)
    >>> print(f"{1e3 * half:.3f} um under 12.5 N, Mindlin {1e3 * sphere.displacement(12.5):.3f} um")
    0.493 um under 12.5 N, Mindlin 0.493 um
    """
    if not contact.half_space.pair.similar:
        raise PartialSlipError("bodies that are not alike: their pressure follows the shear")
    P = checks.number("load P [N]", P, above=0.0, error=PartialSlipError)
    if checks.whole("stages", stages) < FEWEST_STAGES:
        raise PartialSlipError(f"{stages} stages: give {FEWEST_STAGES} or more")
    checks.choice("tilt", tilt, get_args(Tilt), PartialSlipError)
    height = checked_heights(height, contact.grid)
    moment = 0.0 if tilt == "free" else None
    pressed = contact.solve(height, P, moment, moment, tolerance=tolerance, start=start)
    normal = _converged(pressed)
    tangential, ratio = _stiffness(contact.half_space, normal)
    tilted = height - normal.tilt_x * contact.grid.y + normal.tilt_y * contact.grid.x
    depth = normal.approach - float(tilted.min())
    shares = (np.arange(stages + 1) / stages) ** DENSER
    reduced = normal
    force, gaps = [0.0], [np.zeros(contact.grid.shape)]
    for approach in normal.approach - shares[1:-1] * depth:
        before = reduced.start if reduced.pressure.any() else None
        reduced = _converged(
            contact.solve(
                height,
                approach=approach,
                tilt_x=normal.tilt_x,
                tilt_y=normal.tilt_y,
                tolerance=tolerance,
                start=before,
            )
        )
        force.append(normal.P - reduced.P)
        gaps.append(np.where(reduced.pressure > 0.0, 0.0, reduced.gap))
    # Without any load they just touch.
    force.append(normal.P)
    gaps.append(tilted - tilted.min())
    slip = ratio * np.where(normal.pressure > 0.0, np.maximum(gaps, 0.0), 0.0)
    curve = PartialSlip(normal, tangential, ratio * depth * shares, np.array(force), slip)
    return _bent_at_once(_bending(curve))


def _bending(curve: PartialSlip) -> PartialSlip:
    """The curve without the stages at which its slope does not fall: nothing gives way there.

    Between some of them no cell leaves the contact. What is left lies on straight lines over them.
    """
    shift, force, kept = curve.shift, curve.force, [0]
    for stage in range(1, len(shift)):
        while len(kept) > 1:
            before, last = kept[-2:]
            rise, run = force[last] - force[before], shift[last] - shift[before]
            onward = (force[stage] - force[last]) / (shift[stage] - shift[last])
            if onward < rise / run - ROUNDING * curve.stiffness:
                break
            kept.pop()
        kept.append(stage)
    return replace(curve, shift=shift[kept], force=force[kept], slip=curve.slip[kept])


def _bent_at_once(curve: PartialSlip) -> PartialSlip:
    """The curve with its first stretch bent, so that it begins as stiff as the stuck contact.

    A grid loses its outermost cells somewhere within the first stretch: here where the slope that
    follows would go on from the first one.
    """
    first, second = curve._slopes[:2]
    if not second < first < curve.stiffness * (1.0 - ROUNDING):
        return curve
    bend = (curve.force[1] - second * curve.shift[1]) / (curve.stiffness - second)
    shift, force, slip = curve.shift.copy(), curve.force.copy(), curve.slip.copy()
    shift[1], force[1], slip[1] = bend, curve.stiffness * bend, 0.0
    return replace(curve, shift=shift, force=force, slip=slip)


def _stiffness(half_space: HalfSpace, normal: NormalState) -> tuple[float, float]:
    """Tangential stiffness of the pressed cells [N/mm], and κ, the normal one over it."""
    pressed = normal.pressure > 0.0
    tangential = stuck_stiffness(half_space, pressed, LoopPath(normal.P, 1.0))
    unit = np.ones((1, np.count_nonzero(pressed)))
    pressure = tractions_of_motion(lambda field: half_space.normal(field[0])[None], pressed, unit)
    return tangential, float(pressure.sum()) * half_space.grid.cell_area / tangential


def _converged(state: NormalState) -> NormalState:
    if not state.converged:
        raise LoopFailure(state.message)
    return state
