"""A joint alone at a prescribed stroke: aged by jumps in energy, with loops at several energies."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from sa_solver.steps import Steps
from sa_solver.types import Array
from wear.joints.ageing import (
    AgeingError,
    LongTest,
    NeverReachedError,
    integrate_cycles,
    marched_stroke,
)
from wear.joints.measured.loop_record import MeasuredLoopError
from wear.joints.measured.measured_loops import measure_loops
from workflow.analyses.time.case import Ageing, JointCase, joules
from workflow.analyses.time.joint_model import wearing_joint
from workflow.analyses.time.outcome import State, TimeOutcome
from workflow.errors import MethodFailed, UserError
from workflow.messages.warning_kinds import WarningKind
from workflow.models.rig.joint import WearingJoint, ageing_test, evolution_curve, steady_loop
from workflow.shell.terminal.reporter import Reporter

# Cycles integrated one by one, half way through the test, to check the jumps.
STRETCH = 1000


def run_joint(case: JointCase, reporter: Reporter, steps: Steps) -> TimeOutcome:
    """Age a joint at its stroke, and describe it at the energies of the case.

    Raises UserError where it never dissipates the energy, MethodFailed where it cannot be aged.
    """
    model = wearing_joint(case)
    rate = model.energy_per_cycle
    with reporter.stage("ageing"):
        test = steps("ageing", lambda: aged(rate, case.ageing, model.evolution.breaks))
    last = test_end(test, case.ageing)
    with reporter.stage("loops"):
        states = tuple(
            steps("loop", partial(_state, model, energy, float(test.cycles_at(energy))))
            for energy in energies_within(case.energies, last, reporter)
        )
    with reporter.stage("check of the jumps"):
        numbers = steps("check of the jumps", lambda: _ageing_numbers(model, test))
    cycles = test.total_cycles
    ended = {"cycles": cycles, "energy": last, "duration": cycles / case.drive.frequency}
    curve = evolution_curve(model, last, test, rate)
    return TimeOutcome(case, states, curve, ended | {"ageing": numbers})


def _state(model: WearingJoint, energy: float, cycles: float) -> State:
    displacement, force, dissipated = steady_loop(model.at(energy), model.amplitude)
    parameters = model.parameters(energy)
    numbers = {
        "energy_per_cycle": dissipated,
        "stroke": float(np.ptp(displacement)),
        "force": 0.5 * float(np.ptp(force)),
        "extracted": extracted(displacement, force, parameters["normal_load"]),
    }
    curves = {"loop": {"displacement": displacement, "force": force}}
    return State(energy, cycles, parameters, numbers, curves)


def extracted(displacement: Array, force: Array, normal_load: float) -> dict[str, float | None]:
    """Return parameters as a measurement would extract them from the loop, None where it cannot."""
    try:
        # With two periods, a whole cycle surely begins and ends at a reversal.
        loops = measure_loops(
            np.concatenate([displacement, displacement[1:], displacement[1:2]]),
            np.concatenate([force, force[1:], force[1:2]]),
            normal_load,
        )
    except MeasuredLoopError:
        return dict.fromkeys(("friction", "stiffness", "residual_stiffness", "energy"))
    return {
        "friction": float(np.mean(loops.friction)) if loops.slides and normal_load else None,
        "stiffness": float(np.mean(loops.stick_stiffness)),
        "residual_stiffness": float(np.mean(loops.residual_stiffness)) if loops.slides else None,
        "energy": float(np.mean(loops.energy)),
    }


# --- ageing -------------------------------------------------------------------------------------


def aged(rate: Callable[[float], float], ageing: Ageing, breaks: tuple[float, ...]) -> LongTest:
    """Return a long test to the end that the case asks for.

    Raises UserError where the energy is never dissipated, MethodFailed where jumps fail.
    """
    try:
        return ageing_test(rate, ageing.cycles, ageing.energy, ageing.tolerance, breaks)
    except NeverReachedError as error:
        raise UserError(f"ageing.energy: {error}; allowed: less, or a joint that slides") from error
    except AgeingError as error:
        raise MethodFailed(f"ageing: {error}") from error


def test_end(test: LongTest, ageing: Ageing) -> float:
    """Return the energy at the end of a test [N mm]."""
    return test.final_energy if ageing.energy is None else ageing.energy


def energies_within(
    energies: tuple[float, ...], last: float, reporter: Reporter
) -> Iterator[float]:
    """Yield the energies of the case that a test reaches, and its last."""
    for energy in energies:
        if energy < last:
            yield energy
        elif energy > last:
            reporter.warn(
                WarningKind.ENERGY_NOT_REACHED,
                f"energies: {joules(energy)} are not reached: the test ends at {joules(last)}",
            )
    yield last


def _ageing_numbers(model: WearingJoint, test: LongTest) -> dict[str, Any]:
    """Return the accuracy of the jumps: as estimated, and against cycles computed one by one."""
    numbers: dict[str, Any] = {"error": test.error, "evaluations": test.evaluations}
    first = np.floor(0.5 * test.total_cycles)
    cycles = int(min(STRETCH, test.total_cycles - first))
    if cycles < 1:
        return numbers
    begin = float(test.energy_at(first))
    marched = marched_stroke(model.law, model.evolution, model.amplitude, start=begin)
    stretch = integrate_cycles(test, marched, first, cycles)
    return numbers | {
        "stretch": {
            "first": float(first),
            "cycles": cycles,
            "difference": stretch.difference,
            "stated": stretch.stated,
        }
    }
