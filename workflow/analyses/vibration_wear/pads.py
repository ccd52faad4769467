"""Contacts at the nodes of a vibrating structure: their motion, and the wear by it.

The contacts are those of two specimens in a rig, or at the joints of any reduced body. In a cycle
of the steady motion by harmonic balance, the contact of a node slides along a path and dissipates
an energy; the wear laws of both bodies give their losses. The gap grows by the depth, and the state
at rest and the motion are then computed again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fe_models.dynamics.curves.phase_resonance import along_phase_resonance
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from sa_solver.types import Array
from wear.contact.contacts import LastSolved
from wear.contact.nodes import NodalContact, NodalState
from wear.joints.friction_contact import FrictionContact
from wear.joints.periodic.march import PeriodicMarch
from wear.laws import WearLaw
from wear.steps.stepping import ContactFailure
from workflow.models.vibration.amount import FORCE, ExcitationSize
from workflow.models.vibration.structure import VibratingStructure

# Relative change of a resonance's frequency from one state to the next. Farther away, Newton's
# method may find another mode.
CLOSE = 0.05


@dataclass(frozen=True)
class PadCycle:
    """Pads of one shape in a cycle of their ``motion`` under the force that wears them.

    ``model`` is the rig on them. For wear, each node slides its path at one pressure, chosen so
    that it dissipates its energy (:class:`wear.contact.nodes.NodalCycle`).
    """

    model: VibratingStructure
    motion: HarmonicSolution

    @property
    def energy(self) -> Array:
        """Energy that each contact dissipates in a cycle ``(j,)`` [N mm]."""
        return self.motion.cycle.dissipated

    @property
    def areas(self) -> Array:
        """Area of each node ``(j,)`` [mm²]."""
        return self.model.rig.area

    @property
    def law(self) -> FrictionContact:
        """Law of the contacts."""
        assert isinstance(self.model.law, FrictionContact)
        return self.model.law

    @property
    def friction(self) -> float | Array:
        return self.law.friction

    @property
    def slip(self) -> Array:
        """Path of each slider ``(1, j)`` [mm]."""
        return self.path[None]

    @cached_property
    def pressure(self) -> Array:
        """Pressure of each node while it slides ``(1, j)`` [MPa]."""
        sliding = np.asarray(self.friction) * self.areas * self.path
        pressure = np.divide(
            self.energy, sliding, out=np.zeros_like(self.path), where=self.path > 0.0
        )
        return pressure[None]

    @property
    def start(self) -> HarmonicSolution:
        """Motion about the state at rest, as a start for the motion about another such state."""
        return _moved_by(self.motion, -self.model.problem.rest.displacement)

    @cached_property
    def path(self) -> Array:
        """Path of each slider in a cycle while it is pressed ``(j,)`` [mm]."""
        motion = self.motion
        moved = (motion.resolution.basis @ motion.coefficients).transpose(1, 0, 2)
        force = motion.cycle.samples
        slider = moved[:, :, :2] - force[:, :, :2] / np.reshape(self.law.stiffness, (1, -1, 1))
        steps = np.linalg.norm(slider - np.roll(slider, 1, axis=0), axis=2)
        pressed = force[:, :, 2] > 0.0
        return np.asarray((steps * (pressed | np.roll(pressed, 1, axis=0))).sum(axis=0))

    def stable_cycles(self, depth_per_pressure: Array) -> float:
        """Return the number of cycles beyond which an explicit step would let a shape error grow.

        A depth δ that is wrong changes the normal forces by -K δ, with K = (1/kn + C)⁻¹: the
        contact springs in series with the elastic bodies, whose compliance C is not negative, under
        constant load or not. Depths per cycle change by -D K δ with D = w/A, where w is the depth
        per pressure. The eigenvalues of D K lie between 0 and max kn D. With ΔN = 1/(max kn D), an
        Euler step multiplies errors by 1 - x, with x between 0 and 1, and a step of second order by
        1 - x + x²/2. Both are stable up to twice that length. The largest w of all nodes counts, as
        nodes that are open may touch before the step ends.
        """
        stiffest = float(np.max(self.law.normal_stiffness / self.areas))
        fastest = stiffest * float(depth_per_pressure.max())
        return 2.0 / fastest if fastest > 0.0 else np.inf


@dataclass(frozen=True)
class WearingPads:
    """Pads that wear under a ``force`` [N], or level, at a ``frequency`` [Hz].

    ``amount`` tells whether it is a force or a level. ``unworn`` is the rig before wear, ``laws``
    are the wear laws of body 1 and body 2. Without a frequency, every state has that of its phase
    resonance. This is followed from the state before or, if none is close, found by ``search`` on
    the equations of the motion.
    """

    unworn: VibratingStructure
    laws: tuple[WearLaw, WearLaw]
    force: float
    frequency: float | None
    amount: ExcitationSize = FORCE
    search: Callable[[HarmonicBalance], HarmonicSolution] | None = None

    def begin(self) -> NodalState:
        """Return the state before the first cycle."""
        return NodalState.unworn(self.unworn.rig.gap)

    @cached_property
    def at(self) -> LastSolved[NodalState, PadCycle]:
        """The cycle of the pads in a state.

        The motion is solved from that of the state before. Raises
        :class:`wear.steps.stepping.ContactFailure` where no motion is found.
        """
        return LastSolved(self._solve)

    def _solve(self, state: NodalState) -> PadCycle:
        model = worn_model(self.unworn, state.surfaces.depth)
        start = state.start
        assert start is None or isinstance(start, HarmonicSolution)
        if start is not None:
            start = _moved_by(start, model.problem.rest.displacement)
        return PadCycle(model, self._motion(model.problem, start))

    def contact_at(self, state: NodalState) -> NodalContact:
        """Return the contact in a state in the form that wear steps need."""
        return NodalContact(self.laws, (self.at(state),))

    def _motion(self, problem: HarmonicBalance, start: HarmonicSolution | None) -> HarmonicSolution:
        if self.frequency is None:
            assert self.search is not None
            followed = None if start is None else self._followed(problem, start)
            return followed or self.search(problem)
        motion = problem.solve(self.frequency, self.force, start)
        if not motion.converged:
            raise ContactFailure(
                f"no motion {self.amount.under(self.force)} at {self.frequency:g} Hz: "
                f"{motion.message}"
            )
        return motion

    def _followed(
        self, problem: HarmonicBalance, start: HarmonicSolution
    ) -> HarmonicSolution | None:
        """Return the phase resonance close to that of another state, None if there is none."""
        settled = problem.solve(start.frequency, self.force, start)
        if not settled.converged:
            return None
        found = along_phase_resonance(problem, settled, (self.force, self.force)).solutions
        if not found or abs(np.log(found[0].frequency / start.frequency)) > CLOSE:
            return None
        return found[0]


def _moved_by(motion: HarmonicSolution, mean: Array) -> HarmonicSolution:
    """Return a motion with the joints' mean displacement shifted by ``mean`` ``(j, d)`` [mm]."""
    coefficients = motion.coefficients.copy()
    coefficients[:, motion.resolution.harmonics.index(0)] += mean
    return replace(motion, coefficients=coefficients)


def worn_model(unworn: VibratingStructure, depth: Array) -> VibratingStructure:
    """Return the rig with contacts worn by a ``depth`` ``(j,)`` [mm]: only their law is new."""
    rig, problem = unworn.rig, unworn.problem
    assert isinstance(unworn.law, FrictionContact)
    assert isinstance(problem.joints, PeriodicMarch)
    law = unworn.law.worn(depth)
    worn = HarmonicBalance(
        problem.model,
        replace(problem.joints, law=law),
        problem.load,
        problem.resolution,
        problem.receptance,
    )
    return VibratingStructure(replace(rig, gap=rig.gap + depth), law, worn, unworn.driving)
