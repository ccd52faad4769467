"""Wear steps of one interface: pressures of a cycle, and the depth worn in many equal cycles.

Pressure comes from the half-space solver under the resultants of each increment. Slip is given: by
the structure (wear method 1 of Gallego 2007) or by the half-space (method 2, see
:mod:`wear.steps.full_cycle`), and does not change during a step. Where the contact slips, q = µ p.

With w_t the depth per pressure and cycle of increment t (:mod:`wear.laws`) and p_t(h) its pressure
on the worn gap h, wear is dh/dN = Σ_t w_t p_t(h). This equation is stiff, since short waves of h
are pressed away at once. There are three kinds of steps; :mod:`wear.steps.steppers` chooses their
length.

- Explicit Euler uses the pressures of the surfaces before the step. It is stable below a limit.
- Implicit Euler takes the increments one after the other, each at the pressure at its end: the
  depth of an increment enters its contact problem as the local compliance w_t ΔN. It is stable at
  any length.
- Second order takes all increments over half the step and back in reverse order over the other half
  (Strang 1968, doi:10.1137/0705041), each by the two implicit stages of Alexander's method
  (1977, doi:10.1137/0714068; L-stable). Both stages have positive weights, so that nothing ever
  grows back and energies add up to the volume.

Where the surfaces move over each other, body 1 wears along its path, and the local compliance is
only an approximation: no step is then better than first order.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from sa_solver.errors import ConvergenceError, InputError
from sa_solver.half_space.influence import Z
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.normal.state import NormalStart, NormalState
from sa_solver.rigid_modes import NORMAL
from sa_solver.ties import SAME, first_largest
from sa_solver.types import Array, Grid
from wear.contact.drive import Drive
from wear.contact.moving import Passage, TravelError
from wear.laws import SlidingConditions, WearLaw
from wear.surfaces import Surfaces
from wear.worn import Cost, WearStep, WornState

GAMMA = 1.0 - np.sqrt(0.5)
"""Weight of the second stage of Alexander's method, and the length of each stage over the step."""

States = dict[int, NormalState]
Starts = dict[int, NormalStart]


class ContactFailure(ConvergenceError):
    """A contact problem did not converge; the message is that of the half-space solver."""


@contextmanager
def failures_of(name: str) -> Iterator[None]:
    """Prefix the message of any :class:`ContactFailure` with the name of the interface."""
    try:
        yield
    except ContactFailure as error:
        raise ContactFailure(f"{name}: {error}") from error


@dataclass(frozen=True)
class SlidingCycle:
    """One closed cycle of loads and slips that wears a contact.

    Parameters
    ----------
    loads
        Resultants of the cycle.
    slip
        Size of the slip in each increment ``(t, nx, ny)`` [mm].
    uplift
        Normal displacement due to shear and to the structure ``(t, nx, ny)`` [mm]; None: none.
    passages
        Motion of body 2 over body 1 in each increment; None where it is too small to matter.
    drive
        Motions imposed in place of the forces of the loads.
    """

    loads: LoadHistory
    slip: Array
    uplift: Array | None = None
    passages: tuple[Passage, ...] | None = None
    drive: Drive = field(default_factory=Drive)

    def gap(self, surfaces: Surfaces, increment: int) -> Array:
        """Return the gap before loading ``(nx, ny)`` [mm] at an increment's position of body 2."""
        gap = surfaces.gap
        if self.passages is not None:
            seen = self.passages[increment].carry(surfaces.depth_1)
            gap = surfaces.initial_gap + surfaces.depth_2 + seen
        return gap if self.uplift is None else gap + self.uplift[increment]

    def midway(self, other: SlidingCycle) -> SlidingCycle:
        """Return the mean of two cycles with the same loads and passages."""
        uplift = None
        if self.uplift is not None and other.uplift is not None:
            uplift = 0.5 * (self.uplift + other.uplift)
        return replace(self, slip=0.5 * (self.slip + other.slip), uplift=uplift)


@dataclass(frozen=True)
class CycleResult:
    """Solution of a cycle on given surfaces.

    Parameters
    ----------
    states
        Contact states by increment.
    energy
        Energy dissipated by each increment of a mean cycle ``(t,)`` [N mm].
    depth_1, depth_2
        Depths worn per mean cycle ``(nx, ny)`` [mm].
    """

    states: States
    energy: Array
    depth_1: Array
    depth_2: Array

    def per_cycle(self, cell_area: float) -> tuple[float, float]:
        """Return the largest depth [mm] and the volume of both bodies [mm³] worn per cycle."""
        depth = max(self.depth_1.max(), self.depth_2.max())
        return float(depth), float((self.depth_1 + self.depth_2).sum() * cell_area)

    @property
    def convolutions(self) -> int:
        """Number of convolutions that the solution took."""
        return sum(state.convolutions for state in self.states.values())


