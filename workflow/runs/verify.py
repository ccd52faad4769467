"""Run cases and compare what they computed with what they expect."""

from __future__ import annotations

from pathlib import Path

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Column, Table

from workflow.case.fields import in_unit_of
from workflow.errors import UserError
from workflow.kinds import load_case
from workflow.runs.run import run_case
from workflow.shell.folder import OutputFolder
from workflow.shell.screen import Loudness
from workflow.shell.screen import console as terminal
from workflow.shell.summary import QuantityError, required_number

COLUMNS = "expected", "computed", "unit", "error", "verdict", "kind", "source"
# Columns of text where the table goes to a file.
FILE_WIDTH = 140


def verify_cases(cases: tuple[Path, ...], out: Path, loudness: Loudness = Loudness.NORMAL) -> bool:
    """Run each case into its own folder under ``out``; True if every expectation is met.

    Where it is quiet, only what was missed is told, a line for each.
    """
    loaded = [(path, load_case(path)) for path in cases]
    for path, case in loaded:
        if not case.expect:
            raise UserError(f"{path}: nothing to verify: the case has no `expect` list")
    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        console.width = FILE_WIDTH
    met_all = True
    for number, (path, case) in enumerate(loaded, 1):
        folder = out / path.stem
        if len(loaded) > 1 and loudness > Loudness.QUIET:
            terminal().print(f"case {number} of {len(loaded)}: {path}", markup=False)
        run_case(case, folder, True, loudness)
        summary = OutputFolder(folder).read_summary()
        table = Table(Column("quantity", no_wrap=True), *COLUMNS, title=str(path), box=SIMPLE)
        for entry in case.expect:
            try:
                computed = required_number(summary, entry.quantity)
            except QuantityError as wrong:
                raise UserError(f"{path}: expect: {wrong}") from wrong
            (value, unit), (computed_value, _) = (
                in_unit_of(entry.value, number) for number in (entry.value, computed)
            )
            error = abs(computed_value - value) / (abs(value) or 1.0)
            met = error <= entry.tolerance
            met_all &= met
            row = (
                f"{value:.6g}",
                f"{computed_value:.6g}",
                unit or "-",
                f"{error:.2%}" if value else f"{error:.1e}",
                "met" if met else "MISSED",
                entry.kind.replace("_", " "),
            )
            table.add_row(entry.quantity, *row, entry.source)
            if not met and loudness is Loudness.QUIET:
                told = f"{computed_value:.6g} {unit}".rstrip()
                terminal().print(
                    f"warning: {path}: {entry.quantity}: {told}, expected {value:.6g}",
                    markup=False,
                    soft_wrap=True,
                )
        if loudness > Loudness.QUIET:
            console.print(table)
    return met_all
