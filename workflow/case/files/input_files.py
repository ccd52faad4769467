"""Readers of files that a case or a command names: CSV rows, arrays and fields of heights."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sa_solver.types import Array
from workflow.case.fields import shown, split_dataset, unreadable
from workflow.errors import UserError, one_line

if TYPE_CHECKING:
    import h5py

COMMENT = "#"
# Control characters that no text has; a form feed and the end-of-file mark of Windows are allowed.
NO_TEXT = re.compile(r"[\x00-\x08\x0e-\x19\x1b-\x1f\x7f]")
QUOTED = re.compile(r'"[^"]*"')
DECIMAL_COMMA = re.compile(r"^([-+]?\d*),(\d+(?:[eE][-+]?\d+)?)$")
# Blanks between a heading and its unit in brackets.
BEFORE_UNIT = re.compile(r"\s+(?=[\[(])")
# Exceptions that h5py raises for dangling links; a damaged file raises others too.
HDF5_ERRORS = OSError, RuntimeError, LookupError


class InputFileError(UserError, ValueError):
    """File that cannot be used; the message is ``file:line: what is wrong; what is allowed``."""


def text_of(file: str | Path) -> str:
    """Return the text of a file in UTF-8, UTF-16 or, where it is neither, in Latin-1.

    Byte order marks are skipped. UTF-16 without a mark is recognized by its zero bytes, which other
    text does not have. Raises InputFileError.
    """
    allowed = "; allowed: text in UTF-8, UTF-16 or Latin-1"
    if wrong := unreadable(Path(file)):
        raise InputFileError(f"{file}: {wrong}{allowed}")
    try:
        raw = Path(file).read_bytes()
        if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            text = raw.decode("utf-16")
        elif 0 in raw[:2]:
            text = raw.decode("utf-16-be" if raw[0] == 0 else "utf-16-le")
        else:
            text = _utf_8_or_latin_1(raw)
    except (OSError, UnicodeDecodeError) as error:
        raise _unreadable(str(file), error, allowed) from error
    if NO_TEXT.search(text):
        raise InputFileError(f"{file}: cannot be read (it is not text){allowed}")
    return text


def _utf_8_or_latin_1(raw: bytes) -> str:
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def csv_rows(file: str | Path, blanks: bool = False) -> list[tuple[int, tuple[str, ...]]]:
    """Return line number and cells of every row of a CSV file that is neither empty nor a comment.

    Comments begin with ``#``. The separator is a semicolon, a tab or a comma, the first of these
    that the first row has; with ``blanks``, white space if it has none of them. Where semicolons
    separate the cells, a comma within a number is a decimal comma, as programs write it in some
    languages. Raises InputFileError.
    """
    # Comments become empty lines, so that line numbers stay right.
    lines = [
        "\n" if line.lstrip().startswith(COMMENT) else line
        for line in io.StringIO(text_of(file), newline="")
    ]
    first = QUOTED.sub("", next((line for line in lines if line.strip()), ""))
    separator = next((at for at in (";", "\t", ",") if at in first and f",{at}" not in first), ",")
    if blanks and not any(at in first for at in ",;\t"):
        separator = " "
        lines = [BEFORE_UNIT.sub("", line.strip()) + "\n" for line in lines]
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=separator == " ")
    try:
        rows = [
            (reader.line_num, tuple(cell.strip() for cell in cells))
            for cells in reader
            if any(cell.strip() for cell in cells)
        ]
    except csv.Error as error:
        raise _unreadable(str(file), error, "; allowed: a CSV file") from error
    if separator != ";":
        return rows
    return [
        (line, tuple(DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in cells)) for line, cells in rows
    ]


def check_widths(file: str | Path, rows: Sequence[tuple[int, tuple[str, ...]]], first: str) -> None:
    """Raise InputFileError unless all rows have as many cells as the first.

    Messages call the first row ``first``.
    """
    count = len(rows[0][1])
    for line, cells in rows:
        if len(cells) != count:
            raise InputFileError(
                f"{file}:{line}: {len(cells)} values; allowed: {count}, as the {first}"
            )


def number_in(place: str, cell: str) -> float:
    """Return the number in a cell; raise InputFileError if it is not a finite number."""
    if DECIMAL_COMMA.match(cell):
        raise InputFileError(
            f"{place}: {cell}: a decimal comma; allowed: a point, or semicolons between the cells"
        )
    try:
        # Python would accept 1_000 as a number.
        number = float("" if "_" in cell else cell)
    except ValueError:
        raise InputFileError(f"{place}: {shown(cell)}: not a number; allowed: numbers") from None
    if not np.isfinite(number):
        raise InputFileError(f"{place}: {cell}: not a finite number; allowed: finite numbers")
    return number


def read_heights(file: str) -> Array:
    """Return heights ``(nx, ny)`` [mm] of ``.npy``, ``.csv`` or ``.h5:dataset``.

    A list is one column. Raises InputFileError.
    """
    heights = _read_csv(file) if file.endswith(".csv") else read_array(file)
    heights = in_rows(file, heights)
    if not np.all(np.isfinite(heights)):
        row, column = np.argwhere(~np.isfinite(heights))[0] + 1
        raise InputFileError(
            f"{file}: row {row}, column {column}: not a finite number; allowed: a height per cell"
        )
    return heights


def in_rows(file: str, heights: np.ndarray) -> Array:
    """Return heights ``(nx, ny)``, a list as one column; raise InputFileError for other arrays."""
    if heights.dtype.kind not in "iuf" or heights.ndim not in (1, 2) or heights.size == 0:
        raise InputFileError(
            f"{file}: {heights.ndim} dimensions of type {heights.dtype}; "
            "allowed: numbers in rows along x and columns along y"
        )
    return heights.reshape(len(heights), -1).astype(np.float64)


def read_array(file: str) -> np.ndarray:
    """Return the array in ``.npy``, ``.npz:array`` or ``.h5:dataset``; raise InputFileError."""
    name, array = split_dataset(file)
    if name.endswith(".h5"):
        return _read_dataset(name, array)
    try:
        found = np.load(name, allow_pickle=False)
        if isinstance(found, np.ndarray):
            return found
        with found:
            if array in found:
                return np.asarray(found[array])
            there = ", ".join(found)
    except Exception as error:  # numpy raises many kinds of exception for other or damaged files
        raise _unreadable(name, error) from error
    raise InputFileError(
        f"{name}: {array or 'which array?'}: name an array after a colon; allowed: {there}"
    )


def _read_dataset(file: str, dataset: str) -> np.ndarray:
    import h5py

    if not dataset:
        raise InputFileError(f"{file}: which dataset? allowed: such as {Path(file).name}:gap")
    with open_hdf5(file) as opened:
        item = opened.get(dataset)
        if not isinstance(item, h5py.Dataset):
            known = ", ".join(opened) or "none"
            raise InputFileError(f"{file}: {dataset}: no such dataset; at the top: {known}")
        return np.asarray(item[()])


@contextmanager
def open_hdf5(file: str) -> Iterator[h5py.File]:
    """Open an HDF5 file for reading; it must contain all of its data itself.

    Raises InputFileError, also for damage that is found during reading. Links to other files are
    refused: they bring in numbers of files that the user has not named, and HDF5 reads missing ones
    as 0.
    """
    import h5py

    try:
        with h5py.File(file, "r") as opened:
            astray = opened.visititems_links(lambda name, link: _astray(opened, name, link))
            if astray:
                raise InputFileError(f"{file}: {astray}; allowed: data in the file itself")
            yield opened
    except InputFileError:
        raise
    except (*HDF5_ERRORS, TypeError, ValueError, MemoryError, SystemError) as error:
        raise _unreadable(file, error) from error


def _astray(opened: h5py.File, name: str, link: Any) -> str | None:
    """Return what is wrong with a link in the file; None if it leads to data in the file."""
    import h5py

    if isinstance(link, h5py.ExternalLink):
        return f"/{name}: a link to another file"
    try:
        item = opened[name]
    except HDF5_ERRORS:
        return f"/{name}: a link that leads nowhere"
    if isinstance(item, h5py.Dataset) and (item.is_virtual or item.external):
        return f"/{name}: a dataset with numbers of another file"
    return None


def _read_csv(file: str) -> np.ndarray:
    rows = csv_rows(file)
    if not rows:
        raise InputFileError(f"{file}:1: empty; allowed: rows of heights")
    check_widths(file, rows, "first row")
    return np.array([[number_in(f"{file}:{line}", cell) for cell in row] for line, row in rows])


def _unreadable(file: str, error: Exception, allowed: str = "") -> InputFileError:
    return InputFileError(f"{file}: cannot be read ({one_line(error)}){allowed}")
