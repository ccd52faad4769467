"""Runs of cases in time: a joint at a prescribed stroke, or in a rig."""

from __future__ import annotations

from wear.joints.parameters import JointError
from workflow.analyses.time.case import JointCase, RigCase
from workflow.analyses.time.joint import run_joint
from workflow.analyses.time.results import write_time_output
from workflow.analyses.time.rig import run_rig
from workflow.analyses.time.worn_joint import warn_of_table, with_computed_wear
from workflow.errors import UserError
from workflow.shell.analysis import Run
from workflow.shell.folders.steps import resumable_steps


def run_time(run: Run[JointCase | RigCase]) -> None:
    """Run a case in time to its end.

    Raises UserError where joint or rig cannot be built as the case describes them, MethodFailed
    where a motion cannot be followed or is not steady.
    """
    folder, reporter = run.folder, run.reporter
    case = with_computed_wear(run)
    try:
        with resumable_steps(run) as steps:
            if isinstance(case, JointCase):
                outcome = run_joint(case, reporter, steps)
            else:
                outcome = run_rig(case, reporter, steps)
    except JointError as error:
        raise UserError(f"{folder.case}: joint: {error}") from error
    warn_of_table(case, float(outcome.evolution["energy"][-1]), reporter)
    write_time_output(outcome, run)
