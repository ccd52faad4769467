"""A run of any kind of case: its folder, its log, and what it is told to do."""

from __future__ import annotations

from pathlib import Path

from workflow import fidelity
from workflow.case import (
    Case,
    FrictionRigWearCase,
    JointCase,
    RigCase,
    SpecimensCase,
    VibrationCase,
    VibrationWearCase,
    WearCase,
)
from workflow.errors import UserError
from workflow.folder import OutputFolder
from workflow.memory import check_memory
from workflow.reporter import Reporter


def run_case(case: Case, out: Path, force: bool) -> None:
    """Run a case from the start into a folder, by the cheapest model if it leaves that open."""
    case, chosen = fidelity.choose(case)
    check_memory(case)
    folder = OutputFolder(out)
    folder.claim(case, force)
    fidelity.keep(folder, chosen)
    _run(case, folder, resume=False)


def resume_run(out: Path) -> bool:
    """Continue the run in a folder from its last whole jump; False if it is finished already."""
    folder = OutputFolder(out)
    case = folder.load_case()
    if folder.summary.exists():
        return False
    if not isinstance(case, WearCase):
        raise UserError(
            f"{out}: a case of this kind takes up no run half done; start it again with "
            f"`fretscale run {folder.case} --out {out}`"
        )
    check_memory(case)
    folder.clear_partial()
    folder.jumps.mkdir(exist_ok=True)
    _run(case, folder, resume=True)
    return True


def _run(case: Case, folder: OutputFolder, resume: bool) -> None:
    reporter = Reporter(folder.log, append=resume)
    try:
        # Imported here: a contact case needs no finite elements, which take a second to load.
        if isinstance(case, WearCase):
            from workflow.wear_run import run_wear

            fidelity.say(fidelity.kept(folder), reporter)
            run_wear(case, folder, reporter, resume)
        elif isinstance(case, SpecimensCase):
            from workflow.specimens_run import run_specimens

            run_specimens(case, folder, reporter)
        elif isinstance(case, JointCase | RigCase):
            from workflow.time_run import run_time

            run_time(case, folder, reporter)
        elif isinstance(case, VibrationCase):
            from workflow.vibration_run import run_vibration

            run_vibration(case, folder, reporter)
        elif isinstance(case, VibrationWearCase):
            from workflow.vibration_wear_run import run_vibration_wear

            run_vibration_wear(case, folder, reporter)
        elif isinstance(case, FrictionRigWearCase):
            from workflow.friction_rig_wear_run import run_friction_rig_wear

            run_friction_rig_wear(case, folder, reporter)
        else:
            from workflow.contact_run import run_contact

            run_contact(case, folder, reporter)
    finally:
        reporter.close()
