"""Table of tangential loops for joint laws: one row per loop, computed or measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sa_solver.types import Array
from workflow.case.fields import Quantity
from workflow.case.files.input_files import InputFileError
from workflow.case.files.table_file import TableFile, read_table_file
from workflow.case.units import UnitError, to_base
from workflow.errors import UserError
from workflow.shell.output.tables import heading, write_table


@dataclass(frozen=True)
class LoopColumn:
    """Column of the table: ``unit`` is the base unit, ``shown`` the unit in the file.

    ``extensive`` quantities are per mm in a line contact.
    """

    name: str
    unit: str
    shown: str
    description: str
    extensive: bool = True

    def units(self, per_length: bool) -> tuple[str, str]:
        """Return the base unit and the unit in the file."""
        per = "/mm" if per_length and self.extensive else ""
        return self.unit + per, self.shown + per

    def written(
        self, rows: Sequence[Mapping[str, float]], per_length: bool
    ) -> tuple[str, list[float]]:
        """Return heading and values of the column, in the unit of the file."""
        base, unit = self.units(per_length)
        factor = to_base(f"1 {unit}", base) if unit != base else 1.0
        return heading(self.name, unit), [row[self.name] / factor for row in rows]


COLUMNS = (
    LoopColumn("cycles", "1", "1", "cycles", extensive=False),
    LoopColumn("energy", "N*mm", "J", "energy that wear has dissipated so far"),
    LoopColumn("P", "N", "N", "normal force"),
    LoopColumn("kt", "N/mm", "N/mm", "tangential stiffness of the stuck contact"),
    LoopColumn("mu", "1", "1", "largest tangential over normal force", extensive=False),
    LoopColumn("energy_per_loop", "N*mm", "mJ", "energy dissipated in the loop"),
    LoopColumn("area", "mm^2", "mm^2", "area in contact"),
    LoopColumn("amplitude", "mm", "mm", "half the range of the displacement", extensive=False),
    LoopColumn("force", "N", "N", "half the range of the tangential force"),
    LoopColumn(
        "sliding", "1", "1", "share of P on cells that slip as branches end", extensive=False
    ),
    LoopColumn("residual_stiffness", "N/mm", "N/mm", "slope of the loop as branches end"),
    LoopColumn(
        "border_load", "1", "1", "share of P on the grid's outermost cells", extensive=False
    ),
    LoopColumn("kt_error", "N/mm", "N/mm", "estimated error of kt due to the grid"),
    LoopColumn("mu_error", "1", "1", "of mu, due to grid and increments", extensive=False),
    LoopColumn(
        "energy_per_loop_error", "N*mm", "mJ", "of energy_per_loop, due to grid and increments"
    ),
)
# Share of P that must slip for mu to be the coefficient of friction, not just what is mobilised.
SLIDES = 1.0 - 1e-6
# Significant digits, since joint laws read the table again.
DIGITS = 12
# Columns that every table must have.
NEEDED = ("energy", "P", "kt", "mu")


@dataclass(frozen=True)
class LoopTable:
    """Columns of a table of loops that joint laws use, ``(k,)`` each, in base units (``COLUMNS``).

    ``energy`` ascends. ``sliding`` is 1 if the table does not have it. ``per_length`` says that
    energies, forces and stiffnesses are per mm.
    """

    energy: Array
    P: Array
    kt: Array
    mu: Array
    sliding: Array
    per_length: bool


def write_loop_table(
    path: Path, rows: Sequence[Mapping[str, float]], per_length: bool = False
) -> None:
    """Write a table of loops; all ``rows`` are in base units and have the same columns."""
    columns = [column for column in COLUMNS if column.name in rows[0]]
    write_table(path, dict(column.written(rows, per_length) for column in columns), DIGITS)


def read_loop_table(path: Path) -> LoopTable:
    """Return the table of loops in file ``path``, of a wear run or measured, in base units.

    Headings are the names of ``COLUMNS``, each with a compatible unit in brackets, or without one
    in its base unit. Raises UserError for a file that is no such table.
    """
    try:
        table = read_table_file(path)
        table.require(NEEDED, f"at least {', '.join(NEEDED)}")
        per_length = _per_length(table)
        units = {column.name: column.units(per_length)[0] for column in COLUMNS}
        # Unknown columns may be misspelt optional ones.
        table.check(units)
        columns = {name: table.column(name, Quantity(units[name])) for name in table.names}
    except InputFileError as error:
        raise UserError(str(error)) from error
    falls = np.flatnonzero(np.diff(columns["energy"]) < 0.0)
    if falls.size:
        line = table.rows[falls[0] + 1][0]
        raise UserError(f"{path}:{line}: the energy falls; allowed: rows in order of their energy")
    sliding = columns.get("sliding", np.ones(len(columns["mu"])))
    needed = {name: columns[name] for name in NEEDED}
    return LoopTable(**needed, sliding=sliding, per_length=per_length)


def _per_length(table: TableFile) -> bool:
    """Return whether the table is of a line contact, by the unit of its stiffness."""
    (kt,) = (column for column in COLUMNS if column.name == "kt")
    try:
        to_base(f"1 {table.unit('kt') or kt.unit}", kt.units(True)[0])
    except UnitError:
        return False
    return True
