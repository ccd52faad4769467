"""Contacts at the nodes of a vibrating structure: how they move, and what that takes off each.

They are those of two specimens in a rig, or at the joints of any reduced body. In a cycle of the
steady motion by harmonic balance the contact of a node slides along a path and dissipates an
energy; what both bodies lose by it is up to their laws. The gap grows by the depth, and rest and
motion are found anew.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fe_models.dynamics.curves.phase_resonance import along_phase_resonance
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from sa_solver.types import Array
from wear.contact.nodes import NodalContact, NodalState
from wear.joints.friction_contact import FrictionContact
from wear.joints.periodic.march import PeriodicMarch
from wear.laws import WearLaw
from wear.steps.stepping import ContactFailure
from wear.surfaces import Surfaces
from workflow.analyses.vibration.excitation import FORCE, Amount
from workflow.analyses.vibration.model import VibrationModel

# Of the frequency of a resonance: by so much it moves from one state to the next. What Newton's
# method finds farther away may be of another mode.
CLOSE = 0.05
# Pads of the last states: those before and after a step.
KEPT = 2


@dataclass(frozen=True)
class PadCycle:
    """Pads of one shape in a cycle of their ``motion`` under the force that wears them.

    ``model`` is the rig on them. For wear each node slides its path at one pressure, with which it
    dissipates what it does (:class:`wear.contact.nodes.NodalCycle`).
    """

    model: VibrationModel
    motion: HarmonicSolution

    @property
    def energy(self) -> Array:
        """What each contact dissipates in a cycle ``(j,)`` [N mm]."""
        return self.motion.cycle.dissipated

    @property
    def areas(self) -> Array:
        """Of each node ``(j,)`` [mm²]."""
        return self.model.rig.area

    @property
    def law(self) -> FrictionContact:
        """That of each contact."""
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
        """Of each node while it slides ``(1, j)`` [MPa]."""
        sliding = np.asarray(self.friction) * self.areas * self.path
        pressure = np.divide(
            self.energy, sliding, out=np.zeros_like(self.path), where=self.path > 0.0
        )
        return pressure[None]

    @property
    def start(self) -> HarmonicSolution:
        """The motion about rest, from which that of pads that rest elsewhere may begin."""
        return _moved_by(self.motion, -self.model.problem.rest.displacement)

    @cached_property
    def path(self) -> Array:
        """Way that each slider moves in a cycle while it is pressed ``(j,)`` [mm]."""
        motion = self.motion
        moved = (motion.resolution.basis @ motion.coefficients).transpose(1, 0, 2)
        force = motion.cycle.samples
        slider = moved[:, :, :2] - force[:, :, :2] / np.reshape(self.law.stiffness, (1, -1, 1))
        steps = np.linalg.norm(slider - np.roll(slider, 1, axis=0), axis=2)
        pressed = force[:, :, 2] > 0.0
        return np.asarray((steps * (pressed | np.roll(pressed, 1, axis=0))).sum(axis=0))

    def stable_cycles(self, depth_per_pressure: Array) -> float:
        """Cycles beyond which an explicit step would let an error of the shape grow.

        A depth δ that is wrong changes the normal forces by -K δ, K = (1/kn + C)⁻¹: the contact
        springs in series with the elastic bodies, whose compliance C is not negative, be it under
        constant load or not. Depths per cycle change by -D K δ with D = w/A, w being the depth per
        pressure. The eigenvalues of D K lie between 0 and max kn D: in ΔN = 1/(max kn D) an Euler
        step multiplies errors by 1 - x, x between 0 and 1, and a step of second order by 1 - x +
        x²/2. Both are stable up to twice that length. The largest w is that of all nodes, as those
        that do not touch yet may touch before the step ends.
        """
        stiffest = float(np.max(self.law.normal_stiffness / self.areas))
        fastest = stiffest * float(depth_per_pressure.max())
        return 2.0 / fastest if fastest > 0.0 else np.inf


@dataclass(frozen=True)
class WearingPads:
    """Pads that wear under a ``force`` [N], or level, at a ``frequency`` [Hz].

    ``amount`` says which it is. ``unworn`` is the rig before, ``laws`` are those of body 1 and
    body 2. Without a frequency it is that of phase resonance in every state, near that of the state
    before, or where there is none close by found by ``search`` on the equations of the motion.
    """

    unworn: VibrationModel
    laws: tuple[WearLaw, WearLaw]
    force: float
    frequency: float | None
    amount: Amount = FORCE
    search: Callable[[HarmonicBalance], HarmonicSolution] | None = None
    _solved: deque[tuple[Surfaces, PadCycle]] = field(
        init=False, default_factory=lambda: deque(maxlen=KEPT)
    )

    def begin(self) -> NodalState:
        """The state before the first cycle."""
        return NodalState.unworn(self.unworn.rig.gap)

    def at(self, state: NodalState) -> PadCycle:
        """The cycle of the pads in a state, its motion solved for from that which wore to it.

        Raises :class:`wear.steps.stepping.ContactFailure` where no motion is found.
        """
        for surfaces, cycle in self._solved:
            if surfaces is state.surfaces:
                return cycle
        model = worn_model(self.unworn, state.surfaces.depth)
        start = state.start
        assert start is None or isinstance(start, HarmonicSolution)
        if start is not None:
            start = _moved_by(start, model.problem.rest.displacement)
        motion = self._motion(model.problem, start)
        cycle = PadCycle(model, motion)
        self._solved.append((state.surfaces, cycle))
        return cycle

    def contact_at(self, state: NodalState) -> NodalContact:
        """The same as wear steps take it."""
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
        """The phase resonance close to that of another state, None if there is none."""
        settled = problem.solve(start.frequency, self.force, start)
        if not settled.converged:
            return None
        found = along_phase_resonance(problem, settled, (self.force, self.force)).solutions
        if not found or abs(np.log(found[0].frequency / start.frequency)) > CLOSE:
            return None
        return found[0]


def _moved_by(motion: HarmonicSolution, mean: Array) -> HarmonicSolution:
    """A motion whose joints' mean displacement is another by so much ``(j, d)`` [mm]."""
    coefficients = motion.coefficients.copy()
    coefficients[:, motion.resolution.harmonics.index(0)] += mean
    return replace(motion, coefficients=coefficients)


def worn_model(unworn: VibrationModel, depth: Array) -> VibrationModel:
    """The rig whose contacts have lost a ``depth`` ``(j,)`` [mm]: only their law is new."""
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
    return VibrationModel(replace(rig, gap=rig.gap + depth), law, worn, unworn.driving)
