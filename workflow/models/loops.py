"""Tangential loops on worn contacts: stiffness, friction and energy for joint laws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sa_solver import checks
from sa_solver.contact import FrictionalContact
from sa_solver.cycles.loop_accuracy import loop_errors
from sa_solver.cycles.tangential_loop import (
    CLOSED,
    MOST_CYCLES,
    LoopFailure,
    LoopPath,
    march_loop,
)
from sa_solver.errors import ContactProblemError, InputError
from sa_solver.types import Array, Tilt
from wear.contact.interface import InterfaceState
from wear.steps.stepping import ContactFailure
from workflow.errors import UserError
from workflow.models.checks.limits import MOST_INCREMENTS


@dataclass(frozen=True)
class TangentialLoops:
    """Settings of tangential loops that measure a contact at times while it wears.

    Parameters
    ----------
    amplitude : float, optional
        Amplitude of the motion [mm].
    force : float, optional
        Amplitude of the force [N], below the limit of sliding; give it or ``amplitude``.
    axis : {"x", "y"}
        Axis of the contact's frame along which it moves.
    increments : int
        Increments of each branch.
    normal_force : float, optional
        Normal force [N]; that at peak load if not given.
    every : {"jump", "end"}
        After every wear step, or only unworn and at the end.
    """

    amplitude: float | None = None
    force: float | None = None
    axis: Literal["x", "y"] = "x"
    increments: int = 12
    normal_force: float | None = None
    every: Literal["jump", "end"] = "jump"

    def __post_init__(self) -> None:
        checks.numbers(self, "amplitude", "force", "normal_force", above=0.0)
        checks.choices(self, axis=("x", "y"), every=("jump", "end"))
        checks.wholes(self, "increments", least=1, most=MOST_INCREMENTS)
        if (self.amplitude is None) == (self.force is None):
            raise InputError("a tangential loop needs an amplitude or a force, not both")

    def due(self, jump: int, ended: bool) -> bool:
        """Return whether a loop is to be run after ``jump``, 0 being the unworn state."""
        return self.every == "jump" or jump == 0 or ended

    def path(self, name: str, state: InterfaceState, peak: int, tilt: Tilt = "free") -> LoopPath:
        """Return the path that a loop imposes on the contact ``name`` under its loads at ``peak``.

        Raises UserError for a contact without load.
        """
        loads = state.loads
        P, Mx, My = (float(column[peak]) for column in (loads.P, loads.Mx, loads.My))
        if self.normal_force is None and not P > 0.0:
            raise UserError(
                f"loops: {name} carries nothing at peak load; allowed: loops.normal_force above 0"
            )
        force = P if self.normal_force is None else self.normal_force
        share = _share(force, state, peak)
        drive: Literal["motion", "force"] = "motion" if self.force is None else "force"
        amplitude = self.amplitude if self.force is None else self.force
        assert amplitude is not None
        moments = None if tilt == "held" else (share * Mx, share * My)
        return LoopPath(force, amplitude, drive, self.increments, self.axis, moments)


@dataclass(frozen=True)
class WornLoop:
    """A tangential loop on worn surfaces.

    ``values`` are the measured quantities by name, in base units. ``displacement`` [mm] and
    ``force`` [N] ``(k,)`` are the curve, first loading included.
    """

    values: dict[str, float]
    displacement: Array
    force: Array


def worn_loop(
    contact: FrictionalContact,
    loops: TangentialLoops,
    name: str,
    state: InterfaceState,
    peak: int,
    tilt: Tilt = "free",
    lift: Array | float = 0.0,
) -> WornLoop:
    """Return the loop of the contact ``name`` in its present state, under its loads at ``peak``.

    The loads widen the gap by ``lift`` ``(nx, ny)`` [mm]. The ``tilt`` is held, or free under the
    moments of the loads. A normal force given for the loop acts along the same line; lift and
    moments scale with its ratio to the load. Raises ContactFailure if the loop does not converge or
    friction cannot carry it, and UserError for a contact without load.
    """
    path = loops.path(name, state, peak, tilt)
    height = state.surfaces.gap + _share(path.P, state, peak) * lift
    try:
        loop = march_loop(contact, height, path)
    except (LoopFailure, ContactProblemError) as error:
        raise ContactFailure(
            f"tangential loop: {error}; allowed: lower loops.force or loops.amplitude"
        ) from error
    if loop.closure > CLOSED:
        raise ContactFailure(
            f"tangential loop: still open by {loop.closure:.1e} of its range after {MOST_CYCLES} "
            "cycles; allowed: lower loops.amplitude or loops.force"
        )
    errors = loop_errors(contact, height, path, loop)
    values = {
        "energy": state.energy,
        "P": loop.P,
        "kt": loop.stiffness,
        "mu": loop.friction,
        "energy_per_loop": loop.energy,
        "area": loop.area,
        "amplitude": loop.amplitude,
        "force": loop.force_amplitude,
        "sliding": loop.sliding,
        "residual_stiffness": loop.residual_stiffness,
        "border_load": loop.border_load,
        "kt_error": errors.stiffness,
        "mu_error": errors.friction,
        "energy_per_loop_error": errors.energy,
    }
    return WornLoop(values, loop.displacement, loop.force)


def _share(force: float, state: InterfaceState, peak: int) -> float:
    """Return the ratio of a normal force to that at peak load; 0 if there is no load."""
    P = float(state.loads.P[peak])
    return force / P if P > 0.0 else 0.0
