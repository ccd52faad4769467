"""Wear of two reduced specimens in cycle blocks of constant shape."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from fe_models.joints.reduced_contact import FrettingConditions, FrettingCycle, ReducedPair
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array
from wear.contact.nodes import NodalContact, NodalState
from wear.laws import WearLaw
from wear.steps.marching import steps
from wear.steps.steppers import ExplicitStepper


@dataclass(frozen=True)
class BlockState:
    """A worn pair after a number of ``cycles``, at the start of a cycle block.

    ``state`` has its surfaces and energy, ``contact`` is the cycle on them, ``wear`` ``(2, n)`` the
    loss of each body in that cycle [mm] and ``stable_cycles`` the longest stable block.
    """

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
        self._last: tuple[Array, float] | None = None

    def stable_cycles(self, depth_per_pressure: Array) -> float:
        if self._last is None or not np.array_equal(self._last[0], depth_per_pressure):
            limit = self._pair.stable_cycles(self.contact.normal, depth_per_pressure / self.areas)
            self._last = depth_per_pressure, limit
        return self._last[1]


class FrettedPair:
    """A pair under one cycle of loads, on its worn shape; each run step solves one cycle."""

    def __init__(
        self,
        pair: ReducedPair,
        laws: tuple[WearLaw, WearLaw],
        conditions: FrettingConditions,
        steps: Steps = COMPUTED,
    ) -> None:
        self._pair, self._laws, self._conditions = pair, laws, conditions
        self._steps = steps
        self._last: tuple[NodalState, PairCycle] | None = None

    def cycle_at(self, state: NodalState) -> PairCycle:
        """Return the cycle on the surfaces of ``state``, started from its last contact."""
        if self._last is None or self._last[0].surfaces is not state.surfaces:
            conditions = self._conditions
            guess = None if state.start is None else np.asarray(state.start)
            gap, cycle = state.surfaces.gap, self._pair.fretting_cycle
            contact = self._steps("fretting cycle", lambda: cycle(gap, conditions, guess))
            self._last = state, PairCycle(self._pair, contact, conditions.friction)
        return self._last[1]

    def contact_at(self, state: NodalState) -> NodalContact:
        """Return the contact in a state in the form that wear steps need."""
        return NodalContact(self._laws, (self.cycle_at(state),))

    def block(self, state: NodalState, cycles: float) -> BlockState:
        """Return the description of a state after a number of cycles."""
        contact = self.contact_at(state)
        return BlockState(
            cycles,
            state,
            self.cycle_at(state).contact,
            np.stack(contact.wear(state)),
            contact.stable_cycles(state),
        )


def wear_in_cycle_blocks(
    fretted: FrettedPair,
    gap: Array,
    stepper: ExplicitStepper,
    to_go: Callable[[BlockState], float],
) -> Iterator[BlockState]:
    """Yield states of a contact of unworn ``gap`` ``(n,)`` that frets until nothing is ``to_go``.

    ``to_go`` returns the most cycles that the block after a state may have. Raises
    :class:`~wear.steps.steppers.StabilityError` where a block of a given length would be unstable.
    """
    block = fretted.block(NodalState.unworn(gap), 0.0)
    yield block

    def most(state: NodalState, done: float) -> float:
        return to_go(block)

    for step in steps(stepper, block.state, most, np.inf, fretted.contact_at):
        block = fretted.block(step.state, block.cycles + step.cycles)
        yield block