@dataclass(frozen=True)
class WearState(WornState):
    """State of a wearing half-space contact between two steps.

    Fields are ``(nx, ny)``, one value per cell. ``starts`` are starting points of the contact
    solver by increment, and ``start`` is that of the half-space's own cycle.
    """

    starts: Starts = field(default_factory=dict)
    start: object = None


@dataclass(frozen=True, eq=False)
class WearingContact:
    """One interface that wears under a ``sliding`` cycle.

    Parameters
    ----------
    contact
        Normal contact on the grid.
    laws
        Wear laws of body 1 and body 2.
    friction
        Coulomb's coefficient of friction.
    sliding
        Loads and slips of the cycle.
    tolerance
        Relative tolerance of the contact solver.
    start
        Starting point for the cycle of surfaces that differ little.
    """

    contact: NormalContact
    laws: tuple[WearLaw, WearLaw]
    friction: float
    sliding: SlidingCycle
    tolerance: float
    start: object = None

    @property
    def grid(self) -> Grid:
        return self.contact.grid

    def midway(self, other: WearingContact) -> WearingContact:
        """Return the contact under the mean of both cycles."""
        friction = 0.5 * (self.friction + other.friction)
        return replace(self, friction=friction, sliding=self.sliding.midway(other.sliding))

    @cached_property
    def dissipating(self) -> list[int]:
        """Increments with load and slip, in cyclic order; the largest load comes last."""
        loads = self.sliding.loads
        works = (loads.P > 0.0) & (loads.share > 0.0) & self.sliding.slip.any(axis=(1, 2))
        count, heaviest = len(loads), first_largest(loads.P)
        order = [(heaviest + 1 + k) % count for k in range(count)]
        return [t for t in order if works[t]]

    # -- rates --------------------------------------------------------------------------------
    def depth_per_pressure(self, state: WearState, cycles: float = 0.0) -> tuple[Array, Array]:
        """Return the depth per pressure of both bodies over a step, ``(t, nx, ny)`` each.

        In mm/MPa per mean cycle. Laws that change with energy receive the energy of the state and
        that expected after ``cycles`` at its pressures.
        """
        surfaces, (law_1, law_2) = state.surfaces, self.laws
        work_1, work_2 = (cycles * work for work in self._work(state.starts))
        energies = state.energy, state.energy + float(work_2.sum()) * self.grid.cell_area
        ends_1 = surfaces.work_1, surfaces.work_1 + work_1
        ends_2 = surfaces.work_2, surfaces.work_2 + work_2
        return (
            self._by_mission(law_1, ends_1, energies),
            self._by_mission(law_2, ends_2, energies),
        )

    def _by_mission(
        self, law: WearLaw, work: tuple[Array, Array], energies: tuple[float, float]
    ) -> Array:
        """Return the depth per pressure of one body, each mission separately and by its share."""
        loads, slip = self.sliding.loads, self.sliding.slip
        parts = [
            law.depth_per_pressure(SlidingConditions(slip[mission], self.friction, work, energies))
            for mission in loads.missions
        ]
        if any(np.shape(p) != slip[m].shape for p, m in zip(parts, loads.missions, strict=True)):
            raise InputError(
                f"{type(law).__name__} returns depths per pressure of shape {np.shape(parts[0])}: "
                "give one for each increment and cell, as the slip has"
            )
        depth: Array = loads.share[:, None, None] * np.concatenate(parts)
        return depth

    def stable_cycles(self, state: WearState, cycles: float = 0.0) -> float:
        """Return the longest explicit step in which the shortest waves of the grid do not grow.

        A mode of compliance λ is multiplied by 1 - w ΔN/λ per step, where w is the depth of both
        bodies per pressure and cycle over all increments that press there. The limit is w ΔN = 2
        λ_min. Where the last pressures are unknown all increments count. Laws that change with
        energy are those of a step of ``cycles``.
        """
        per_pressure = np.add(*self.depth_per_pressure(state, cycles))
        for t, start in state.starts.items():
            per_pressure[t] *= start.pressure > 0.0
        fastest = float(per_pressure.sum(axis=0).max())
        softest = float(self.contact.half_space.symbol(Z, Z).min())
        return 2.0 * softest / fastest if fastest > 0.0 else np.inf

    def comparable_cycles(self, state: WearState) -> float:
        """Return the longest second-order step whose halves still show its error [cycles].

        A step of first order may be twice as long. The result is infinite if all increments are the
        same: these may wear together.

        Increments wear one after the other. In a step in which one of them presses away waves as
        long as the contact, the last one determines the surfaces whatever the length of the step.
        With the compliance λ = L/π E* of a wave of the contact's length L, and w of one increment,
        a step with w ΔN = x λ has an error of order p of about (x/(1 + x))^p. The difference
        between the step and its two halves is then 0.42 times the value expected from the order (p
        = 2, x = 1), or 0.33 times (p = 1, x = 2), and falls beyond.
        """
        working, sliding = self.dissipating, self.sliding
        wear = np.add(*self.depth_per_pressure(state))
        pressing = sliding.drive.values(sliding.loads)[:, list(NORMAL)].T
        imposed = (values[working] for values in (*pressing, wear))
        lifts = () if sliding.uplift is None else (sliding.uplift[working],)
        alike = sliding.passages is None and all(
            np.allclose(values, values[:1], rtol=SAME, atol=SAME * np.abs(values).max(initial=0.0))
            for values in (*imposed, *lifts)
        )
        if alike or not wear.any():
            return np.inf
        pressures = [start.pressure for start in state.starts.values()]
        touched = np.sum(pressures, axis=0) > 0.0 if pressures else np.ones(self.grid.shape, bool)
        length = max(
            np.count_nonzero(touched.any(axis=1 - axis)) * pitch
            for axis, pitch in enumerate(self.grid.pitch[: 1 if self.grid.line else 2])
        )
        softness = length / (np.pi * self.contact.half_space.pair.contact_modulus)
        return softness / float(wear[:, touched].mean(axis=1).max())

    # -- cycles on surfaces that do not change --------------------------------------------------
    def cycle(self, state: WearState, increments: list[int]) -> CycleResult:
        """Solve the given increments on the surfaces of ``state``."""
        states: States = {}
        for t in increments:
            before = states[t - 1].start if t - 1 in states else None
            states[t] = self.solve(state.surfaces, t, state.starts.get(t, before))
        return self._result(state, states)

    def _result(self, state: WearState, states: States) -> CycleResult:
        wear_1, wear_2 = self.depth_per_pressure(state)
        energy = np.zeros(len(self.sliding.loads))
        worn = Surfaces.unworn(state.surfaces.initial_gap)
        for t, solved in states.items():
            worn = self._worn(worn, t, solved.pressure, (wear_1, wear_2))
            energy[t] = self._dissipated(t, solved.pressure).sum() * self.grid.cell_area
        return CycleResult(states, energy, worn.depth_1, worn.depth_2)

    # -- steps ----------------------------------------------------------------------------------
    def explicit_step(self, state: WearState, cycles: float) -> WearStep[WearState]:
        """Wear ``cycles`` cycles at the pressures of the present surfaces."""
        march = _March(self, state, cycles)
        for t, solved in self.cycle(state, self.dissipating).states.items():
            march.wear(t, solved, cycles)
        return march.step()

    def implicit_step(
        self, state: WearState, cycles: float, back: bool = False
    ) -> WearStep[WearState]:
        """Wear ``cycles`` cycles by implicit Euler, each increment at the pressure at its end.

        Increments wear one after the other, in reverse order if ``back``. At given slips the step
        is stable at any length.
        """
        march = _March(self, state, cycles)
        for t in reversed(self.dissipating) if back else self.dissipating:
            march.wear(t, march.solve(t, cycles), cycles)
        return march.step()

    def second_order_step(self, state: WearState, cycles: float) -> WearStep[WearState]:
        """Wear ``cycles`` cycles by a step of second order, stable at any length at given slips."""
        march = _March(self, state, cycles)
        half = 0.5 * cycles
        for t in reversed(self.dissipating):
            march.two_stages(t, half)
        for t in self.dissipating:
            march.two_stages(t, half)
        return march.step()

    # -- one increment --------------------------------------------------------------------------
    def solve(
        self,
        surfaces: Surfaces,
        increment: int,
        start: NormalStart | None,
        compliance: Array | None = None,
    ) -> NormalState:
        """Return the contact state of one increment, with wear as a ``compliance`` if given.

        ``compliance`` is ``(nx, ny)`` [mm/MPa].
        """
        state = self.contact.solve(
            self.sliding.gap(surfaces, increment),
            **self.sliding.drive.pressing(self.sliding.loads, increment),
            tolerance=self.tolerance,
            start=start,
            compliance=compliance,
        )
        if not state.converged:
            raise ContactFailure(f"increment {increment + 1}: {state.message}")
        return state

    def _worn(
        self,
        surfaces: Surfaces,
        increment: int,
        pressure_cycles: Array,
        per_pressure: tuple[Array, Array],
    ) -> Surfaces:
        """Return the surfaces after wear by the pressure times cycles [MPa] of an increment."""
        wear_1, wear_2 = (body[increment] * pressure_cycles for body in per_pressure)
        work = self._dissipated(increment, pressure_cycles)
        return surfaces.worn(
            self._on_body_1(increment, wear_1), wear_2, self._on_body_1(increment, work), work
        )

    def _on_body_1(self, increment: int, field: Array) -> Array:
        """Return a field of the contact as distributed over the passing surface of body 1."""
        passages = self.sliding.passages
        if passages is None:
            return field
        try:
            return passages[increment].deposit(field)
        except TravelError as error:
            raise ContactFailure(f"increment {increment + 1}: {error}") from error

    def _dissipated(self, increment: int, pressure: Array) -> Array:
        """Return the energy per area ``(nx, ny)`` [N/mm] of an increment of a mean cycle."""
        share = float(self.sliding.loads.share[increment])
        work: Array = share * self.friction * self.sliding.slip[increment] * pressure
        return work

    def energy_per_cycle(self, state: WearState) -> float:
        """Return the energy of a mean cycle at the last pressures of a state [N mm]."""
        return float(self._work(state.starts)[1].sum()) * self.grid.cell_area

    def _work(self, starts: Starts) -> tuple[Array, Array]:
        """Return the energy per area of both surfaces in a mean cycle, at the given pressures."""
        work_1 = work_2 = np.zeros(self.grid.shape)
        for t, start in starts.items():
            work = self._dissipated(t, start.pressure)
            work_1, work_2 = work_1 + self._on_body_1(t, work), work_2 + work
        return work_1, work_2


