"""A rig with a joint: shaken until it is steady, driven by a recorded force, or hit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from fe_models.dynamics.excitation import Force, Harmonic, Recorded
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.motion import Motion, Start
from fe_models.dynamics.newmark import StepControl, integrate
from fe_models.dynamics.rig import Link, lumped_rig, natural_frequencies, unit_force
from sa_solver.types import Array
from wear.joints.ageing import LongTest
from workflow.case import RigCase
from workflow.case import excitation as given
from workflow.case.input_files import read_columns
from workflow.case.time_case import Ageing, Rig
from workflow.errors import MethodFailed
from workflow.joint_model import JointModel, Law
from workflow.reporter import Reporter
from workflow.time_joint import aged, energies_within, evolution_curve, extracted, test_end
from workflow.time_outcome import LOOP, MOTION, State, TimeOutcome

# Cycles in a row that must change little before a state is steady: one alone may change little
# while a slow mode turns.
IN_A_ROW = 3
# Steady states that an ageing is first built on, beside that of no energy, and at most. Doubled
# until the cycles agree.
FEWEST_STATES, MOST_STATES = 6, 48
# The first of them, as a share of the last energy: friction that rises as ln E changes early.
FIRST_STATE = 1e-6


@dataclass(frozen=True)
class SteadyCycle:
    """The last of ``periods`` cycles, and where to go on from.

    ``displacement`` ``(k, n)`` of the masses [mm]; of the joint ``stretch`` [mm] and ``force`` [N]
    ``(k,)``, and ``energy`` [N mm] that it dissipates. ``change`` is that of energy and stroke from
    the cycle before, ``error`` what one step may add to the displacement, both relative.
    """

    displacement: Array
    stretch: Array
    force: Array
    energy: float
    periods: int
    change: float
    error: float
    end: Start


def run_rig(case: RigCase, reporter: Reporter) -> TimeOutcome:
    """Run a rig at all energies that are asked for.

    Raises MethodFailed where a motion is not found or not steady, UserError where the joint can
    never dissipate what it is to be aged by.
    """
    model, joint = rig_model(case.structure), JointModel.of(case)
    if isinstance(case.excitation, given.Hammer):
        from workflow.time_hammer import run_hammer

        outcome = run_hammer(case, model, joint, reporter)
    elif isinstance(case.excitation, given.Recorded):
        outcome = _run_recorded(case, case.excitation, model, joint, reporter)
    else:
        outcome = _run_harmonic(case, case.excitation, model, joint, reporter)
    return replace(outcome, numbers={"free": free_modes(model), **outcome.numbers})


def rig_model(rig: Rig) -> DynamicModel:
    """Masses m1, m2, ... in a row from the ground on, the last held to the ground by the joint."""
    names = [f"m{number}" for number in range(1, len(rig.masses) + 1)]
    links = [Link(name, before) for name, before in zip(names, [None, *names], strict=False)]
    return lumped_rig(
        dict(zip(names, rig.masses, strict=True)),
        dict(zip(links, rig.springs, strict=True)),
        [[Link(names[-1])]],
        rig.damping_ratio,
    )


def force_on(model: DynamicModel, mass: int) -> Array:
    """A force of 1 N on the mass of that number, ``(n,)``."""
    return unit_force(model, f"m{mass}")


def free_modes(model: DynamicModel) -> list[float]:
    """Natural frequencies without the joint [Hz]."""
    found: list[float] = natural_frequencies(model).tolist()
    return found


def modes(model: DynamicModel, law: Law) -> dict[str, list[float]]:
    """Natural frequencies with the joint stuck, and with all of it sliding [Hz]."""
    stuck = law.respond(law.rest(1), np.zeros((1, 1))).tangent
    sliding = getattr(law, "residual_stiffness", 0.0)
    return {
        "stuck": natural_frequencies(model, stuck).tolist(),
        "sliding": natural_frequencies(model, sliding).tolist(),
    }


def check_motion(motion: Motion, energy: float) -> None:
    """Raise MethodFailed for a motion that was not found to its end."""
    if not motion.converged:
        raise MethodFailed(f"motion at {energy:g} N mm: {motion.message}; lower integration.step")


# --- recorded -----------------------------------------------------------------------------------


def _run_recorded(
    case: RigCase,
    excitation: given.Recorded,
    model: DynamicModel,
    joint: JointModel,
    reporter: Reporter,
) -> TimeOutcome:
    columns = read_columns(excitation.file, given.RECORDED)
    times = columns["time"]
    force = Recorded(force_on(model, excitation.mass), times, columns["force"])
    states = []
    for energy in case.energies:
        law = joint.at(energy)
        with reporter.stage("motion"):
            control, begin = StepControl(case.integration.step), Start(time=float(times[0]))
            motion = integrate(model, law, force, float(np.ptp(times)), control, begin)
        check_motion(motion, energy)
        last = motion.displacement[:, -1]
        numbers = modes(model, law) | {
            "dissipated": float(motion.energies.joints[-1, 0]),
            "largest_displacement": float(np.abs(last).max()),
            "largest_force": float(np.abs(motion.joint_force).max()),
            "step_error": motion.error,
        }
        curves = {MOTION: motion_curves(motion, force)}
        states.append(State(energy, None, joint.parameters(energy), numbers, curves))
    return TimeOutcome(case, tuple(states), evolution_curve(joint, case.energies[-1]))


def motion_curves(motion: Motion, force: Force) -> dict[str, Array]:
    """What is kept of a motion."""
    return {
        "time": motion.times,
        "excitation": force.value(motion.times),
        "displacement": motion.displacement,
        "acceleration": motion.acceleration,
        "joint_force": motion.joint_force[:, 0, 0],
        "dissipated": motion.energies.joints[:, 0],
    }


# --- harmonic -----------------------------------------------------------------------------------


def _run_harmonic(
    case: RigCase,
    excitation: given.Harmonic,
    model: DynamicModel,
    joint: JointModel,
    reporter: Reporter,
) -> TimeOutcome:
    steady = _SteadyStates(case, excitation, model, joint)
    energies, cycles, rate, test = list(case.energies), None, None, None
    numbers: dict[str, Any] = {}
    if case.ageing.wanted:
        with reporter.stage("ageing"):
            rate, test, numbers = _aged(case.ageing, steady, joint, reporter)
        energies = list(energies_within(case.energies, numbers["energy"], reporter))
        cycles = test.cycles_at(np.array(energies)).tolist()
    with reporter.stage("steady states"):
        states = tuple(
            _steady_state(model, joint, energy, steady.at(energy), cycles and cycles[number])
            for number, energy in enumerate(energies)
        )
    return TimeOutcome(case, states, evolution_curve(joint, energies[-1], test, rate), numbers)


def _steady_state(
    model: DynamicModel,
    joint: JointModel,
    energy: float,
    cycle: SteadyCycle,
    cycles: float | None,
) -> State:
    parameters = joint.parameters(energy)
    numbers: dict[str, Any] = modes(model, joint.at(energy)) | {
        "stroke": float(np.ptp(cycle.stretch)),
        "energy_per_cycle": cycle.energy,
        "force": 0.5 * float(np.ptp(cycle.force)),
        "amplitudes": (0.5 * np.ptp(cycle.displacement, axis=0)).tolist(),
        "extracted": extracted(cycle.stretch, cycle.force, parameters["normal_load"]),
        "periods": cycle.periods,
        "change": cycle.change,
        "step_error": cycle.error,
    }
    curves = {LOOP: {"displacement": cycle.stretch, "force": cycle.force}}
    return State(energy, cycles, parameters, numbers, curves)


class _SteadyStates:
    """Steady states of a rig at any energy, each found once, from the one that is nearest."""

    def __init__(
        self,
        case: RigCase,
        excitation: given.Harmonic,
        model: DynamicModel,
        joint: JointModel,
    ) -> None:
        self._excitation, self._model, self._joint = excitation, model, joint
        self._steps = int(np.ceil(1.0 / (excitation.frequency * case.integration.step) - 1e-9))
        self._found: dict[float, SteadyCycle] = {}

    def at(self, energy: float) -> SteadyCycle:
        """The steady cycle after so much dissipated ``energy`` [N mm]."""
        if energy not in self._found:
            near = min(self._found, key=lambda own: abs(own - energy), default=None)
            start = None if near is None else self._found[near].end
            self._found[energy] = self._settle(energy, start)
        return self._found[energy]

    def _settle(self, energy: float, start: Start | None) -> SteadyCycle:
        excitation, law = self._excitation, self._joint.at(energy)
        period = 1.0 / excitation.frequency
        shape = force_on(self._model, excitation.mass)
        force = Harmonic(shape, excitation.force, excitation.frequency)
        control = StepControl(period / self._steps)
        if start is not None:
            # Where a period begins, whatever came before: times must not lose their digits.
            start = replace(start, time=0.0)
        before, in_a_row = np.full(2, np.inf), 0
        for periods in range(1, excitation.periods + 1):
            motion = integrate(self._model, law, force, period, control, start)
            check_motion(motion, energy)
            start = replace(motion.end, time=0.0)
            dissipated = float(motion.energies.joints[-1, 0])
            stretch = motion.joint_displacement[:, 0, 0]
            now = np.array([dissipated, np.ptp(stretch)])
            change = _change(now, before)
            in_a_row = in_a_row + 1 if change <= excitation.steady else 0
            if in_a_row == IN_A_ROW:
                return SteadyCycle(
                    motion.displacement,
                    stretch,
                    motion.joint_force[:, 0, 0],
                    dissipated,
                    periods,
                    change,
                    motion.error,
                    start,
                )
            before = now
        raise MethodFailed(
            f"no steady state at {energy:g} N mm after {excitation.periods} cycles: they still "
            f"change by {change:.1e}; raise excitation.periods or excitation.steady"
        )


def _change(now: Array, before: Array) -> float:
    """The larger relative change of energy and stroke; of what stays at nothing there is none."""
    if not np.isfinite(before).all():
        return np.inf
    scale = np.where(now > 0.0, now, 1.0)
    return float(np.max(np.abs(now - before) / scale))


# --- ageing -------------------------------------------------------------------------------------


def _aged(
    ageing: Ageing, steady: _SteadyStates, joint: JointModel, reporter: Reporter
) -> tuple[Callable[[float], float], LongTest, dict[str, Any]]:
    """Energy per cycle between steady states, the test that it makes, and its numbers.

    Steady states are added between those there are until they no longer change the cycles.
    """
    breaks = joint.evolution.breaks
    end = ageing.energy or _energy_of(ageing, steady)
    nodes = [0.0, *np.geomspace(FIRST_STATE * end, end, FEWEST_STATES).tolist()]
    before = np.inf
    while True:
        rate = _between(nodes, [steady.at(energy).energy for energy in nodes])
        test = aged(rate, ageing, (*breaks, *nodes[1:-1]))
        last = test_end(test, ageing)
        cycles = float(test.cycles_at(last))
        # By energy the cycles change, by cycles the energy.
        now = cycles if ageing.energy is not None else last
        change = abs(now - before) / now
        if change <= ageing.tolerance or len(nodes) > MOST_STATES:
            break
        before = now
        inner = np.sqrt(np.multiply(nodes[1:-1], nodes[2:])).tolist()
        nodes = sorted({*nodes, *inner, max(last, nodes[-1])})
    if change > ageing.tolerance:
        reporter.warn(
            f"ageing: {len(nodes)} steady states leave an error of about {change:.1e}, above "
            f"ageing.tolerance {ageing.tolerance:g}"
        )
    numbers = {"error": change * cycles, "steady_states": len(nodes)}
    return rate, test, {"cycles": cycles, "energy": last, "ageing": numbers}


def _energy_of(ageing: Ageing, steady: _SteadyStates) -> float:
    """About the energy of so many cycles [N mm]."""
    assert ageing.cycles is not None
    energy = ageing.cycles * steady.at(0.0).energy
    return ageing.cycles * max(steady.at(energy).energy, steady.at(0.0).energy)


def _between(energies: list[float], rates: list[float]) -> Callable[[float], float]:
    """Energy of a cycle between those computed, over ln(E + E1); constant beyond the last."""
    places, floor = np.asarray(energies), energies[1]
    curve = PchipInterpolator(np.log(places + floor), rates)

    def rate(energy: float) -> float:
        return max(float(curve(np.log(min(energy, places[-1]) + floor))), 0.0)

    return rate
