"""Measured surfaces in files: profilometers' own, tables of points, and bare heights.

Profilometers' files say their units and pitch themselves, and are read and written by surfalize.
Their lines go along x and follow each other along y.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sa_solver.errors import InputError
from sa_solver.scans import Scan
from sa_solver.types import Array
from workflow.case.fields import Quantity, shown, split_dataset, unreadable
from workflow.case.input_files import (
    InputFileError,
    check_widths,
    csv_rows,
    number_in,
    read_array,
)
from workflow.case.table_file import TableFile, read_table_file
from workflow.case.units import to_base
from workflow.errors import UserError, one_line

if TYPE_CHECKING:
    from types import ModuleType

# Of the many that the library reads, those of profilometers that say their units and pitch.
PROFILOMETER = (
    *(".x3p", ".sur", ".al3d", ".plu", ".plux", ".sdf", ".opd", ".os3d", ".tmd", ".gwy"),
    *(".vk4", ".vk6", ".vk7", ".zon", ".zmg", ".nms"),
)
WRITTEN = ".x3p", ".sur", ".al3d", ".sdf"
BARE = ".npy", ".npz", ".csv", ".h5"
ENDINGS = (*PROFILOMETER, *BARE)
UNITS = "m", "mm", "um", "nm"
TO_MICRONS = 1e3
# Points along a direction below which there is no surface to speak of.
FEWEST = 4
# Share of a step by which the points of a table may lie beside a regular grid.
REGULAR = 0.01
NOT_MEASURED = "", "nan"


def read_scan(file: str, unit: str | None, pitch: tuple[float, float] | None) -> Scan:
    """The scan in a file, its heights and pitch in mm, NaN where points are missing.

    ``unit`` of the heights and ``pitch`` [mm] are for files of bare heights, which do not say them:
    ``.npy``, ``.npz:array``, ``.h5:dataset`` and ``.csv``, rows along x and columns along y. A CSV
    file with headings ``x, y, z`` is a table of points of a regular grid, each in any order.
    Raises InputFileError.
    """
    name, _ = split_dataset(file)
    if Path(name).suffix.lower() in PROFILOMETER:
        _check_own_units(file, unit, pitch)
        return _checked(file, lambda: _read_profilometer(Path(name)))
    if name.endswith(".csv") and _has_headings(name):
        _check_own_units(file, unit, pitch)
        return _checked(file, lambda: _read_points(read_table_file(name)))
    if unit is None or pitch is None:
        missing = " and ".join(key for key, at in (("unit", unit), ("pitch", pitch)) if at is None)
        raise InputFileError(
            f"{file}: bare heights do not say their {missing}; allowed: both beside the file"
        )
    heights = _read_matrix(name) if name.endswith(".csv") else read_array(file)
    if heights.dtype.kind not in "iuf" or heights.ndim not in (1, 2) or heights.size == 0:
        raise InputFileError(
            f"{file}: {heights.ndim} dimensions of type {heights.dtype}; "
            "allowed: numbers in rows along x and columns along y"
        )
    scale = to_base(f"1 {unit}", "mm")
    rows = heights.reshape(len(heights), -1)
    return _checked(file, lambda: Scan(rows.astype(np.float64) * scale, pitch))


def _check_own_units(file: str, unit: str | None, pitch: tuple[float, float] | None) -> None:
    given = " and ".join(key for key, at in (("unit", unit), ("pitch", pitch)) if at is not None)
    if given:
        raise InputFileError(f"{file}: says its units and pitch itself; allowed: no {given}")


def _checked(file: str, read: Callable[[], Scan]) -> Scan:
    """What is read, once it is a surface. Raises InputFileError."""
    try:
        scan = read()
    except InputError as error:
        raise InputFileError(f"{file}: {error}") from error
    nx, ny = scan.heights.shape
    if nx < FEWEST or 1 < ny < FEWEST:
        raise InputFileError(
            f"{file}: {nx} x {ny} points; allowed: at least {FEWEST} along x, and as many along y "
            "or one column"
        )
    if np.any(np.isinf(scan.heights)):
        raise InputFileError(f"{file}: infinite heights; allowed: numbers, and NaN where missing")
    return scan


# --- bare heights and tables --------------------------------------------------------------------


def _has_headings(file: str) -> bool:
    """Whether the first row has words in it."""
    rows = csv_rows(file)
    return bool(rows) and any(_is_word(cell) for cell in rows[0][1])


def _is_word(cell: str) -> bool:
    try:
        float(cell or "0")
    except ValueError:
        return True
    return False


def _read_matrix(file: str) -> Array:
    """Heights in rows along x; NaN where a cell is empty or says so."""
    rows = csv_rows(file)
    if not rows:
        raise InputFileError(f"{file}:1: empty; allowed: rows of heights")
    check_widths(file, rows, "first row")
    return np.array([[_height(f"{file}:{line}", cell) for cell in row] for line, row in rows])


def _height(place: str, cell: str) -> float:
    return np.nan if cell.lower() in NOT_MEASURED else number_in(place, cell)


def _read_points(table: TableFile) -> Scan:
    """A table of points x, y, z that lie on a regular grid, in any order; some may be missing."""
    table.check(dict.fromkeys(("x", "y", "z"), "mm"))
    table.require(("x", "y", "z"), "x, y and z, each with its unit in brackets")
    x, y = (table.column(name, Quantity("mm")) for name in ("x", "y"))
    scale = to_base(f"1 {table.unit('z') or 'mm'}", "mm")
    z = np.array(
        [
            scale * _height(f"{table.file}:{line}: z", cell)
            for (line, _), cell in zip(table.rows, table.cells("z"), strict=True)
        ]
    )
    (rows, dx), (columns, dy) = (_steps(table, name, at) for name, at in (("x", x), ("y", y)))
    heights = np.full((rows.max() + 1, columns.max() + 1), np.nan)
    given = np.zeros(heights.shape, dtype=bool)
    for point, place in enumerate(zip(rows, columns, strict=True)):
        if given[place]:
            raise table.refusal(point, "x", "a point given twice", "each point once")
        given[place] = True
        heights[place] = z[point]
    return Scan(heights, (dx, dy))


def _steps(table: TableFile, name: str, at: Array) -> tuple[np.ndarray, float]:
    """Numbers of the steps ``(n,)`` that points lie at, and the step [mm]; 1 where all are alike.

    The step is that between the most neighbours. Raises InputFileError for points beside it.
    """
    places = np.unique(at)
    if len(places) == 1:
        return np.zeros(len(at), dtype=np.int64), 1.0
    gaps = np.diff(places)
    coarse = float(np.median(gaps[gaps > REGULAR * gaps.max()]))
    # From end to end, which rounding of a single step is small against.
    step = float(np.ptp(places)) / max(round(float(np.ptp(places)) / coarse), 1)
    numbers = (at - places[0]) / step
    beside = np.abs(numbers - np.rint(numbers)) > max(REGULAR, 1e-9)
    for point in np.flatnonzero(beside).tolist():
        raise table.refusal(
            point, name, f"beside a regular grid of {step:.6g} mm", "points of a regular grid"
        )
    return np.rint(numbers).astype(np.int64), step


# --- profilometers ------------------------------------------------------------------------------


def _surfalize(file: Path) -> ModuleType:
    """The library. Raises InputFileError where it is not installed."""
    try:
        import surfalize
    except ImportError:
        raise InputFileError(
            f"{file}: {file.suffix} is read by surfalize, which is not installed: pip install "
            "'fretscale[profilometer]', or export the scan as .npy or .csv"
        ) from None
    return surfalize


def _read_profilometer(file: Path) -> Scan:
    library = _surfalize(file)
    if wrong := unreadable(file):
        raise InputFileError(f"{file}: {wrong}; allowed: a scan")
    try:
        with warnings.catch_warnings():
            # It would take a file that is none of its kind by the first reader that makes
            # numbers of it.
            warnings.filterwarnings("error", message="The file suffix indicates")
            warnings.filterwarnings("ignore", message="The surface has different pixel size")
            surface = library.Surface.load(str(file))
            lines = np.asarray(surface.data, dtype=np.float64)
            pitch = float(surface.step_x), float(surface.step_y)
    except Exception as error:  # damage ends in a dozen ways
        raise InputFileError(
            f"{file}: cannot be read as {shown(file.suffix)} ({one_line(error)}); allowed: a scan "
            "in this format"
        ) from error
    return Scan(lines.T / TO_MICRONS, (pitch[0] / TO_MICRONS, pitch[1] / TO_MICRONS))


def write_scan(file: Path, scan: Scan) -> None:
    """Write a scan in the format that the file's ending says, one of ``WRITTEN`` or ``.npz``.

    ``.npz`` has ``heights`` ``(nx, ny)`` and ``pitch`` ``(2,)`` in mm. Raises UserError.
    """
    ending = file.suffix.lower()
    if ending == ".npz":
        np.savez(file, heights=scan.heights, pitch=np.array(scan.pitch))
        return
    if ending not in WRITTEN:
        raise UserError(f"{file}: no such format; allowed: {', '.join((*WRITTEN, '.npz'))}")
    lines = TO_MICRONS * scan.heights.T
    # A surface of one height leaves the library 0 / 0, which it writes rightly nevertheless.
    with warnings.catch_warnings(), np.errstate(invalid="ignore"):
        warnings.filterwarnings("ignore", message="The surface has different pixel size")
        steps = [TO_MICRONS * step for step in scan.pitch]
        _surfalize(file).Surface(lines, *steps).save(str(file))
