"""Partial slip of a contact under a constant load and a motion along one axis.

The solution follows from normal problems alone. Between similar bodies, shear displaces the
surfaces tangentially by κ times as much as pressure of the same distribution displaces them
normally. If p(P) is the pressure under P, and the shear force has grown from 0, then

    q = µ [p(P) - p(P*)],   T = µ (P - P*),   δ = κ µ (δz - δz*),   s = κ µ g*

with P* < P at the same tilt. The surfaces stick where p(P*) > 0. Elsewhere in the contact they slip
by κ µ times the gap g* under P*. When P* has fallen to 0 the contact slides. After a reversal the
contact follows the same curve, doubled (Masing). In a closed loop of amplitude A each place slips
by 4 s(A), and the loop dissipates 4 µ Σ p s(A) S.

For ν = 0 this is the solution of the discrete problem. Otherwise the shear across the motion is
neglected, and κ is the ratio of the normal to the tangential stiffness of the pressed cells, which
between spheres is Mindlin's (2 - ν)/(2 - 2ν).

A structure can represent such a contact by sliders in parallel. The sliders are not the cells: when
a ring of cells slips, its support of all other cells is lost. Independent cells, each with its
share of the stuck stiffness and its own µp, would follow T = µP (3 s - 2 s^1.5) on a sphere, with
s = kt δ/(3 µP). Half way to full slip they would carry 23 % less than Mindlin's
T = µP (1 - (1 - 2 s)^1.5), and dissipate 37 % more in a loop.

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
    LoopPath,
    converged,
    stuck_stiffness,
    tractions_of_motion,
)
from sa_solver.errors import InputError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact, checked_heights
from sa_solver.normal.state import NormalStart, NormalState
from sa_solver.ties import SAME
from sa_solver.types import Array, Tilt

STAGES = 24
"""Number of reduced loads P*. The energies of loops between spheres then differ from those of the
full tangential problem by less than 2 %, from a quarter of the amplitude of full sliding up."""

DENSER = 1.5
"""Power of their number with which the stages are spaced. They are denser where little has slipped,
because the energy of small loops grows with the cube of their amplitude."""

FEWEST_STAGES = 2
"""Least number of stages between rest and sliding: the first of them bends the curve."""

ROUNDING = 1e-9
"""Change of a slope, relative to the stuck stiffness, that is due to rounding."""


class PartialSlipError(InputError):
    """Contact whose partial slip does not follow from normal problems."""


@dataclass(frozen=True)
class PartialSlip:
    """Response of a contact to a tangential motion, for a coefficient of friction of 1.

    For a coefficient of friction µ, shifts, forces and slips are µ times as large. Between the
    points of the curve they are linear.

    Attributes
    ----------
    normal
        Normal contact at rest.
    stiffness
        Stiffness of the stuck contact [N/mm], which is the first slope of the curve.
    shift
        Tangential motion ``(k,)`` [mm], ascending from 0 to full sliding.
    force
        Tangential force ``(k,)`` [N].
    slip
        Slip of the cells ``(k, nx, ny)`` [mm].
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
        """Shifts ``(n,)`` [mm] at which the sliders of :attr:`slider_stiffness` begin to slide."""
        return self.shift[1:]

    @property
    def slider_stiffness(self) -> Array:
        """Stiffness ``(n,)`` [N/mm] of each of n parallel sliders that represent the curve."""
        return -np.diff(self._slopes)

    @property
    def slider_load(self) -> Array:
        """Normal load ``(n,)`` [N] of each slider; the sum is the load of the contact."""
        return self.slider_stiffness * self.reach

    def travelled(self, travel: Array) -> Array:
        """Return the sliding path ``(nx, ny)`` [mm] of every cell for given paths of the sliders.

        ``travel`` ``(n,)`` [mm] are the paths of the sliders. A slider with the reach d travels by
        4 (A - d) in a closed loop of amplitude A. The slip of a cell is a piecewise linear function
        of the shift, with kinks at the reaches of the sliders. Its path is the sum over the kinks
        of the change of slope times the path of the slider. Loops inside the loop add to the path.
        """
        kinks = np.diff(self.slip, axis=0) / np.diff(self.shift)[:, None, None]
        # Beyond the last shift all cells in contact slip by the motion itself.
        sliding = (self.normal.pressure > 0.0).astype(float)
        kinks = np.diff(np.concatenate([kinks, sliding[None]]), axis=0)
        path: Array = np.einsum("n,nij->ij", travel, kinks)
        return np.maximum(path, 0.0)

    @property
    def onset(self) -> Array:
        """Shift up to which each cell sticks ``(nx, ny)`` [mm]; 0 outside the contact.

        Slips that differ by rounding only, as in a symmetric contact, count as equal.
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
    """Return the response of a contact of similar bodies to a motion along x.

    Parameters
    ----------
    contact
        Solver of the normal problem.
    height
        Gap of the unloaded bodies ``(nx, ny)`` [mm], infinite or masked where a body has no
        surface.
    P
        Normal load [N].
    stages
        Number of points of the curve after the first.
    tolerance
        Tolerance of the normal problems.
    start
        Initial guess for the pressure under P.
    tilt
        Whether the tilt under P is held, or free so that there are no moments.

    Raises
    ------
    PartialSlipError
        For dissimilar bodies or a load that is not above 0.
    LoopFailure
        If a normal problem does not converge.

    Examples
    --------
    A sphere moved along a flat, compared with Mindlin. Forces and motions are those for a
    coefficient of friction of 1:

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
        raise PartialSlipError(
            "the pressure of dissimilar bodies depends on the shear: use march_loop instead"
        )
    if contact.half_space.pair.layered:
        raise PartialSlipError(
            "layers do not resist shear as they resist pressure: use march_loop instead"
        )
    P = checks.number("load P [N]", P, above=0.0, error=PartialSlipError)
    if checks.whole("stages", stages) < FEWEST_STAGES:
        raise PartialSlipError(f"{stages} stages: give {FEWEST_STAGES} or more")
    checks.choice("tilt", tilt, get_args(Tilt), PartialSlipError)
    height = checked_heights(height, contact.grid)
    moment = 0.0 if tilt == "free" else None
    pressed = contact.solve(height, P, moment, moment, tolerance=tolerance, start=start)
    normal = converged(pressed)
    tangential, ratio = _stiffness(contact.half_space, normal)
    tilted = height - normal.tilt_x * contact.grid.y + normal.tilt_y * contact.grid.x
    depth = normal.approach - float(tilted.min())
    shares = (np.arange(stages + 1) / stages) ** DENSER
    reduced = normal
    force, gaps = [0.0], [np.zeros(contact.grid.shape)]
    for approach in normal.approach - shares[1:-1] * depth:
        before = reduced.start if reduced.pressure.any() else None
        reduced = converged(
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
    # Without load the bodies just touch.
    force.append(normal.P)
    gaps.append(tilted - tilted.min())
    slip = ratio * np.where(normal.pressure > 0.0, np.maximum(gaps, 0.0), 0.0)
    curve = PartialSlip(normal, tangential, ratio * depth * shares, np.array(force), slip)
    return _with_first_kink(_concave(curve))


def _concave(curve: PartialSlip) -> PartialSlip:
    """Return the curve without the stages at which its slope does not fall.

    No cell leaves the contact there. The remaining curve is concave.
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


def _with_first_kink(curve: PartialSlip) -> PartialSlip:
    """Return the curve with its first segment bent, so that it begins with the stuck stiffness.

    On a grid the outermost cells start to slip somewhere within the first segment. The kink is
    where the line of the second segment, extended backwards, meets the line of stuck stiffness.
    """
    first, second = curve._slopes[:2]
    if not second < first < curve.stiffness * (1.0 - ROUNDING):
        return curve
    bend = (curve.force[1] - second * curve.shift[1]) / (curve.stiffness - second)
    shift, force, slip = curve.shift.copy(), curve.force.copy(), curve.slip.copy()
    shift[1], force[1], slip[1] = bend, curve.stiffness * bend, 0.0
    return replace(curve, shift=shift, force=force, slip=slip)


def _stiffness(half_space: HalfSpace, normal: NormalState) -> tuple[float, float]:
    """Return the tangential stiffness [N/mm] of the pressed cells, and κ.

    κ is the ratio of the normal to the tangential stiffness.
    """
    pressed = normal.pressure > 0.0
    tangential = stuck_stiffness(half_space, pressed, LoopPath(normal.P, 1.0))
    unit = np.ones((1, np.count_nonzero(pressed)))
    pressure = tractions_of_motion(lambda field: half_space.normal(field[0])[None], pressed, unit)
    return tangential, float(pressure.sum()) * half_space.grid.cell_area / tangential
