"""A friction rig whose specimens wear each other: motion, wear, motion, responses on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from sa_solver.steps import Steps
from wear.nodes import NodalState
from wear.steppers import HeunStepper
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.vibration.case import VibrationCase
from workflow.analyses.vibration.loops import loop_of
from workflow.analyses.vibration.model import VibrationModel
from workflow.analyses.vibration.outcome import Curves
from workflow.analyses.vibration_wear.case import FrictionRigWearCase
from workflow.analyses.vibration_wear.outcome import (
    LOOP,
    NODES,
    VibrationWearOutcome,
    WornState,
    depth_fields,
    path_field,
    step_error,
    wearing_loop,
)
from workflow.analyses.vibration_wear.pads import PadCycle, WearingPads
from workflow.analyses.vibration_wear.states import responses_to_all, worn_states
from workflow.case.loading import load_case
from workflow.case.plain import counted
from workflow.shell.dataset import Dataset
from workflow.shell.reporter import Reporter


def wear_specimens(
    case: FrictionRigWearCase, reporter: Reporter, steps: Steps
) -> VibrationWearOutcome:
    """All that is kept of a run."""
    wear = case.wear
    unworn = VibrationModel.of(case.unworn, reporter)
    specimens = load_case(case.structure.specimens, [SpecimensCase])
    pads = WearingPads(unworn, specimens.laws, case.wearing, wear.frequency, case.amount)
    state = pads.begin()
    with reporter.stage("wear"):
        pads.at(state)

    def describe(state: NodalState, cycles: float, taken: int) -> WornState:
        reached = cycles, taken
        worn = _worn_state(case.unworn, pads.at(state), state, reached, reporter, steps)
        if worn.numbers["step_error"] > wear.tolerance:
            reporter.warn(
                f"{cycles:g} cycles: wear steps leave an error of {worn.numbers['step_error']:.2g} "
                f"of depth or volume, above wear.tolerance {wear.tolerance:g}: lower it, or raise "
                "resolution.samples or resolution.harmonics"
            )
        return worn

    stepper = HeunStepper(wear.tolerance)
    states = worn_states(wear.cycles, stepper, state, pads.contact_at, describe, reporter, steps)
    rig = unworn.rig
    places = {
        "x": Dataset(rig.places[:, 0], "mm", "of each node on the contact plane"),
        "y": Dataset(rig.places[:, 1], "mm", "of each node on the contact plane"),
        "area": Dataset(rig.area, "mm^2", "that belongs to each node"),
    }
    return VibrationWearOutcome(case, states, places=places)


def _worn_state(
    case: VibrationCase,
    cycle: PadCycle,
    state: NodalState,
    reached: tuple[float, int],
    reporter: Reporter,
    steps: Steps,
) -> WornState:
    """The pads in a state, ``reached`` by so many cycles in all and steps since the last."""
    cycles, taken = reached
    loop = loop_of(cycle.model, cycle.motion, case.laws[0].normal_load)
    error, responses = responses_to_all(case, cycle.model, cycle.motion, reporter, steps)
    depth = state.surfaces.depth
    numbers: dict[str, Any] = {
        "cycles": cycles,
        "steps": taken,
        "energy": state.energy,
        "volume": float(depth @ cycle.areas),
        "depth": float(depth.max()),
        "step_error": step_error(state, cycle.areas),
        "friction": float(np.max(cycle.law.friction)),
        # Not of the loop: nodes that hardly touch slip at once, and it may never stick as a whole.
        "stiffness": cycle.model.stuck_slope(cycle.motion.frequency),
        "stroke": loop.numbers["stroke"],
        "energy_per_cycle": float(cycle.energy.sum()),
        "error": error,
        **cycle.model.numbers(),
    }
    reporter.log(
        f"{cycles:g} cycles: {counted(taken, 'step')}, "
        f"{counted(numbers['touching'], 'node')} touching, stroke {numbers['stroke']:.4g} mm"
    )
    return WornState(cycles, numbers, _fields(cycle, state, loop), responses)


def _fields(cycle: PadCycle, state: NodalState, loop: Curves) -> dict[str, dict[str, Dataset]]:
    gap, pressed = np.asarray(cycle.law.gap), cycle.model.rest.cycle.samples[0, :, 2]
    moved, pulled = (loop.datasets[name].values for name in ("displacement", "force"))
    return {
        NODES: {
            "gap": Dataset(gap, "mm", "of the worn bodies without load"),
            **depth_fields(*state.surfaces.depths),
            "normal_force": Dataset(pressed, "N", "of each node at rest"),
            "path": path_field(cycle.path),
            "energy": Dataset(cycle.energy, "N mm", "that each node dissipates in such a cycle"),
        },
        LOOP: wearing_loop(moved, pulled),
    }
