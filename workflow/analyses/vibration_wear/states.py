"""States of a contact that wears in a rig, with the responses in each: motion and wear in turn."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.resolution_error import resolution_error
from sa_solver.steps import Steps
from wear.steps.marching import advance_cycles
from wear.steps.steppers import Contact, Stepper
from wear.worn import State
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.output.outcome import Response
from workflow.analyses.vibration.response import response_under, warn_of_error
from workflow.analyses.vibration_wear.output.outcome import WornRig
from workflow.models.vibration.structure import VibratingStructure
from workflow.shell.terminal.reporter import Reporter

# Share of the wear in the work for a state; the rest are the responses in it.
WEAR = 0.2


def worn_states(
    numbers: tuple[float, ...],
    stepper: Stepper[State, Contact],
    state: State,
    contact_at: Callable[[State], Contact],
    describe: Callable[[State, float, int], WornRig],
    reporter: Reporter,
    steps: Steps,
) -> tuple[WornRig, ...]:
    """Return the unworn state, and the states after each number of cycles.

    ``describe`` returns the description of a state, from the state, its cycles, and the number of
    steps since the last one.
    """
    total, done = numbers[-1], 0.0
    states = []
    with reporter.course("vibration and wear"):
        for cycles in reporter.parts((0.0, *numbers), lambda cycles: f"{cycles:.4g} cycles"):
            count = 0
            if cycles > 0.0:
                stretch, left = cycles - done, total - done
                with reporter.part(0.0, WEAR, "wear"), reporter.stage("wear"):
                    worn = advance_cycles(
                        stepper,
                        state,
                        stretch,
                        left,
                        contact_at,
                        steps,
                        partial(_tell, reporter, stretch),
                    )
                state, done = worn.state, cycles
                count = worn.spent.steps
            name = "worn state" if count else "unworn state"
            with reporter.part(WEAR if count else 0.0, 1.0):
                states.append(steps(name, partial(describe, state, cycles, count)))
    return tuple(states)


def _tell(reporter: Reporter, stretch: float, cycles: float) -> None:
    """Report that a number of ``cycles`` of a ``stretch`` have worn."""
    reporter.reached(cycles / stretch, f"{cycles:.3g} of {stretch:.3g} cycles")


def responses_to_all(
    case: VibrationCase,
    model: VibratingStructure,
    motion: HarmonicSolution,
    reporter: Reporter,
    steps: Steps,
) -> tuple[float, tuple[Response, ...]]:
    """Return the error of the ``motion`` that wears, and the responses to each force."""
    error = resolution_error(model.problem.refined(motion.resolution), motion).largest
    warn_of_error("the motion that wears", error, case, reporter)
    with reporter.stage("response"):
        responses = [
            response_under(case, model, force, reporter, steps)[0]
            for force in reporter.parts(case.amounts, case.amount.told)
        ]
    return error, tuple(responses)
