"""Tables of numbers in CSV files that come with a case or a command: one dialect for all of them.

The first row has the headings, each a name with a unit in brackets, or without one in the base
unit. Lines that begin with ``#`` are comments, empty ones and a byte-order mark are passed over.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sa_solver.types import Array
from workflow.case.fields import Quantity, shown
from workflow.case.input_files import InputFileError
from workflow.case.units import UnitError, to_base
from workflow.errors import one_line

COMMENT = "#"
HEADING = re.compile(r"(?P<name>[^\[\]]*?)\s*(?:\[\s*(?P<unit>[^\[\]]*?)\s*\])?")


@dataclass(frozen=True)
class TableFile:
    """A file as it is written: ``headings`` in their ``line``, and ``rows``, each with its line."""

    file: str
    line: int
    headings: tuple[str, ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]

    @property
    def place(self) -> str:
        """File and line of the headings."""
        return f"{self.file}:{self.line}"

    @property
    def names(self) -> tuple[str, ...]:
        """The headings without their units."""
        return tuple(_name_and_unit(heading)[0] for heading in self.headings)

    def unit(self, name: str) -> str:
        """Unit of a column, empty without one."""
        return _name_and_unit(self.headings[self.names.index(name)])[1]

    def require(self, name: str, allowed: str) -> None:
        """Raise InputFileError, which says what is ``allowed``, unless there is such a column."""
        if name not in self.names:
            there = ", ".join(shown(heading) for heading in self.headings)
            raise InputFileError(
                f"{self.place}: no column {name}; this file has {there}; allowed: {allowed}"
            )

    def column(self, name: str, quantity: Quantity) -> Array:
        """Numbers ``(n,)`` of a column that there is, in the base unit of ``quantity``.

        Raises InputFileError for a column that is given twice, a unit of another kind, and what
        is no number or outside the limits of ``quantity``.
        """
        if self.names.count(name) > 1:
            raise InputFileError(f"{self.place}: {name}: column given twice; allowed: once")
        place, factor = self.names.index(name), self._factor(name, quantity.unit or "1")
        return np.array(
            [
                _number(f"{self.file}:{line}: {name}", cells[place], factor, quantity)
                for line, cells in self.rows
            ]
        )

    def _factor(self, name: str, base: str) -> float:
        """Base units in the unit of a column."""
        unit = self.unit(name)
        if unit in ("", base):
            return 1.0
        try:
            return to_base(f"1 {unit}", base)
        except UnitError as error:
            raise InputFileError(
                f"{self.place}: {name}: {error}; allowed: units of {base}"
            ) from error


def read_table_file(file: str | Path) -> TableFile:
    """Headings and rows of a CSV file. Raises InputFileError where it is none."""
    lines = _lines(file)
    if len(lines) < 2:
        line = lines[0][0] if lines else 1
        raise InputFileError(f"{file}:{line}: no rows; allowed: a header and at least one row")
    (line, headings), *rows = lines
    for number, cells in rows:
        if len(cells) != len(headings):
            raise InputFileError(
                f"{file}:{number}: {len(cells)} values; allowed: {len(headings)}, as the header"
            )
    return TableFile(str(file), line, headings, tuple(rows))


def _lines(file: str | Path) -> list[tuple[int, tuple[str, ...]]]:
    """Line number and cells of every row that is neither empty nor a comment."""
    try:
        with Path(file).open(newline="", encoding="utf-8-sig") as stream:
            # Empty in place of comments, so that they still count.
            lines = ("\n" if line.lstrip().startswith(COMMENT) else line for line in stream)
            reader = csv.reader(lines)
            return [
                (reader.line_num, tuple(cell.strip() for cell in cells))
                for cells in reader
                if any(cell.strip() for cell in cells)
            ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputFileError(
            f"{file}: cannot be read ({one_line(error)}); allowed: a CSV file"
        ) from error


def _name_and_unit(heading: str) -> tuple[str, str]:
    """Name and unit of a heading; one in other brackets is a name as a whole."""
    match = HEADING.fullmatch(heading)
    return (match["name"], match["unit"] or "") if match else (heading, "")


def _number(place: str, cell: str, factor: float, quantity: Quantity) -> float:
    """A cell in the base unit, within the limits of its quantity."""
    try:
        # Python would take 1_000 for a number.
        number = factor * float("" if "_" in cell else cell)
    except ValueError:
        raise InputFileError(f"{place}: {shown(cell)}: not a number; allowed: numbers") from None
    if not np.isfinite(number):
        raise InputFileError(f"{place}: {cell}: not a finite number; allowed: finite numbers")
    if not quantity.contains(number):
        raise InputFileError(f"{place}: {cell}: out of range; allowed: {quantity.allowed}")
    return number
