"""Motions of a rig whose joints have aged, with their numbers and curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fe_models.dynamics.excitation import ExcitationForce
from fe_models.dynamics.motion import Motion, Start
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from sa_solver.steps import COMPUTED, Steps
from workflow.analyses.rig.rig_model import RigModel
from workflow.analyses.time.case import RigCase, joules
from workflow.analyses.time.joint_model import JointModel
from workflow.case.text.readable import percent
from workflow.errors import MethodFailed
from workflow.shell.output.dataset import Dataset
from workflow.shell.terminal.reporter import Reporter

# Error by time steps, as a share of the largest displacement, from which a warning is given.
STEPS_LEAVE = 0.05


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
    law = joint.at(energy)
    pulled = rig.with_preload(law, force)
    motion = integrate(rig.model, law, pulled, duration, control, start, steps, reached)
    if not motion.converged:
        raise MethodFailed(f"motion at {joules(energy)}: {motion.message}")
    return motion


def warn_of_steps(energy: float, error: float, reporter: Reporter) -> None:
    """Warn where the time steps cause a large error of a motion at an ``energy`` [N mm]."""
    if error > STEPS_LEAVE:
        reporter.warn(
            f"at {joules(energy)} the time steps cause an error of {percent(error)} of the largest "
            "displacement: lower integration.step"
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


def motion_curves(rig: RigModel, motion: Motion, force: ExcitationForce) -> dict[str, Dataset]:
    """Return the curves of a motion."""
    seen, pull = rig.seen.T, "force of the joint, or the sum of several, resisting"
    dissipated = motion.energies.joints.sum(axis=1)
    lost = "energy that the joint has dissipated since the beginning"
    of_entries = {}
    if len(rig.entries) > 1:
        moved, pulled = rig.by_entry(motion)
        of_each = "of the joints of each entry of structure.joints"
        of_entries = {
            "joints_displacement": Dataset(moved, "mm", f"mean displacement {of_each}"),
            "joints_force": Dataset(pulled, "N", f"sum of the forces {of_each}, resisting"),
        }
    return {
        "time": Dataset(motion.times, "s", "time"),
        "excitation": Dataset(force.value(motion.times), "N", "force of the excitation"),
        "displacement": Dataset(
            motion.displacement @ seen, "mm", "displacements of the reported points"
        ),
        "acceleration": Dataset(
            motion.acceleration @ seen, "mm/s^2", "accelerations of the reported points"
        ),
        "joint_force": Dataset(rig.loop(motion)[1], "N", pull),
        **of_entries,
        "dissipated": Dataset(dissipated, "N mm", lost),
    }
