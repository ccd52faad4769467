"""The contact stage of one interface: its grid, its loads and slips, its wear."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fe_models.mesh import Face, Interface
from fe_models.transfer import FaceTransfer
from sa_solver.contact import ContactState, FrictionalContact
from sa_solver.half_space import HalfSpace
from sa_solver.normal import NormalContact
from sa_solver.types import Array, ElasticPair, Grid, LoadHistory
from wear.full_cycle import march_cycle
from wear.moving import followed, passages
from wear.steppers import (
    ErrorControl,
    Explicit,
    Implicit,
    SecondOrder,
    Stepper,
    advance_cycles,
    first_cycles,
)
from wear.stepping import CycleResult, SlidingCycle, Starts, WearingContact, WearState
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.case.sections import ContactStress, Duration
from workflow.analyses.wear.contact_loops import WornLoop, worn_loop
from workflow.analyses.wear.interface_state import InterfaceState, Spent
from workflow.analyses.wear.load_source import ContactFace, FaceLoads
from workflow.errors import UserError


@dataclass(frozen=True)
class StageSettings:
    """What a contact stage is made from."""

    case: WearCase
    contact: ContactFace


@dataclass(frozen=True)
class CycleTractions:
    """Tractions and slip of one contact over the increments of a closed cycle.

    ``pressure`` ``(t, nx, ny)`` and ``shear`` ``(t, 2, nx, ny)`` on body 2 [MPa] are those at the
    end of an increment, ``slip`` ``(t, 2, nx, ny)`` [mm] that during it. Where slip is the
    structure's (method normal), shear is µp against it and, unknown where nothing slips, 0 there:
    ``unknown`` ``(t,)`` is the share of the normal force on such cells.
    """

    pressure: Array
    shear: Array
    slip: Array
    unknown: Array


@dataclass(frozen=True)
class FirstContact:
    """What the contact of the unworn cycle says: see :class:`wear.stepping.CycleResult`.

    ``energy`` ``(t,)`` [N mm]; ``pressure`` ``(t, nx, ny)`` [MPa]; ``stable_cycles`` the longest
    stable explicit step; ``cycle`` the states at its increments where the half-space has its own
    friction (method full), else empty.
    """

    energy: Array
    pressure: Array
    touches_border: bool
    largest_residual: float
    spent: Spent
    stable_cycles: float
    cycle: tuple[ContactState, ...]

    @property
    def highest_pressure(self) -> float:
        """Largest pressure of all increments [MPa]."""
        return float(self.pressure.max())


@dataclass(frozen=True)
class Wearing:
    """A contact that wears, ``slip`` ``(t, 2, nx, ny)`` [mm], and the cycle of the half-space that
    it comes from (empty: from the structure).
    """

    contact: WearingContact
    slip: Array
    cycle: tuple[ContactState, ...]


class ContactStage:
    """One interface on its grid."""

    def __init__(self, settings: StageSettings) -> None:
        self._case = case = settings.case
        self._contact_face = settings.contact
        self.face = settings.contact.face
        self.grid = settings.contact.grid(case.contact.grid)
        self.transfer = FaceTransfer.between(self.face, self.grid)
        self.pair = ElasticPair(case.material(1), case.material(2))
        half_space = HalfSpace(self.grid, self.pair)
        self._contact = NormalContact(half_space)
        self._frictional: FrictionalContact | None = None
        self._laws = case.wear_of(1).described(), case.wear_of(2).described()
        _check_section(case.stress, self.grid)
        self._stepper = _stepper(case.wear)
        self._spent = Spent()
        self._current: tuple[tuple[Array, ...], Wearing] | None = None

    @property
    def name(self) -> str:
        return self.face.name

    @property
    def remedy(self) -> str:
        """What to do where the contact reaches the border of the grid."""
        return self._contact_face.remedy

    @property
    def coarse_grid(self) -> Grid:
        """A grid with as many cells as the face has nodes."""
        return self._contact_face.grid(self._contact_face.coarse)

    def _gap(self, grid: Grid) -> Array:
        gap = self._contact_face.gap(grid.x, grid.y)
        return np.ascontiguousarray(np.broadcast_to(gap, grid.shape))

    def begin(self, history: FaceLoads) -> tuple[InterfaceState, FirstContact]:
        """The unworn state, and the contact at every loaded increment of the first cycle."""
        unworn = WearState.unworn(self._gap(self.grid))
        state = InterfaceState(
            **vars(unworn), loads=history.loads, slip=history.slip, ends=np.empty((0, 2, 2))
        )
        loaded = np.flatnonzero(history.loads.P > 0.0).tolist()
        before, wearing = self._spent, self._wearing(state)
        result = wearing.contact.cycle(state, loaded)
        depth_rate, volume_rate = result.per_cycle(self.grid.cell_area)
        starts = {t: own.start for t, own in result.states.items()}
        state = replace(
            state,
            depth_rate=depth_rate,
            volume_rate=volume_rate,
            starts=starts,
            ends=self._ends(wearing.slip, starts, history.loads),
        )
        first_step = first_cycles(wearing.contact, state, self._case.wear.cycles)
        states = result.states.values()
        return replace(state, next_cycles=first_step), FirstContact(
            energy=result.energy,
            pressure=self._pressure(result),
            touches_border=any(s.touches_border for s in states),
            largest_residual=max((s.residuals.largest for s in states), default=0.0),
            spent=self._spent_since(before) + Spent(len(states), result.convolutions),
            stable_cycles=wearing.contact.stable_cycles(state),
            cycle=wearing.cycle,
        )

    def follow(self, state: InterfaceState, history: FaceLoads) -> InterfaceState:
        """The state under the loads of a new structural solution."""
        starts = {t: start for t, start in state.starts.items() if history.loads.P[t] > 0.0}
        state = replace(state, loads=history.loads, slip=history.slip, starts=starts)
        if self._case.contact.method == "full":
            return state  # body 2 goes on as the half-space's own slip has it
        ends = self._ends(self.transfer.to_cells(history.slip), starts, history.loads)
        return replace(state, ends=ends)

    def _ends(self, slip: Array, starts: Starts, loads: LoadHistory) -> Array:
        """Where body 2 is before and after each increment, if its motion is to be followed."""
        pressure = np.zeros(self.grid.shape)
        for start in starts.values():
            pressure += start.pressure
        wear, body_1 = self._case.wear, self._case.wear_of(1)
        forced = {"auto": None, "follow": True, "neglect": False}[wear.motion]
        if forced is None and getattr(body_1, "coefficient", None) == 0.0:
            forced = False  # what does not wear looks the same everywhere
        ends = followed(self.grid, slip, pressure, loads.blocks, forced)
        if len(ends) and getattr(body_1.evolution, "scope", None) == "local":
            raise UserError(
                "wear.motion: the surfaces move over each other, and that of body 1 changes from "
                "place to place (evolution.scope: local), which no wear step follows; allowed: "
                "motion: neglect, or scope: global"
            )
        return ends

    def _pressure(self, result: CycleResult) -> Array:
        """Pressure of every increment of a cycle ``(t, nx, ny)``."""
        pressure = np.zeros((len(result.energy), *self.grid.shape))
        for t, state in result.states.items():
            pressure[t] = state.pressure
        return pressure

    def jump(
        self, state: InterfaceState, cycles: float, left: float
    ) -> tuple[InterfaceState, Spent]:
        """Wear ``cycles`` of the ``left`` cycles of the run; also what it took."""
        before = self._spent
        result = advance_cycles(self._stepper, state, cycles, left, self._contact_at)
        after = result.state
        assert isinstance(after, InterfaceState)
        # Friction of the half-space on the new surfaces: for the record now, to wear by next.
        self._wearing(after)
        own = Spent(result.contact_solves, result.convolutions, result.steps)
        return after, own + self._spent_since(before)

    def _contact_at(self, state: WearState) -> WearingContact:
        assert isinstance(state, InterfaceState)
        return self._wearing(state).contact

    def _spent_since(self, before: Spent) -> Spent:
        """What cycles with the half-space's own friction have taken since."""
        now = self._spent
        return Spent(
            now.contact_solves - before.contact_solves, now.convolutions - before.convolutions
        )

    def stable_cycles(self, state: InterfaceState) -> float:
        """Largest stable explicit jump."""
        return self._wearing(state).contact.stable_cycles(state)

    def peak_fields(self, state: InterfaceState, peak: int) -> dict[str, Array]:
        """Pressure, shear and slip at peak load on the present surfaces, for the record."""
        wearing = self._wearing(state)
        if wearing.cycle:
            own = wearing.cycle[peak]
            return {"pressure": own.pressure, "shear": own.shear, "slip": own.slip}
        slip = self.transfer.to_cells(state.slip[peak])
        pressure = wearing.contact.solve(state.surfaces, peak, state.starts.get(peak)).pressure
        shear = self._sliding_shear(pressure, slip, state.energy)
        return {"pressure": pressure, "shear": shear, "slip": slip}

    def unworn_tractions(self, history: FaceLoads, first: FirstContact) -> CycleTractions:
        """Tractions of the first cycle, solved already."""
        if first.cycle:
            return _own_tractions(first.cycle)
        return self._structures_tractions(history.slip, first.pressure, 0.0)

    def tractions(self, state: InterfaceState) -> CycleTractions:
        """Tractions of a cycle on the present surfaces."""
        wearing = self._wearing(state)
        if wearing.cycle:
            return _own_tractions(wearing.cycle)
        loaded = np.flatnonzero(state.loads.P > 0.0).tolist()
        result = wearing.contact.cycle(state, loaded)
        return self._structures_tractions(state.slip, self._pressure(result), state.energy)

    def _structures_tractions(
        self, nodal_slip: Array, pressure: Array, energy: float
    ) -> CycleTractions:
        """Those where slip is the structure's, once so much ``energy`` [N mm] is dissipated."""
        slip = self.transfer.to_cells(nodal_slip)
        stuck = ~slip.any(axis=1)
        force = pressure.sum(axis=(1, 2))
        held = np.where(stuck, pressure, 0.0).sum(axis=(1, 2))
        unknown = np.divide(held, force, out=np.zeros_like(force), where=force > 0.0)
        pairs = zip(pressure, slip, strict=True)
        shear = np.stack([self._sliding_shear(p, s, energy) for p, s in pairs])
        return CycleTractions(pressure, shear, slip, unknown)

    def _sliding_shear(self, pressure: Array, slip: Array, energy: float) -> Array:
        """µp against ``slip`` ``(2, nx, ny)``; 0 where nothing slips."""
        size = np.hypot(*slip)
        opposing = np.divide(-slip, size, out=np.zeros_like(slip), where=size > 0.0)
        shear: Array = self._case.friction.at(energy) * pressure * opposing
        return shear

    def coarse_pressure(self, loads: LoadHistory, peak: int) -> Array:
        """Unworn peak pressure on a grid as coarse as the mesh of the structure."""
        grid = self.coarse_grid
        at_peak = (float(column[peak]) for column in (loads.P, loads.Mx, loads.My))
        contact = NormalContact(HalfSpace(grid, self.pair))
        return contact.solve(self._gap(grid), *at_peak).pressure

    def nodal_depth(self, state: InterfaceState) -> Array:
        """Worn depth of both bodies together at the nodes of the face, volume kept."""
        return self.transfer.to_nodes(state.surfaces.depth)

    def face_of(self, body: Literal[1, 2]) -> Face:
        """The face of one body, with its own nodes."""
        return self.face.face(body) if isinstance(self.face, Interface) else self.face

    def depths_of_bodies(self, state: InterfaceState) -> tuple[Array, Array]:
        """Worn depths of body 1 and body 2 at the nodes of their own faces, volumes kept."""
        face_1 = self.face_of(1)
        own = self.transfer if face_1 is self.face else FaceTransfer.between(face_1, self.grid)
        surfaces = state.surfaces
        return own.to_nodes(surfaces.depth_1), self.transfer.to_nodes(surfaces.depth_2)

    def loop(self, state: InterfaceState, peak: int) -> WornLoop:
        """The tangential loop that the case asks for, on the present surfaces."""
        friction = self._case.friction.at(state.energy)
        return worn_loop(self._rubbed(friction), self._case.loops, self.name, state, peak)

    def _rubbed(self, friction: float) -> FrictionalContact:
        """The contact with the half-space's own friction."""
        if self._frictional is None or self._frictional.friction != friction:
            contact, half_space = self._case.contact, self._contact.half_space
            self._frictional = FrictionalContact(
                half_space, friction, contact.tolerance, contact.gross_slip
            )
        return self._frictional

    def _wearing(self, state: InterfaceState) -> Wearing:
        """The contact under the state's loads and slips, kept until these change.

        Slips of the structure change with its solution, those of the half-space with wear.
        """
        full = self._case.contact.method == "full"
        friction = self._case.friction.at(state.energy)
        columns = np.array([*vars(state.loads).values()], dtype=float)
        key: tuple[Array, ...] = columns, state.slip, state.ends, np.array([friction])
        if full:
            key = *key, state.surfaces.gap, state.surfaces.depth_1
        if self._current is not None and all(map(np.array_equal, self._current[0], key)):
            return self._current[1]
        ways = passages(self.grid, state.ends)
        slip = self.transfer.to_cells(state.slip)
        sliding = SlidingCycle(state.loads, np.hypot(slip[:, 0], slip[:, 1]), None, ways)
        cycle: tuple[ContactState, ...] = ()
        if full:
            cycle = self._rubbing(state, sliding, friction)
            slip = np.stack([own.slip for own in cycle])
            sizes = np.hypot(slip[:, 0], slip[:, 1])
            sliding = replace(sliding, slip=sizes, uplift=self._uplift(cycle))
        contact = WearingContact(
            self._contact, self._laws, friction, sliding, self._case.contact.tolerance
        )
        self._current = key, Wearing(contact, slip, cycle)
        return self._current[1]

    def _rubbing(
        self, state: InterfaceState, sliding: SlidingCycle, friction: float
    ) -> tuple[ContactState, ...]:
        """The closed cycle with the half-space's own friction, on the present surfaces."""
        gaps = np.stack([sliding.gap(state.surfaces, t) for t in range(len(state.loads))])
        motion = state.slip.mean(axis=2) if self._contact_face.driven else None
        cycle = tuple(march_cycle(self._rubbed(friction), gaps, state.loads, motion))
        self._spent += Spent(len(cycle), sum(own.convolutions for own in cycle))
        return cycle

    def _uplift(self, cycle: tuple[ContactState, ...]) -> Array | None:
        """Normal displacement under the shear of each increment; None for similar bodies."""
        if self.pair.similar:
            return None
        half_space = self._contact.half_space
        return np.stack([half_space.normal_under_shear(own.shear) for own in cycle])


