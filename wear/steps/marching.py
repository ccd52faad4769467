"""Many wear steps, one after the other: of a jump, or of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Generic

from sa_solver.steps import COMPUTED, Steps
from wear.steps.steppers import ROUNDING, Contact, Stepper
from wear.worn import Spent, State, WearStep


@dataclass(frozen=True)
class SubcyclingStepper(Generic[State, Contact]):
    """Several steps of a ``stepper`` taken as one, as long as ``longest`` says of a state.

    It is told the most cycles that they may have together.
    """

    stepper: Stepper[State, Contact]
    longest: Callable[[State, float], float]
    marched_by: Steps = COMPUTED

    def step(
        self, state: State, most: float, left: float, contact_at: Callable[[State], Contact]
    ) -> WearStep[State]:
        longest, by = self.longest(state, most), self.marched_by
        return advance_cycles(self.stepper, state, longest, left, contact_at, by)


def steps(
    stepper: Stepper[State, Contact],
    state: State,
    to_go: Callable[[State, float], float],
    left: float,
    contact_at: Callable[[State], Contact],
) -> Iterator[WearStep[State]]:
    """Steps of a run that has ``left`` cycles, until nothing is ``to_go``.

    That is told a state and the cycles done so far, and gives the most that the next step may have.
    """
    done = 0.0
    while (most := to_go(state, done)) > 0.0:
        step = stepper.step(state, most, left - done, contact_at)
        state, done = step.state, done + step.cycles
        yield step


def rest(cycles: float, done: float) -> float:
    """What is to go of so many ``cycles``; nothing where it is but rounding."""
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
    """Wear ``cycles`` cycles of the ``left`` ones of the run, in as many steps as it takes.

    ``reached`` is told, after each of them, how many cycles are done.
    """

    def further(worn: WearStep[State]) -> WearStep[State] | None:
        most = rest(cycles, worn.cycles)
        if not most > 0.0:
            return None
        step = stepper.step(worn.state, most, left - worn.cycles, contact_at)
        reached(worn.cycles + step.cycles)
        return WearStep(step.state, worn.cycles + step.cycles, worn.spent + step.spent)

    worn = marched_by.march("wear step", WearStep(state, 0.0, Spent()), further)
    return replace(worn, cycles=cycles)
