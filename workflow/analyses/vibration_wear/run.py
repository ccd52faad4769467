"""Runs of vibration cases whose contact wears."""

from __future__ import annotations

from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError
from fe_models.dynamics.periodic.receptance import ReceptanceError
from sa_solver.normal.contact import NormalContactError
from wear.joints.parameters import JointError
from wear.steps.stepping import ContactFailure
from workflow.analyses.vibration_wear.case import VibrationWearCase
from workflow.analyses.vibration_wear.half_space_run import wear_half_space
from workflow.analyses.vibration_wear.nodes_run import wear_nodes
from workflow.analyses.vibration_wear.output.results import (
    VibrationWearRun,
    write_vibration_wear_output,
)
from workflow.errors import MethodFailed, UserError
from workflow.shell.folders.steps import resumable_steps


def run_vibration_wear(run: VibrationWearRun) -> None:
    """Run a vibration case with wear to its end.

    Raises UserError where contact, specimens or rig cannot be built as the case describes them, and
    MethodFailed where the state at rest, a contact problem or a motion is not found.
    """
    case, reporter = run.case, run.reporter
    try:
        with resumable_steps(run) as steps:
            if isinstance(case, VibrationWearCase):
                outcome = wear_half_space(case, reporter, steps)
            else:
                outcome = wear_nodes(case, reporter, steps)
    except (ContactFailure, NormalContactError) as error:
        raise MethodFailed(str(error)) from error
    except JointError as error:
        raise UserError(f"{run.folder.case}: joint: {error}") from error
    except (HarmonicBalanceError, ReceptanceError) as error:
        raise UserError(f"{run.folder.case}: structure: {error}") from error
    write_vibration_wear_output(outcome, run)
