"""Measured surfaces in files: formats of profilometers, tables of points, and bare heights.

Files of profilometers contain their units and pitch. Most are read and written by surfalize;
those that it reads wrongly are read by :mod:`workflow.case.files.instrument_files`. Their lines run
along x and follow each other along y.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sa_solver.errors import InputError
from sa_solver.surfaces.scans import Scan
from sa_solver.types import Array
from workflow.case.fields import Quantity, shown, split_dataset, unreadable
from workflow.case.files.input_files import (
    InputFileError,
    check_widths,
    csv_rows,
    in_rows,
    number_in,
    read_array,
    text_of,
)
from workflow.case.files.instrument_files import READERS
from workflow.case.files.table_file import TableFile
from workflow.case.text.plain import plain
from workflow.case.units import UnitError, to_base
from workflow.errors import UserError, one_line

if TYPE_CHECKING:
    from types import ModuleType

# The formats of surfalize for which a second reader (SurfaceTopography 1.27) finds the same heights
# and pitch. For .nms, .zmg and .zon the two differ in pitch, sign or missing points.
PROFILOMETER = (
    *(".x3p", ".sur", ".al3d", ".plu", ".plux", ".sdf", ".opd", ".os3d", ".tmd", ".gwy"),
    *(".vk4", ".vk6", ".vk7"),
)
WRITTEN = ".x3p", ".sur", ".al3d", ".sdf"
TEXT = ".csv", ".txt", ".xyz"
BARE = ".npy", ".npz", ".h5"
ENDINGS = (*PROFILOMETER, *TEXT, *BARE)
UNITS = "m", "mm", "um", "nm"
TO_MICRONS = 1e3
# Fewest points along a direction for which a surface can be described.
FEWEST = 4
# Share of a step by which the points of a table may deviate from a regular grid.
REGULAR = 0.01
NOT_MEASURED = "", "nan"
# Limits of plausible scans. Smaller heights than LEAST_HEIGHT are counts that were read as floats;
# a range above STEEPEST times the size, and steps outside PITCHES [mm], mean a wrong unit. Probes
# resolve a tenth of a nanometre.
LEAST_HEIGHT, STEEPEST, PITCHES = 1e-30, 10.0, (1e-7, 1e2)
# Points closer than this [mm] come from an atomic force microscope, or have a wrong unit.
NEAR = 1e-5
# Header that Gwyddion writes above heights, in the language of its user.
GWYDDION = re.compile(
    r"\s*#.*\n"
    r"# (?:Width|Šířka|Breite|Anchura|Largeur|Larghezza|幅|폭|Largura|Ширина):"
    r"\s*(?P<width>\S+)\s+(?P<x_unit>\S+)\n"
    r"# [^:\n]+:\s*(?P<height>\S+)\s+(?P<y_unit>\S+)\n"
    r"# [^:\n]+:\s*(?P<z_unit>\S+)\n"
)
LONGEST_HEADER = 5000
HEADINGS = "headings such as x [mm], y [mm], z [um] in the first row"


def read_scan(file: str, unit: str | None, pitch: tuple[float, float] | None) -> Scan:
    """Return the scan in a file, with heights and pitch in mm and NaN where points are missing.

    ``unit`` of the heights and ``pitch`` [mm] are for files of bare heights, which do not contain
    them: ``.npy``, ``.npz:array``, ``.h5:dataset`` and text, rows along x and columns along y. Text
    with headings ``x, y, z`` is a table of points of a regular grid, in any order; three columns
    without headings are such points in ``unit``. Raises InputFileError.
    """
    name, _ = split_dataset(file)
    ending = Path(name).suffix.lower()
    if ending not in ENDINGS:
        raise InputFileError(
            f"{file}: no scan in a supported format; allowed: {', '.join(ENDINGS)}: export it as "
            ".x3p, .sur or x, y, z in text"
        )
    if ending in PROFILOMETER:
        _check_own_units(file, unit, pitch)
        return _checked(file, lambda: _read_profilometer(Path(name)))
    if ending in TEXT:
        return _checked(file, lambda: _read_text(name, unit, pitch))
    return _checked(file, lambda: _bare(file, read_array(file), unit, pitch))


def _bare(file: str, heights: Array, unit: str | None, pitch: tuple[float, float] | None) -> Scan:
    """Return the scan of heights in rows along x; raise InputFileError."""
    if unit is None or pitch is None:
        missing = " and ".join(key for key, at in (("unit", unit), ("pitch", pitch)) if at is None)
        raise InputFileError(
            f"{file}: bare heights do not state their {missing}; allowed: state both with the file"
        )
    return Scan(in_rows(file, heights) * to_base(f"1 {unit}", "mm"), pitch)


def _check_own_units(file: str, unit: str | None, pitch: tuple[float, float] | None) -> None:
    given = " and ".join(key for key, at in (("unit", unit), ("pitch", pitch)) if at is not None)
    if given:
        raise InputFileError(f"{file}: states its units and pitch itself; allowed: no {given}")


def _checked(file: str, read: Callable[[], Scan]) -> Scan:
    """Return the scan from ``read`` if it is a plausible surface; else raise InputFileError."""
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
    if wrong := _implausible(scan):
        raise InputFileError(f"{file}: {wrong}: it is damaged or in another unit; allowed: a scan")
    return scan


def _implausible(scan: Scan) -> str:
    """Return a description of what no measured surface has; empty if the scan is plausible."""
    heights = np.abs(scan.heights[scan.measured])
    range_, size = float(np.ptp(scan.heights[scan.measured])), max(scan.size)
    tiny = heights[(heights > 0.0) & (heights < LEAST_HEIGHT)]
    if tiny.size:
        return f"heights of {tiny[0]:.1g} mm"
    if range_ > STEEPEST * size:
        return f"heights that differ by {plain(range_, 'mm', 3)} over {plain(size, 'mm', 3)}"
    for step in scan.pitch:
        if not PITCHES[0] <= step <= PITCHES[1]:
            return f"points {plain(step, 'mm', 3)} apart"
    return ""


# --- bare heights and tables --------------------------------------------------------------------


def _read_text(file: str, unit: str | None, pitch: tuple[float, float] | None) -> Scan:
    """Return a scan in text: of Gwyddion, a table of points, or bare heights.

    Raises InputFileError.
    """
    rows = csv_rows(file, blanks=True)
    if not rows:
        raise InputFileError(f"{file}:1: empty; allowed: rows of heights, or of points x, y, z")
    if header := GWYDDION.match("\n".join(text_of(file)[:LONGEST_HEADER].splitlines())):
        _check_own_units(file, unit, pitch)
        return _read_gwyddion(file, header.groupdict())
    if any(_is_word(cell) for cell in rows[0][1]):
        _check_own_units(file, unit, pitch)
        return _read_points(TableFile(file, *rows[0], tuple(rows[1:])), "mm")
    if len(rows[0][1]) != 3:
        return _bare(file, _read_matrix(file), unit, pitch)
    if unit is None:
        raise InputFileError(
            f"{file}: points x, y, z without a unit; allowed: {HEADINGS}, or state the unit of "
            "all three"
        )
    scan = _read_points(TableFile(file, rows[0][0], ("x", "y", "z"), tuple(rows)), unit)
    own, beside = scan.pitch, pitch or scan.pitch
    axes = [axis for axis in (0, 1) if scan.heights.shape[axis] > 1]
    if any(abs(own[axis] - beside[axis]) > REGULAR * own[axis] for axis in axes):
        apart, given = (
            " x ".join(plain(of[axis], "mm", 3) for axis in axes) for of in (own, beside)
        )
        raise InputFileError(f"{file}: points {apart} apart, not {given}; allowed: no other pitch")
    return scan


def _read_gwyddion(file: str, header: dict[str, str]) -> Scan:
    """Return heights in lines along x, which follow their width, height and unit."""
    lines = _read_matrix(file)
    sizes = (f"{header['width']} {header['x_unit']}", f"{header['height']} {header['y_unit']}")
    try:
        width, height = (to_base(size, "mm") for size in sizes)
        scale = to_base(f"1 {header['z_unit']}", "mm")
    except UnitError as error:
        raise InputFileError(f"{file}: {error}; allowed: widths and heights in lengths") from error
    ny, nx = lines.shape
    return Scan(scale * lines.T, (width / nx, height / ny))


def _is_word(cell: str) -> bool:
    try:
        float(cell.replace(",", ".") or "0")
    except ValueError:
        return True
    return False


def _read_matrix(file: str) -> Array:
    """Return heights in rows along x, with NaN where a cell is empty or says so."""
    rows = csv_rows(file, blanks=True)
    check_widths(file, rows, "first row")
    return np.array([[_height(f"{file}:{line}", cell) for cell in row] for line, row in rows])


def _height(place: str, cell: str) -> float:
    if cell.lower() in NOT_MEASURED:
        return np.nan
    try:
        return number_in(place, cell)
    except InputFileError as error:
        raise InputFileError(f"{error}, and NaN or nothing where one is missing") from None


def _read_points(table: TableFile, unit: str) -> Scan:
    """Return a scan from points x, y, z of a regular grid, in any order; some may be missing.

    ``unit`` is the unit of columns whose headings have none.
    """
    table.check(dict.fromkeys(("x", "y", "z"), "mm"))
    table.require(("x", "y", "z"), HEADINGS)
    if not table.rows:
        raise InputFileError(f"{table.place}: no rows; allowed: a row for each point")
    check_widths(table.file, [(table.line, table.headings), *table.rows], "header")
    scale = to_base(f"1 {unit}", "mm")
    x, y = (
        table.column(name, Quantity("mm")) * (1.0 if table.unit(name) else scale)
        for name in ("x", "y")
    )
    scale = to_base(f"1 {table.unit('z') or unit}", "mm")
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
    """Return the step number ``(n,)`` of each point, and the step [mm], which is 1 for one place.

    The step is the median distance of neighbours. Raises InputFileError for points off the grid.
    """
    places = np.unique(at)
    if len(places) == 1:
        return np.zeros(len(at), dtype=np.int64), 1.0
    gaps = np.diff(places)
    coarse = float(np.median(gaps[gaps > REGULAR * gaps.max()]))
    # The step from end to end: the rounding of a single step is small compared with it.
    step = float(np.ptp(places)) / max(round(float(np.ptp(places)) / coarse), 1)
    numbers = (at - places[0]) / step
    beside = np.abs(numbers - np.rint(numbers)) > max(REGULAR, 1e-9)
    for point in np.flatnonzero(beside).tolist():
        raise table.refusal(
            point, name, f"not on a regular grid of {step:.6g} mm", "points of a regular grid"
        )
    return np.rint(numbers).astype(np.int64), step


# --- profilometers ------------------------------------------------------------------------------


def _surfalize(file: Path) -> ModuleType:
    """Return the library; raise InputFileError where it is not installed."""
    try:
        import surfalize
    except ImportError:
        raise InputFileError(
            f"{file}: {file.suffix} is read by surfalize, which is not installed: pip install "
            "'fretscale[profilometer]', or export the scan as .npy or .csv"
        ) from None
    return surfalize


def _read_profilometer(file: Path) -> Scan:
    own = READERS.get(file.suffix.lower())
    library = None if own else _surfalize(file)
    if wrong := unreadable(file):
        raise InputFileError(f"{file}: {wrong}; allowed: a scan")
    try:
        # Overflowing numbers are found later, in the heights.
        with np.errstate(over="ignore", invalid="ignore"):
            return own(file.read_bytes()) if own else _by_library(library, file)
    except InputError as error:
        raise InputFileError(f"{file}: {error}; allowed: a scan in this format") from error
    except Exception as error:  # damaged files raise many kinds of exception
        raise InputFileError(
            f"{file}: cannot be read as {shown(file.suffix)} ({one_line(error)}); allowed: a scan "
            "in this format: export it again, or as .x3p"
        ) from error


def _by_library(library: Any, file: Path) -> Scan:
    with warnings.catch_warnings():
        # For a file that does not match its suffix, the library would try other readers and use
        # the first that yields numbers.
        warnings.filterwarnings("error", message="The file suffix indicates")
        warnings.filterwarnings("ignore", message="The surface has different pixel size")
        try:
            surface = library.Surface.load(str(file))
        except UserWarning:
            raise InputError("it is damaged, or of another kind than its name says") from None
        lines = np.asarray(surface.data, dtype=np.float64)
        pitch = float(surface.step_x), float(surface.step_y)
    if surface.metadata.get("inverted"):
        raise InputError(
            "its heights are marked as inverted, which some programs mean as their sign and some "
            "as a note: export it without, or as .x3p"
        )
    return Scan(lines.T / TO_MICRONS, (pitch[0] / TO_MICRONS, pitch[1] / TO_MICRONS))


def write_scan(file: Path, scan: Scan) -> None:
    """Write a scan in the format of the file's ending, one of ``WRITTEN`` or ``.npz``.

    ``.npz`` has ``heights`` ``(nx, ny)`` and ``pitch`` ``(2,)`` in mm. Raises UserError.
    """
    ending = file.suffix.lower()
    if ending == ".npz":
        np.savez(file, heights=scan.heights, pitch=np.array(scan.pitch))
        return
    if ending not in WRITTEN:
        raise UserError(f"{file}: no such format; allowed: {', '.join((*WRITTEN, '.npz'))}")
    lines = TO_MICRONS * scan.heights.T
    if ending == ".sur" and scan.missing and np.nanmin(lines) == np.nanmax(lines):
        raise UserError(
            f"{file}: a single height, and missing points, neither of which .sur can store; "
            "allowed: .x3p"
        )
    # For a surface of one height the library computes 0 / 0, but still writes it correctly.
    with warnings.catch_warnings(), np.errstate(invalid="ignore"):
        warnings.filterwarnings("ignore", message="The surface has different pixel size")
        steps = [TO_MICRONS * step for step in scan.pitch]
        # The unit in .sur is Latin-1; other programs do not recognize it in UTF-8.
        _surfalize(file).Surface(lines, *steps).save(str(file), encoding="latin-1")