class _March:
    """A wear step in progress: its surfaces, starting points and cost so far."""

    def __init__(self, contact: WearingContact, state: WearState, cycles: float) -> None:
        self.surfaces = state.surfaces
        self._contact, self._before, self._cycles = contact, state, cycles
        self._starts = dict(state.starts)
        self._per_pressure = contact.depth_per_pressure(state, cycles)
        self._spent = Cost(steps=1)

    def solve(self, increment: int, cycles: float) -> NormalState:
        """Return the contact state whose wear over ``cycles`` is part of its gap."""
        wear_1, wear_2 = (body[increment] for body in self._per_pressure)
        state = self._contact.solve(
            self.surfaces, increment, self._starts.get(increment), (wear_1 + wear_2) * cycles
        )
        self._starts[increment] = state.start
        return state

    def wear(self, increment: int, state: NormalState, cycles: float) -> None:
        """Let an increment wear ``cycles`` times at the pressure of ``state``."""
        self._starts[increment] = state.start
        self._spent += Cost(1, state.convolutions)
        self.surfaces = self._contact._worn(
            self.surfaces, increment, state.pressure * cycles, self._per_pressure
        )

    def two_stages(self, increment: int, cycles: float) -> None:
        """Take Alexander's method on one increment."""
        stage = GAMMA * cycles
        self.wear(increment, self.solve(increment, stage), cycles - stage)
        self.wear(increment, self.solve(increment, stage), stage)

    def step(self) -> WearStep[WearState]:
        """Return the completed step."""
        before, after = self._before.surfaces, self.surfaces
        lost = after.depth_1 - before.depth_1, after.depth_2 - before.depth_2
        area = self._contact.grid.cell_area
        state = replace(
            self._before,
            surfaces=after,
            energy=self._before.energy + float((after.work_2 - before.work_2).sum()) * area,
            depth_rate=float(max(depth.max() for depth in lost)) / self._cycles,
            volume_rate=float(sum(depth.sum() for depth in lost)) * area / self._cycles,
            starts=self._starts,
            start=self._contact.start,
        )
        return WearStep(state, self._cycles, self._spent)
