"""``fretscale scar``: depth and volume of the wear between two scans of a body."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sa_solver.errors import InputError
from sa_solver.surfaces.scans import Scan
from sa_solver.types import Mask
from wear.scar import Scar, measure_scar
from workflow.case.fields import Quantity, quantity_of_option
from workflow.case.files.input_files import InputFileError
from workflow.case.files.scan_files import NEAR, UNITS, read_scan
from workflow.case.text.plain import plain
from workflow.case.text.readable import percent
from workflow.errors import UserError
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import locked
from workflow.shell.folders.store import replacing, write_text

TABLE, FIELDS, FIGURE = "scar.csv", "scar.npz", "scar.png"
TO_MICRONS, PER_MICRON = 1e3, 1e9
LENGTH = Quantity("mm", range_text="a length such as '4 um'")
PITCH = Quantity("mm", above=0.0, range_text="a length above 0 such as '4 um'")
LENGTHS = "lengths from the middle, XMIN,XMAX,YMIN,YMAX such as '-0.3 mm,0.3 mm,-0.2 mm,0.2 mm'"


def scar_of_files(
    before: Path, after: Path, worn: str | None, bare: tuple[str, str, str] | None
) -> Scar:
    """Measure the wear between two files of scans.

    ``worn`` is a rectangle on the second scan, as text; ``bare`` has unit and pitch along x and y
    for files that do not contain them. Raises UserError.
    """
    first, second = (_read(path, bare) for path in (before, after))
    where = None if worn is None else _rectangle(worn, second)
    try:
        return measure_scar(first, second, where)
    except InputError as error:
        raise UserError(f"{after}: {error}") from error


def _read(path: Path, bare: tuple[str, str, str] | None) -> Scan:
    unit, *steps = bare or (None,)
    if unit is not None and unit not in UNITS:
        raise UserError(f"--bare {unit}: no such unit; allowed: {', '.join(UNITS)}")
    pitch = [quantity_of_option(step, PITCH, "--bare") for step in steps]
    try:
        return read_scan(str(path), unit, (pitch[0], pitch[1]) if pitch else None)
    except InputFileError as error:
        beside = " (--bare UNIT DX DY)" if "with the file" in str(error) else ""
        raise UserError(f"{error}{beside}") from error


def _rectangle(text: str, scan: Scan) -> Mask:
    """Return the points of a scan within a rectangle; raise UserError if there are none."""
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 4:
        raise UserError(f"--worn {text}: not four; allowed: {LENGTHS}")
    x_min, x_max, y_min, y_max = (quantity_of_option(part, LENGTH, "--worn") for part in parts)
    x, y = (
        (np.arange(count) - 0.5 * (count - 1)) * pitch
        for count, pitch in zip(scan.heights.shape, scan.pitch, strict=True)
    )
    inside: Mask = ((x >= x_min) & (x <= x_max))[:, None] & ((y >= y_min) & (y <= y_max))[None, :]
    if not inside.any():
        raise UserError(f"--worn {text}: no point of the scan is in it; allowed: {LENGTHS}")
    return inside


# --- report -------------------------------------------------------------------------------------


def report(scar: Scar) -> list[str]:
    """Return lines on the wear with 95 % bounds, the alignment of the scans, and warnings."""
    mean = "(the largest mean of 3 x 3 points)"
    volume, deepest = PER_MICRON * scar.volume, TO_MICRONS * scar.deepest
    if scar.volume_error is None or scar.depth_error is None:
        lines = [
            f"volume   {volume:.4g} um^3 ({scar.volume:.4g} mm^3), error unknown",
            f"deepest  {deepest:.4g} um {mean}, error unknown",
        ]
    else:
        lines = [
            f"volume   {volume:.4g} +- {PER_MICRON * scar.volume_error:.2g} um^3 "
            f"({scar.volume:.4g} mm^3), 95 %",
            f"deepest  {deepest:.4g} +- {TO_MICRONS * scar.depth_error:.2g} um {mean}",
        ]
    lines.append(f"area     {scar.area:.4g} mm^2")
    if scar.length is None or scar.patches is None:
        lines.append("rim      without noise")
    else:
        lines.append(
            f"rim      {plain(scar.noise, 'mm', 3)} rms, correlated over "
            f"{plain(scar.length, 'mm', 3)}: {scar.patches:.0f} independent patches"
        )
    if scar.shift is None:
        lines.append("the rims have no common roughness: they are aligned only by their planes")
    else:
        errors = [f" +- {plain(error, 'mm', 2)}" for error in scar.shift_error or ()] or ["", ""]
        x, y = (
            f"{plain(by, 'mm', 4)}{error}" for by, error in zip(scar.shift, errors, strict=True)
        )
        lines.append(f"aligned: the second lies {x}, {y} off the first")
    if scar.missing:
        lines.append(
            f"{percent(scar.missing)} of the worn area are missing points, which are filled in"
        )
    return [*lines, *(f"warning: {warning}" for warning in _warnings_about(scar))]


def _warnings_about(scar: Scar) -> list[Notice]:
    plausibility_warnings = []
    if (step := min(scar.pitch)) < NEAR:
        plausibility_warnings.append(
            Notice(
                WarningKind.UNUSUAL_LENGTH,
                f"points {plain(step, 'mm', 3)} apart: is their unit right?",
            )
        )
    if scar.patches is None:
        plausibility_warnings.append(
            Notice(
                WarningKind.UNCERTAIN_SCAR,
                "both scans agree around the worn area to the last digit, as no two "
                "measurements do, so the error is unknown: are they one file, "
                "damaged, or computed?",
            )
        )
    elif not scar.sure:
        plausibility_warnings.append(
            Notice(
                WarningKind.UNCERTAIN_SCAR,
                "the noise is correlated over so much of the rim that the errors are rough "
                "at best: take scans that reach farther",
            )
        )
    if scar.volume <= (scar.volume_error or 0.0):
        plausibility_warnings.append(
            Notice(
                WarningKind.NO_WORN_VOLUME,
                "the volume does not differ from none: are the files in the right order?",
            )
        )
    return plausibility_warnings


# --- files --------------------------------------------------------------------------------------


def write_scar(scar: Scar, out: Path, title: str, force: bool) -> list[Path]:
    """Write the numbers, the depths on the points of the second scan, and the figure.

    Raises UserError for a folder that has them already, unless ``force``.
    """
    from workflow.commands.scar_figure import write_figure

    with locked(out):
        folder = OutputFolder(out, "scar")
        paths = folder.replace(dict.fromkeys((TABLE, FIELDS, FIGURE), "measured scar"), force)
        write_text(paths[0], "\n".join(_table(scar)) + "\n")
        with replacing(paths[1]) as place, place.open("wb") as stream:
            np.savez_compressed(
                stream, depth=scar.depth, worn=scar.worn, pitch=np.array(scar.pitch)
            )
        write_figure(scar, title, paths[2])
    return paths


def _table(scar: Scar) -> list[str]:
    rows = {
        "volume [mm^3]": (scar.volume, scar.volume_error),
        "deepest [mm]": (scar.deepest, scar.depth_error),
        "area [mm^2]": (scar.area, None),
        "noise [mm]": (scar.noise, None),
        "correlated [mm]": (scar.length, None),
        "patches [1]": (scar.patches, None),
        "missing [1]": (scar.missing, None),
    }
    lines = [
        f"{name},{_cell(value, 10)},{_cell(bound, 6)}" for name, (value, bound) in rows.items()
    ]
    return ["quantity,value,bound 95 %", *lines]


def _cell(value: float | None, digits: int) -> str:
    """Return a number for the table, empty if it is unknown."""
    return "" if value is None else f"{value:.{digits}g}"
