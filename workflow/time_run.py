"""A case in time: a joint at a prescribed stroke, or in a rig that is shaken, hit or driven."""

from __future__ import annotations

from workflow.case import JointCase, RigCase
from workflow.errors import UserError
from workflow.folder import OutputFolder
from workflow.reporter import Reporter


def run_time(case: JointCase | RigCase, folder: OutputFolder, reporter: Reporter) -> None:
    """Run a case in time to its end.

    Raises UserError where joint or rig cannot be what the case says, MethodFailed where a motion
    cannot be followed or is not steady.
    """
    # Imported here: joint laws are compiled when they are first needed.
    from wear.joints.parameters import JointError
    from workflow.time_output import write_time_output
    from workflow.worn_joint import warn_of_table, with_computed_wear

    reporter.say(f"run: {case.title}")
    case = with_computed_wear(case, folder, reporter)
    try:
        if isinstance(case, JointCase):
            from workflow.time_joint import run_joint

            outcome = run_joint(case, reporter)
        else:
            from workflow.time_rig import run_rig

            outcome = run_rig(case, reporter)
    except JointError as error:
        raise UserError(f"{folder.case}: joint: {error}") from error
    warn_of_table(case, float(outcome.evolution["energy"][-1]), reporter)
    write_time_output(outcome, folder, reporter)
