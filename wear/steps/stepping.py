"""Cycle-jumped wear of one interface: pressures of a cycle, and the depth of many alike.

Pressure comes from the half-space solver under the resultants of each increment. Slip is given: by
the structure (wear method 1 of Gallego 2007) or by the half-space (method 2, see
:mod:`wear.steps.full_cycle`), and does not change during a step. Where it slips, q = µ p.

With w_t the depth per pressure and cycle of increment t (:mod:`wear.laws`) and p_t(h) its pressure
on the worn gap h, wear is dh/dN = Σ_t w_t p_t(h): stiff, since short waves of h are pressed away at
once. Three steps are offered here; :mod:`wear.steps.steppers` chooses their length.

- explicit Euler, at the pressures of the surfaces before the step; stable below a limit only;
- implicit Euler, increment after increment, each at the pressure it ends with: the depth of an
  increment enters its contact problem as the local compliance w_t ΔN. Stable at any length;
- second order: all increments over half the step and back in reverse order over the other half
  (Strang 1968, doi:10.1137/0705041), each by the two implicit stages of Alexander's method
  (1977, doi:10.1137/0714068; L-stable). Both stages weigh in with their own positive share, so that
  nothing ever grows back and energies add up to the volume.

Where the surfaces move over each other, body 1 wears where it passes, and its local compliance only
stands for that: then no step is better than first order.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from sa_solver.errors import ConvergenceError
from sa_solver.half_space.influence import Z
from sa_solver.normal.contact import NormalContact, NormalStart, NormalState
from sa_solver.rigid_modes import NORMAL
from sa_solver.ties import SAME, first_largest
from sa_solver.types import Array, Grid, LoadHistory
from wear.contact.drive import Drive
from wear.contact.moving import Passage, TravelError
from wear.laws import SlidingConditions, WearLaw
from wear.surfaces import Surfaces
from wear.worn import Spent, WearStep, WornState

GAMMA = 1.0 - np.sqrt(0.5)
"""Share of the second stage of Alexander's method, and the reach of either."""

States = dict[int, NormalState]
Starts = dict[int, NormalStart]


class ContactFailure(ConvergenceError):
    """The half-space solver did not converge; the message is its own."""


@contextmanager
def failures_of(name: str) -> Iterator[None]:
    """Let a :class:`ContactFailure` say of which interface it is."""
    try:
        yield
    except ContactFailure as error:
        raise ContactFailure(f"{name}: {error}") from error


@dataclass(frozen=True)
class SlidingCycle:
    """One closed cycle as the wear of a contact feels it.

    ``slip`` ``(t, nx, ny)`` is the size of the slip in each increment [mm]; ``uplift``
    ``(t, nx, ny)`` [mm] the normal displacement under its shear, None for similar bodies;
    ``passages`` how body 2 moves over body 1 in each, None where that is too little to matter.
    A ``drive`` may impose motions in the place of the loads' forces.
    """

    loads: LoadHistory
    slip: Array
    uplift: Array | None = None
    passages: tuple[Passage, ...] | None = None
    drive: Drive = field(default_factory=Drive)

    def gap(self, surfaces: Surfaces, increment: int) -> Array:
        """Gap before loading ``(nx, ny)`` [mm] where an increment has body 2, lifted by shear."""
        gap = surfaces.gap
        if self.passages is not None:
            seen = self.passages[increment].carry(surfaces.depth_1)
            gap = surfaces.initial_gap + surfaces.depth_2 + seen
        return gap if self.uplift is None else gap + self.uplift[increment]

    def midway(self, other: SlidingCycle) -> SlidingCycle:
        """The mean of two cycles with the same loads and passages."""
        uplift = None
        if self.uplift is not None and other.uplift is not None:
            uplift = 0.5 * (self.uplift + other.uplift)
        return replace(self, slip=0.5 * (self.slip + other.slip), uplift=uplift)


