"""Records of hysteresis loops in CSV files, as measuring programs write them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from sa_solver.types import Array
from wear.joints.measured.measured_loops import MeasuredLoops
from workflow.case.fields import Quantity
from workflow.case.files.input_files import InputFileError
from workflow.case.files.table_file import read_table_file
from workflow.errors import UserError

BASE_UNITS = {"displacement": "mm", "force": "N", "time": "s", "normal_load": "N"}
NEEDED = ("displacement", "force")


def read_loop_file(path: Path, names: Mapping[str, str]) -> dict[str, Array]:
    """Return the columns ``(t,)`` of ``BASE_UNITS`` that a file has, in these units.

    ``names`` maps a column of ``BASE_UNITS`` to its heading in the file, where they differ; other
    columns are ignored. Raises UserError with the line.
    """
    called = {key: names.get(key, key) for key in BASE_UNITS}
    try:
        table = read_table_file(path)
        for key in (*NEEDED, *names):
            table.require([called[key]], f"a column of that name, or --column {key}=NAME")
        return {
            key: table.column(called[key], Quantity(unit))
            for key, unit in BASE_UNITS.items()
            if called[key] in table.names
        }
    except InputFileError as error:
        raise UserError(str(error)) from error


def account(loops: MeasuredLoops) -> str:
    """Return lines on the loops found in a record, and on the work outside them."""
    # Differences of sums are not exactly zero; shares below rounding count as zero.
    work = float(loops.work[-1])
    before, between, after = (one if abs(one) > 1e-9 * work else 0.0 for one in loops.left_out)
    count = len(loops.energy)
    return (
        f"{count} closed loop{'s' if count > 1 else ''} of {loops.energy.sum():.4g} mJ; left out, "
        f"of {work:.4g} mJ of work in the record: {before:.3g} mJ before the first loop, "
        f"{between:.3g} between loops, {after:.3g} after the last; reversals closer than "
        f"{1e3 * loops.resolution:.2g} um are taken as noise"
    )
