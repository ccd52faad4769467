"""Half-space contacts in a vibrating rig: the joint that they form, and the wear by the motion.

The present surfaces define the joint. Under its load, every cell of the grid is an elementary
contact with its pressure, or its gap, and the shift at which it begins to slip. All cells together,
coupled by the half-space, are equivalent to a number of sliders in parallel
(:mod:`sa_solver.cycles.partial_slip`). The rig's steady motion by harmonic balance gives the energy
that each slider dissipates, and thus the slip of every cell in a cycle. This slip, together with
the pressure that changes by wear, wears the surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.receptance import Receptance
from sa_solver.contact import FrictionalContact
from sa_solver.cycles.partial_slip import PartialSlip, PartialSlipError, partial_slip_curve
from sa_solver.cycles.tangential_loop import LoopFailure, LoopPath, TangentialLoop, march_loop
from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.types import Array, ElasticPair, Grid
from wear.contact.contacts import LastSolved
from wear.contact.drive import Drive
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.parallel import ParallelSliders
from wear.steps.stepping import ContactFailure, SlidingCycle, WearingContact, WearState
from workflow.analyses.wear.structures.bodies.case import (
    BodiesWearCase,
    Reciprocation,
    WearGrid,
)
from workflow.analyses.wear.structures.bodies.model import gap_of
from workflow.models.rig.rig_model import RigModel
from workflow.models.vibration.excitation import Driving

# Share by which friction may change in a wear step.
FRICTION_CHANGE = 0.03
# Steps of each branch of the half-space loop.
LOOP_INCREMENTS = 12
# Tolerance of the contact solver unless the case gives one: tighter than that of wear, because the
# damping of small motions is a small difference of large forces.
SOLVED = 1e-8


@dataclass(frozen=True)
class ContactCycle:
    """The contact in one state of its surfaces, and its motion in the rig.

    ``sliders`` are its law, ``motion`` is the motion of the rig under the force that wears. In a
    cycle, the sliders dissipate ``by_slider`` ``(n,)`` [N mm] and the cells slip by ``path`` ``(nx,
    ny)`` [mm], which is multiplied by a factor ``adjusted`` so that both dissipate the same energy.
    ``wearing`` is the contact in the form that wear steps need.
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
        return np.asarray(self.friction * self.slipping.normal.pressure * self.path)

    @property
    def displacement(self) -> Array:
        """Displacement of the joint through the cycle ``(t,)`` [mm]."""
        return np.asarray(self.motion.resolution.basis @ self.motion.coefficients[0, :, 0])

    @property
    def full_slip(self) -> float:
        """Motion from rest at which all of the contact slides [mm]."""
        return self.friction * float(self.slipping.reach[-1])

    @property
    def stroke(self) -> float:
        """Displacement of the joint from end to end [mm]."""
        return float(np.ptp(self.displacement))


