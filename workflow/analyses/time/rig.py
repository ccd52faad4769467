"""A rig with a joint: in steady vibration, driven by a recorded force, or hit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from fe_models.dynamics.excitation import HarmonicForce, RecordedForce
from fe_models.dynamics.motion import Start
from fe_models.dynamics.transient.newmark import TimeStepControl
from sa_solver.steps import Steps
from sa_solver.types import Array
from wear.joints.ageing import LongTest
from workflow.analyses.rig import excitation as given
from workflow.analyses.rig.building import rig_model
from workflow.analyses.rig.structure import own_laws
from workflow.analyses.time.case import Ageing, Integration, RigCase, joules
from workflow.analyses.time.hammer import run_hammer
from workflow.analyses.time.joint import aged, energies_within, extracted, test_end
from workflow.analyses.time.joint_model import JointModel
from workflow.analyses.time.memory import memory
from workflow.analyses.time.motion import (
    motion_curves,
    motion_numbers,
    motion_of,
    step_control,
    warn_of_steps,
)
from workflow.analyses.time.outcome import State, TimeOutcome
from workflow.errors import MethodFailed
from workflow.messages.warning_kinds import WarningKind
from workflow.models.rig.joint import evolution_curve
from workflow.models.rig.rig_model import RigModel
from workflow.shell.terminal.reporter import Reporter

# Cycles in a row that must change little before a state is steady: a single one may do so while a
# slow mode turns.
IN_A_ROW = 3
# Number of steady states of an ageing at first, without that at energy 0, and at most. It is
# doubled until the cycles agree. The change by a doubling is CHANGE = 2³ - 1 times the remaining
# error, as cubics between the states are of order 3 to 4.
FEWEST_STATES, MOST_STATES, CHANGE = 6, 48, 7.0
# The first settled state takes as long as this many others, which start from a state nearby.
FROM_REST = 4
# First state after energy 0, as a share of the last energy: friction that rises as ln E changes
# early.
FIRST_STATE = 1e-6


@dataclass(frozen=True)
class SteadyCycle:
    """The last of ``periods`` cycles, and the state from which to continue.

    ``amplitudes`` ``(k,)`` are those of the observed displacements [mm]. Of the joints, ``stretch``
    [mm] and ``force`` [N] are ``(t,)``, ``energy`` [N mm] is the dissipated one, and ``contact``
    has the normal forces. ``change`` is the change of energy and stroke from the cycle before,
    ``error`` the error of the displacement by time steps, both relative.
    """

    amplitudes: Array
    stretch: Array
    force: Array
    energy: float
    contact: dict[str, Any]
    periods: int
    change: float
    error: float
    end: Start


def run_rig(case: RigCase, reporter: Reporter, steps: Steps) -> TimeOutcome:
    """Run a rig at all energies of the case.

    Raises MethodFailed where a motion is not found or not steady, UserError where the joint can
    never dissipate the energy of the ageing.
    """
    rig = rig_model(case.structure, case.joint, case.excitation.mass, reporter)
    memory(case, len(rig.model.mass)).check()
    joint = JointModel.of(case, rig.counts, own_laws(case.structure))
    runs = {"hammer": run_hammer, "recorded": _run_recorded, "harmonic": _run_harmonic}
    outcome = runs[case.excitation.kind](case, rig, joint, reporter, steps)
    numbers = {"free": rig.free(), **outcome.numbers}
    return replace(outcome, numbers=numbers, seen=rig.labels)


# --- recorded -----------------------------------------------------------------------------------


def _run_recorded(
    case: RigCase, rig: RigModel, joint: JointModel, reporter: Reporter, steps: Steps
) -> TimeOutcome:
    assert isinstance(case.excitation, given.Recorded)
    times, samples = case.excitation.read()
    force = RecordedForce(rig.driven, times, samples)
    control, begin = step_control(case), Start(time=float(times[0]))
    duration, states, tell = float(np.ptp(times)), [], reporter.reached
    with reporter.course("motions"):
        for energy in reporter.parts(case.energies, joules):
            with reporter.stage("motion"):
                motion = motion_of(rig, joint, energy, force, duration, control, begin, steps, tell)
            largest = {"largest_force": float(np.abs(rig.loop(motion)[1]).max())}
            numbers = rig.modes(joint.at(energy)) | motion_numbers(rig, motion) | largest
            warn_of_steps(energy, motion.error, reporter)
            curves = {"motion": motion_curves(rig, motion, force)}
            states.append(State(energy, None, joint.parameters(energy), numbers, curves))
    return TimeOutcome(case, tuple(states), evolution_curve(joint, case.energies[-1]))


# --- harmonic -----------------------------------------------------------------------------------


def _run_harmonic(
    case: RigCase, rig: RigModel, joint: JointModel, reporter: Reporter, steps: Steps
) -> TimeOutcome:
    assert isinstance(case.excitation, given.Harmonic)
    steady = _SteadyStates(case.excitation, case.integration, rig, joint, reporter, steps)
    energies, rate, test = list(case.energies), None, None
    cycles: list[float | None] = [None] * len(energies)
    numbers: dict[str, Any] = {}
    with reporter.course("steady states"):
        if case.ageing.wanted:
            with reporter.stage("ageing"):
                rate, test, numbers = _aged(case, steady, joint, reporter)
            energies = list(energies_within(case.energies, numbers["energy"], reporter))
            cycles = test.cycles_at(np.array(energies)).tolist()
        with reporter.stage("steady states"):
            expected = len({*steady.settled, *energies})
            states = tuple(
                _steady_state(rig, joint, energy, steady.at(energy, expected), reached)
                for energy, reached in zip(energies, cycles, strict=True)
            )
    for state in states:
        warn_of_steps(state.energy, state.numbers["step_error"], reporter)
    return TimeOutcome(case, states, evolution_curve(joint, energies[-1], test, rate), numbers)


def _steady_state(
    rig: RigModel,
    joint: JointModel,
    energy: float,
    cycle: SteadyCycle,
    cycles: float | None,
) -> State:
    parameters = joint.parameters(energy)
    numbers: dict[str, Any] = rig.modes(joint.at(energy)) | {
        "stroke": float(np.ptp(cycle.stretch)),
        "energy_per_cycle": cycle.energy,
        "force": 0.5 * float(np.ptp(cycle.force)),
        "amplitudes": cycle.amplitudes.tolist(),
        **cycle.contact,
        "extracted": extracted(cycle.stretch, cycle.force, parameters["normal_load"]),
        "periods": cycle.periods,
        "change": cycle.change,
        "step_error": cycle.error,
    }
    curves = {"loop": {"displacement": cycle.stretch, "force": cycle.force}}
    return State(energy, cycles, parameters, numbers, curves)


@dataclass(frozen=True)
class _Settling:
    """A rig on its way to a steady state, after a number of ``periods``.

    The next period begins at ``start``. ``now`` are energy and stroke of the last one. Their
    ``change`` has been small for ``in_a_row`` periods, and ``steady`` is the last period once that
    is enough.
    """

    start: Start | None
    now: Array
    change: float = np.inf
    in_a_row: int = 0
    periods: int = 0
    steady: SteadyCycle | None = None


@dataclass(frozen=True)
class _SteadyStates:
    """Steady states of a rig at any energy, each computed once, from the nearest one."""

    excitation: given.Harmonic
    integration: Integration
    rig: RigModel
    joint: JointModel
    reporter: Reporter
    steps: Steps
    settled: dict[float, SteadyCycle] = field(default_factory=dict)

    def at(self, energy: float, expected: int) -> SteadyCycle:
        """Return the steady cycle after a dissipated ``energy`` [N mm].

        ``expected`` is the approximate number of steady states in all, for the progress.
        """
        if energy not in self.settled:
            near = min(self.settled, key=lambda settled: abs(settled - energy), default=None)
            start, done = None if near is None else self.settled[near].end, len(self.settled)
            end = done + FROM_REST
            begin, whole = 0 if start is None else end - 1, max(expected + FROM_REST - 1, end)
            with self.reporter.part(begin / whole, end / whole, joules(energy)):
                self.settled[energy] = self._settle(energy, start)
        return self.settled[energy]

    def _settle(self, energy: float, start: Start | None) -> SteadyCycle:
        excitation, rig, period = self.excitation, self.rig, 1.0 / self.excitation.frequency
        force = HarmonicForce(rig.driven, excitation.force, excitation.frequency)
        # An even number, so that a step-doubling run ends with the period.
        steps = 2 * int(np.ceil(0.5 * period / self.integration.step - 1e-9))
        control = TimeStepControl(period / steps, self.integration.tolerance)
        if start is not None:
            # Set the time back to the beginning of a period, as large times would lose digits.
            start = replace(start, time=0.0)
        first, settled = 1.0, 0.0

        def tell(change: float, periods: int) -> None:
            nonlocal first, settled
            if np.isfinite(change):
                # The change falls by about the same factor in each period.
                first = max(first, change)
                fallen = np.log(first / max(change, excitation.steady))
                settled = max(settled, float(fallen / np.log(first / excitation.steady)))
                self.reporter.reached(settled, f"period {periods}")

        def further(last: _Settling) -> _Settling | None:
            if last.steady is not None or last.periods == excitation.periods:
                return None
            motion = motion_of(rig, self.joint, energy, force, period, control, last.start)
            dissipated = float(motion.energies.joints[-1, rig.shared].sum())
            stretch, joint_force = rig.loop(motion)
            now = np.array([dissipated, np.ptp(stretch)])
            change, periods = _change(now, last.now), last.periods + 1
            tell(change, periods)
            in_a_row = last.in_a_row + 1 if change <= excitation.steady else 0
            begin, steady = replace(motion.end, time=0.0), None
            if in_a_row == IN_A_ROW:
                steady = SteadyCycle(
                    0.5 * np.ptp(motion.displacement @ rig.seen.T, axis=0),
                    stretch,
                    joint_force,
                    dissipated,
                    rig.contact(motion),
                    periods,
                    change,
                    motion.error,
                    begin,
                )
            return _Settling(begin, now, change, in_a_row, periods, steady)

        last = self.steps.march("period", _Settling(start, np.full(2, np.inf)), further)
        if last.steady is None:
            raise MethodFailed(
                f"no steady state at {joules(energy)} after {excitation.periods} cycles, which "
                f"still change by {last.change:.1e}: raise excitation.periods or excitation.steady"
            )
        return last.steady


def _change(now: Array, before: Array) -> float:
    """Return the larger relative change of energy and stroke; 0 for values that stay at 0."""
    if not np.isfinite(before).all():
        return np.inf
    scale = np.where(now > 0.0, now, 1.0)
    return float(np.max(np.abs(now - before) / scale))


# --- ageing -------------------------------------------------------------------------------------


def _aged(
    case: RigCase, steady: _SteadyStates, joint: JointModel, reporter: Reporter
) -> tuple[Callable[[float], float], LongTest, dict[str, Any]]:
    """Return the energy per cycle between steady states, the long test, and its numbers.

    Steady states are added between the existing ones until the cycles are accurate enough.
    """
    ageing, breaks = case.ageing, joint.evolution.breaks
    end = ageing.energy or _energy_of(ageing, steady)
    nodes = [0.0, *np.geomspace(FIRST_STATE * end, end, FEWEST_STATES).tolist()]
    before = np.inf
    while True:
        # Usually the states are doubled once; those that the case asks for come on top.
        expected = len(case.energies) + 2 * len(nodes)
        rate = _between(nodes, [steady.at(energy, expected).energy for energy in nodes])
        test = aged(rate, ageing, (*breaks, *nodes[1:-1]))
        last = test_end(test, ageing)
        cycles = test.total_cycles
        # If the end is given by energy, the cycles change; if by cycles, the energy.
        now = cycles if ageing.energy is not None else last
        error = abs(now - before) / now / CHANGE
        if error <= ageing.tolerance or len(nodes) > MOST_STATES:
            break
        before = now
        inner = np.sqrt(np.multiply(nodes[1:-1], nodes[2:])).tolist()
        nodes = sorted({*nodes, *inner, max(last, nodes[-1])})
    if error > ageing.tolerance:
        reporter.warn(
            WarningKind.INACCURATE_AGEING,
            f"ageing: {len(nodes)} steady states cause an error of about {error:.1e}, above "
            f"ageing.tolerance {ageing.tolerance:g}",
        )
    numbers = {"relative_error": error, "steady_states": len(nodes)}
    return rate, test, {"cycles": cycles, "energy": last, "ageing": numbers}


def _energy_of(ageing: Ageing, steady: _SteadyStates) -> float:
    """Return the approximate energy of the cycles of the ageing [N mm]."""
    assert ageing.cycles is not None
    unworn = steady.at(0.0, FEWEST_STATES).energy
    energy = ageing.cycles * unworn
    return ageing.cycles * max(steady.at(energy, FEWEST_STATES).energy, unworn)


def _between(energies: list[float], rates: list[float]) -> Callable[[float], float]:
    """Return the energy of a cycle, interpolated over ln(E + E1); constant beyond the last."""
    places, floor = np.asarray(energies), energies[1]
    curve = PchipInterpolator(np.log(places + floor), rates)

    def rate(energy: float) -> float:
        return max(float(curve(np.log(min(energy, places[-1]) + floor))), 0.0)

    return rate
