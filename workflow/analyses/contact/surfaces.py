"""Measured surfaces on top of the form of two bodies: case entries and heights."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import StrictBool, model_validator

from sa_solver.errors import InputError
from sa_solver.surfaces.scans import (
    Beyond,
    Level,
    Resampled,
    Scan,
    filled,
    levelled,
    resampled,
    rms,
)
from sa_solver.types import Array, Grid
from workflow.case.fields import File, Quantity, Word, split_dataset
from workflow.case.files.scan_files import ENDINGS, NEAR, UNITS, read_scan
from workflow.case.sections import Length, Section, at_entry, disagreement, entry, one_of
from workflow.case.text.plain import plain, shares
from workflow.messages.warning_kinds import Notice, WarningKind

Shift = Annotated[float, Quantity("mm", at_least=-1e4, at_most=1e4, range_text="-10 to 10 m")]
Angle = Annotated[float, Quantity("rad", at_least=-6.4, at_most=6.4, range_text="-360 to 360 deg")]
Share = Annotated[float, Quantity("1", at_least=0.0, at_most=0.5)]
# Share of the roughness that may be lost on a grid without a warning.
LOST = 0.3
# Height [mm] below which a surface counts as smooth.
SMOOTH = 1e-9
# Place of the measured surfaces in a case by default.
KEY = "structure.surfaces"
# Bounds of plausible roughness: largest height over the shorter side, and least height [mm].
STEEP, FINE = 0.1, 1e-7


class MeasuredSurface(Section):
    """Heights out of the body as measured, with any number of points and pitch."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("unit", "pitch")

    file: Annotated[str, File(ENDINGS)] = entry(
        "scan of a profilometer (.sur, .x3p, .al3d, .plu, ...), x, y, z (.csv, .txt, .xyz), or "
        "bare heights (.npy, .csv, .txt; with a colon .npz:array, .h5:dataset)",
        "disk.npy",
    )
    unit: Annotated[str, Word(UNITS)] | None = entry(
        "unit of bare heights, or of x, y, z without headings: m, mm, um or nm; other files "
        "state it",
        "um",
        default=None,
    )
    pitch: tuple[Length, Length] | None = entry(
        "distance of the points of bare heights along x, along y; other files state it [mm]",
        ["20 um", "20 um"],
        default=None,
    )
    level: Level = entry(
        "what is subtracted: none, mean, plane, or form (second order)", "plane", default="plane"
    )
    missing: Share = entry(
        "share of points that may be missing: they are filled in by a membrane over their "
        "neighbours [1]",
        "5 %",
        default=0.05,
    )
    flipped: StrictBool = entry(
        "true if it is seen through the body, so that its columns run against y",
        False,
        default=False,
    )
    shift: tuple[Shift, Shift] = entry(
        "place of its middle from the middle of the contact's grid, along x, along y [mm]",
        [0, 0],
        default=(0.0, 0.0),
    )
    angle: Angle = entry("rotation on the face, from x to y [rad]", "0 deg", default=0.0)
    beyond: Beyond = entry(
        "beyond its border the grid finds nothing (refused), or the mirrored scan",
        "refused",
        default="refused",
    )

    @model_validator(mode="after")
    def _can_be_read(self) -> MeasuredSurface:
        try:
            with at_entry("file"):
                self.scan()
        except InputError as error:
            raise disagreement(f"{self.file}: {error}", "missing", "file") from error
        return self

    def read(self) -> Scan:
        """Return the scan as it is in the file. Raises InputFileError."""
        return _read(self.file, _stamp(self.file), self.unit, self.pitch)

    def scan(self) -> Scan:
        """Return the levelled scan with gaps filled. Raises InputFileError, InputError."""
        return _prepared(self.read(), self.level, self.missing)

    def on(self, grid: Grid, number: int) -> Resampled:
        """Return the surface on the grid of the contact, as body 1 or 2. Raises InputError."""
        below = (number == 1) != self.flipped
        scan = self.scan() if below else self.scan().turned_over
        return resampled(scan, grid, self.shift, self.angle, self.beyond)

    @property
    def place(self) -> str:
        """Description of the position on the face, empty if it is the measured one."""
        parts = []
        if any(self.shift):
            x, y = (plain(by, "mm", 4) for by in self.shift)
            parts.append(f"middle at {x}, {y}")
        if self.angle:
            parts.append(f"turned by {plain(self.angle, 'rad')} from x to y")
        if self.flipped:
            parts.append("flipped")
        return "".join(f", {part}" for part in parts)


def _stamp(file: str) -> tuple[int, int] | None:
    """Return modification time and size of a file, by which changes are noticed, or None.

    None means that there is no such file.
    """
    try:
        found = Path(split_dataset(file)[0]).stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size


# Scans of millions of points take seconds to read and are needed repeatedly. Both surfaces of two
# flanks fit into the cache.
@lru_cache(maxsize=4)
def _read(file: str, stamp: object, unit: str | None, pitch: tuple[float, float] | None) -> Scan:
    return read_scan(file, unit, pitch)


@lru_cache(maxsize=4)
def _prepared(scan: Scan, level: Level, missing: float) -> Scan:
    return filled(levelled(scan, level), missing)