class VibratingContact:
    """The contact of a ``case`` in a ``rig`` whose joint it is.

    It wears under a ``force`` [N], or level, of the excitation ``driving`` at a ``frequency`` [Hz];
    its motion is computed at a ``resolution``.
    """

    def __init__(
        self,
        case: BodiesWearCase,
        rig: RigModel,
        driving: Driving,
        force: float,
        frequency: float,
        resolution: Resolution,
    ) -> None:
        self._case, self.rig, self.driving = case, rig, driving
        self._tolerance = case.contact.tolerance or SOLVED
        self._force, self._frequency, self._resolution = force, frequency, resolution
        self.grid = Grid.covering(case.contact.size, case.contact.grid)
        pair = ElasticPair(case.material(1), case.material(2))
        self._contact = NormalContact(HalfSpace(self.grid, pair))
        self._laws = case.wear_of(1).described(), case.wear_of(2).described()
        assert isinstance(case.load_path, Reciprocation), "a case that is unfit"
        self._tilt, self.load = case.load_path.tilt, case.load_path.P
        self._receptance = Receptance(rig.model)
        self.at = LastSolved(self._solve)

    @property
    def settings(self) -> WearGrid:
        """Settings of the grid, as the case has them."""
        return self._case.contact

    def unworn(self) -> WearState:
        """Return the surfaces before the first cycle, pressed together."""
        gap = gap_of(self._case.structure, self.grid)(self.grid.x, self.grid.y)
        unworn = WearState.unworn(np.ascontiguousarray(np.broadcast_to(gap, self.grid.shape)))
        cycle = self.at(unworn)
        starts = {0: cycle.slipping.normal.start}
        result = cycle.wearing.cycle(replace(unworn, starts=starts), cycle.wearing.dissipating)
        depth_rate, volume_rate = result.per_cycle(self.grid.cell_area)
        return replace(unworn, starts=starts, depth_rate=depth_rate, volume_rate=volume_rate)

    def wearing(self, state: WearState) -> WearingContact:
        """Return the contact in a state in the form that wear steps need."""
        return self.at(state).wearing

    def steady_friction_cycles(self, state: WearState, most: float) -> float:
        """Return the number of cycles, at most ``most``, in which friction hardly changes; or 1.

        A wear step uses the friction at its beginning.
        """
        cycle, cycles = self.at(state), most
        per_cycle = float(cycle.by_slider.sum())
        while cycles > 1.0:
            friction = self._case.friction.at(state.energy + cycles * per_cycle)
            if abs(friction - cycle.friction) <= FRICTION_CHANGE * cycle.friction:
                return cycles
            cycles *= 0.5
        return min(1.0, most)

    def problem(self, sliders: Jenkins, resolution: Resolution) -> HarmonicBalance:
        """Return the balance of the rig held by ``sliders``."""
        return HarmonicBalance(
            self.rig.model,
            ParallelSliders(sliders),
            self.driving.load,
            resolution,
            self._receptance,
        )

    def loop(self, cycle: ContactCycle, amplitude: float) -> TangentialLoop:
        """Return the half-space loop of an amplitude [mm], from the full tangential problem.

        Raises ContactFailure if it does not converge.
        """
        contact = FrictionalContact(self._contact.half_space, cycle.friction, self._tolerance)
        moments = None if self._tilt == "held" else (0.0, 0.0)
        path = LoopPath(self.load, amplitude, increments=LOOP_INCREMENTS, moments=moments)
        try:
            return march_loop(contact, cycle.state.surfaces.gap, path)
        except LoopFailure as error:
            raise ContactFailure(f"tangential loop: {error}") from error

    # -- steps of at --------------------------------------------------------------------------
    def _solve(self, state: WearState) -> ContactCycle:
        """Return the contact in a state.

        The motion is solved from that of the state before. Raises ContactFailure where contact or
        motion are not found.
        """
        start = state.starts.get(0)
        try:
            slipping = partial_slip_curve(
                *(self._contact, state.surfaces.gap, self.load),
                tolerance=self._tolerance,
                start=start,
                tilt=self._tilt,
            )
        except (PartialSlipError, LoopFailure) as error:
            raise ContactFailure(str(error)) from error
        friction = self._case.friction.at(state.energy)
        sliders = Jenkins(slipping.slider_stiffness, friction, slipping.slider_load)
        motion = self._motion(sliders, state.start)
        at = motion.resolution
        cycle = ParallelSliders(sliders).settle(motion.coefficients, at.basis, at.weights, at.lead)
        path, adjusted = self._path(slipping, sliders, cycle.by_slider)
        wearing = WearingContact(
            self._contact, self._laws, friction, self._cycle(path), self._tolerance, start=motion
        )
        return ContactCycle(
            state, friction, slipping, sliders, motion, cycle.by_slider, path, adjusted, wearing
        )

    def _motion(self, sliders: Jenkins, start: object) -> HarmonicSolution:
        assert start is None or isinstance(start, HarmonicSolution)
        problem = self.problem(sliders, self._resolution)
        motion = problem.solve(self._frequency, self._force, start)
        if not motion.converged:
            raise ContactFailure(
                f"no motion {self.driving.amount.under(self._force)} at "
                f"{self._frequency:g} Hz: {motion.message}"
            )
        return motion

    def _path(self, slipping: PartialSlip, sliders: Jenkins, lost: Array) -> tuple[Array, float]:
        """Return the path of every cell in a cycle, and the factor that equates the energies."""
        limit = sliders.limit
        travel = np.divide(lost, limit, out=np.zeros_like(lost), where=limit > 0.0)
        path = slipping.travelled(travel)
        by_cells = float(np.vdot(slipping.normal.pressure, path)) * self.grid.cell_area
        by_cells *= float(sliders.friction)
        if not by_cells > 0.0:
            return np.zeros(self.grid.shape), 1.0
        factor = float(lost.sum()) / by_cells
        return factor * path, factor

    def _cycle(self, path: Array) -> SlidingCycle:
        """Return a cycle of one increment, as neither load nor pressure changes in the cycle."""
        nothing, pressed = np.zeros(1), np.array([self.load])
        loads = LoadHistory(pressed, *(nothing,) * 7, sliding=np.zeros(1, dtype=bool))
        return SlidingCycle(loads, path[None], drive=Drive.by_forces(self._tilt))
