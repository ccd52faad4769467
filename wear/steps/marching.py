"""Sequences of wear steps: those of a jump, or of a whole run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic

from sa_solver.steps import COMPUTED, Steps
from wear.steps.steppers import ROUNDING, Contact, Stepper
from wear.worn import Cost, State, WearStep


@dataclass(frozen=True)
class SubcyclingStepper(Generic[State, Contact]):
    """A stepper that takes several steps of another stepper as one.

    ``longest`` returns the length of the joint step [cycles], from a state and the most cycles
    allowed.
    """

    stepper: Stepper[State, Contact]
    longest: Callable[[State, float], float]
    marched_by: Steps = COMPUTED

    def step(
        self, state: State, most: float, left: float, contact_at: Callable[[State], Contact]
    ) -> WearStep[State]:
        longest, by = self.longest(state, most), self.marched_by
        return advance_cycles(self.stepper, state, longest, left, contact_at, by)


def rest(cycles: float, done: float) -> float:
    """Return the remaining part of ``cycles``, or 0 if it is only rounding."""
    return cycles - done if cycles - done > ROUNDING * cycles else 0.0


def advance_cycles(
    stepper: Stepper[State, Contact],
    state: State,
    cycles: float,
    left: float,
    contact_at: Callable[[State], Contact],
    marched_by: Steps = COMPUTED,
    reached: Callable[[float], None] = lambda cycles: None,
) -> WearStep[State]:
    """Wear ``cycles`` of the ``left`` cycles of the run, in as many steps as needed.

    Parameters
    ----------
    stepper
        Method and length of the steps.
    state
        State before the first step.
    cycles, left
        Cycles to wear, and cycles left in the whole run.
    contact_at
        Function that returns the contact that belongs to a state.
    marched_by
        Source of the steps: computed, or recorded earlier.
    reached
        Callback after each step, with the number of cycles done.
    """

    def further(worn: WearStep[State]) -> WearStep[State] | None:
        most = rest(cycles, worn.cycles)
        if not most > 0.0:
            return None
        step = stepper.step(worn.state, most, left - worn.cycles, contact_at)
        reached(worn.cycles + step.cycles)
        return WearStep(step.state, worn.cycles + step.cycles, worn.cost + step.cost)

    worn = marched_by.march("wear step", WearStep(state, 0.0, Cost()), further)
    return replace(worn, cycles=cycles)
