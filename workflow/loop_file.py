"""Records of hysteresis loops in CSV files, as measuring programs write them."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sa_solver.types import Array
from workflow.case.fields import shown
from workflow.case.units import UnitError, to_base
from workflow.errors import UserError
from workflow.resultants.table import COMMENT, HEADER

BASE_UNITS = {"displacement": "mm", "force": "N", "time": "s", "normal_load": "N"}
NEEDED = ("displacement", "force")


@dataclass(frozen=True)
class LoopFile:
    """Columns of a file, ``(t,)`` each, in base units; None for those that it does not have."""

    displacement: Array
    force: Array
    time: Array | None
    normal_load: Array | None


def read_loop_file(path: Path, names: Mapping[str, str]) -> LoopFile:
    """Read the columns of ``BASE_UNITS``, of which ``names`` gives those named otherwise.

    Headings are names with a unit in brackets, or in the base unit without. Lines that begin with
    ``#`` are comments, other columns are left alone. Raises UserError with the line.
    """
    called = {key: names.get(key, key) for key in BASE_UNITS}
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            lines = ("\n" if line.lstrip().startswith(COMMENT) else line for line in stream)
            reader = csv.reader(lines)
            rows = ((reader.line_num, row) for row in reader if any(map(str.strip, row)))
            return _read(path, called, rows, required=[*NEEDED, *names])
    except (UnicodeDecodeError, csv.Error) as error:
        text = " ".join(str(error).split())
        raise UserError(f"{path}: cannot be read ({text}); allowed: a CSV file") from error


def _read(
    path: Path,
    called: Mapping[str, str],
    rows: Iterator[tuple[int, list[str]]],
    required: list[str],
) -> LoopFile:
    """The columns of the rows, the first of which are headings."""
    number, headings = next(rows, (1, []))
    place = f"{path}:{number}"
    found = _columns(place, headings, called)
    for key in required:
        if key not in found:
            there = ", ".join(shown(cell.strip()) for cell in headings) or "nothing"
            raise UserError(
                f"{place}: no column {called[key]}; this file has {there}; allowed: a column of "
                f"that name, or --column {key}=NAME"
            )
    numbers: dict[str, list[float]] = {key: [] for key in found}
    for line, row in rows:
        if len(row) != len(headings):
            raise UserError(f"{path}:{line}: {len(row)} values; allowed: {len(headings)}")
        for key, (column, _) in found.items():
            numbers[key].append(_number(f"{path}:{line}: {called[key]}", row[column]))
    if not numbers["force"]:
        raise UserError(f"{place}: no rows; allowed: headings and a row for every sample")
    columns = {key: factor * np.array(numbers[key]) for key, (_, factor) in found.items()}
    return LoopFile(**{key: columns.get(key) for key in BASE_UNITS})  # type: ignore[arg-type]


def _columns(
    place: str, headings: list[str], called: Mapping[str, str]
) -> dict[str, tuple[int, float]]:
    """Place in a row, and base units in its unit, of every column that is wanted."""
    found: dict[str, tuple[int, float]] = {}
    keys = {name: key for key, name in called.items()}
    for column, cell in enumerate(headings):
        match = HEADER.fullmatch(cell.strip())
        key = keys.get(match["name"]) if match else None
        if match is None or key is None:
            continue
        if key in found:
            raise UserError(f"{place}: {called[key]}: column given twice; allowed: once")
        found[key] = column, _factor(f"{place}: {called[key]}", match["unit"], BASE_UNITS[key])
    return found


def _factor(place: str, unit: str | None, base: str) -> float:
    """Base units in a unit."""
    if unit is None:
        return 1.0
    try:
        return to_base(f"1 {unit}", base)
    except UnitError as error:
        raise UserError(f"{place}: {error}; allowed: units of {base}") from error


def _number(place: str, cell: str) -> float:
    try:
        # Python would take 1_000 for a number.
        number = float("" if "_" in cell else cell)
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        raise UserError(f"{place}: {shown(cell.strip())}: no number; allowed: finite numbers")
    return number
