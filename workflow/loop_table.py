"""The table of tangential loops that joint laws read: a row per loop, computed or measured."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sa_solver.types import Array
from workflow.case.units import UnitError, to_base
from workflow.errors import UserError
from workflow.store import replacing


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
HEADING = re.compile(r"\s*(\w+)\s*(?:\[(.*)\])?\s*")


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


def write_table(path: Path, rows: Iterable[dict[str, float]], per_length: bool = False) -> None:
    """Write a table of loops, whose ``rows`` are in base units."""
    factors = {
        column.name: to_base(f"1 {shown}", unit) if shown != unit else 1.0
        for column in COLUMNS
        for unit, shown in [column.units(per_length)]
    }
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([column.heading(per_length) for column in COLUMNS])
        for row in rows:
            writer.writerow([f"{row[name] / factor:.12g}" for name, factor in factors.items()])


def read_loop_table(path: Path) -> LoopTable:
    """The table of loops in file ``path``, of a wear run or measured, in base units.

    Headings are the names of ``COLUMNS``, each with any unit of its kind in brackets, or in its
    base unit without. Raises UserError for a file that is no such table.
    """
    try:
        lines = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeError, csv.Error) as error:
        raise UserError(f"{path}: cannot be read ({error}); allowed: a table of loops") from error
    rows = [(number, line) for number, line in enumerate(lines, start=1) if "".join(line).strip()]
    if len(rows) < 2:
        raise UserError(f"{path}: no table; allowed: headings and a row for every loop")
    headings = _headings(path, rows[0][1])
    numbers = np.array([_numbers(path, number, line, len(headings)) for number, line in rows[1:]])
    per_length = _per_length(path, headings)
    columns = {column.name: np.full(len(numbers), np.nan) for column in COLUMNS}
    for values, (column, unit) in zip(numbers.T, headings, strict=True):
        columns[column.name] = values * _factor(path, column, unit, per_length)
    if np.any(np.diff(columns["energy"]) < 0.0):
        raise UserError(f"{path}: the energy falls; allowed: rows in the order of their energy")
    return LoopTable(**columns, per_length=per_length)


def _headings(path: Path, cells: Sequence[str]) -> list[tuple[Column, str]]:
    """Column and unit of every heading; an empty unit for the base unit."""
    known = {column.name: column for column in COLUMNS}
    found: list[tuple[Column, str]] = []
    for cell in cells:
        match = HEADING.fullmatch(cell)
        if match is None or match[1] not in known:
            raise UserError(f"{path}:1: {cell!r}: no column; allowed: {', '.join(known)}")
        found.append((known[match[1]], (match[2] or "").strip()))
    names = [column.name for column, _ in found]
    for name in NEEDED:
        if names.count(name) == 0:
            raise UserError(f"{path}:1: no column {name}; allowed: at least {', '.join(NEEDED)}")
    for name in names:
        if names.count(name) > 1:
            raise UserError(f"{path}:1: two columns {name}; allowed: one")
    return found


def _numbers(path: Path, number: int, cells: Sequence[str], count: int) -> list[float]:
    """One row of finite numbers."""
    if len(cells) != count:
        raise UserError(f"{path}:{number}: {len(cells)} cells; allowed: {count}, as headings")
    values = []
    for cell in cells:
        try:
            values.append(float(cell))
        except ValueError as error:
            raise UserError(f"{path}:{number}: {cell!r}; allowed: numbers") from error
    if not np.all(np.isfinite(values)):
        raise UserError(f"{path}:{number}: a number that is not finite; allowed: finite numbers")
    return values


def _per_length(path: Path, headings: Sequence[tuple[Column, str]]) -> bool:
    """Whether the table is of a line contact: by the unit of its stiffness."""
    ((column, unit),) = [own for own in headings if own[0].name == "kt"]
    try:
        to_base(f"1 {unit or column.unit}", column.units(True)[0])
    except UnitError:
        return False
    return True


def _factor(path: Path, column: Column, unit: str, per_length: bool) -> float:
    """Base units in a unit of the table."""
    base, _ = column.units(per_length)
    if unit in ("", base):
        return 1.0
    try:
        return to_base(f"1 {unit}", base)
    except UnitError as error:
        raise UserError(f"{path}:1: {column.name}: {error}; allowed: units of {base}") from error
