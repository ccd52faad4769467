"""Verification of cases: runs them and compares the results with the expected values."""

from __future__ import annotations

from pathlib import Path

from rich.box import SIMPLE
from rich.table import Column, Table

from workflow.errors import UserError
from workflow.kinds import load_case
from workflow.messages.warning_kinds import WarningKind
from workflow.runs.run import run_case
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.expectations import verdicts
from workflow.shell.output.summary import QuantityError
from workflow.shell.terminal.screen import Loudness, tables_console
from workflow.shell.terminal.screen import console as terminal

COLUMNS = "expected", "computed", "unit", "error", "verdict", "kind", "source"
# Width of the table in columns of text when it is written to a file.
FILE_WIDTH = 140


def verify_cases(cases: tuple[Path, ...], out: Path, loudness: Loudness = Loudness.NORMAL) -> bool:
    """Run each case in a folder under ``out``; return True if every expectation is met.

    In quiet mode only missed expectations are printed, one line for each.
    """
    loaded = [(path, load_case(path)) for path in cases]
    for path, case in loaded:
        if not case.expect:
            raise UserError(f"{path}: nothing to verify: the case has no `expect` list")
    console = tables_console(FILE_WIDTH)
    met_all = True
    for number, (path, case) in enumerate(loaded, 1):
        folder = out / path.stem
        if len(loaded) > 1 and loudness > Loudness.QUIET:
            terminal().print(f"case {number} of {len(loaded)}: {path}", markup=False)
        run_case(case, folder, True, loudness)
        summary = OutputFolder(folder).read_summary()
        table = Table(Column("quantity", no_wrap=True), *COLUMNS, title=str(path), box=SIMPLE)
        try:
            found = verdicts(case, summary)
        except QuantityError as wrong:
            raise UserError(f"{path}: expect: {wrong}") from wrong
        for verdict in found:
            met_all &= verdict.met
            row = (
                f"{verdict.expected:.6g}",
                f"{verdict.computed:.6g}",
                verdict.unit or "-",
                verdict.error_text,
                "met" if verdict.met else "MISSED",
                verdict.entry.kind.replace("_", " "),
            )
            table.add_row(verdict.entry.quantity, *row, verdict.entry.source)
            if not verdict.met and loudness is Loudness.QUIET:
                reported = f"{verdict.computed:.6g} {verdict.unit}".rstrip()
                missed = WarningKind.EXPECTATION_NOT_MET.marked(
                    f"{path}: {verdict.entry.quantity}: {reported}, expected {verdict.expected:.6g}"
                )
                terminal().print(f"warning: {missed}", markup=False, soft_wrap=True)
        if loudness > Loudness.QUIET:
            console.print(table)
    return met_all
