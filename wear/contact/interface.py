"""Contact of one interface: its grid, its loads and slips, and its wear.

Loads and slips come from outside, over one closed cycle (:class:`FaceLoads`). Slips are either
those of the structure's nodes, or those that the half-space computes itself under the same loads
(wear methods 1 and 2 of Gallego 2007); the latter are computed again on every worn surface.
:class:`InterfaceSettings` describes an interface, :class:`InterfaceState` is its state between two
jumps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactState
from sa_solver.cycles.increments import slip_of_states
from sa_solver.errors import InputError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.ties import first_largest
from sa_solver.types import Array, Mask
from wear.contact.face_loads import FaceLoads
from wear.contact.link import StructureLink, linked
from wear.contact.moving import followed, passages
from wear.contact.settings import InterfaceSettings
from wear.contact.tractions import ContactFields, CycleTractions, acting_slip
from wear.laws import EvolvingLaw
from wear.steps.full_cycle import CycleStart, march_cycle, slip_around, slip_known, starts_near
from wear.steps.marching import advance_cycles, rest
from wear.steps.steppers import first_cycles
from wear.steps.stepping import (
    CycleResult,
    SlidingCycle,
    Starts,
    WearingContact,
    WearState,
)
from wear.worn import Cost

EVEN_FRICTION = 0.05
"""Largest relative change of friction in a part of a wear jump. Steps take friction from their
beginning or middle: where it halves within a tenth of a run, 0.4 % are left in the energy.
"""

EVEN_SAMPLES = np.linspace(0.0, 1.0, 33)
"""Shares of the energy of a part at which friction is compared."""


class MotionError(InputError):
    """Surfaces move over each other under a wear law that no wear step can follow then."""


# --- state ----------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class InterfaceState(WearState):
    """State of an interface between two jumps.

    Parameters
    ----------
    loads, slip, link
        Loads, nodal slip ``(t, 2, n)`` [mm] and link of the last solution of the load source.
    pressed
        Distribution of the largest load over the nodes at that solution ``(n,)``, as shares; empty
        where the source does not know its nodes.
    paths
        Paths of body 2 about its position in each increment ``(t, 3, 2)`` [mm]; empty where its
        motion is too small to follow (:func:`wear.contact.moving.followed`).
    start
        A :class:`wear.steps.full_cycle.CycleStart` where the half-space computes its own cycle
        (method full).
    """

    loads: LoadHistory
    slip: Array
    link: StructureLink
    pressed: Array
    paths: Array


# --- result of the first cycle --------------------------------------------------------------------


@dataclass(frozen=True)
class FirstContact:
    """Result of the contact over the unworn cycle.

    Parameters
    ----------
    energy
        Energy dissipated in each increment ``(t,)`` [N mm].
    pressure
        Pressure of each increment ``(t, nx, ny)`` [MPa].
    touches_border
        Whether the contact reaches the border of the grid in any increment.
    largest_residual
        Largest residual of the contact solver.
    cost
        Cost of the solution.
    stable_cycles
        Longest stable explicit wear step [cycles].
    link
        Link to the unworn structure.
    cycle
        Contact states of the increments where the half-space has its own friction (method full),
        else empty.
    """

    energy: Array
    pressure: Array
    touches_border: bool
    largest_residual: float
    cost: Cost
    stable_cycles: float
    link: StructureLink
    cycle: tuple[ContactState, ...]


# --- the contact ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Loaded:
    """A contact under its loads, with the slip that it wears by.

    ``slip`` is ``(t, 2, nx, ny)`` [mm]; ``cycle`` the cycle of the half-space that gave it, or
    empty if it is that of the loads.
    """

    contact: WearingContact
    slip: Array
    cycle: tuple[ContactState, ...]


class InterfaceContact:
    """Contact of one interface on its grid.

    All methods raise :class:`~wear.steps.stepping.ContactFailure` where a contact problem does not
    converge.

    Examples
    --------
    The wear of a sliding cylinder in its first cycle by Archard's K s P / H, and the longest stable
    explicit step:

    >>> import numpy as np
    >>> from sa_solver import ElasticPair, Grid, LoadHistory, Material
    >>> from wear import *
    >>> grid, steel, law = Grid.line_contact(1.4, 70), Material(210e3, 0.3), ArchardLaw(1e-4,
    ...     3000.0)
    >>> contact = InterfaceContact(InterfaceSettings(
    ...     name="cylinder", grid=grid, gap=grid.x**2 / 20.0, transfer=CellNodes(grid),
    ...     pair=ElasticPair(steel, steel), laws=(law, law),
    ...     friction=lambda energy: 0.5, stepper=ImplicitStepper(),
    ... ))
    >>> zero, slip = np.zeros(1), np.zeros((1, 2, 70))
    >>> slip[:, 0] = 0.04
    >>> loads = CycleLoads(LoadHistory(zero + 50.0, *[zero] * 7, sliding=zero == 0.0), slip)
    >>> state, first = contact.begin(loads, cycles=1e5)
    >>> print(f"{state.volume_rate:.3e} mm^3/mm of {2 * 1e-4 * 0.04 * 50.0 / 3000.0:.3e}")
    1.333e-07 mm^3/mm of 1.333e-07
    >>> print(f"explicit steps of up to {first.stable_cycles:.0f} cycles")
    explicit steps of up to 96 cycles
    """

    def __init__(self, settings: InterfaceSettings) -> None:
        self.settings, self.name = settings, settings.name
        self.grid, self.transfer, self.pair = settings.grid, settings.transfer, settings.pair
        self._contact = NormalContact(HalfSpace(settings.grid, settings.pair))
        self._frictional: FrictionalContact | None = None
        self._spent = self._reported = Cost()
        self._current: tuple[tuple[Array, ...], _Loaded] | None = None
        # Progress callback, called after each increment of a half-space cycle with friction.
        self.solved: Callable[[], None] = lambda: None

    # -- wear ------------------------------------------------------------------------------------
    def begin(self, history: FaceLoads, cycles: float) -> tuple[InterfaceState, FirstContact]:
        """Return the unworn state of a run of ``cycles``, and the contact of its first cycle.

        The contact is solved in every loaded increment. Raise :class:`MotionError` where the
        surfaces move over each other under a law that cannot follow.
        """
        state = InterfaceState.unworn(
            self.settings.gap,
            loads=history.loads,
            slip=history.slip,
            link=self._link(history),
            pressed=np.empty(0),
            paths=np.empty((0, 3, 2)),
        )
        loaded = self._loaded(state)
        if self.pair.similar:
            # Friction changes the pressure of dissimilar bodies, so that only the states of
            # similar bodies are solutions of the normal contact.
            solved = {increment: end.pressed for increment, end in enumerate(loaded.cycle)}
            state = replace(state, starts=solved)
        result = loaded.contact.cycle(state, np.flatnonzero(history.loads.P > 0.0).tolist())
        depth_rate, volume_rate = result.per_cycle(self.grid.cell_area)
        starts = {t: pressed.start for t, pressed in result.states.items()}
        known = slip_known(loaded.cycle, history.loads)
        state = replace(
            state,
            depth_rate=depth_rate,
            volume_rate=volume_rate,
            starts=starts,
            start=loaded.contact.start,
            pressed=self._pressed(starts, history),
            paths=self._paths(loaded.slip, starts, history.loads, known),
        )
        first_step = first_cycles(loaded.contact, state, cycles)
        states, pressure = result.states.values(), self._pressure(result)
        work = self._unworn_tractions(history, pressure, loaded.cycle).work.sum(axis=(1, 2))
        return replace(state, next_cycles=first_step), FirstContact(
            energy=history.loads.share * work * self.grid.cell_area,
            pressure=pressure,
            touches_border=any(s.touches_border for s in states),
            largest_residual=max((s.residuals.largest for s in states), default=0.0),
            cost=self._new_cost() + Cost(len(states), result.convolutions),
            stable_cycles=loaded.contact.stable_cycles(state),
            link=state.link,
            cycle=loaded.cycle,
        )

    def follow(self, state: InterfaceState, history: FaceLoads) -> tuple[InterfaceState, Cost]:
        """Return the state under the loads of a new solution, and the cost.

        Raise :class:`MotionError` as :meth:`begin` does.
        """
        return self._followed(state, history, self._link(history)), self._new_cost()

    def _followed(
        self, state: InterfaceState, history: FaceLoads, link: StructureLink
    ) -> InterfaceState:
        if isinstance(state.coarse, InterfaceState):
            state = replace(state, coarse=self._followed(state.coarse, history, link))
        starts = {t: start for t, start in state.starts.items() if history.loads.P[t] > 0.0}
        state = replace(
            state,
            loads=history.loads,
            slip=history.slip,
            link=link,
            pressed=self._pressed(starts, history),
            starts=starts,
        )
        if self.settings.method == "full":
            return state  # The half-space's own slip determines the motion of body 2.
        paths = self._paths(self.transfer.to_cells(history.slip), starts, history.loads)
        return replace(state, paths=paths)

    def jump(
        self, state: InterfaceState, cycles: float, left: float
    ) -> tuple[InterfaceState, Cost]:
        """Wear ``cycles`` of the ``left`` cycles of the run, and return the state and the cost.

        A jump in which friction changes much is worn in parts in which it changes little.
        """
        cost, done = Cost(), 0.0
        while (remaining := rest(cycles, done)) > 0.0:
            part = self._of_even_friction(state, remaining)
            worn = advance_cycles(self.settings.stepper, state, part, left - done, self.wearing)
            assert isinstance(worn.state, InterfaceState)
            state, cost, done = worn.state, cost + worn.cost, done + part
        return state, cost + self._new_cost()

    def _of_even_friction(self, state: InterfaceState, cycles: float) -> float:
        """Return the length of a part of ``cycles`` in which friction changes little [cycles]."""
        friction = self.settings.friction
        energy = self._loaded(state).contact.energy_per_cycle(state) * EVEN_SAMPLES
        while cycles > 1.0:
            passed = np.array([friction(state.energy + float(e)) for e in cycles * energy])
            if np.ptp(passed) <= EVEN_FRICTION * passed.max():
                break
            cycles = max(1.0, 0.5 * cycles)
        return cycles

    def stable_cycles(self, state: InterfaceState) -> float:
        """Return the longest stable explicit step [cycles]."""
        return self._loaded(state).contact.stable_cycles(state)

    @property
    def areas(self) -> float:
        """Area of a cell of the worn surfaces [mm²]."""
        return self.grid.cell_area

    def volume(self, depth: Array) -> float:
        """Return the volume of a worn ``depth`` ``(nx, ny)`` [mm³]."""
        return float(depth.sum()) * self.grid.cell_area

    def on_cells(self, field: Array) -> Array:
        """Return a field of the worn surfaces on the cells of the grid: the field itself."""
        return field

    def at_nodes(self, field: Array) -> Array:
        """Return a field of the worn surfaces ``(nx, ny)`` at the nodes of the face ``(n,)``."""
        return self.transfer.to_nodes(field)

    def moved(self, state: InterfaceState) -> float:
        """Return the share of the load that wear has moved since the loads were last solved.

        It is 0 where the source does not know its nodes.
        """
        if not state.pressed.size:
            return 0.0
        now = self._shared_out(state.starts, state.loads)
        return 0.5 * float(np.abs(now - state.pressed).sum())

    # -- tractions ---------------------------------------------------------------------------------
    def fields(self, state: InterfaceState, increment: int) -> ContactFields:
        """Return tractions and slip of an increment on the present surfaces."""
        loaded = self._loaded(state)
        if loaded.cycle:
            solved = loaded.cycle[increment]
            return ContactFields(solved.pressure, solved.shear, solved.slip)
        slip, start = self.transfer.to_cells(state.slip[increment]), state.starts.get(increment)
        pressure = loaded.contact.solve(state.surfaces, increment, start).pressure
        return ContactFields(pressure, self._sliding_shear(pressure, slip, state.energy), slip)

    def tractions(self, state: InterfaceState) -> CycleTractions:
        """Return the tractions of a cycle on the present surfaces."""
        loaded = self._loaded(state)
        if loaded.cycle:
            return self._half_space_tractions(state.loads, loaded.cycle, state.energy)
        result = loaded.contact.cycle(state, np.flatnonzero(state.loads.P > 0.0).tolist())
        return self._given_tractions(state, self._pressure(result), state.energy)

    def unworn_tractions(self, history: FaceLoads, first: FirstContact) -> CycleTractions:
        """Return the tractions of the first cycle, which is solved already."""
        return self._unworn_tractions(history, first.pressure, first.cycle)

    def _unworn_tractions(
        self, history: FaceLoads, pressure: Array, cycle: tuple[ContactState, ...]
    ) -> CycleTractions:
        if cycle:
            return self._half_space_tractions(history.loads, cycle, 0.0)
        return self._given_tractions(history, pressure, 0.0)

    def frictional(self, energy: float) -> FrictionalContact:
        """Return the half-space contact with friction after ``energy`` [N mm] is dissipated."""
        friction = self.settings.friction(energy)
        if self._frictional is None or self._frictional.friction != friction:
            self._frictional = FrictionalContact(
                self._contact.half_space,
                friction,
                self.settings.shear_tolerance,
                self.settings.gross_slip,
            )
        return self._frictional

    def _new_cost(self) -> Cost:
        """Return the cost of half-space cycles and links since the last call."""
        cost, self._reported = self._spent - self._reported, self._spent
        return cost

    # -- loads -------------------------------------------------------------------------------------
    def _link(self, history: FaceLoads) -> StructureLink:
        """Return the link that corrects the half-space for the structure of the loads."""
        settings, force, displacement = self.settings, history.force, history.displacement
        if settings.link == "half_space" or force is None or displacement is None:
            return StructureLink.none()
        half_space, shear = self._contact.half_space, settings.method == "full"
        before = half_space.count
        link = linked(half_space, self.transfer, history.loads, force, displacement, shear)
        self._spent += Cost(0, half_space.count - before)
        return link.level() if settings.drive.tilt == "free" else link

    def wearing(self, state: WearState) -> WearingContact:
        """Return the contact that wears under the loads and slips of a state."""
        assert isinstance(state, InterfaceState)
        return self._loaded(state).contact

    def _loaded(self, state: InterfaceState) -> _Loaded:
        """Return the contact under the loads and slips of a state, cached until they change.

        Slips of the loads change with a new solution, slips of the half-space with wear.
        """
        settings, friction = self.settings, self.settings.friction(state.energy)
        columns = np.array([*vars(state.loads).values()], dtype=float)
        key: tuple[Array, ...] = columns, state.slip, state.paths, np.array([friction])
        key = *key, state.link.coefficients, state.link.region
        if settings.method == "full":
            # The start values affect the result by rounding, which a resumed run must reproduce.
            starts = [start.pressure for start in state.starts.values()]
            key = *key, state.surfaces.gap, state.surfaces.depth_1, np.array([*state.starts])
            key = *key, *starts, *(vars(state.start).values() if state.start else ())
        if self._current is not None and all(map(np.array_equal, self._current[0], key)):
            return self._current[1]
        slip, ways = self.transfer.to_cells(state.slip), passages(self.grid, state.paths)
        acting = acting_slip(slip, state.loads)
        moved = state.link.fields(self.transfer.places) if state.link.corrects else None
        uplift = None if moved is None else moved[:, 2]
        sliding = SlidingCycle(state.loads, acting, uplift, ways, settings.drive)
        cycle: tuple[ContactState, ...] = ()
        if settings.method == "full":
            cycle = self._half_space_cycle(state, sliding, moved)
            slip = np.stack([increment.slip for increment in cycle])
            loads, sizes = state.loads, slip_around(cycle, state.loads, self.grid)
            acting = slip_of_states(sizes, loads.P > 0.0, loads.missions)
            sliding = replace(sliding, slip=acting)
            if not self.pair.similar:
                lift = self._contact.half_space.normal_under_shear
                lifted = np.stack([lift(increment.shear) for increment in cycle])
                sliding = replace(sliding, uplift=lifted if uplift is None else uplift + lifted)
        contact = WearingContact(
            *(self._contact, settings.laws, friction, sliding, settings.tolerance),
            start=CycleStart.of(cycle) if cycle else None,
        )
        self._current = key, _Loaded(contact, slip, cycle)
        return self._current[1]

    def _half_space_cycle(
        self, state: InterfaceState, sliding: SlidingCycle, moved: Array | None
    ) -> tuple[ContactState, ...]:
        """Return the closed cycle with the half-space's own friction.

        ``moved`` ``(t, 3, nx, ny)`` [mm] is the displacement of the surfaces by the link, if any.
        """
        gaps = np.stack([sliding.gap(state.surfaces, t) for t in range(len(state.loads))])
        contact = self.frictional(state.energy)
        known = state.start if isinstance(state.start, CycleStart) else None
        drive, starts = self.settings.drive, starts_near(known, state.starts, len(state.loads))
        cycle = tuple(march_cycle(contact, gaps, state.loads, drive, moved, starts, self.solved))
        self._spent += Cost(len(cycle), sum(increment.convolutions for increment in cycle))
        return cycle

    def _paths(
        self, slip: Array, starts: Starts, loads: LoadHistory, known: Mask | None = None
    ) -> Array:
        """Return the paths of body 2 over which the states act, empty if it is not followed."""
        pressure = sum((start.pressure for start in starts.values()), np.zeros(self.grid.shape))
        law, forced = self.settings.laws[0], self.settings.follow
        paths = followed(self.grid, slip, pressure, loads.missions, forced, known)
        if len(paths) and isinstance(law, EvolvingLaw) and law.scope == "local":
            raise MotionError(
                "the surfaces move over each other, and the wear law of body 1 changes with the "
                "local energy, which wear steps cannot follow: neglect the motion, or let the law "
                "change with the energy of the whole contact"
            )
        return paths

    def _pressed(self, starts: Starts, history: FaceLoads) -> Array:
        """Return the distribution of the largest load, as in :class:`InterfaceState`."""
        return np.empty(0) if history.force is None else self._shared_out(starts, history.loads)

    def _shared_out(self, starts: Starts, loads: LoadHistory) -> Array:
        """Return the share of the largest of ``loads`` on every node ``(n,)``, 0 without load."""
        start = starts.get(first_largest(loads.P))
        if start is None:
            return np.zeros(len(self.transfer.areas))
        forces = self.transfer.to_nodes(start.pressure) * self.transfer.areas
        shares: Array = forces / forces.sum()
        return shares

    # -- tractions of given slips ------------------------------------------------------------------
    def _pressure(self, result: CycleResult) -> Array:
        """Return the pressure of every increment of a cycle ``(t, nx, ny)`` [MPa]."""
        pressure = np.zeros((len(result.energy), *self.grid.shape))
        for t, state in result.states.items():
            pressure[t] = state.pressure
        return pressure

    def _given_tractions(
        self, loads: FaceLoads | InterfaceState, pressure: Array, energy: float
    ) -> CycleTractions:
        """Return the tractions under the slip of the loads, after a dissipated ``energy``."""
        slip = self.transfer.to_cells(loads.slip)
        stuck = ~slip.any(axis=1)
        force = pressure.sum(axis=(1, 2))
        held = np.where(stuck, pressure, 0.0).sum(axis=(1, 2))
        unknown = np.divide(held, force, out=np.zeros_like(force), where=force > 0.0)
        shear = self._sliding_shear(pressure, slip, energy)
        friction = self.settings.friction(energy)
        return CycleTractions(loads.loads, friction, pressure, shear, slip, unknown)

    def _half_space_tractions(
        self, loads: LoadHistory, cycle: tuple[ContactState, ...], energy: float
    ) -> CycleTractions:
        """Return the tractions of a half-space cycle with its own friction."""
        pressure, shear, slip = (
            np.stack([getattr(increment, name) for increment in cycle])
            for name in ("pressure", "shear", "slip")
        )
        friction = self.settings.friction(energy)
        return CycleTractions(loads, friction, pressure, shear, slip, np.zeros(len(cycle)))

    def _sliding_shear(self, pressure: Array, slip: Array, energy: float) -> Array:
        """Return the shear µp against ``slip`` ``(..., 2, nx, ny)``, 0 where nothing slips."""
        size = np.hypot(slip[..., 0, :, :], slip[..., 1, :, :])[..., None, :, :]
        opposing = np.divide(-slip, size, out=np.zeros_like(slip), where=size > 0.0)
        shear: Array = self.settings.friction(energy) * pressure[..., None, :, :] * opposing
        return shear
