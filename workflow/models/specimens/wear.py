"""Wear of two reduced specimens in cycle blocks of constant shape."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.joints.reduced_contact import FrettingConditions, FrettingCycle, ReducedPair
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array
from wear.contact.contacts import LastSolved, SoleContact
from wear.contact.nodes import NodalContact, NodalState
from wear.coupled import CoupledWear
from wear.coupled_state import CoupledState, Observer
from wear.laws import WearLaw
from wear.schedule import Schedule
from wear.steps.steppers import ExplicitStepper


@dataclass(frozen=True)
class BlockState:
    """A worn pair after a number of ``cycles``, at the start of a cycle block.

    ``number`` blocks went before. ``state`` has its surfaces and energy, ``contact`` is the cycle
    on them, ``wear`` ``(2, n)`` the loss of each body in that cycle [mm] and ``stable_cycles`` the
    longest stable block.
    """

    number: int
    cycles: float
    state: NodalState
    contact: FrettingCycle
    wear: Array
    stable_cycles: float

    @property
    def depths(self) -> Array:
        """Worn depth of each body ``(2, n)`` [mm]."""
        return np.stack(self.state.surfaces.depths)

    @property
    def energy(self) -> float:
        """Energy dissipated since the start [N mm]."""
        return self.state.energy


class PairCycle:
    """A fretting cycle of a pair in the form that nodal wear needs: see :mod:`wear.contact.nodes`.

    By Masing's rule each node slides its whole path at one pressure.
    """

    def __init__(self, pair: ReducedPair, contact: FrettingCycle, friction: float) -> None:
        self._pair, self.contact, self.friction = pair, contact, friction
        self.slip, self.pressure = contact.cycle_slip[None], contact.normal.pressure[None]
        self.areas, self.start = pair.areas, contact.normal.touching
        self._stable: dict[bytes, float] = {}

    def stable_cycles(self, depth_per_pressure: Array) -> float:
        known = depth_per_pressure.tobytes()
        if known not in self._stable:
            compliance = depth_per_pressure / self.areas
            self._stable[known] = self._pair.stable_cycles(self.contact.normal, compliance)
        return self._stable[known]


class FrettedPair:
    """A pair under one cycle of loads, on its worn shape; each run step solves one cycle."""

    def __init__(
        self,
        pair: ReducedPair,
        laws: tuple[WearLaw, WearLaw],
        conditions: FrettingConditions,
        steps: Steps = COMPUTED,
    ) -> None:
        self.pair, self._laws, self._conditions = pair, laws, conditions
        self._steps = steps
        self.cycle_at = LastSolved(self._solve)
        self._described: tuple[CoupledState[NodalState], BlockState] | None = None

    def _solve(self, state: NodalState) -> PairCycle:
        """Return the cycle on the surfaces of ``state``, started from its last contact."""
        conditions = self._conditions
        guess = None if state.start is None else np.asarray(state.start)
        gap, cycle = state.surfaces.gap, self.pair.fretting_cycle
        contact = self._steps("fretting cycle", lambda: cycle(gap, conditions, guess))
        return PairCycle(self.pair, contact, conditions.friction)

    def contact_at(self, state: NodalState) -> NodalContact:
        """Return the contact in a state in the form that wear steps need."""
        return NodalContact(self._laws, (self.cycle_at(state),))

    def block(self, after: CoupledState[NodalState]) -> BlockState:
        """Return the description of the state after some jumps."""
        if self._described is None or self._described[0] is not after:
            (state,) = after.interfaces
            contact = self.contact_at(state)
            self._described = (
                after,
                BlockState(
                    after.jump,
                    float(after.cycles[-1]),
                    state,
                    self.cycle_at(state).contact,
                    np.stack(contact.wear(state)),
                    contact.stable_cycles(state),
                ),
            )
        return self._described[1]


@dataclass(frozen=True)
class CycleBlocks(Schedule):
    """A run in explicit cycle blocks.

    ``to_go`` returns the most cycles that the block after a state may have, and 0 at the end.
    """

    fretted: FrettedPair
    stepper: ExplicitStepper
    to_go: Callable[[BlockState], float]

    def ended(self, state: CoupledState[Any]) -> bool:
        return not self.left(state) > 0.0

    def next_jump(self, state: CoupledState[Any]) -> float:
        (worn,) = state.interfaces
        return self.stepper.length(self.fretted.contact_at(worn), worn, self.left(state))

    def left(self, state: CoupledState[Any]) -> float:
        return self.to_go(self.fretted.block(state))


def wear_in_cycle_blocks(
    fretted: FrettedPair,
    gap: Array,
    stepper: ExplicitStepper,
    to_go: Callable[[BlockState], float],
    observers: Sequence[Observer] = (),
) -> Iterator[BlockState]:
    """Yield states of a contact of unworn ``gap`` ``(n,)`` that frets until nothing is ``to_go``.

    ``to_go`` is that of :class:`CycleBlocks`. Raises
    :class:`~wear.steps.steppers.StabilityError` where a block of a given length would be unstable.
    """
    contact = SoleContact(stepper, fretted.contact_at, fretted.pair.areas)
    loop = CoupledWear(CycleBlocks(fretted, stepper, to_go), None, contact, observers)
    state = loop.unworn([NodalState.unworn(gap)])
    yield fretted.block(state)
    yield from map(fretted.block, loop.march(state))