def _stepper(wear: Duration) -> Stepper:
    """What advances the surfaces of a contact, as the case asks for."""
    step = wear.step
    if step.kind == "explicit":
        return Explicit(step.fraction)
    control = None
    if step.automatic:
        relative = wear.tolerance if wear.depth_tolerance is None else None
        control = ErrorControl(relative, wear.depth_tolerance)
    return Implicit(control) if step.kind == "implicit" else SecondOrder(control)


def _check_section(stress: ContactStress, grid: Grid) -> None:
    """Refuse at once a section that could not be drawn at the end."""
    if stress.section == "none":
        return
    if stress.section == "y" and grid.line:
        raise UserError("stress.section: y: a line contact has no length along y; allowed: x, none")
    reach = 0.5 * grid.size[1 if stress.section == "x" else 0]
    if abs(stress.at) > reach:
        raise UserError(
            f"stress.at: {stress.at:g} mm is off the contact's grid; "
            f"allowed: {-reach:.4g} to {reach:.4g} mm"
        )


def _own_tractions(cycle: tuple[ContactState, ...]) -> CycleTractions:
    """Tractions where the half-space has its own friction: known everywhere."""
    pressure, shear, slip = (
        np.stack([getattr(own, name) for own in cycle]) for name in ("pressure", "shear", "slip")
    )
    return CycleTractions(pressure, shear, slip, np.zeros(len(cycle)))
