"""Motions of a rig whose joints have aged, with their numbers and curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fe_models.dynamics.excitation import ExcitationForce
from fe_models.dynamics.motion import Motion, Start
from fe_models.dynamics.transient.newmark import TimeStepControl
from sa_solver.steps import COMPUTED, Steps
from workflow.analyses.time.case import RigCase, joules
from workflow.analyses.time.joint_model import JointModel
from workflow.case.text.readable import percent
from workflow.errors import MethodFailed
from workflow.layout.declared import Arrays
from workflow.messages.warning_kinds import WarningKind
from workflow.models.rig.motion import LARGEST_ERROR, MotionModel, curves_of
from workflow.models.rig.rig_model import RigModel
from workflow.shell.terminal.reporter import Reporter


def step_control(case: RigCase) -> TimeStepControl:
    """Return the step control that the case asks for."""
    return TimeStepControl(case.integration.step, case.integration.tolerance)


def motion_of(
    rig: RigModel,
    joint: JointModel,
    energy: float,
    force: ExcitationForce,
    duration: float,
    control: TimeStepControl,
    start: Start | None = None,
    steps: Steps = COMPUTED,
    reached: Callable[[float], None] = lambda share: None,
) -> Motion:
    """Return the motion of a rig whose joints have dissipated an ``energy`` [N mm] before.

    ``reached`` is called at times with the share of the motion that is done. Raises MethodFailed
    for a motion that was not found to its end.
    """
    model = MotionModel(rig, joint.at(energy), force, duration, control, start)
    try:
        return model.motion(steps, reached)
    except MethodFailed as error:
        raise MethodFailed(f"motion at {joules(energy)}: {error}") from error


def warn_of_steps(energy: float, error: float, reporter: Reporter) -> None:
    """Warn where the time steps cause a large error of a motion at an ``energy`` [N mm]."""
    if error > LARGEST_ERROR:
        reporter.warn(
            WarningKind.LONG_TIME_STEPS,
            f"at {joules(energy)} the time steps cause an error of {percent(error)} of the largest "
            "displacement: lower integration.step",
        )


def motion_numbers(rig: RigModel, motion: Motion) -> dict[str, Any]:
    """Return numbers of a motion, for the summary."""
    return {
        "dissipated": float(motion.energies.joints[-1].sum()),
        "largest_displacement": float(np.abs(rig.looked_at(motion.displacement)).max()),
        **rig.contact(motion),
        "step_error": motion.error,
        "joint_residual": motion.residual,
        "balance_error": motion.energies.balance_error,
    }


def motion_curves(rig: RigModel, motion: Motion, force: ExcitationForce) -> Arrays:
    """Return the curves of a motion."""
    of_entries = {}
    if len(rig.entries) > 1:
        moved, pulled = rig.by_entry(motion)
        of_entries = {"joints_displacement": moved, "joints_force": pulled}
    return {**curves_of(rig, force, motion), **of_entries}
