"""Translation of a vibration case into the structure and the model that it describes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.motion_recorder import Accuracy
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.rig import natural_frequencies
from sa_solver.types import Array
from wear.joints.friction_contact import FrictionContact
from workflow.analyses.rig.building import rig_model
from workflow.analyses.rig.laws import law_of, laws_of
from workflow.analyses.rig.structure import FrictionRig
from workflow.analyses.vibration.case.case_base import VibrationCaseBase
from workflow.analyses.vibration.case.load import driving_of
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.memory import memory
from workflow.case.sections import Case
from workflow.errors import UserError
from workflow.layout.declared import Arrays
from workflow.models.rig.laws import Laws, law_of_all
from workflow.models.rig.rig_model import MOST_FREQUENCIES, RigModel
from workflow.models.vibration.model import VibrationModel
from workflow.models.vibration.structure import VibratingStructure
from workflow.models.vibration.sweep import FrequencySweep
from workflow.shell.terminal.reporter import Reporter


def vibration_model(case: Case, reporter: Reporter) -> VibrationModel:
    """Return the model of a case.

    Raises UserError for an impossible structure or joint, and for a case of another kind.
    """
    if not isinstance(case, VibrationCase):
        raise UserError(
            "only steady vibration without wear has such a model; allowed: cases of analysis "
            "vibration without a section wear"
        )
    order = round(case.engine_order or 1)
    rig = rig_model(case.structure, case.joint, case.mass, reporter, case.ring, order)
    return model_on(case, rig, _law(case, rig))


def model_on(case: VibrationCase, rig: RigModel, law: Laws) -> VibrationModel:
    """Return the model of a case on a rig whose joints have this law."""
    memory(case, len(rig.model.mass), rig.joints).check()
    return VibrationModel(
        rig,
        law,
        case.amounts,
        sweep_of(case),
        Resolution(case.harmonics, case.resolution.samples),
        driving_of(case.excitation, rig, case.resolution.harmonics[-1]),
        0.0 if rig.pressing is None else case.laws[0].normal_load,
    )


def sweep_of(case: VibrationCaseBase) -> FrequencySweep:
    """Return the frequencies of a case, and how curves are followed over them."""
    upward = case.continuation.start == "lower"
    return FrequencySweep(*case.frequencies, upward, accuracy_of(case), step_control(case))


def step_control(
    case: VibrationCaseBase, watch: Callable[[float], None] = lambda parameter: None
) -> ContinuationControl:
    """Return the step control of curves that the case asks for; ``watch`` gets each new point."""
    steps = case.continuation
    return ContinuationControl(
        first=steps.first_step,
        least=steps.shortest_step,
        most=steps.longest_step,
        iterations=steps.iterations,
        max_iterations=steps.most_iterations,
        max_angle=float(np.degrees(steps.largest_angle)),
        max_points=steps.most_points,
        tolerance=steps.tolerance,
        watch=watch,
    )


def accuracy_of(case: VibrationCaseBase) -> Accuracy | None:
    """Return the accuracy of motions that the case asks for, None if the resolution is given."""
    tolerance = case.resolution.tolerance
    if tolerance is None:
        return None
    allowed = Accuracy(tolerance)
    return replace(allowed, highest=max(allowed.highest, case.harmonics[-1]))


def _law(case: VibrationCase, rig: RigModel) -> Laws:
    """Return the law of each joint: joints of an entry, or all, share stiffness and load evenly.

    Between two bodies that a load presses together, joints have the gap of the bodies and no load
    of their own. They may share the stiffness by their areas.
    """
    if not isinstance(case.structure, FrictionRig):
        shared, *own = laws_of([case.joint, *case.own_laws])
        return law_of_all(shared, own, rig.counts)
    whole = law_of(case.laws[0])
    assert isinstance(whole, FrictionContact)
    even = case.structure.sharing == "even"
    share = 1.0 / rig.joints if even else rig.area / rig.area.sum()
    return replace(
        whole,
        stiffness=share * whole.stiffness,
        normal_stiffness=share * whole.normal_stiffness,
        normal_load=0.0,
        gap=rig.gap,
    )


# --- numbers of the structure ---------------------------------------------------------------------


def structure_numbers(structure: VibratingStructure) -> dict[str, Any]:
    """Return natural frequencies, and the contact of joints at rest, for the summary."""
    rig = structure.rig
    numbers: dict[str, Any] = {
        **structure.natural,
        "damping_stuck": rig.stuck_damping(structure.law, structure.resting),
    }
    if rig.sector is not None:
        ring = rig.sector.ring
        numbers["ring"] = {"sectors": ring.sectors, "engine_order": ring.engine_order}
    if structure.driving.left_out:
        numbers["left_out_of_records"] = list(structure.driving.left_out)
    if rig.pressing is not None:
        numbers["touching"] = int(structure.touching.sum())
        numbers["joints"] = rig.joints
    return numbers


def diameters(structure: VibratingStructure) -> Arrays | None:
    """Return natural frequencies by nodal diameters for a sector of a ring, else None."""
    rig = structure.rig
    if rig.sector is None:
        return None
    numbers = range(rig.sector.ring.sectors // 2 + 1)
    models = [rig.sector.at(number) for number in numbers]
    springs: dict[str, float | Array] = {
        "free": 0.0,
        "stuck": rig.stuck(structure.law, structure.resting),
    }
    return {"diameters": np.array(numbers)} | {
        name: np.array([natural_frequencies(model, of)[:MOST_FREQUENCIES] for model in models])
        for name, of in springs.items()
    }


def contact_at_rest(structure: VibratingStructure) -> Arrays | None:
    """Return places of the joints and their state at rest, None if they have no places."""
    rig = structure.rig
    if rig.pressing is None:
        return None
    rest = structure.rest
    return {
        "x": rig.places[:, 0],
        "y": rig.places[:, 1],
        "gap": rig.gap,
        "area": rig.area,
        "normal_force": rest.cycle.samples[0, :, 2],
        "normal_displacement": rest.coefficients[:, 0, 2],
    }
