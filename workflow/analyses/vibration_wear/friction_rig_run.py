"""A friction rig whose specimens wear each other: motion, wear, motion, responses on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from sa_solver.types import Array
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.vibration.model import VibrationModel
from workflow.analyses.vibration.outcome import Curves
from workflow.analyses.vibration.response import loop_of, response_under
from workflow.analyses.vibration_wear.case import FrictionRigWearCase
from workflow.analyses.vibration_wear.outcome import (
    LOOP,
    NODES,
    VibrationWearOutcome,
    WornState,
    depth_fields,
    path_field,
    wearing_loop,
)
from workflow.analyses.vibration_wear.pad_wear_steps import PadState, worn_until
from workflow.analyses.vibration_wear.pads import RubbedPads, WearingPads
from workflow.case.loading import load_named
from workflow.shell.dataset import Dataset
from workflow.shell.reporter import Reporter


def wear_specimens(case: FrictionRigWearCase, reporter: Reporter) -> VibrationWearOutcome:
    """All that is kept of a run."""
    own = case.wear
    unworn = VibrationModel.of(case.unworn, reporter)
    pads = WearingPads(unworn, _coefficients(case), own.force, own.frequency)
    with reporter.stage("wear"):
        state = PadState.new(pads)
    states = [_kept(case, pads, state, state.steps, reporter)]
    with reporter.jumps(own.cycles[-1], 0.0) as progress:
        for cycles in own.cycles:
            before = state.steps
            with reporter.stage("wear"):
                state = worn_until(pads, state, cycles, own.tolerance)
            states.append(_kept(case, pads, state, state.steps - before, reporter))
            progress.update(cycles, len(states) - 1)
    rig = unworn.rig
    assert rig.places is not None
    assert rig.area is not None
    places = {
        "x": Dataset(rig.places[:, 0], "mm", "of each node on the contact plane"),
        "y": Dataset(rig.places[:, 1], "mm", "of each node on the contact plane"),
        "area": Dataset(rig.area, "mm^2", "that belongs to each node"),
    }
    return VibrationWearOutcome(case, tuple(states), places=places)


def _coefficients(case: FrictionRigWearCase) -> tuple[float, float]:
    """Of body 1 and 2 [1/MPa], from the case whose specimens the rig has been made of."""
    file = case.structure.specimens
    specimens = load_named("structure.specimens", file, [SpecimensCase], "specimens")
    return specimens.wear.body_1.coefficient, specimens.wear.body_2.coefficient


def _kept(
    case: FrictionRigWearCase, pads: WearingPads, state: PadState, steps: int, reporter: Reporter
) -> WornState:
    """The pads in a state, reached in ``steps`` since the last, and the rig on them."""
    rubbed, of_state = state.rubbed, case.unworn
    loop = loop_of(of_state, rubbed.model, rubbed.motion)
    with reporter.stage("response"):
        found = [response_under(of_state, rubbed.model, own, reporter)[0] for own in case.forces]
    numbers: dict[str, Any] = {"cycles": state.cycles, "steps": steps, "energy": state.energy}
    numbers |= _numbers(rubbed, state.depth, loop) | rubbed.model.numbers()
    if state.worst > case.wear.tolerance:
        reporter.warn(
            f"{state.cycles:g} cycles: steps of the shortest length left an error of "
            f"{state.worst:.2g}, above wear.tolerance {case.wear.tolerance:g}: raise "
            "resolution.samples or resolution.harmonics"
        )
    tolerance = case.resolution.tolerance
    if tolerance is not None and rubbed.motion.left_out > tolerance:
        reporter.warn(
            f"the motion that wears leaves out harmonics of {rubbed.motion.left_out:.1e}, above "
            "resolution.tolerance: raise resolution.harmonics, those to begin with"
        )
    reporter.log(
        f"{state.cycles:g} cycles: {steps} steps, {numbers['touching']} nodes touch, "
        f"stroke {numbers['stroke']:.4g} mm"
    )
    return WornState(state.cycles, numbers, _fields(pads, state, loop), tuple(found))


def _numbers(rubbed: RubbedPads, depth: Array, loop: Curves) -> dict[str, Any]:
    return {
        "volume": float(depth @ rubbed.area),
        "depth": float(depth.max()),
        "friction": float(np.max(rubbed.law.friction)),
        # None where no increment of the loop sticks.
        "stiffness": np.nan if loop.numbers["stiffness"] is None else loop.numbers["stiffness"],
        "stroke": loop.numbers["stroke"],
        "energy_per_cycle": float(rubbed.energy.sum()),
        "left_out": rubbed.motion.left_out,
    }


def _fields(pads: WearingPads, state: PadState, loop: Curves) -> dict[str, dict[str, Dataset]]:
    rubbed = state.rubbed
    gap, pressed = np.asarray(rubbed.law.gap), rubbed.model.rest.cycle.samples[0, :, 2]
    moved, pulled = (loop.datasets[name].values for name in ("displacement", "force"))
    return {
        NODES: {
            "gap": Dataset(gap, "mm", "of the worn bodies without load"),
            **depth_fields(*pads.depths(state.depth)),
            "normal_force": Dataset(pressed, "N", "of each node at rest"),
            "path": path_field(rubbed.path),
            "energy": Dataset(rubbed.energy, "N mm", "that each node dissipates in such a cycle"),
        },
        LOOP: wearing_loop(moved, pulled),
    }
