"""Tables of numbers in CSV files that come with a case or a command, all in the same dialect.

The first row has the headings, each a name with a unit in brackets; without one, the column is in
the base unit. Alternatively the second row has the units, as measuring programs write them. Lines
that begin with ``#`` are comments; empty lines and a byte-order mark are skipped. Encodings and
separators are those of :func:`workflow.case.files.input_files.csv_rows`.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from sa_solver.types import Array, Indices
from workflow.case.fields import Quantity, shown
from workflow.case.files.input_files import InputFileError, check_widths, csv_rows, number_in
from workflow.case.units import UnitError, to_base

HEADING = re.compile(r"(?P<name>[^\[\]]*?)\s*(?:\[\s*(?P<unit>[^\[\]]*?)\s*\])?")
# Other notations of a unit. They count only if the text is a unit: "force (left)" is a name.
ELSEWHERE = re.compile(r"(?P<name>.+?)\s*(?:\((?P<in_brackets>.+)\)|\s(?:in|/)\s+(?P<after>\S+))")

# A row of units below the names, bare or in brackets, and the sign for no unit.
BRACKETS, NO_UNIT = re.compile(r"^[\[(]\s*(.*?)\s*[\])]$"), "-"


@dataclass(frozen=True)
class TableFile:
    """CSV file as written: ``headings`` with their ``line``, and ``rows``, each with its line."""

    file: str
    line: int
    headings: tuple[str, ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def place(self) -> str:
        """File and line of the headings."""
        return f"{self.file}:{self.line}"

    @property
    def names(self) -> tuple[str, ...]:
        """Headings without their units."""
        return tuple(_name_and_unit(heading)[0] for heading in self.headings)

    def unit(self, name: str) -> str:
        """Return the unit of a column, empty if it has none."""
        return _name_and_unit(self.headings[self.names.index(name)])[1]

    def check(self, units: Mapping[str, str | None]) -> None:
        """Raise InputFileError unless all columns are among those of ``units``.

        Each may be given once, in a unit that can be converted to its base unit; None means text.
        """
        for name, heading in zip(self.names, self.headings, strict=True):
            if name not in units:
                near = difflib.get_close_matches(name, list(units), n=1)
                hint = f"did you mean '{near[0]}'?" if near else f"allowed: {', '.join(units)}"
                raise InputFileError(f"{self.place}: {shown(heading)}: unknown column; {hint}")
            self._check_column(name, units[name])

    def require(self, names: Iterable[str], allowed: str) -> None:
        """Raise InputFileError, which says what is ``allowed``, unless all columns exist."""
        missing = [name for name in names if name not in self.names]
        if missing:
            there = ", ".join(shown(heading) for heading in self.headings)
            if any(name in self.headings for name in missing):
                there += ", each called without its unit"
            raise InputFileError(
                f"{self.place}: no column {', '.join(missing)}; this file has {there}; "
                f"allowed: {allowed}"
            )

    def require_unit(self, name: str, example: str) -> None:
        """Raise InputFileError for a column without a unit, with an ``example`` of one."""
        if not self.unit(name):
            raise InputFileError(
                f"{self.place}: {shown(name)}: no unit; allowed: one in brackets, such as "
                f"{name} [{example}]"
            )

    def cells(self, name: str) -> list[str]:
        """Return the texts of an existing column, as they are written."""
        place = self.names.index(name)
        return [cells[place] for _, cells in self.rows]

    def column(self, name: str, quantity: Quantity) -> Array:
        """Return the numbers ``(n,)`` of an existing column, in the base unit of ``quantity``.

        Conversion is exact, as in a case. Raises InputFileError for a column that is given twice, a
        unit of another dimension, and values that are not numbers or outside the limits of
        ``quantity``.
        """
        base = quantity.unit or "1"
        self._check_column(name, base)
        unit = self.unit(name)
        numbers = []
        for (line, _), cell in zip(self.rows, self.cells(name), strict=True):
            place = f"{self.file}:{line}: {name}"
            number = number_in(place, cell)
            if unit not in ("", base):
                number = to_base(f"{cell} {unit}", base)
            if not quantity.contains(number):
                raise InputFileError(f"{place}: {cell}: out of range; allowed: {quantity.allowed}")
            numbers.append(number)
        return np.array(numbers)

    def whole(self, name: str) -> list[int]:
        """Return a column of whole numbers; raise InputFileError for others."""
        numbers = self.column(name, Quantity("1"))
        for row in np.flatnonzero(numbers != np.rint(numbers)).tolist():
            raise self.refusal(row, name, "not a whole number", "whole numbers")
        return [int(number) for number in numbers]

    def once(self, name: str) -> Indices:
        """Return a column of whole numbers ``(n,)``; raise InputFileError if one occurs twice."""
        numbers = np.array(self.whole(name), dtype=np.int64)
        _, first = np.unique(numbers, return_index=True)
        for row in np.setdiff1d(np.arange(len(self)), first).tolist():
            raise self.refusal(row, name, f"{name} given twice", "once")
        return numbers

    def refusal(self, row: int, name: str, wrong: str, allowed: str) -> InputFileError:
        """Return the error about one cell; for a missing column it names the column only."""
        line, cells = self.rows[row]
        value = f"{cells[self.names.index(name)]}: " if name in self.names else ""
        return InputFileError(f"{self.file}:{line}: {name}: {value}{wrong}; allowed: {allowed}")

    def _check_column(self, name: str, base: str | None) -> None:
        if self.names.count(name) > 1:
            raise InputFileError(f"{self.place}: {name}: column given twice; allowed: once")
        if unit := self.unit(name):
            check_unit(f"{self.place}: {name}", unit, base or "1")


def read_table_file(file: str | Path) -> TableFile:
    """Return headings and rows of a CSV file; raise InputFileError for any other file."""
    rows = csv_rows(file)
    if len(rows) < 2:
        line = rows[0][0] if rows else 1
        raise InputFileError(f"{file}:{line}: no rows; allowed: a header and at least one row")
    check_widths(file, rows, "header")
    (line, headings), *rest = rows
    if len(rest) > 1 and (units := _units_below(headings, rest[0][1])):
        headings = tuple(
            f"{name} [{unit}]" if unit else name for name, unit in zip(headings, units, strict=True)
        )
        rest = rest[1:]
    return TableFile(str(file), line, headings, tuple(rest))


def read_columns(file: str, allowed: Mapping[str, Quantity]) -> dict[str, Array]:
    """Return all columns ``(n,)`` of a file by name, in base units; each must be ``allowed``.

    Raises InputFileError.
    """
    table = read_table_file(file)
    table.check({name: quantity.unit for name, quantity in allowed.items()})
    return {name: table.column(name, allowed[name]) for name in table.names}


def check_unit(place: str, unit: str, base: str) -> None:
    """Raise InputFileError unless ``unit`` can be converted to ``base``."""
    try:
        to_base(f"1 {unit}", base)
    except UnitError as error:
        allowed = "a bare number" if base == "1" else f"{base}, or a unit of the same dimension"
        raise InputFileError(f"{place}: {error}; allowed: {allowed}") from error


def _units_below(headings: tuple[str, ...], cells: tuple[str, ...]) -> tuple[str, ...]:
    """Return the units in a second row of headings, "" for none; empty if it is no such row."""
    units = tuple(BRACKETS.sub(r"\1", cell) for cell in cells)
    units = tuple("" if unit == NO_UNIT else unit for unit in units)
    if not any(units) or any(_name_and_unit(heading)[1] for heading in headings):
        return ()
    for unit in filter(None, units):
        try:
            to_base(f"1 {unit}", None)
        except UnitError:
            return ()
    # A row that contains a number is the first row of the table.
    return () if any(unit[0] in "0123456789.+" for unit in filter(None, units)) else units


@cache
def _name_and_unit(heading: str) -> tuple[str, str]:
    """Return name and unit of a heading: in brackets, parentheses, or after ``in`` or a slash."""
    if match := ELSEWHERE.fullmatch(heading):
        unit = (match["in_brackets"] or match["after"]).strip()
        with suppress(UnitError):
            to_base(f"1 {unit}", None)
            return match["name"], unit
    match = HEADING.fullmatch(heading)
    return (match["name"], match["unit"] or "") if match else (heading, "")
