"""Runs of structures that wear their contacts at nodes: motion and wear in turn."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from fe_models.dynamics.curves.forced_response import along_frequency
from fe_models.dynamics.curves.phase_resonance import along_phase_resonance
from fe_models.dynamics.periodic.cycle_energy import energy_lost, work_done
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from sa_solver.steps import Steps
from wear.contact.nodes import NodalState
from wear.laws import WearLaw
from wear.steps.steppers import HeunStepper
from wear.steps.stepping import ContactFailure
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.vibration.following import VibrationRun
from workflow.analyses.vibration.model import step_control, structure_numbers, vibration_model
from workflow.analyses.vibration.output.loops import loop_of
from workflow.analyses.vibration.output.outcome import Curves
from workflow.analyses.vibration.response import warn_of_stroke
from workflow.analyses.vibration_wear.body import body_model
from workflow.analyses.vibration_wear.case import (
    FrictionRigWearCase,
    NodesWearCase,
    ReducedWearCase,
)
from workflow.analyses.vibration_wear.output.outcome import (
    VibrationWearOutcome,
    WornNodes,
    WornRig,
    step_error,
)
from workflow.analyses.vibration_wear.pads import PadCycle, WearingPads
from workflow.analyses.vibration_wear.states import responses_to_all, worn_states
from workflow.case.loading import load_case
from workflow.case.text.plain import counted
from workflow.layout.declared import Arrays
from workflow.messages.warning_kinds import WarningKind
from workflow.models.rig.rig_model import RigModel
from workflow.models.vibration.structure import VibratingStructure
from workflow.shell.terminal.reporter import Reporter


def wear_nodes(
    case: FrictionRigWearCase | ReducedWearCase, reporter: Reporter, steps: Steps
) -> VibrationWearOutcome:
    """Return the outcome of a run."""
    wear = case.wear
    unworn, laws = _unworn(case, reporter)
    search = partial(resonance_that_wears, case) if wear.at_resonance else None
    pads = WearingPads(unworn, laws, case.wearing, wear.frequency, case.amount, search)
    state = pads.begin()
    with reporter.stage("wear"):
        pads.at(state)

    def describe(state: NodalState, cycles: float, taken: int) -> WornRig:
        cycle = pads.at(state)
        run = VibrationRun(case.unworn, cycle.model, reporter, steps)
        worn = _worn_state(run, cycle, state, cycles, taken)
        if worn.numbers["step_error"] > wear.tolerance:
            reporter.warn(
                WarningKind.LONG_WEAR_STEPS,
                f"{cycles:g} cycles: wear steps cause an error of "
                f"{worn.numbers['step_error']:.2g} of depth or volume, above wear.tolerance "
                f"{wear.tolerance:g}: lower it, or raise resolution.samples or "
                "resolution.harmonics",
            )
        return worn

    stepper = HeunStepper(wear.tolerance)
    of_contact = stepper, state, pads.contact_at, unworn.rig.area
    states = worn_states(wear.cycles, *of_contact, describe, reporter, steps)
    return VibrationWearOutcome(case, states, nodes=_nodes(unworn.rig))


def _unworn(
    case: FrictionRigWearCase | ReducedWearCase, reporter: Reporter
) -> tuple[VibratingStructure, tuple[WearLaw, WearLaw]]:
    """Return the structure before the first cycle, and the wear laws of body 1 and body 2."""
    if isinstance(case, ReducedWearCase):
        return body_model(case, reporter), case.laws
    specimens = load_case(case.structure.specimens, [SpecimensCase])
    return vibration_model(case.unworn, reporter).structure, specimens.laws


def resonance_that_wears(case: NodesWearCase, problem: HarmonicBalance) -> HarmonicSolution:
    """Return the phase resonance under the force that wears.

    This is the resonance with the largest response within the frequencies. Raises
    :class:`wear.steps.stepping.ContactFailure` where there is none.
    """
    force, upward = case.wearing, case.continuation.start == "lower"
    branch = along_frequency(
        problem, force, case.frequencies, upward=upward, control=step_control(case.unworn)
    )
    found = along_phase_resonance(problem, branch, (force, force))
    if not found.solutions:
        raise ContactFailure(
            f"no resonance {case.amount.under(force)}: {branch.message or found.message}; change "
            "frequencies, or give wear.frequency"
        )
    return found.solutions[0]


def _nodes(rig: RigModel) -> WornNodes:
    """Return the places of the contacts, as far as they are known."""
    nodes, on_plane = rig.nodes, {axis: rig.places[:, k] for k, axis in enumerate("xy")}
    if nodes is None:
        return WornNodes({**on_plane, "area": rig.area})
    bodies = {"normal": nodes.normals}
    if nodes.places is not None:
        bodies["position"] = nodes.places
        if len(rig.places):
            bodies |= on_plane
    return WornNodes(bodies | {"area": rig.area}, nodes.names)


def _worn_state(
    run: VibrationRun, cycle: PadCycle, state: NodalState, cycles: float, taken: int
) -> WornRig:
    """Return the pads after a number of ``cycles``, ``taken`` wear steps after the last state."""
    problem, motion = cycle.model.problem, cycle.motion
    loop = loop_of(cycle.model, motion, run.case.laws[0].normal_load)
    error, responses = responses_to_all(run, motion)
    at = f"{cycles:g} cycles: in the motion that wears"
    warn_of_stroke(cycle.model, at, motion, run.reporter)
    depth = state.surfaces.depth
    numbers: dict[str, Any] = {
        "cycles": cycles,
        "steps": taken,
        "energy": state.energy,
        "volume": float(depth @ cycle.areas),
        "depth": float(depth.max()),
        "step_error": step_error(state, cycle.areas),
        "friction": float(np.max(cycle.law.friction)),
        # Not the slope of the loop: nodes with little load slip at once, so that the contact may
        # never stick as a whole.
        "stiffness": cycle.model.stuck_slope(cycle.motion.frequency),
        "stroke": loop.numbers["stroke"],
        "frequency": motion.frequency,
        "energy_per_cycle": float(cycle.energy.sum()),
        "work_per_cycle": work_done(problem, motion),
        "damped_per_cycle": energy_lost(problem, motion) - float(cycle.energy.sum()),
        "error": error,
        **structure_numbers(cycle.model),
    }
    run.reporter.log(
        f"{cycles:g} cycles: {counted(taken, 'step')}, "
        f"{counted(numbers['touching'], 'node')} touching, stroke {numbers['stroke']:.4g} mm"
    )
    return WornRig(cycles, numbers, _fields(cycle, state, loop), responses)


def _fields(cycle: PadCycle, state: NodalState, loop: Curves) -> dict[str, Arrays]:
    depth_1, depth_2 = state.surfaces.depths
    return {
        "nodes": {
            "gap": cycle.model.rig.gap,
            "depth_1": depth_1,
            "depth_2": depth_2,
            "normal_force": cycle.model.rest.cycle.samples[0, :, 2],
            "path": cycle.path,
            "energy": cycle.energy,
        },
        "loop": {name: loop.arrays[name] for name in ("displacement", "force")},
    }
