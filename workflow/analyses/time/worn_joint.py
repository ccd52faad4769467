"""Joints whose friction and stiffness follow the wear of their contact, which is computed first."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from workflow.analyses.time.case import JointCase, RigCase
from workflow.analyses.wear.output.loop_table import SLIDES, read_loop_table
from workflow.case.loading import YAML
from workflow.errors import UserError
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.analysis import Run
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.terminal.reporter import Reporter

# A joint is under the load of its table if they differ by less than this share.
SAME_LOAD = 0.01
# Folder of the wear run inside that of the joint.
WEAR = "wear"


def with_computed_wear(run: Run[JointCase | RigCase]) -> JointCase | RigCase:
    """Return the case with the table of loops from its wear case, unchanged if it names none.

    The wear case runs in the subfolder ``wear``, where an earlier run is resumed. Raises UserError
    if the case has more than a single contact.
    """
    case, file = run.case, run.case.evolution.file
    if file is None or not file.endswith(YAML):
        return case
    folder = run.folder.reserve(WEAR, "wear of the contact, a run of its own")
    with run.reporter.stage("wear of the contact"):
        computed = run.compute(Path(file), folder)
    if not computed:
        run.reporter.say(f"wear of the contact: taken from the earlier run in {folder}")
    summary = OutputFolder(folder).read_summary()
    tables = {
        name: folder / reported["loops"]["file"]
        for name, reported in summary.items()
        if isinstance(reported, dict) and "loops" in reported
    }
    if len(tables) != 1:
        raise UserError(
            f"evolution.file: {file} wears the contacts {', '.join(sorted(tables))}; allowed: a "
            f"case of one contact, or one of the tables in {folder}"
        )
    evolution = case.evolution.model_copy(update={"file": str(*tables.values())})
    return case.model_copy(update={"evolution": evolution})


def warn_of_table(case: JointCase | RigCase, last: float, reporter: Reporter) -> None:
    """Warn where a table of loops is used outside its energies, its load, or as friction.

    ``last`` is the largest energy of the joint [N mm]. The coefficient mu of loops that do not
    slide as a whole is not the friction.
    """
    if case.evolution.file is None:
        return
    table = read_loop_table(Path(case.evolution.file))
    if last > table.energy[-1]:
        reporter.warn(
            WarningKind.TABLE_TOO_SHORT,
            f"evolution.file: its loops end at {1e-3 * table.energy[-1]:g} J; beyond, up to "
            f"{1e-3 * last:g} J, the last one holds",
        )
    if table.sliding.min() < SLIDES:
        reporter.warn(
            WarningKind.LOOPS_DO_NOT_SLIDE,
            f"evolution.file: {np.count_nonzero(table.sliding < SLIDES)} of its {len(table.mu)} "
            "loops do not slide as a whole, so their mu is less than the coefficient of "
            "friction: compute them with a larger loops.amplitude",
        )
    load = case.joint.normal_load
    if load > 0.0 and np.any(np.abs(table.P - load) > SAME_LOAD * load):
        reporter.warn(
            WarningKind.LOOPS_OF_ANOTHER_LOAD,
            f"evolution.file: its loops are under {table.P.min():g} to {table.P.max():g} N, but "
            f"the joint is under {load:g} N, and stiffness depends on the load",
        )
