"""Files that a case names: columns of numbers with their units known, and fields of heights."""

from __future__ import annotations

import csv
import difflib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sa_solver.types import Array
from workflow.case.fields import Quantity, shown, split_dataset


class InputFileError(ValueError):
    """A file that cannot be taken; ``file:line: what is wrong; what is allowed``."""


def read_columns(file: str, allowed: Mapping[str, Quantity]) -> dict[str, Array]:
    """Columns ``(n,)`` of a CSV file with a header of ``allowed`` names, in base units.

    Raises InputFileError.
    """
    rows = _rows(file)
    if len(rows) < 2:
        raise InputFileError(f"{file}:1: no rows; allowed: a header and a row per increment")
    (line, header), *rest = rows
    _check_header(f"{file}:{line}", header, list(allowed))
    values = [_numbers(f"{file}:{line}", header, row, allowed) for line, row in rest]
    return dict(zip(header, np.array(values).T.copy(), strict=True))


def _check_header(place: str, header: list[str], allowed: list[str]) -> None:
    for name in header:
        if name not in allowed:
            near = difflib.get_close_matches(name, allowed, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"allowed: {', '.join(allowed)}"
            raise InputFileError(f"{place}: {shown(name)}: unknown column; {hint}")
        if header.count(name) > 1:
            raise InputFileError(f"{place}: {name}: column given twice; allowed: once")


def _numbers(
    place: str, header: list[str], row: list[str], allowed: Mapping[str, Quantity]
) -> list[float]:
    """One row of the table, every number within its limits."""
    if len(row) != len(header):
        raise InputFileError(f"{place}: {len(row)} values; allowed: {len(header)}, as the header")
    values = []
    for name, cell in zip(header, row, strict=True):
        number = _number(f"{place}: {name}", cell)
        if not allowed[name].contains(number):
            raise InputFileError(
                f"{place}: {name}: {cell}: out of range; allowed: {allowed[name].allowed}"
            )
        values.append(number)
    return values


def _number(place: str, cell: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        raise InputFileError(f"{place}: {shown(cell)}: not a number; allowed: numbers") from None
    if not np.isfinite(number):
        raise InputFileError(f"{place}: {cell}: not a finite number; allowed: finite numbers")
    return number


def height_shape(file: str) -> tuple[int, int]:
    """Cells along x and y of a file of heights. Raises InputFileError."""
    rows, columns = read_heights(file).shape
    return rows, columns


def read_heights(file: str) -> Array:
    """Heights ``(nx, ny)`` [mm] of ``.npy``, ``.csv`` or ``.h5:dataset``; a list is one column.

    Raises InputFileError.
    """
    name, dataset = split_dataset(file)
    ending = Path(name).suffix
    if ending == ".npy":
        heights = _read_npy(name)
    elif ending == ".h5":
        heights = _read_dataset(name, dataset)
    else:
        heights = _read_csv(name)
    if heights.dtype.kind not in "iuf" or heights.ndim not in (1, 2) or heights.size == 0:
        raise InputFileError(
            f"{file}: {heights.ndim} dimensions of type {heights.dtype}; "
            "allowed: numbers in rows along x and columns along y"
        )
    heights = heights.reshape(len(heights), -1).astype(np.float64)
    if not np.all(np.isfinite(heights)):
        row, column = np.argwhere(~np.isfinite(heights))[0] + 1
        raise InputFileError(
            f"{file}: row {row}, column {column}: not a finite number; allowed: a height per cell"
        )
    return heights


def _read_npy(file: str) -> np.ndarray:
    try:
        return np.asarray(np.load(file, allow_pickle=False))
    except (OSError, ValueError, EOFError) as error:
        raise InputFileError(f"{file}: cannot be read ({_first_line(error)})") from error


def _read_dataset(file: str, dataset: str) -> np.ndarray:
    import h5py

    if not dataset:
        raise InputFileError(f"{file}: which dataset? allowed: such as {Path(file).name}:gap")
    try:
        with h5py.File(file) as opened:
            found = opened.get(dataset)
            if not isinstance(found, h5py.Dataset):
                known = ", ".join(opened) or "none"
                raise InputFileError(f"{file}: {dataset}: no such dataset; at the top: {known}")
            return np.asarray(found[()])
    except OSError as error:
        raise InputFileError(f"{file}: cannot be read ({_first_line(error)})") from error


def _read_csv(file: str) -> np.ndarray:
    rows = _rows(file)
    if not rows:
        raise InputFileError(f"{file}:1: empty; allowed: rows of heights")
    values = []
    for line, row in rows:
        if len(row) != len(rows[0][1]):
            raise InputFileError(
                f"{file}:{line}: {len(row)} values; allowed: {len(rows[0][1])}, as the first row"
            )
        values.append([_number(f"{file}:{line}", cell) for cell in row])
    return np.array(values)


def _rows(file: str) -> list[tuple[int, list[str]]]:
    """Line number and cells of every row that is not empty."""
    try:
        with Path(file).open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.reader(stream)
            return [
                (reader.line_num, [cell.strip() for cell in row])
                for row in reader
                if any(cell.strip() for cell in row)
            ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputFileError(f"{file}: cannot be read ({_first_line(error)})") from error


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
