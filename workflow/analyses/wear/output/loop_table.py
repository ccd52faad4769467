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
from workflow.layout.declared import declared
from workflow.shell.output.tables import heading, write_table

OVER_ENERGY = """
    energy | N mm | energy | energy that wear has dissipated so far
    kt | N/mm | energy | tangential stiffness of the stuck contact | N/mm/mm
    mu | 1 | energy | largest tangential over normal force
    kt_error | N/mm | energy | estimated error of kt due to the grid | N/mm/mm
    mu_error | 1 | energy | estimated error of mu due to grid and increments
"""
"""Quantities of loops that the results have over the energy."""
_QUANTITIES = declared(f"""{OVER_ENERGY}
    cycles | 1 | energy | cycles
    P | N | energy | normal force
    energy_per_loop | N mm | energy | energy dissipated in the loop
    area | mm^2 | energy | area in contact
    amplitude | mm | energy | half the range of the displacement
    force | N | energy | half the range of the tangential force
    sliding | 1 | energy | share of P on cells that slip as branches end
    residual_stiffness | N/mm | energy | slope of the loop as branches end | N/mm/mm
    border_load | 1 | energy | share of P on the grid's outermost cells
    energy_per_loop_error | N mm | energy | estimated error of energy_per_loop due to grid and
        increments
""")
# Columns of the table, in their order.
COLUMNS = {
    name: _QUANTITIES[name]
    for name in (
        *("cycles", "energy", "P", "kt", "mu", "energy_per_loop", "area", "amplitude", "force"),
        *("sliding", "residual_stiffness", "border_load"),
        *("kt_error", "mu_error", "energy_per_loop_error"),
    )
}
# Units of energies in the table.
SHOWN = {"energy": "J", "energy_per_loop": "mJ", "energy_per_loop_error": "mJ"}
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
    columns = {}
    for name in filter(rows[0].__contains__, COLUMNS):
        base = COLUMNS[name].unit_in(per_length)
        unit = base.replace("N mm", SHOWN.get(name, ""))
        factor = to_base(f"1 {unit}", base) if unit != base else 1.0
        columns[heading(name, unit)] = [row[name] / factor for row in rows]
    write_table(path, columns, DIGITS)


def read_loop_table(path: Path) -> LoopTable:
    """Return the table of loops in file ``path``, of a wear run or measured, in base units.

    Headings are the names of ``COLUMNS``, each with a compatible unit in brackets, or without one
    in its base unit. Raises UserError for a file that is no such table.
    """
    try:
        table = read_table_file(path)
        table.require(NEEDED, f"at least {', '.join(NEEDED)}")
        per_length = _per_length(table)
        units = {name: column.unit_in(per_length) for name, column in COLUMNS.items()}
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
    kt = COLUMNS["kt"]
    try:
        to_base(f"1 {table.unit('kt') or kt.unit}", kt.unit_in(line=True))
    except UnitError:
        return False
    return True