class SurfacesOfTwo(Section):
    """Base of measured surfaces of one or both bodies: heights out of them, on top of the form."""

    # Names of body 1 and body 2 in the case.
    names: ClassVar[tuple[str, str]]

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if not self.bodies:
            raise disagreement(
                f"no surface; allowed: {', '.join(self.names)} or both", self.names[0]
            )
        return self

    @property
    def bodies(self) -> dict[str, MeasuredSurface]:
        """The surfaces that are given, by name of their body."""
        both = {name: getattr(self, name) for name in self.names}
        return {name: surface for name, surface in both.items() if surface is not None}

    def of(self, number: int, grid: Grid) -> Resampled | None:
        """Return the surface of body 1 or 2 on a grid, None if it has none. Raises InputError."""
        surface: MeasuredSurface | None = getattr(self, self.names[number - 1])
        return None if surface is None else surface.on(grid, number)

    def on(self, grid: Grid) -> dict[str, Resampled]:
        """Return each surface on a grid, by body. Raises InputError."""
        both = {name: self.of(number, grid) for number, name in enumerate(self.names, 1)}
        return {name: surface for name, surface in both.items() if surface is not None}

    def gap(self, grid: Grid) -> Array:
        """Return the change of the gap of the unloaded bodies by the surfaces ``(nx, ny)`` [mm]."""
        return -sum((on.heights for on in self.on(grid).values()), start=0.0 * (grid.x + grid.y))

    def check(self, grid: Grid, key: str = KEY, size: str = "contact.size") -> None:
        """Refuse surfaces that do not cover the grid.

        The error is at ``key``, the entry of the surfaces; ``size`` is the entry of the grid's
        size.
        """
        for number, name in enumerate(self.names, 1):
            try:
                self.of(number, grid)
            except InputError as error:
                file = self.bodies[name].file
                raise disagreement(f"{file}: {error}", f"{key}.{name}.file", size) from error

    def summary(self, grid: Grid) -> dict[str, Any]:
        """Return numbers of each surface in base units: points, pitch, missing share and others."""
        numbers = {}
        for name, on in self.on(grid).items():
            scan = self.bodies[name].read()
            numbers[name] = {
                "points": list(scan.heights.shape),
                "pitch": list(scan.pitch),
                "missing": scan.missing,
                "rms": rms(self.bodies[name].scan().heights),
                "rms_on_grid": rms(on.heights),
                "lost": on.lost,
                "beyond": on.beyond,
            }
        return numbers

    def reported(self, summary: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
        """Return the numbers of each surface as one line of text, by body."""
        return {
            name: f"{_in_words(numbers)}{self.bodies[name].place}"
            for name, numbers in summary.items()
        }

    def plausibility_warnings(self, grid: Grid, key: str = KEY) -> Iterator[Notice]:
        """Warn about units, and about grids that lose the roughness."""
        for name, numbers in self.summary(grid).items():
            height = numbers["rms"]
            if height > STEEP * min(grid.size[: 1 if grid.line else 2]) or SMOOTH < height < FINE:
                text = f"heights of {plain(height, 'mm', 3)} rms: is their unit right?"
                yield Notice(WarningKind.UNUSUAL_LENGTH, f"{key}.{name}: {text}")
            if (step := min(numbers["pitch"])) < NEAR:
                text = f"points {plain(step, 'mm', 3)} apart: is their unit right?"
                yield Notice(WarningKind.UNUSUAL_LENGTH, f"{key}.{name}: {text}")
            if height > SMOOTH and numbers["lost"] > LOST * height:
                lost = f"{plain(numbers['lost'], 'mm', 3)} of {plain(height, 'mm', 3)} rms"
                yield Notice(
                    WarningKind.LOST_ROUGHNESS,
                    f"{key}.{name}: {lost} is finer than the cells, which cannot carry it: take "
                    "more cells",
                )


class MeasuredSurfaces(SurfacesOfTwo):
    """Measured surfaces of the lower body, the upper one or both."""

    names: ClassVar[tuple[str, str]] = ("body_1", "body_2")
    also_filled_in: ClassVar[tuple[str, ...]] = ("body_1",)
    in_schema: ClassVar[Mapping[str, Any]] = one_of("body_1", "body_2")

    body_1: MeasuredSurface | None = entry(
        "surface of the lower body, seen from above", default=None
    )
    body_2: MeasuredSurface | None = entry(
        "surface of the upper body, seen from below: turned over about x", default=None
    )


def _in_words(numbers: Mapping[str, Any]) -> str:
    (nx, ny), pitch = numbers["points"], numbers["pitch"]
    steps = [plain(step, "mm", 4) for step in pitch]
    apart = steps[0] if ny == 1 or steps[0] == steps[1] else " x ".join(steps)
    lost = numbers.get("lost_by_nodes")
    nodes = "" if lost is None else f", {plain(lost, 'mm', 3)} finer than the nodes"
    share = numbers["beyond"]
    beyond = f", mirrored over {shares(share)} of the grid" if share else ""
    missing = f", {numbers['missing']:.2g} of them filled in" if numbers["missing"] else ""
    return (
        f"{nx} x {ny} points {apart} apart{missing}, {plain(numbers['rms'], 'mm', 3)} rms, "
        f"{plain(numbers['lost'], 'mm', 3)} of it finer than the grid{nodes}{beyond}"
    )
