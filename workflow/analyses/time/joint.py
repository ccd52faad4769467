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
    long_test,
    marched_stroke,
    steady_stroke,
)
from wear.joints.law import march_joints
from wear.joints.measured.loop_record import MeasuredLoopError
from wear.joints.measured.measured_loops import measure_loops
from workflow.analyses.time.case import Ageing, JointCase, joules
from workflow.analyses.time.joint_model import JointModel
from workflow.analyses.time.outcome import State, TimeOutcome
from workflow.errors import MethodFailed, UserError
from workflow.layout.declared import Arrays
from workflow.models.rig.laws import Laws
from workflow.shell.terminal.reporter import Reporter

# Points of a loop: those of a cosine over a cycle, dense at the reversals.
LOOP_POINTS = 720
# Cycles in which a loop settles from rest. From the second one on, cycles repeat for every law but
# Bouc-Wen's, which takes a few more where it hardly slides.
SETTLING = 20
# Cycles integrated one by one, half way through the test, to check the jumps.
STRETCH = 1000
# Points of the evolution over the energy: evenly spaced, and as many evenly in the logarithm from
# this share on, as friction changes within a few cycles.
CURVE_POINTS, CURVE_BEGIN = 101, 1e-6


def run_joint(case: JointCase, reporter: Reporter, steps: Steps) -> TimeOutcome:
    """Age a joint at its stroke, and describe it at the energies of the case.

    Raises UserError where it never dissipates the energy, MethodFailed where it cannot be aged.
    """
    model, amplitude = JointModel.of(case), 0.5 * case.drive.stroke
    with reporter.stage("ageing"):
        rate = steady_stroke(model.line_law, model.evolution, amplitude)
        test = steps("ageing", lambda: aged(rate, case.ageing, model.evolution.breaks))
    last = test_end(test, case.ageing)
    with reporter.stage("loops"):
        states = tuple(
            steps("loop", partial(_state, model, energy, float(test.cycles_at(energy)), amplitude))
            for energy in energies_within(case.energies, last, reporter)
        )
    with reporter.stage("check of the jumps"):
        numbers = steps("check of the jumps", lambda: _ageing_numbers(model, test, amplitude))
    cycles = test.total_cycles
    ended = {"cycles": cycles, "energy": last, "duration": cycles / case.drive.frequency}
    curve = evolution_curve(model, last, test, rate)
    return TimeOutcome(case, states, curve, ended | {"ageing": numbers})


def _state(model: JointModel, energy: float, cycles: float, amplitude: float) -> State:
    displacement, force, dissipated = steady_loop(model.at(energy), amplitude)
    parameters = model.parameters(energy)
    numbers = {
        "energy_per_cycle": dissipated,
        "stroke": float(np.ptp(displacement)),
        "force": 0.5 * float(np.ptp(force)),
        "extracted": extracted(displacement, force, parameters["normal_load"]),
    }
    curves = {"loop": {"displacement": displacement, "force": force}}
    return State(energy, cycles, parameters, numbers, curves)


def steady_loop(law: Laws, amplitude: float) -> tuple[Array, Array, float]:
    """Return a settled cycle between ± ``amplitude`` [mm]: displacement, force, and energy.

    The cycle begins and ends at a reversal; the energy is the dissipated one.
    """
    phase = np.linspace(0.0, 2.0 * np.pi, LOOP_POINTS + 1)
    moved = amplitude * np.cos(phase)[:, None, None]
    settling = np.array([amplitude, *[-amplitude, amplitude] * SETTLING])[:, None, None]
    begin = np.zeros((1, 1))
    settled = march_joints(law, law.rest(1), begin, settling)
    cycle = march_joints(law, settled.state, settling[-1], moved)
    return moved[:, 0, 0], cycle.force[:, 0, 0], float(cycle.dissipated.sum())


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
        return long_test(
            rate,
            np.inf if ageing.cycles is None else ageing.cycles,
            until=np.inf if ageing.energy is None else ageing.energy,
            tolerance=ageing.tolerance,
            breaks=breaks,
        )
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
                f"energies: {joules(energy)} are not reached: the test ends at {joules(last)}"
            )
    yield last


def evolution_curve(
    model: JointModel,
    last: float,
    test: LongTest | None = None,
    rate: Callable[[float], float] | None = None,
) -> Arrays:
    """Return parameters over the energy up to the ``last``, with cycles if the joint is aged.

    Cycles come with the energy per cycle.
    """
    energy = np.array([0.0])
    if last > 0.0:
        even = np.linspace(0.0, last, CURVE_POINTS)
        energy = np.union1d(even, np.geomspace(CURVE_BEGIN * last, last, CURVE_POINTS)[:-1])
    parameters = [model.parameters(dissipated) for dissipated in energy.tolist()]
    curve = {"energy": energy}
    if test is not None and rate is not None:
        per_cycle = np.array([rate(dissipated) for dissipated in energy.tolist()])
        curve |= {"cycles": test.cycles_at(energy), "energy_per_cycle": per_cycle}
    return curve | {
        name: np.array([values[name] for values in parameters]) for name in parameters[0]
    }


def _ageing_numbers(model: JointModel, test: LongTest, amplitude: float) -> dict[str, Any]:
    """Return the accuracy of the jumps: as estimated, and against cycles computed one by one."""
    numbers: dict[str, Any] = {"error": test.error, "evaluations": test.evaluations}
    first = np.floor(0.5 * test.total_cycles)
    cycles = int(min(STRETCH, test.total_cycles - first))
    if cycles < 1:
        return numbers
    begin = float(test.energy_at(first))
    marched = marched_stroke(model.line_law, model.evolution, amplitude, start=begin)
    stretch = integrate_cycles(test, marched, first, cycles)
    return numbers | {
        "stretch": {
            "first": float(first),
            "cycles": cycles,
            "difference": stretch.difference,
            "stated": stretch.stated,
        }
    }
