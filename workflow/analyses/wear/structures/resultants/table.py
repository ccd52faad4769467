"""Tables that another program wrote: CSV with comments and units; every error has its line."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array
from workflow.case import units
from workflow.case.fields import shown
from workflow.case.input_files import InputFileError
from workflow.case.table_file import TableFile, read_table_file


@dataclass(frozen=True)
class Table:
    """Rows of a file by column: ``numbers`` ``(n,)`` in base units, ``cells`` as written."""

    file: str
    lines: tuple[int, ...]
    numbers: dict[str, Array]
    cells: dict[str, list[str]]

    def __len__(self) -> int:
        return len(self.lines)

    def refusal(self, row: int, column: str, wrong: str, allowed: str) -> InputFileError:
        """The error about one cell; a column that the file does not give is named alone."""
        value = f"{self.cells[column][row]}: " if column in self.cells else ""
        return InputFileError(
            f"{self.file}:{self.lines[row]}: {column}: {value}{wrong}; allowed: {allowed}"
        )

    def whole(self, column: str) -> list[int]:
        """A column of whole numbers. Raises InputFileError."""
        numbers = self.numbers[column]
        for row in np.flatnonzero(numbers != np.rint(numbers)).tolist():
            raise self.refusal(row, column, "not a whole number", "whole numbers")
        return [int(number) for number in numbers]


def read_table(file: str, base_units: Mapping[str, str | None], required: Sequence[str]) -> Table:
    """Rows of a CSV file whose header names columns, each with its unit in brackets or in none.

    ``base_units`` are those of all columns that may be given: ``"1"`` is a bare number, None is
    text. Lines that begin with ``#`` are comments. Raises InputFileError.
    """
    table = read_table_file(file)
    written = _columns(table, base_units)
    missing = [name for name in required if name not in written]
    if missing:
        raise InputFileError(
            f"{table.place}: {', '.join(missing)}: missing; "
            f"allowed: {', '.join(required)} in every file; this one has {', '.join(written)}"
        )
    cells = {name: [row[k] for _, row in table.rows] for k, name in enumerate(written)}
    lines = tuple(line for line, _ in table.rows)
    numbers = {}
    for name, unit in written.items():
        base = base_units[name]
        if base is not None:
            pairs = zip(lines, cells[name], strict=True)
            numbers[name] = np.array(
                [_number(f"{file}:{n}: {name}", c, unit, base) for n, c in pairs]
            )
    return Table(file, lines, numbers, cells)


def _columns(table: TableFile, base_units: Mapping[str, str | None]) -> dict[str, str | None]:
    """Unit as written, or None, by name of the column."""
    found: dict[str, str | None] = {}
    for name in table.names:
        if name not in base_units:
            near = difflib.get_close_matches(name, list(base_units), n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"allowed: {', '.join(base_units)}"
            raise InputFileError(f"{table.place}: {shown(name)}: unknown column; {hint}")
        if name in found:
            raise InputFileError(f"{table.place}: {name}: column given twice; allowed: once")
        unit = table.unit(name) or None
        if unit is not None:
            check_unit(f"{table.place}: {name}", unit, base_units[name] or "1")
        found[name] = unit
    return found


def check_unit(place: str, unit: str, base: str) -> None:
    """Raise InputFileError unless ``unit`` can be converted to ``base``."""
    try:
        units.to_base(f"1 {unit}", base)
    except units.UnitError as error:
        allowed = "a bare number" if base == "1" else f"{base}, or a unit of the same dimension"
        raise InputFileError(f"{place}: {error}; allowed: {allowed}") from error


def _number(place: str, cell: str, unit: str | None, base: str) -> float:
    try:
        # Python would take 1_000 for a number.
        number = float("" if "_" in cell else cell)
    except ValueError:
        raise InputFileError(f"{place}: {shown(cell)}: not a number; allowed: numbers") from None
    if unit is not None and np.isfinite(number):
        number = units.to_base(f"{cell} {unit}", base)
    if not np.isfinite(number):
        raise InputFileError(f"{place}: {cell}: not a finite number; allowed: finite numbers")
    return number
