"""A friction rig whose specimens wear each other: motion, wear, motion, responses on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from sa_solver.types import Array
from wear.nodes import NodalState
from wear.steppers import HeunStepper, advance_cycles
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
from workflow.analyses.vibration_wear.pads import RubbedPads, WearingPads
from workflow.case.loading import load_named
from workflow.shell.dataset import Dataset
from workflow.shell.reporter import Reporter


def wear_specimens(case: FrictionRigWearCase, reporter: Reporter) -> VibrationWearOutcome:
    """All that is kept of a run."""
    own = case.wear
    unworn = VibrationModel.of(case.unworn, reporter)
    file = case.structure.specimens
    specimens = load_named("structure.specimens", file, [SpecimensCase], "specimens")
    pads = WearingPads(unworn, specimens.laws, own.force, own.frequency)
    stepper, total, done = HeunStepper(own.tolerance), own.cycles[-1], 0.0
    state = pads.begin()
    with reporter.stage("wear"):
        pads.at(state)
    states, error = [_kept(case, pads, state, (0.0, 0), reporter)], 0.0
    with reporter.jumps(total, 0.0) as progress:
        for cycles in own.cycles:
            with reporter.stage("wear"):
                worn = advance_cycles(stepper, state, cycles - done, total - done, pads.contact_at)
            state, done, error = worn.state, cycles, max(error, worn.error)
            _warn_of_steps(case, cycles, error, reporter)
            states.append(_kept(case, pads, state, (cycles, worn.spent.steps), reporter))
            progress(cycles, len(states) - 1)
    rig = unworn.rig
    assert rig.places is not None
    assert rig.area is not None
    places = {
        "x": Dataset(rig.places[:, 0], "mm", "of each node on the contact plane"),
        "y": Dataset(rig.places[:, 1], "mm", "of each node on the contact plane"),
        "area": Dataset(rig.area, "mm^2", "that belongs to each node"),
    }
    return VibrationWearOutcome(case, tuple(states), places=places)


def _warn_of_steps(
    case: FrictionRigWearCase, cycles: float, error: float, reporter: Reporter
) -> None:
    if error > case.wear.tolerance:
        reporter.warn(
            f"{cycles:g} cycles: steps of the shortest length left an error of "
            f"{error:.2g}, above wear.tolerance {case.wear.tolerance:g}: raise "
            "resolution.samples or resolution.harmonics"
        )


def _kept(
    case: FrictionRigWearCase,
    pads: WearingPads,
    state: NodalState,
    reached: tuple[float, int],
    reporter: Reporter,
) -> WornState:
    """The pads in a state, ``reached`` by so many cycles in all and steps since the last."""
    (cycles, steps), rubbed, of_state = reached, pads.at(state), case.unworn
    loop = loop_of(of_state, rubbed.model, rubbed.motion)
    with reporter.stage("response"):
        found = [response_under(of_state, rubbed.model, own, reporter)[0] for own in case.forces]
    numbers: dict[str, Any] = {"cycles": cycles, "steps": steps, "energy": state.energy}
    numbers |= _numbers(rubbed, state.surfaces.depth, loop) | rubbed.model.numbers()
    tolerance = case.resolution.tolerance
    if tolerance is not None and rubbed.motion.left_out > tolerance:
        reporter.warn(
            f"the motion that wears leaves out harmonics of {rubbed.motion.left_out:.1e}, above "
            "resolution.tolerance: raise resolution.harmonics, those to begin with"
        )
    reporter.log(
        f"{cycles:g} cycles: {steps} steps, {numbers['touching']} nodes touch, "
        f"stroke {numbers['stroke']:.4g} mm"
    )
    return WornState(cycles, numbers, _fields(rubbed, state, loop), tuple(found))


def _numbers(rubbed: RubbedPads, depth: Array, loop: Curves) -> dict[str, Any]:
    return {
        "volume": float(depth @ rubbed.areas),
        "depth": float(depth.max()),
        "friction": float(np.max(rubbed.law.friction)),
        # None where no increment of the loop sticks.
        "stiffness": np.nan if loop.numbers["stiffness"] is None else loop.numbers["stiffness"],
        "stroke": loop.numbers["stroke"],
        "energy_per_cycle": float(rubbed.energy.sum()),
        "left_out": rubbed.motion.left_out,
    }


def _fields(rubbed: RubbedPads, state: NodalState, loop: Curves) -> dict[str, dict[str, Dataset]]:
    gap, pressed = np.asarray(rubbed.law.gap), rubbed.model.rest.cycle.samples[0, :, 2]
    moved, pulled = (loop.datasets[name].values for name in ("displacement", "force"))
    return {
        NODES: {
            "gap": Dataset(gap, "mm", "of the worn bodies without load"),
            **depth_fields(*state.surfaces.depths),
            "normal_force": Dataset(pressed, "N", "of each node at rest"),
            "path": path_field(rubbed.path),
            "energy": Dataset(rubbed.energy, "N mm", "that each node dissipates in such a cycle"),
        },
        LOOP: wearing_loop(moved, pulled),
    }
