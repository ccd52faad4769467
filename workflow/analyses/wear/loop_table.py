"""The table of tangential loops that joint laws read: a row per loop, computed or measured."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sa_solver.types import Array
from workflow.case.fields import Quantity, shown
from workflow.case.input_files import InputFileError
from workflow.case.table_file import TableFile, read_table_file
from workflow.case.units import UnitError, to_base
from workflow.errors import UserError
from workflow.shell.store import replacing


@dataclass(frozen=True)
class Column:
    """A column of the table: ``unit`` is the base unit, ``shown`` the unit it is written in.

    ``extensive`` quantities are per mm in a line contact.
    """

    name: str
    unit: str
    shown: str
    description: str
    extensive: bool = True

    def units(self, per_length: bool) -> tuple[str, str]:
        """Base unit and the one written."""
        per = "/mm" if per_length and self.extensive else ""
        return self.unit + per, self.shown + per

    def heading(self, per_length: bool) -> str:
        """Name and unit, as they head the column."""
        return f"{self.name} [{self.units(per_length)[1]}]"


COLUMNS = (
    Column("cycles", "1", "1", "cycles", extensive=False),
    Column("energy", "N*mm", "J", "energy that wear has dissipated so far"),
    Column("P", "N", "N", "normal force"),
    Column("kt", "N/mm", "N/mm", "tangential stiffness of the stuck contact"),
    Column("mu", "1", "1", "largest tangential over normal force", extensive=False),
    Column("energy_per_loop", "N*mm", "mJ", "energy dissipated in the loop"),
    Column("area", "mm^2", "mm^2", "area in contact"),
    Column("amplitude", "mm", "mm", "half the range of the displacement", extensive=False),
    Column("force", "N", "N", "half the range of the tangential force"),
    Column("sliding", "1", "1", "share of P on cells that slip as branches end", extensive=False),
    Column("residual_stiffness", "N/mm", "N/mm", "slope of the loop as branches end"),
    Column("border_load", "1", "1", "share of P on the grid's outermost cells", extensive=False),
)
# Without these a table is none.
NEEDED = ("energy", "P", "kt", "mu")


@dataclass(frozen=True)
class LoopTable:
    """Columns of a table of loops, ``(k,)`` each, in base units: see ``COLUMNS``.

    ``energy`` ascends; columns that the file does not have are NaN. ``per_length`` says that
    energies, forces, stiffnesses and areas are per mm.
    """

    cycles: Array
    energy: Array
    P: Array
    kt: Array
    mu: Array
    energy_per_loop: Array
    area: Array
    amplitude: Array
    force: Array
    sliding: Array
    residual_stiffness: Array
    border_load: Array
    per_length: bool


def write_table(path: Path, rows: Iterable[Mapping[str, float]], per_length: bool = False) -> None:
    """Write a table of loops, whose ``rows`` are in base units and have the same columns."""
    rows = list(rows)
    columns = [column for column in COLUMNS if column.name in rows[0]]
    factors = {column.name: _factor(*column.units(per_length)) for column in columns}
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([column.heading(per_length) for column in columns])
        for row in rows:
            writer.writerow([f"{row[name] / factor:.12g}" for name, factor in factors.items()])


def _factor(base: str, written: str) -> float:
    """Base units in the unit that is written."""
    return to_base(f"1 {written}", base) if written != base else 1.0


def read_loop_table(path: Path) -> LoopTable:
    """The table of loops in file ``path``, of a wear run or measured, in base units.

    Headings are the names of ``COLUMNS``, each with any unit of its kind in brackets, or in its
    base unit without. Raises UserError for a file that is no such table.
    """
    try:
        table = read_table_file(path)
        _refuse_unknown(table)
        for name in NEEDED:
            table.require(name, f"at least {', '.join(NEEDED)}")
        per_length = _per_length(table)
        columns = {
            column.name: table.column(column.name, Quantity(column.units(per_length)[0]))
            if column.name in table.names
            else np.full(len(table.rows), np.nan)
            for column in COLUMNS
        }
    except InputFileError as error:
        raise UserError(str(error)) from error
    falls = np.flatnonzero(np.diff(columns["energy"]) < 0.0)
    if falls.size:
        line = table.rows[falls[0] + 1][0]
        raise UserError(f"{path}:{line}: the energy falls; allowed: rows in order of their energy")
    return LoopTable(**columns, per_length=per_length)


def _refuse_unknown(table: TableFile) -> None:
    """Refuse other columns, which may be slips of the pen for those that need not be given."""
    known = [column.name for column in COLUMNS]
    for name, heading in zip(table.names, table.headings, strict=True):
        if name not in known:
            raise InputFileError(
                f"{table.place}: {shown(heading)}: no column; allowed: {', '.join(known)}"
            )


def _per_length(table: TableFile) -> bool:
    """Whether the table is of a line contact: by the unit of its stiffness."""
    (kt,) = (column for column in COLUMNS if column.name == "kt")
    try:
        to_base(f"1 {table.unit('kt') or kt.unit}", kt.units(True)[0])
    except UnitError:
        return False
    return True