@dataclass(frozen=True)
class CycleResult:
    """A cycle on given surfaces.

    ``states`` by increment; ``energy`` ``(t,)`` dissipated by each increment of a mean cycle
    [N mm]; ``depth_1`` and ``depth_2`` ``(nx, ny)`` worn per mean cycle [mm].
    """

    states: States
    energy: Array
    depth_1: Array
    depth_2: Array

    def per_cycle(self, cell_area: float) -> tuple[float, float]:
        """Largest depth [mm] and volume of both bodies [mm³] worn per cycle."""
        depth = max(self.depth_1.max(), self.depth_2.max())
        return float(depth), float((self.depth_1 + self.depth_2).sum() * cell_area)

    @property
    def convolutions(self) -> int:
        """Convolutions spent."""
        return sum(state.convolutions for state in self.states.values())


@dataclass(frozen=True)
class WearState(WornState):
    """What the wear of a half-space contact must remember between two steps.

    Fields are ``(nx, ny)``, one value per cell; ``starts`` are the contact solver's, by increment,
    and ``start`` is that of whoever found the cycle that led to it.
    """

    starts: Starts = field(default_factory=dict)
    start: object = None


@dataclass(frozen=True, eq=False)
class WearingContact:
    """One interface under a ``sliding`` cycle; ``laws`` are those of body 1 and body 2.

    ``start`` is what the cycle of surfaces that are little different may be found from.
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
        """The contact under the mean of both cycles."""
        friction = 0.5 * (self.friction + other.friction)
        return replace(self, friction=friction, sliding=self.sliding.midway(other.sliding))

    @cached_property
    def dissipating(self) -> list[int]:
        """Increments that dissipate, loaded and with slip somewhere, the heaviest load last.

        Over thousands of cycles it does not matter where a cycle begins. A step that ends with the
        widest contact leaves no unworn rim for the next one.
        """
        loads = self.sliding.loads
        works = (loads.P > 0.0) & (loads.share > 0.0) & self.sliding.slip.any(axis=(1, 2))
        count, heaviest = len(loads), first_largest(loads.P)
        order = [(heaviest + 1 + k) % count for k in range(count)]
        return [t for t in order if works[t]]

    # -- rates --------------------------------------------------------------------------------
    def depth_per_pressure(self, state: WearState, cycles: float = 0.0) -> tuple[Array, Array]:
        """Depth per pressure of both bodies over a step from ``state``, each ``(t, nx, ny)``.

        In mm/MPa and mean cycle. Laws that change with energy take that of the state and that
        expected after so many cycles at its pressures.
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
        """Depth per pressure of one body: each mission of a mix for itself, by its share."""
        loads, slip = self.sliding.loads, self.sliding.slip
        parts = [
            law.depth_per_pressure(SlidingConditions(slip[mission], self.friction, work, energies))
            for mission in loads.missions
        ]
        depth: Array = loads.share[:, None, None] * np.concatenate(parts)
        return depth

    def stable_cycles(self, state: WearState, cycles: float = 0.0) -> float:
        """Longest explicit step that does not make a roughness of the grid's shortest waves grow.

        A mode of compliance λ is multiplied by 1 - w ΔN/λ per step, w being the depth of both
        bodies per pressure and cycle over all increments that press there; the limit is
        w ΔN = 2 λ_min. Where the last pressures are unknown all increments count. Laws that change
        with energy are those of a step of ``cycles``.
        """
        per_pressure = np.add(*self.depth_per_pressure(state, cycles))
        for t, start in state.starts.items():
            per_pressure[t] *= start.pressure > 0.0
        fastest = float(per_pressure.sum(axis=0).max())
        softest = float(self.contact.half_space.symbol(Z, Z).min())
        return 2.0 * softest / fastest if fastest > 0.0 else np.inf

    def comparable_cycles(self, state: WearState) -> float:
        """How long a step of second order may be for two halves of it to tell its error.

        One of first order may be twice as long.

        Increments wear one after the other. A step in which one of them presses away waves as long
        as the contact leaves the surfaces to the last one, whatever its length: with the compliance
        λ = L/π E* of a wave of the contact's length L and w of one increment, a step of w ΔN = x λ
        has an error of order p of about (x/(1 + x))^p. What two halves of it differ from the whole
        by is then 0.42 times what they say (p = 2, x = 1), or 0.33 times (p = 1, x = 2), and falls
        beyond. Increments that are all alike may wear together.
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
        """Wear ``cycles`` cycles, first order in them, each increment at the pressure it ends with.

        Increments wear in turn, or in reverse order if ``back``. Stable at any length, at given
        slips.
        """
        march = _March(self, state, cycles)
        for t in reversed(self.dissipating) if back else self.dissipating:
            march.wear(t, march.solve(t, cycles), cycles)
        return march.step()

    def second_order_step(self, state: WearState, cycles: float) -> WearStep[WearState]:
        """Wear ``cycles`` cycles, second order in them and stable at any length, at given slips."""
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
        """Contact state of one increment; ``compliance`` ``(nx, ny)`` [mm/MPa] is wear."""
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
        """The surfaces after the pressure times cycles [MPa] of an increment."""
        wear_1, wear_2 = (body[increment] * pressure_cycles for body in per_pressure)
        work = self._dissipated(increment, pressure_cycles)
        return surfaces.worn(
            self._on_body_1(increment, wear_1), wear_2, self._on_body_1(increment, work), work
        )

    def _on_body_1(self, increment: int, field: Array) -> Array:
        """What the contact leaves behind on body 1's own surface, passing over it."""
        passages = self.sliding.passages
        if passages is None:
            return field
        try:
            return passages[increment].deposit(field)
        except TravelError as error:
            raise ContactFailure(f"increment {increment + 1}: {error}") from error

    def _dissipated(self, increment: int, pressure: Array) -> Array:
        """Energy per area ``(nx, ny)`` [N/mm] of an increment of a mean cycle."""
        share = float(self.sliding.loads.share[increment])
        work: Array = share * self.friction * self.sliding.slip[increment] * pressure
        return work

    def _work(self, starts: Starts) -> tuple[Array, Array]:
        """Energy per area of both bodies' surfaces and mean cycle, at the given pressures."""
        work_1 = work_2 = np.zeros(self.grid.shape)
        for t, start in starts.items():
            work = self._dissipated(t, start.pressure)
            work_1, work_2 = work_1 + self._on_body_1(t, work), work_2 + work
        return work_1, work_2


