"""Gross slip: whether a contact slides, and its rigid motion, from the energy it dissipates.

A force at the friction limit does not determine how far the bodies slide, but the dissipated energy
does. The rigid increments Δδx, Δδy are found such that the contact dissipates Edx + Edy. Their
direction follows from one of two rules. With ``energies``, the energy is divided between x and y as
given (Gallego 2007, eq. 8), and the signs are such that slip opposes the given force. With
``force``, the shear force has the given direction. Rotation is neglected. The rules agree where the
bodies slide like rigid ones. Where the surfaces also slip sideways, outwards from the middle, eq. 8
counts this as sliding, which implies a transverse force that no load balances.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sa_solver.contact_state import ContactLoad
from sa_solver.rigid_modes import PLANAR, PlanarModes
from sa_solver.tangential.contact import TangentialContactError
from sa_solver.tangential.friction_limit import largest_share
from sa_solver.types import Array

SlidingRule = Literal["force", "energies"]

GROSS_SHARE = 0.99
"""Share of the largest shear force above which the contact counts as sliding, where its energy is
known. Above this share the motion hardly follows from the force, but it does from the energy. A
structure with a few sticking nodes at the ends of a flank carries 0.2 % less than the largest force
while it slides by tens of µm."""

SHARE_CHECKED = 0.5
"""Share of µP, or of its moment, above which the largest shear load is computed."""

ACCURACY, PER_TOLERANCE = 1e-6, 10.0
"""Relative error of the energy, and error of the direction [rad], at which the search ends. It is
at least ten times the tolerance of the contact problems, because the direction of shear solved to
1e-8 is accurate to about 1e-7."""

LOOSEST = 1e-3
LOOSER = 0.01
"""Tolerance of the first contact problem, and ratio of later tolerances to the error before."""

FLATTEST = 0.05
"""Least slope of the secants, relative to the slope in full sliding. The slopes are the energy per
length of the motion, over µP, and the change of the direction of force or energies per change of
the direction of motion. A smaller slope from the last two motions is not reliable, because the
motions are too close to each other."""

ITERATIONS = 30
"""Most contact problems solved; 3 to 8 are usual."""


def slides(limit: Array, load: ContactLoad, modes: PlanarModes, cell_area: float) -> bool:
    """Return whether ``load`` gives an energy, and nearly the largest force that friction carries.

    ``limit`` ``(nx, ny)`` is µp [MPa], ``modes`` are the rigid motions of the grid, whose cells
    have ``cell_area`` [mm²]. A force of :data:`GROSS_SHARE` of the largest is near enough. Raises
    TangentialContactError for energies that are not finite.
    """
    if load.energy is None:
        return False
    if not np.all(np.isfinite(load.energy)):
        raise TangentialContactError(
            f"energies {load.energy} must be finite: check the load history"
        )
    if load.energy.sum() <= 0.0:
        return False
    forces = load.values[[PLANAR[k] for k in modes.free]]
    target = forces / (modes.lengths * cell_area)
    carried = float(limit.sum())
    if any(load.motion[k] for k in PLANAR) or carried == 0.0:
        return False
    if np.linalg.norm(target) < SHARE_CHECKED * carried:
        return False
    pressed = limit > 0.0
    shapes = modes.fields()[:, :, pressed]
    enough = 1.0 / GROSS_SHARE
    accuracy = 0.1 * (1.0 - GROSS_SHARE)
    share = largest_share(limit[pressed], shapes, target, accuracy=accuracy, enough=enough)
    return share <= enough


@dataclass(frozen=True)
class GrossSlip:
    """Result of a search for gross slip.

    Attributes
    ----------
    error
        Error of the last contact problem solved, of energy and direction. Poisson's ratio couples
        both directions of shear, so that no direction of sliding dissipates energy along x or y
        only. With the rule ``energies`` an error of the direction may then remain, while the total
        energy is met.
    missing
        Relative error of the energy alone.
    creeps
        Whether the contact dissipates more than the given energy without any motion. The force is
        then below the sliding force and determines the state.
    accuracy
        Error at which the search ends: see :data:`ACCURACY`.
    """

    error: float
    missing: float
    creeps: bool
    accuracy: float = ACCURACY

    @property
    def message(self) -> str:
        """Message that says what is wrong and what to try; empty if the energy is met."""
        if self.missing <= self.accuracy:
            return ""
        return (
            f"the sliding contact dissipates an energy off by {self.missing:.1e} of that of its "
            "loads: take smaller increments; if the energy comes from a structure, refine its "
            "mesh; if it comes from a file of loads, check Edx and Edy"
        )


def gross_slip(
    slide: Callable[[Array, float], tuple[Array, Array]],
    carried: float,
    energy: Array,
    force: Array,
    tolerance: float,
    direction: SlidingRule = "force",
    stored: float = 0.0,
    near: Array | None = None,
) -> GrossSlip:
    """Slide a contact until it dissipates a given energy.

    While all cells slip, the energy grows by µP per length of the motion, and the direction of
    force and energies turns with the motion. Length and direction are then corrected at once. Where
    some cells stick the energy grows more slowly, and where friction prevents sideways slip the
    direction turns more slowly. The slopes are therefore estimated from the last two motions.

    Parameters
    ----------
    slide
        Function that solves the contact for a motion (Δδx, Δδy) [mm] to a tolerance and returns the
        shear force (Qx, Qy) [N] and the energy (Edx, Edy) [N mm]. The state that it solves last is
        the result.
    carried
        µP [N], with the mean of P at both ends of the increment.
    energy
        Energy (Edx, Edy) [N mm] to dissipate, with a sum above 0.
    force
        Given shear force (Qx, Qy) [N].
    tolerance
        Tolerance of the last contact problem.
    direction
        Rule for the direction of sliding.
    stored
        Approximate work [N mm] of the shear in sliding on its own displacement, for the initial
        guess.
    near
        Motion near the one sought, as a better initial guess.
    """
    total = float(energy.sum())
    wanted = angle = _angle(force if direction == "force" else np.sqrt(energy.clip(0.0)))
    length = max(0.0, total + stored) / carried
    accuracy = max(ACCURACY, PER_TOLERANCE * tolerance)
    inner, by_length, by_angle = LOOSEST, _Secant(carried), _Secant(1.0)
    if near is not None and near.any():
        inner = LOOSER * LOOSEST
        length, angle = float(np.linalg.norm(near)), _angle(near)
    for _ in range(ITERATIONS):
        shear, dissipated = slide(length * sliding_direction(force, angle), max(inner, tolerance))
        measured = _angle(shear if direction == "force" else np.sqrt(dissipated.clip(0.0)))
        missing, turn = total - float(dissipated.sum()), wanted - measured
        longer, turned = by_length.change(length, missing), by_angle.change(angle, turn)
        turn = float(np.clip(angle + turn, 0.0, 0.5 * np.pi)) - angle
        change = max(abs(missing) / total, abs(turn))
        if change <= accuracy and inner <= tolerance:
            break
        inner = max(tolerance, LOOSER * min(change, inner))
        length = max(0.0, length + longer)
        angle = float(np.clip(angle + turned, 0.0, 0.5 * np.pi))
    lacking = abs(missing) / total
    creeps = length == 0.0 and missing < -accuracy * total
    return GrossSlip(max(lacking, abs(wanted - measured)), lacking, creeps, accuracy)


class _Secant:
    """Secant slope of a quantity against its control, from the last two values.

    The slope is ``steepest`` until two values are known, and never below :data:`FLATTEST` times
    that.
    """

    def __init__(self, steepest: float) -> None:
        self._steepest = self._slope = steepest
        self._last: tuple[float, float] | None = None

    def change(self, value: float, missing: float) -> float:
        """Return the change of the control for the error ``missing`` at this ``value`` of it."""
        if self._last is not None:
            further, less = value - self._last[0], self._last[1] - missing
            if further * less > 0.0:
                slope = max(less / further, FLATTEST * self._steepest)
                self._slope = min(slope, self._steepest)
        self._last = value, missing
        return missing / self._slope


def sliding_direction(force: Array, angle: float | None = None) -> Array:
    """Return the unit vector ``(2,)`` in the quadrant of ``force`` at an ``angle`` [rad].

    The angle is that of the force by default.
    """
    angle = _angle(force) if angle is None else angle
    vector: Array = np.where(force < 0.0, -1.0, 1.0) * np.array([np.cos(angle), np.sin(angle)])
    return vector


def _angle(vector: Array) -> float:
    """Return the angle of (±x, ±y), mirrored to the first quadrant [rad]."""
    along, across = np.abs(vector)
    return float(np.arctan2(across, along))
