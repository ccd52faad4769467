"""Motion, wear, motion: the states of a contact that wears in a rig, and the responses in each."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from fe_models.dynamics.harmonic_solution import HarmonicSolution
from fe_models.dynamics.resolution_error import resolution_error
from sa_solver.steps import Steps
from wear.steppers import Contact, Stepper, advance_cycles
from wear.worn import State
from workflow.analyses.vibration.case import VibrationCase
from workflow.analyses.vibration.model import VibrationModel
from workflow.analyses.vibration.outcome import Response
from workflow.analyses.vibration.response import response_under, warn_of_error
from workflow.analyses.vibration_wear.outcome import WornState
from workflow.shell.reporter import Reporter


def worn_states(
    numbers: tuple[float, ...],
    stepper: Stepper[State, Contact],
    state: State,
    contact_at: Callable[[State], Contact],
    describe: Callable[[State, float, int, float], WornState],
    reporter: Reporter,
    steps: Steps,
) -> tuple[WornState, ...]:
    """The states after so many cycles each, the unworn one before them.

    ``describe`` makes them, of a state, its cycles, the steps since the last one, and the largest
    error of a step so far.
    """
    total, done, error = numbers[-1], 0.0, 0.0
    states = [steps("unworn state", partial(describe, state, done, 0, error))]
    with reporter.jumps(total, 0.0) as progress:
        for cycles in numbers:
            with reporter.stage("wear"):
                stretch, left = cycles - done, total - done
                worn = advance_cycles(stepper, state, stretch, left, contact_at, steps)
            state, done, error = worn.state, cycles, max(error, worn.error)
            described = partial(describe, state, cycles, worn.spent.steps, error)
            states.append(steps("worn state", described))
            progress(cycles, len(states) - 1)
    return tuple(states)


def responses_to_all(
    case: VibrationCase,
    model: VibrationModel,
    motion: HarmonicSolution,
    reporter: Reporter,
    steps: Steps,
) -> tuple[float, tuple[Response, ...]]:
    """The error of the ``motion`` that wears, and what its state does under each force."""
    error = resolution_error(model.problem.refined(motion.resolution), motion).largest
    warn_of_error("the motion that wears", error, case, reporter)
    with reporter.stage("response"):
        responses = [
            response_under(case, model, force, reporter, steps)[0] for force in case.forces
        ]
    return error, tuple(responses)
