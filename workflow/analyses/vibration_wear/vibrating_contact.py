"""A half-space contact in a vibrating rig: what it is to the rig, and how the motion wears it.

The surfaces of the present make the joint: under its load every cell of the grid is an elementary
contact with its pressure, or its gap, and the shift at which it begins to slip, and all of them
together, tied by the half-space, are so many sliders in parallel (:mod:`sa_solver.partial_slip`).
The rig's steady motion by harmonic balance says what each slider dissipates, and so how far every
cell slips in a cycle. That slip, and the pressure that wear itself changes, wear the surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fe_models.dynamics.harmonic_balance import HarmonicBalance, PeriodicLoad
from fe_models.dynamics.harmonic_solution import HarmonicSolution
from fe_models.dynamics.harmonics import Resolution
from fe_models.dynamics.receptance import Receptance
from sa_solver.contact import FrictionalContact
from sa_solver.half_space import HalfSpace
from sa_solver.normal import NormalContact
from sa_solver.partial_slip import PartialSlip, PartialSlipError, partial_slip_curve
from sa_solver.tangential_loop import LoopFailure, LoopPath, TangentialLoop, march_loop
from sa_solver.types import Array, ElasticPair, Grid, LoadHistory
from wear.joints.jenkins import Jenkins
from wear.joints.parallel import ParallelSliders
from wear.stepping import ContactFailure, SlidingCycle, WearingContact, WearState
from workflow.analyses.rig.rig_model import RigModel
from workflow.analyses.wear.structures.bodies.case import BodiesWearCase
from workflow.analyses.wear.structures.bodies.source import gap_of

# Contacts of the last states: those before and after a step.
KEPT = 2
# Share by which friction may change in a wear step.
FRICTION_CHANGE = 0.03
# Steps of each branch of the loop that the half-space is led through.
LOOP_INCREMENTS = 12


@dataclass(frozen=True)
class Shaking:
    """The force that wears: ``force`` [N] at ``frequency`` [Hz], found at a ``resolution``."""

    force: float
    frequency: float
    resolution: Resolution


@dataclass(frozen=True)
class Rubbing:
    """The contact in one state of its surfaces, and how the rig rubs it.

    ``sliders`` are its law, ``motion`` that of the rig under the force that wears, in a
    cycle of which the sliders dissipate ``by_slider`` ``(n,)`` [N mm] and the cells slip by
    ``path`` ``(nx, ny)`` [mm], ``adjusted`` by a factor so that they dissipate exactly
    as much. ``wearing`` is what wear steps take.
    """

    state: WearState
    friction: float
    slipping: PartialSlip
    sliders: Jenkins
    motion: HarmonicSolution
    by_slider: Array
    path: Array
    adjusted: float
    wearing: WearingContact

    @property
    def energy(self) -> Array:
        """Energy of a cycle per area ``(nx, ny)`` [N/mm]."""
        energy: Array = self.friction * self.slipping.normal.pressure * self.path
        return energy

    @property
    def displacement(self) -> Array:
        """Of the joint through the cycle ``(t,)`` [mm]."""
        moved: Array = self.motion.resolution.basis @ self.motion.coefficients[0, :, 0]
        return moved

    @property
    def full_slip(self) -> float:
        """Motion from rest at which all of the contact slides [mm]."""
        return self.friction * float(self.slipping.reach[-1])

    @property
    def stroke(self) -> float:
        """Way of the joint from end to end [mm]."""
        return float(np.ptp(self.displacement))


class VibratingContact:
    """The contact of a ``case`` in a ``rig`` whose joint it is."""

    def __init__(self, case: BodiesWearCase, rig: RigModel, shaking: Shaking) -> None:
        self._case, self._rig, self._shaking = case, rig, shaking
        self.grid = Grid.covering(case.contact.size, case.contact.grid)
        pair = ElasticPair(case.material(1), case.material(2))
        self._contact = NormalContact(HalfSpace(self.grid, pair))
        self._laws = case.wear_of(1).described(), case.wear_of(2).described()
        self._receptance = Receptance(rig.model)
        self._kept: list[Rubbing] = []

    @property
    def load(self) -> float:
        """Normal force [N]."""
        return self._case.load_path.P

    def unworn(self) -> WearState:
        """The surfaces before the first cycle, pressed."""
        gap = gap_of(self._case.structure, self.grid)(self.grid.x, self.grid.y)
        unworn = WearState.unworn(np.ascontiguousarray(np.broadcast_to(gap, self.grid.shape)))
        rubbing = self.at(unworn)
        starts = {0: rubbing.slipping.normal.start}
        result = rubbing.wearing.cycle(replace(unworn, starts=starts), rubbing.wearing.dissipating)
        depth_rate, volume_rate = result.per_cycle(self.grid.cell_area)
        return replace(unworn, starts=starts, depth_rate=depth_rate, volume_rate=volume_rate)

    def at(self, state: WearState) -> Rubbing:
        """The contact in a state. Raises ContactFailure where contact or motion are not found."""
        for kept in self._kept:
            same = kept.state.surfaces is state.surfaces
            if same and kept.state.energy == state.energy:
                return kept
        found = self._found(state)
        self._kept = [*self._kept[1 - KEPT :], found]
        return found

    def wearing(self, state: WearState) -> WearingContact:
        """The same for wear steps."""
        return self.at(state).wearing

    def alike_cycles(self, state: WearState, most: float) -> float:
        """Cycles, ``most`` or fewer, in which friction hardly changes; or one.

        A wear step takes the friction of its beginning.
        """
        rubbing, cycles = self.at(state), most
        per_cycle = float(rubbing.by_slider.sum())
        while cycles > 1.0:
            friction = self._case.friction.at(state.energy + cycles * per_cycle)
            if abs(friction - rubbing.friction) <= FRICTION_CHANGE * rubbing.friction:
                return cycles
            cycles *= 0.5
        return min(1.0, most)

    def problem(self, sliders: Jenkins, resolution: Resolution) -> HarmonicBalance:
        """The balance of the rig held by ``sliders``."""
        return HarmonicBalance(
            self._rig.model,
            ParallelSliders(sliders),
            # The force is a sine: Re (-i) exp(iωt).
            PeriodicLoad({1: -1j * self._rig.driven}),
            resolution,
            self._receptance,
        )

    def loop(self, rubbing: Rubbing, amplitude: float) -> TangentialLoop:
        """The half-space's own loop of an amplitude [mm]: the whole tangential problem.

        Raises ContactFailure if it does not converge.
        """
        half_space, tolerance = self._contact.half_space, self._case.contact.tolerance
        contact = FrictionalContact(half_space, rubbing.friction, tolerance)
        path = LoopPath(self.load, amplitude, increments=LOOP_INCREMENTS)
        try:
            return march_loop(contact, rubbing.state.surfaces.gap, path)
        except LoopFailure as error:
            raise ContactFailure(f"tangential loop: {error}") from error

    # -- steps of at --------------------------------------------------------------------------
    def _found(self, state: WearState) -> Rubbing:
        tolerance = self._case.contact.tolerance
        start = state.starts.get(0)
        try:
            slipping = partial_slip_curve(
                self._contact, state.surfaces.gap, self.load, tolerance=tolerance, start=start
            )
        except (PartialSlipError, LoopFailure) as error:
            raise ContactFailure(str(error)) from error
        friction = self._case.friction.at(state.energy)
        sliders = Jenkins(slipping.slider_stiffness, friction, slipping.slider_load)
        motion = self._motion(sliders)
        own = motion.resolution
        cycle = ParallelSliders(sliders).settle(
            motion.coefficients, own.basis, own.weights, own.lead
        )
        path, adjusted = self._path(slipping, sliders, cycle.by_slider)
        wearing = WearingContact(self._contact, self._laws, friction, self._cycle(path), tolerance)
        return Rubbing(
            state, friction, slipping, sliders, motion, cycle.by_slider, path, adjusted, wearing
        )

    def _motion(self, sliders: Jenkins) -> HarmonicSolution:
        own = self._shaking
        problem = self.problem(sliders, own.resolution)
        start = self._kept[-1].motion if self._kept else None
        motion = problem.solve(own.frequency, own.force, start)
        if not motion.converged:
            raise ContactFailure(
                f"no motion under {own.force:g} N at {own.frequency:g} Hz: {motion.message}"
            )
        return motion

    def _path(self, slipping: PartialSlip, sliders: Jenkins, lost: Array) -> tuple[Array, float]:
        """Path of every cell in a cycle, and the factor that keeps the energy."""
        limit = sliders.limit
        travel = np.divide(lost, limit, out=np.zeros_like(lost), where=limit > 0.0)
        path = slipping.travelled(travel)
        found = float(np.vdot(slipping.normal.pressure, path)) * self.grid.cell_area
        found *= float(sliders.friction)
        if not found > 0.0:
            return np.zeros(self.grid.shape), 1.0
        factor = float(lost.sum()) / found
        return factor * path, factor

    def _cycle(self, path: Array) -> SlidingCycle:
        """One increment: the load stays, and so does the pressure on surfaces that do not move."""
        nothing, pressed = np.zeros(1), np.array([self.load])
        loads = LoadHistory(pressed, *(nothing,) * 7, sliding=np.zeros(1, dtype=bool))
        return SlidingCycle(loads, path[None])
