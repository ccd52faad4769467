"""States of a contact that wears in a rig, with the responses in each: motion and wear in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import Any

from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.resolution_error import resolution_error
from sa_solver.steps import Steps
from sa_solver.types import Array
from wear.contact.contacts import SoleContact
from wear.coupled import CoupledWear
from wear.coupled_state import CoupledState, Observer
from wear.schedule import Schedule
from wear.steps.steppers import Contact, Stepper
from wear.worn import State
from workflow.analyses.vibration.following import VibrationRun
from workflow.analyses.vibration.output.outcome import Response
from workflow.analyses.vibration.response import response_under, warn_of_error
from workflow.analyses.vibration_wear.output.outcome import WornRig
from workflow.shell.terminal.reporter import Reporter

# Share of the wear in the work for a state; the rest are the responses in it.
WEAR = 0.2


@dataclass(frozen=True)
class GivenCycles(Schedule):
    """A run with one jump to each of these numbers of cycles, in ascending order."""

    ends: tuple[float, ...]

    def ended(self, state: CoupledState[Any]) -> bool:
        return state.jump == len(self.ends)

    def next_jump(self, state: CoupledState[Any]) -> float:
        return self.ends[state.jump] - float(state.cycles[-1])

    def left(self, state: CoupledState[Any]) -> float:
        return self.ends[-1] - float(state.cycles[-1])


@dataclass(frozen=True)
class JumpProgress(Observer):
    """Progress of the wear to the next state."""

    reporter: Reporter

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        with self.reporter.part(0.0, WEAR, name), self.reporter.stage(name):
            yield

    def worn(self, cycles: float, done: float) -> None:
        """Report that ``done`` of the ``cycles`` of a jump have worn."""
        self.reporter.reached(done / cycles, f"{done:.3g} of {cycles:.3g} cycles")


def worn_states(
    numbers: tuple[float, ...],
    stepper: Stepper[State, Contact],
    state: State,
    contact_at: Callable[[State], Contact],
    areas: Array | float,
    describe: Callable[[State, float, int], WornRig],
    reporter: Reporter,
    steps: Steps,
) -> tuple[WornRig, ...]:
    """Return the unworn state, and the states after each number of cycles.

    ``describe`` returns the description of a state, from the state, its cycles, and the number of
    steps since the last one. ``areas`` are those of the cells or nodes [mm²].
    """
    progress = JumpProgress(reporter)
    contact = SoleContact(stepper, contact_at, areas, steps, progress.worn)
    loop = CoupledWear(GivenCycles(numbers), None, contact, [progress])
    begun = loop.unworn([state])
    states, before = [], 0
    with reporter.course("vibration and wear"):
        parts = reporter.parts((0.0, *numbers), lambda cycles: f"{cycles:.4g} cycles")
        for cycles, worn in zip(parts, chain([begun], loop.march(begun)), strict=True):
            count, before = worn.cost.steps - before, worn.cost.steps
            name = "worn state" if count else "unworn state"
            with reporter.part(WEAR if count else 0.0, 1.0):
                (contact_state,) = worn.interfaces
                states.append(steps(name, partial(describe, contact_state, cycles, count)))
    return tuple(states)


def responses_to_all(
    run: VibrationRun, motion: HarmonicSolution
) -> tuple[float, tuple[Response, ...]]:
    """Return the error of the ``motion`` that wears, and the responses to each force."""
    problem = run.structure.problem.with_resolution(motion.resolution)
    error = resolution_error(problem, motion).largest
    warn_of_error(run, "the motion that wears", error)
    with run.reporter.stage("response"):
        responses = [
            response_under(run, force)[0]
            for force in run.reporter.parts(run.case.amounts, run.case.amount.as_text)
        ]
    return error, tuple(responses)
