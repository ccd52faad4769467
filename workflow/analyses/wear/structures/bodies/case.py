"""A wear case of two bodies without a structure, under a closed cycle of forces and motions.

A line contact, in plane strain, has other dimensions of loads and grid and is a separate kind of
case, though both are written ``analysis: wear`` and ``kind: bodies``.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from math import inf
from typing import Annotated, Any, ClassVar, Generic, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from sa_solver.surfaces import shapes
from sa_solver.types import Grid, Tilt
from sa_solver.types import Material as ElasticMaterial
from workflow.analyses.contact.case import (
    HEIGHTS,
    PLANE,
    BodyMaterials,
    Cylinder,
    Ellipsoid,
    FlatRounded,
    Heights,
    Plane,
    Shape,
    Sphere,
    check_bulk_stress,
    check_surfaces,
    elastic,
    require_shape,
    surfaces_in_words,
    touches_along_a_line,
    unworn_contact,
)
from workflow.analyses.contact.load_path import Leg, LegsOrFile, LegT, LineLeg
from workflow.analyses.contact.plausibility import about_grid, about_pressure, about_shear
from workflow.analyses.contact.surfaces import KEY
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.case.scanned import ScannedFace
from workflow.analyses.wear.case.sections import ContactSection, Cycles, PressingForce, WearSection
from workflow.case.fields import Quantity, Whole
from workflow.case.files.input_files import read_heights
from workflow.case.plausibility import heights, long_stroke
from workflow.case.sections import GridCells, Length, LineCells, Section, Title, disagreement, entry
from workflow.case.source import Source
from workflow.case.text.plain import plain, shares
from workflow.messages.warning_kinds import Notice
from workflow.models.gaps import GapFunction
from workflow.models.uncoupled.load_table import SHIFTS, LoadTable

PressingLineForce = Annotated[
    float, Quantity("N/mm", above=0.0, at_most=1e9, range_text="above 0 and at most 1e6 kN/mm")
]
Direction = Annotated[
    float, Quantity("rad", at_least=-6.4, at_most=6.4, range_text="-360 to 360 deg")
]
Increments = Annotated[int, Whole(1, 1000)]
Accuracy = Annotated[float, Quantity("1", at_least=1e-6, at_most=1.0)]

# Name of the only contact.
NAME = "interface"
FLAT = "flat"
TILTS = "tilt of the bodies: held: as they are placed; free: as no moment leaves them"

# --- bodies -------------------------------------------------------------------------------------


class Flat(Shape):
    """A flat rectangle with sharp edges on a step: the pad of a specimen."""

    shape: Literal["flat"] = entry("flat, or as in contact cases", "flat")
    half_width: Length = entry("half width of the rectangle, along x [mm]", "0.5 mm")
    half_length: Length = entry("half length of the rectangle, along y [mm]", "0.5 mm")
    step: Length = entry(
        "height of the rectangle above the body [mm]",
        "0.1 mm",
        default=0.1,
    )

    def described(self) -> GapFunction:
        sizes = self.model_dump(include={"half_width", "half_length", "step"})
        return partial(shapes.rectangle, **sizes)


class FlatStrip(Shape):
    """A flat strip with sharp edges on a step: a line contact."""

    shape: Literal["flat"] = entry("flat, or as in contact cases", "flat")
    half_width: Length = entry("half width of the strip, along x [mm]", "0.5 mm")
    step: Length = entry("height of the strip above the body [mm]", "0.1 mm", default=0.1)

    def described(self) -> GapFunction:
        return partial(shapes.strip, half_width=self.half_width, step=self.step)


BodiesOfArea = Annotated[Sphere | Ellipsoid | Flat | Plane | Heights, Field(discriminator="shape")]
BodiesOfLine = Annotated[
    Cylinder | FlatRounded | FlatStrip | Plane | Heights, Field(discriminator="shape")
]

# --- loads --------------------------------------------------------------------------------------


class Stroke(Section):
    """Reciprocating motion at constant speed under a constant normal force."""

    known_by: ClassVar[frozenset[str]] = frozenset({"stroke"})


class Reciprocation(Stroke):
    """Body 2 moves back and forth at constant speed under a constant normal force."""

    P: PressingForce = entry("normal force [N]", "50 N")
    stroke: Length = entry("stroke of body 2, peak to peak, far from the contact [mm]", "20 um")
    direction: Direction = entry("direction of the stroke, from x to y [rad]", "0 deg", default=0.0)
    increments: Increments = entry(
        "number of equal steps of each way, forward and back", 4, default=4
    )
    tilt: Tilt = entry(TILTS, "held", default="held")

    def table(self) -> LoadTable:
        """Return every increment of the cycle."""
        return LoadTable.stroke(self.P, self.stroke, self.increments, self.direction)


class LineReciprocation(Stroke):
    """Body 2 moves back and forth along x at constant speed under a constant normal force."""

    P: PressingLineForce = entry("normal force [N/mm]", "50 N/mm")
    stroke: Length = entry("stroke of body 2, peak to peak, far from the contact [mm]", "20 um")
    increments: Increments = entry(
        "number of equal steps of each way, forward and back", 4, default=4
    )
    tilt: Tilt = entry(TILTS, "held", default="held")

    def table(self) -> LoadTable:
        """Return every increment of the cycle."""
        return LoadTable.stroke(self.P, self.stroke, self.increments)


class ClosedCycle(LegsOrFile[LegT], Generic[LegT]):
    """Forces and motions of a closed cycle: the first leg begins where the last one ends."""

    closed: ClassVar[bool] = True
    known_by: ClassVar[frozenset[str]] = frozenset({"legs", "file"})

    legs: tuple[LegT, ...] = entry(
        "legs, one after the other and repeated: the first begins where the last one ends",
        default=(),
    )
    tilt: Tilt = entry(f"{TILTS}; unless a moment or tilt is named", "held", default="held")

    @model_validator(mode="after")
    def _presses(self) -> Self:
        columns = self.table().columns
        if not np.any(columns.get("P", columns.get("approach", 0.0)) > 0.0):
            raise disagreement(
                "nothing presses the bodies together; allowed: P or approach above 0 somewhere",
                "file" if self.file is not None else "legs",
            )
        return self


class ForcedCycle(ClosedCycle[Leg]):
    """Closed cycle of any loads; all but motions along the face need ``contact.method: full``."""


class LineContactCycle(ClosedCycle[LineLeg]):
    """Closed cycle of any loads; all but motions along the face need ``contact.method: full``."""


def _way(value: object) -> str:
    """Return the tag of a cycle: a stroke, unless it has legs or a file."""
    if isinstance(value, Section):
        return "(stroke)" if isinstance(value, Stroke) else "(cycle)"
    named = set(value) if isinstance(value, dict) else set()
    return "(cycle)" if ClosedCycle.known_by & named and not Stroke.known_by & named else "(stroke)"


LoadPath = Annotated[
    Annotated[Reciprocation, Tag("(stroke)")] | Annotated[ForcedCycle, Tag("(cycle)")],
    Discriminator(_way),
]
LineLoadPath = Annotated[
    Annotated[LineReciprocation, Tag("(stroke)")] | Annotated[LineContactCycle, Tag("(cycle)")],
    Discriminator(_way),
]

# --- grids --------------------------------------------------------------------------------------

METHODS = (
    "normal: every cell slides by the whole stroke; full: slips of the half-space, over the stroke"
)
ACCURACY = (
    "error of depth and energy of a cycle that increments may cause with method full, which "
    "splits them [1]"
)
SPLIT = "split until their error is {} of depth and energy (contact.accuracy)"
LINK = "there is no structure to link to: both bodies are half-spaces"


class BodiesWear(WearSection):
    """Wear laws of two bodies, and length of the run."""

    cycles: Cycles = entry("number of cycles of the whole run [1]", 1e5)


class WearGrid(ContactSection):
    """Half-space solution on a grid centred on body 2, which moves with it."""

    grid: tuple[GridCells, GridCells] = entry(
        "number of cells along x, along y; for heights as many as in their file",
        [128, 128],
        default=(128, 128),
    )
    size: tuple[Length, Length] = entry(
        "size of the grid along x, along y, with room for the stroke [mm]", ["1 mm", "1 mm"]
    )
    method: Literal["normal", "full"] = entry(METHODS, "normal", default="normal")
    accuracy: Accuracy = entry(ACCURACY, "2 %", default=0.02)
    link: Literal["half_space"] = entry(LINK, "half_space", default="half_space")


class LineWearGrid(ContactSection):
    """Half-plane solution on strips centred on body 2, which move with it."""

    grid: LineCells = entry(
        "number of cells along x; for heights as many as in their file", 512, default=(512, 1)
    )
    size: Length = entry("size of the grid along x, with room for the stroke [mm]", "2 mm")
    method: Literal["normal", "full"] = entry(METHODS, "normal", default="normal")
    accuracy: Accuracy = entry(ACCURACY, "2 %", default=0.02)
    link: Literal["half_space"] = entry(LINK, "half_space", default="half_space")


# --- cases --------------------------------------------------------------------------------------


class TwoBodiesWearCase(WearCase):
    """Two bodies that wear without a structure, over an area or along a line."""

    half_spaces: ClassVar[bool] = True
    line: ClassVar[bool]

    structure: BodiesOfArea | BodiesOfLine = entry("the bodies: no finite elements")
    materials: BodyMaterials = entry("the two bodies in contact")
    load_path: LoadPath | LineLoadPath
    contact: WearGrid | LineWearGrid
    wear: BodiesWear = entry("law, length of the run and step")

    @classmethod
    def suits(cls, source: Source) -> bool:
        return touches_along_a_line(source, (PLANE, HEIGHTS, FLAT)) == cls.line

    @property
    def size(self) -> tuple[float, float]:
        """Size of the grid along x and y [mm]; infinite along the line of a line contact."""
        size = self.contact.size
        return size if isinstance(size, tuple) else (size, inf)

    @property
    def grid(self) -> Grid:
        """Grid of the contact."""
        return Grid.over(self.size, self.contact.grid, self.line)

    @model_validator(mode="after")
    def _can_run(self) -> Self:
        _check(self)
        return self

    def surfaces_summary(self) -> dict[str, Any]:
        surfaces = self.structure.surfaces
        return {} if surfaces is None else {"surfaces": surfaces.summary(self.grid)}

    def scanned(self) -> Iterator[ScannedFace]:
        if self.structure.surfaces is not None:
            yield ScannedFace(NAME, KEY, self.structure.surfaces, self.grid)

    def material(self, number: int) -> ElasticMaterial:
        return elastic(getattr(self.materials, self.bodies[number - 1]))

    @property
    def loads_in_words(self) -> str:
        return _in_words(self.load_path, "N/mm" if self.line else "N")

    def loads_outline(self) -> list[tuple[str, str]]:
        kind = "line contact" if self.line else "no finite elements"
        return [
            ("structure", f"{self.structure.text}, {kind}"),
            *surfaces_in_words(self.structure, self.grid),
            ("load path", self.loads_in_words),
            *([("increments", SPLIT.format(shares(self.contact.accuracy)))] if self.splits else []),
        ]

    @property
    def splits(self) -> bool:
        """True if increments are split to meet ``contact.accuracy``; rows of a file are not."""
        path = self.load_path
        return self.contact.method == "full" and getattr(path, "file", None) is None

    def face_sides(self) -> tuple[float, float]:
        along, across = self.size
        return along, 1.0 if self.line else across

    def plausibility_warnings(self) -> Iterator[Notice]:
        yield from super().plausibility_warnings()
        yield from _warnings_about(self)


class BodiesWearCase(TwoBodiesWearCase):
    """Two bodies that wear over an area."""

    about: ClassVar[str] = "a ball, flat or measured heights that wear under a cycle of loads"
    line: ClassVar[bool] = False

    title: Title = entry("one line", "Ball that wears on a flat")
    structure: BodiesOfArea = entry("the bodies: no finite elements; body 2 has the form")
    load_path: LoadPath = entry(
        "motion of body 2 on body 1: a stroke, or legs or a file of a cycle"
    )
    contact: WearGrid = entry("half-space grid")


class LineBodiesWearCase(TwoBodiesWearCase):
    """Two bodies that wear along a line, in plane strain: everything is per length of it."""

    about: ClassVar[str] = "a cylinder, flat or heights along a line that wear under such a cycle"
    line: ClassVar[bool] = True

    title: Title = entry("one line", "Cylinder that wears on a flat")
    structure: BodiesOfLine = entry("the bodies: no finite elements; body 2 has the form")
    load_path: LineLoadPath = entry(
        "motion of body 2 on body 1, forces per length: a stroke, or legs or a file of a cycle"
    )
    contact: LineWearGrid = entry("half-plane grid")


def _check(case: TwoBodiesWearCase) -> None:
    """Refuse a grid, heights, motions, materials and loops that do not fit together."""
    if isinstance(case.structure, Heights):
        require_shape(case.structure.file, case.contact.grid)
    check_surfaces(case.structure, case.grid)
    table, path = case.load_path.table(), case.load_path
    check_bulk_stress(table, case.materials)
    _check_room(case, table)
    if isinstance(path, Stroke):
        return
    given = table.columns
    if case.contact.method == "normal" and (wrong := table.unfit_for_sliding):
        raise disagreement(
            f"normal lets every cell slide by the whole motion, but load_path {wrong}; "
            f"allowed: full, or no more than {', '.join(SHIFTS)} along the face",
            "contact.method",
        )
    tilted = sorted(given.keys() & {"approach", "tilt_x", "tilt_y"})
    if case.loops.wanted and (tilted or (path.tilt == "held" and given.keys() & {"Mx", "My"})):
        raise disagreement(
            "loops run under a normal force, level or free to tilt, but load_path has "
            f"{', '.join(tilted) or 'moments beside a tilt that is held'}; allowed: no loops",
            "loops",
        )


def _check_room(case: TwoBodiesWearCase, table: LoadTable) -> None:
    """Refuse a stroke that leaves the grid, if its motion is to be followed."""
    reach = np.array([np.ptp(table[name]) for name in SHIFTS])
    stroke = float(np.hypot(*reach))
    if case.wear.motion == "neglect" or not stroke > 0.0:
        return
    room = min(
        length * stroke / part for length, part in zip(case.size, reach, strict=True) if part > 0
    )
    if stroke >= room:
        key = "load_path.stroke" if isinstance(case.load_path, Stroke) else "load_path"
        raise disagreement(
            f"{stroke:g} mm: the grid reaches over {room:g} mm along it; allowed: shorter strokes, "
            "a larger contact.size, or wear.motion: neglect",
            *(key, "contact.size"),
        )


def _in_words(path: LoadPath | LineLoadPath, force: str) -> str:
    """Return a description of a cycle, with forces in the unit ``force``."""
    table = path.table()
    steps = f"{len(table)} increments, tilt {path.tilt}"
    if isinstance(path, Reciprocation | LineReciprocation):
        return f"{plain(path.P, force)}, stroke {plain(path.stroke, 'mm')} in {steps}"
    return f"{', '.join(path.ranges())} in {steps}"


def _warnings_about(case: TwoBodiesWearCase) -> Iterator[Notice]:
    """Yield plausibility warnings about loads, stroke and heights of a file."""
    bodies = case.materials.body_1, case.materials.body_2
    table, simple = case.load_path.table(), isinstance(case.load_path, Stroke)
    sides = (case.size[0], case.size[0]) if case.line else case.size
    load = max(table.columns["P"]) if "P" in table.columns else 0.0
    found = unworn_contact(case.structure, bodies, load, case.line) if load > 0.0 else None
    if found is not None:
        width, pressure = found
        stroke = float(np.linalg.norm([np.ptp(table[name]) for name in SHIFTS]))
        yield from about_pressure(f"load_path{'.P' if simple else ''}", pressure, bodies)
        yield from about_grid(width, sides, case.contact.grid)
        yield from long_stroke(f"load_path{'.stroke' if simple else ''}", stroke, width)
    unit = "N/mm" if case.line else "N"
    yield from about_shear("load_path", table, case.friction.coefficient, unit)
    yield from case.surface_warnings()
    if isinstance(case.structure, Heights):
        yield from heights("structure.file", read_heights(case.structure.file), sides)
