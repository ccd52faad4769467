"""Gross slip: whether a contact slides, and its rigid motion, from the energy it dissipates.

A force at its limit no longer says how far the bodies slide; energies do. The rigid increments Δδx,
Δδy are found such that the contact dissipates Edx + Edy, in one of two directions: ``energies``,
that which shares the sum between x and y as given (Gallego 2007, eq. 8), with the signs that make
slip oppose the given force, or ``force``, that in which the shear force has the given direction.
Rotation is neglected. The two agree where the bodies slide as rigid ones do. Where the surfaces
also slip sideways, outwards from the middle, eq. 8 takes that for sliding: it implies a force
across that nothing balances.
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
"""Share of the largest shear force from which the contact counts as sliding, where energies are at
hand: from there on the force hardly says how far, the energy does. A structure whose last nodes
stick at the ends of a flank holds 0.2 % less than friction could while it slides by tens of µm."""

SHARE_CHECKED = 0.5
"""Share of µP or of its moment from which the largest force is computed."""

ACCURACY = 1e-6
"""Error of the energy, relative, and of the direction, in rad, at which the search ends. Shear
solved to 1e-8 has its direction to about 1e-7."""

LOOSEST = 1e-3
LOOSER = 0.01
"""Tolerance of the first contact problem, and of the others over the error before them."""

FLATTEST = 0.05
"""Least of µP that a longer motion is taken to dissipate more per length, as the contact begins to
slide, and least part of its own turn that a turned motion is taken to turn force or energies: where
the last two motions say less, they are too near each other to say anything."""

ITERATIONS = 30
"""Contact problems solved; 3 to 8 are usual."""


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
    """How near the last contact problem solved is to sliding as given: see :data:`ACCURACY`.

    ``missing`` is the error of the energy alone. Shear is coupled by Poisson's ratio, so no
    direction of sliding spares x or y all energy: then the error of ``energies`` in direction
    stays, and the sum is met. ``creeps`` says that without any motion the contact dissipates more
    than given: its force is then below what sliding takes, and to be believed.
    """

    error: float
    missing: float
    creeps: bool

    @property
    def message(self) -> str:
        """Empty when the energy is met, else what is wrong and what to try."""
        if self.missing <= ACCURACY:
            return ""
        return (
            f"the sliding contact dissipates an energy off by {self.missing:.1e} of that which its "
            "loads say: take smaller increments; where a structure's nodes say it, refine its "
            "mesh, where a file of loads does, check Edx and Edy"
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
    """Slide a contact until it dissipates ``energy`` (Edx, Edy) [N mm], their sum above 0.

    ``slide`` solves it for a motion (Δδx, Δδy) [mm] to a tolerance and gives its shear force (Qx,
    Qy) [N] and energy (Edx, Edy) [N mm]: its last state is the one sought. ``carried`` is µP [N],
    P the mean of both ends, and ``force`` the given (Qx, Qy) [N]. ``stored`` [N mm] is the work
    that the shear of sliding does on its own displacement, about: it makes the first guess good. A
    motion ``near`` the one sought makes a better one.

    While all slips, a longer motion dissipates µP more per length, and a turned one turns force and
    shares of energy with it: both are corrected at once by what is missing. Where some cells still
    stick it dissipates less, and where friction holds sideways slip back it turns less: as much as
    the last two motions tell.
    """
    total = float(energy.sum())
    wanted = angle = _angle(force if direction == "force" else np.sqrt(energy.clip(0.0)))
    length = max(0.0, total + stored) / carried
    inner, by_length, by_angle = LOOSEST, _Secant(carried), _Secant(1.0)
    if near is not None and near.any():
        inner = LOOSER * LOOSEST
        length, angle = float(np.linalg.norm(near)), _angle(near)
    for _ in range(ITERATIONS):
        shear, spent = slide(length * sliding_direction(force, angle), max(inner, tolerance))
        measured = _angle(shear if direction == "force" else np.sqrt(spent.clip(0.0)))
        missing, turn = total - float(spent.sum()), wanted - measured
        longer, turned = by_length.change(length, missing), by_angle.change(angle, turn)
        turn = float(np.clip(angle + turn, 0.0, 0.5 * np.pi)) - angle
        change = max(abs(missing) / total, abs(turn))
        if change <= ACCURACY and inner <= tolerance:
            break
        inner = max(tolerance, LOOSER * min(change, inner))
        length = max(0.0, length + longer)
        angle = float(np.clip(angle + turned, 0.0, 0.5 * np.pi))
    lacking = abs(missing) / total
    creeps = length == 0.0 and missing < -ACCURACY * total
    return GrossSlip(max(lacking, abs(wanted - measured)), lacking, creeps)


class _Secant:
    """The slope of what is missing of one number against that number, from its last two values.

    It is ``steepest`` until two are known, and at least :data:`FLATTEST` times that.
    """

    def __init__(self, steepest: float) -> None:
        self._steepest = self._slope = steepest
        self._last: tuple[float, float] | None = None

    def change(self, value: float, missing: float) -> float:
        """Of the number, for what is ``missing`` at this ``value``."""
        if self._last is not None:
            further, less = value - self._last[0], self._last[1] - missing
            if further * less > 0.0:
                slope = max(less / further, FLATTEST * self._steepest)
                self._slope = min(slope, self._steepest)
        self._last = value, missing
        return missing / self._slope


def sliding_direction(force: Array, angle: float | None = None) -> Array:
    """Unit vector ``(2,)`` in the quadrant of ``force``, at its own angle unless one is given."""
    angle = _angle(force) if angle is None else angle
    vector: Array = np.where(force < 0.0, -1.0, 1.0) * np.array([np.cos(angle), np.sin(angle)])
    return vector


def _angle(vector: Array) -> float:
    """Direction of (±x, ±y) in the first quadrant [rad]."""
    along, across = np.abs(vector)
    return float(np.arctan2(across, along))