class _March:
    """A step under way: surfaces, starts and what it has taken so far."""

    def __init__(self, contact: WearingContact, state: WearState, cycles: float) -> None:
        self.surfaces = state.surfaces
        self._contact, self._before, self._cycles = contact, state, cycles
        self._starts = dict(state.starts)
        self._per_pressure = contact.depth_per_pressure(state, cycles)
        self._spent = Spent(steps=1)

    def solve(self, increment: int, cycles: float) -> NormalState:
        """Contact whose wear over ``cycles`` is part of its gap."""
        wear_1, wear_2 = (body[increment] for body in self._per_pressure)
        state = self._contact.solve(
            self.surfaces, increment, self._starts.get(increment), (wear_1 + wear_2) * cycles
        )
        self._starts[increment] = state.start
        return state

    def wear(self, increment: int, state: NormalState, cycles: float) -> None:
        """Let an increment wear ``cycles`` times at the pressure of ``state``."""
        self._starts[increment] = state.start
        self._spent += Spent(1, state.convolutions)
        self.surfaces = self._contact._worn(
            self.surfaces, increment, state.pressure * cycles, self._per_pressure
        )

    def two_stages(self, increment: int, cycles: float) -> None:
        """Alexander's method on one increment."""
        stage = GAMMA * cycles
        self.wear(increment, self.solve(increment, stage), cycles - stage)
        self.wear(increment, self.solve(increment, stage), stage)

    def step(self) -> WearStep[WearState]:
        """The step taken."""
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
