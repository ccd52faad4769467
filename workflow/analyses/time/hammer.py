"""Hammer tests of a rig: frequency response and ring-down of its first mode, at every energy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fe_models.dynamics.excitation import HammerBlow
from fe_models.dynamics.motion import Motion
from fe_models.dynamics.transient.free_decay import ring_down
from fe_models.dynamics.transient.impact_hammer import (
    FrequencyResponse,
    SignalError,
    frequency_response,
)
from sa_solver.steps import Steps
from workflow.analyses.rig import excitation as given
from workflow.analyses.time.case import RigCase, joules
from workflow.analyses.time.joint_model import JointModel
from workflow.analyses.time.motion import (
    motion_curves,
    motion_numbers,
    motion_of,
    step_control,
    warn_of_steps,
)
from workflow.analyses.time.outcome import State, TimeOutcome
from workflow.case.text.readable import percent
from workflow.errors import MethodFailed
from workflow.layout.declared import Arrays
from workflow.messages.warning_kinds import WarningKind
from workflow.models.rig.joint import evolution_curve
from workflow.models.rig.rig_model import RigModel
from workflow.shell.terminal.reporter import Reporter

# The second mode is searched between these multiples of its frequencies without the joint and with
# all of it stuck.
BELOW_FREE, ABOVE_STUCK = 0.95, 1.05
# A response that is still this large at the end of its record leaks into the frequency response.
AT_REST = 0.05
# Share of the largest displacement. A ring-down that is smaller, once the filter has settled, shows
# the filter and not the first mode.
NOTHING_LEFT = 1e-3
# Share of the energy dissipated in the record, at which a motion counts as decayed: a measure of
# damping without a mode.
DECAYED = 0.9
# Points of a ring-down in the results: few are enough, as it is smooth.
RING_DOWN_POINTS = 400
# Reason why a ring-down has no damping, and the result to use instead.
TOO_SHORT = (
    "the motion fades before the filter around its first mode settles, so damping and frequency "
    "against amplitude are not known; the frequency response is"
)


def run_hammer(
    case: RigCase, rig: RigModel, joint: JointModel, reporter: Reporter, steps: Steps
) -> TimeOutcome:
    """Hit the rig at every energy; the energy stays constant during the record.

    Raises MethodFailed where a motion is not found, or shows no resonance.
    """
    assert isinstance(case.excitation, given.Hammer)
    hammer, control = case.excitation, step_control(case)
    blow = HammerBlow(rig.driven, hammer.force, hammer.duration)
    states, tell = [], reporter.reached
    with reporter.course("motions"):
        for energy in reporter.parts(case.energies, joules):
            with reporter.stage("motion"):
                motion = motion_of(
                    rig, joint, energy, blow, hammer.record, control, steps=steps, reached=tell
                )
            warn_of_steps(energy, motion.error, reporter)
            with reporter.stage("signals"):
                states.append(_state(hammer, blow, rig, joint, energy, motion, reporter))
    curve = evolution_curve(joint, case.energies[-1])
    return TimeOutcome(case, tuple(states), curve, _change(states))


def _state(
    hammer: given.Hammer,
    blow: HammerBlow,
    rig: RigModel,
    joint: JointModel,
    energy: float,
    motion: Motion,
    reporter: Reporter,
) -> State:
    bounds, step = rig.modes(joint.at(energy)), float(motion.times[1] - motion.times[0])
    acceleration = rig.looked_at(motion.acceleration)
    response = frequency_response(blow.value(motion.times), acceleration, step)
    if response.remaining > AT_REST:
        reporter.warn(
            WarningKind.RECORD_ENDS_EARLY,
            f"at {joules(energy)} the record ends with {percent(response.remaining)} of the "
            "response left, which blurs its peaks: raise excitation.record",
        )
    peaks = _peak("first", response, *hammer.band, energy)
    if rig.in_a_row and len(bounds["stuck"]) > 1:
        ends = BELOW_FREE * rig.free()[1], ABOVE_STUCK * bounds["stuck"][1]
        if ends[1] < hammer.highest:
            peaks |= _peak("second", response, *ends, energy)
    decay = _ring_down(rig, motion, hammer, energy, reporter)
    numbers: dict[str, Any] = {
        **bounds,
        **peaks,
        "ring_down": _ends(decay),
        "decay_time": _decay_time(motion),
        "remaining": response.remaining,
        "resolution": float(response.frequency[0]),
        **motion_numbers(rig, motion),
    }
    seen = response.frequency <= hammer.highest
    curves = {
        "motion": motion_curves(rig, motion, blow),
        "frequency_response": {
            "frequency": response.frequency[seen],
            "magnitude": np.abs(response.value[seen]),
            "phase": np.angle(response.value[seen]),
        },
    }
    if decay is not None:
        curves["ring_down"] = decay
    return State(energy, None, joint.parameters(energy), numbers, curves)


def _peak(
    name: str, response: FrequencyResponse, lowest: float, highest: float, energy: float
) -> dict[str, float]:
    """Return frequency and height of the highest line between two frequencies [Hz].

    No mode is fitted to it, as joints that slide give peaks of another shape.
    """
    inside = (response.frequency >= lowest) & (response.frequency <= highest)
    lines, heights = response.frequency[inside], np.abs(response.value[inside])
    top = int(np.argmax(heights)) if len(heights) else 0
    if not 0 < top < len(lines) - 1:
        raise MethodFailed(
            f"at {joules(energy)} the response has no peak from {lowest:.4g} to {highest:.4g} Hz: "
            "change excitation.band, or raise excitation.record"
        )
    return {f"{name}_frequency": float(lines[top]), f"{name}_peak": float(heights[top])}


def _decay_time(motion: Motion) -> float:
    """Return the time in which the joints dissipate most of their energy in the record [s]."""
    dissipated = motion.energies.joints.sum(axis=1)
    place = int(np.searchsorted(dissipated, DECAYED * dissipated[-1]))
    return float(motion.times[place] - motion.times[0])


def _ring_down(
    rig: RigModel, motion: Motion, hammer: given.Hammer, energy: float, reporter: Reporter
) -> Arrays | None:
    """Return frequency and damping of the first mode against its amplitude.

    They are found from the acceleration, as in measurements, so that creep of the joint does not
    matter. Returns None if the motion has no ring-down.
    """
    free = motion.times > hammer.duration
    step = float(motion.times[1] - motion.times[0])
    try:
        decay = ring_down(rig.looked_at(motion.acceleration)[free], step, hammer.band)
    except SignalError as error:
        reporter.warn(WarningKind.NO_RING_DOWN, f"no ring-down at {joules(energy)}: {error}")
        return None
    amplitude = decay.amplitude / (2.0 * np.pi * decay.frequency) ** 2
    if amplitude[0] < NOTHING_LEFT * np.abs(rig.looked_at(motion.displacement)).max():
        reporter.warn(WarningKind.NO_RING_DOWN, f"no ring-down at {joules(energy)}: {TOO_SHORT}")
        return None
    kept = np.unique(np.linspace(0, len(amplitude) - 1, RING_DOWN_POINTS).astype(int))
    return {
        "amplitude": amplitude[kept],
        "frequency": decay.frequency[kept],
        "damping_ratio": decay.damping_ratio[kept],
    }


def _ends(decay: Arrays | None) -> dict[str, dict[str, float]] | None:
    """Return a ring-down where it is largest and where it is smallest."""
    if decay is None:
        return None
    return {
        when: {name: float(curve[place]) for name, curve in decay.items()}
        for when, place in (("largest", 0), ("smallest", -1))
    }


def _change(states: Sequence[State]) -> dict[str, Any]:
    """Return the change of the first mode by wear: ratios of last to first state, and signs.

    A sign is 1 for a rise, -1 for a fall. The damping is that at the largest amplitude of the
    ring-downs. A joint that dissipates nothing has no change.
    """
    if len(states) < 2:
        return {}
    first, last = (_first_mode(state) for state in (states[0], states[-1]))
    both = [name for name in first if name in last and first[name] > 0.0]
    return {
        "ratio": {name: last[name] / first[name] for name in both},
        "change": {name: float(np.sign(last[name] - first[name])) for name in both},
    }


def _first_mode(state: State) -> dict[str, float]:
    numbers = state.numbers
    mode = {name: numbers[name] for name in ("first_frequency", "first_peak", "decay_time")}
    if numbers["ring_down"] is not None:
        mode["damping_ratio"] = numbers["ring_down"]["largest"]["damping_ratio"]
    return mode
