"""A wear case of two bodies without a structure, one sliding to and fro on the other.

A line contact, in plane strain, differs in the dimensions of its loads and its grid: a separate
kind of case, though both are written ``analysis: wear`` and ``kind: bodies``.
"""

from __future__ import annotations

from math import cos, inf, sin
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from sa_solver.types import Array, Tilt
from workflow.analyses.contact.case import (
    HEIGHTS,
    BodyMaterial,
    Cylinder,
    Ellipsoid,
    FlatRounded,
    Heights,
    Shape,
    Sphere,
    require_shape,
    touches_along_a_line,
)
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.case.sections import Contact, PressingForce, TwoBodies, Wear
from workflow.case.fields import Quantity, Whole
from workflow.case.sections import GridCells, Length, Section, Title, disagreement, entry
from workflow.case.source import Source

PressingLineForce = Annotated[
    float, Quantity("N/mm", above=0.0, at_most=1e9, range_text="above 0 and at most 1e6 kN/mm")
]
Direction = Annotated[
    float, Quantity("rad", at_least=-6.4, at_most=6.4, range_text="-360 to 360 deg")
]
Increments = Annotated[int, Whole(1, 1000)]

FLAT = "flat"
TILTS = "of the bodies, held: as they are placed; free: as no moment at all leaves them"

# --- bodies -------------------------------------------------------------------------------------


class Flat(Shape):
    """A flat rectangle with sharp edges on a step: the pad of a specimen."""

    shape: Literal["flat"] = entry("flat, or as in contact cases", "flat")
    half_width: Length = entry("of the rectangle, along x [mm]", "0.5 mm")
    half_length: Length = entry("of the rectangle, along y [mm]", "0.5 mm")
    step: Length = entry("from the rectangle back to the body [mm]", "0.1 mm", default=0.1)

    def height(self, x: Array, y: Array) -> Array:
        on_top = (np.abs(x) < self.half_width) & (np.abs(y) < self.half_length)
        return np.where(on_top, 0.0, self.step)


class FlatStrip(Shape):
    """A flat strip with sharp edges on a step: a line contact."""

    shape: Literal["flat"] = entry("flat, or as in contact cases", "flat")
    half_width: Length = entry("of the strip, along x [mm]", "0.5 mm")
    step: Length = entry("from the strip back to the body [mm]", "0.1 mm", default=0.1)

    def height(self, x: Array, y: Array) -> Array:
        return np.where(np.abs(x) < self.half_width, 0.0, self.step)


class BodyMaterials(TwoBodies[BodyMaterial]):
    """The two bodies in contact."""


# --- loads --------------------------------------------------------------------------------------


class Reciprocation(Section):
    """Body 2 moves to and fro at constant speed under a constant normal force."""

    P: PressingForce = entry("normal force [N]", "50 N")
    stroke: Length = entry("of body 2, from end to end, far from the contact [mm]", "50 um")
    direction: Direction = entry("of the stroke, from x to y [rad]", "0 deg", default=0.0)
    increments: Increments = entry("equal steps of each way, there and back", 4, default=4)
    tilt: Tilt = entry(TILTS, "held", default="held")


class LineReciprocation(Section):
    """Body 2 moves to and fro along x at constant speed under a constant normal force."""

    P: PressingLineForce = entry("normal force [N/mm]", "50 N/mm")
    stroke: Length = entry("of body 2, from end to end, far from the contact [mm]", "50 um")
    increments: Increments = entry("equal steps of each way, there and back", 4, default=4)
    tilt: Tilt = entry(TILTS, "held", default="held")


# --- grids --------------------------------------------------------------------------------------

OneRow = Annotated[int, Whole(1, 1)]
METHODS = (
    "normal: every cell slides by all of the stroke; full: slips of the half-space, over the stroke"
)
LINK = "there is no structure to link the contact to: both bodies are half-spaces"


class WearGrid(Contact):
    """Half-space solution on a grid centred on body 2, which moves with it."""

    grid: tuple[GridCells, GridCells] = entry(
        "cells along x, along y; of heights as many as their file has",
        [128, 128],
        default=(128, 128),
    )
    size: tuple[Length, Length] = entry(
        "of the grid along x, along y, room for the stroke included [mm]", ["1 mm", "1 mm"]
    )
    method: Literal["normal", "full"] = entry(METHODS, "normal", default="normal")
    link: Literal["half_space"] = entry(LINK, "half_space", default="half_space")


class LineWearGrid(Contact):
    """Half-plane solution on strips centred on body 2, which move with it."""

    grid: tuple[GridCells, OneRow] = entry(
        "strips along x, in one row; of heights as many as their file has",
        [512, 1],
        default=(512, 1),
    )
    size: Length = entry("of the grid along x, room for the stroke included [mm]", "2 mm")
    method: Literal["normal", "full"] = entry(METHODS, "normal", default="normal")
    link: Literal["half_space"] = entry(LINK, "half_space", default="half_space")


# --- cases --------------------------------------------------------------------------------------


class BodiesWearCase(WearCase):
    """Two bodies that wear over an area of both directions."""

    title: Title = entry("one line", "Ball that wears on a flat")
    structure: Annotated[Sphere | Ellipsoid | Flat | Heights, Field(discriminator="shape")] = entry(
        "the bodies: no finite elements; body 2 has the form"
    )
    materials: BodyMaterials = entry("the two bodies in contact")
    load_path: Reciprocation = entry("of body 2 on body 1")
    contact: WearGrid = entry("half-space grid")
    wear: Wear = entry("law, length of the run and step")

    @classmethod
    def suits(cls, source: Source) -> bool:
        return not touches_along_a_line(source, (HEIGHTS, FLAT))

    @model_validator(mode="after")
    def _can_run(self) -> BodiesWearCase:
        x, y = self.contact.size
        across, along = abs(cos(self.load_path.direction)), abs(sin(self.load_path.direction))
        room = min(x / across if across > 0.0 else inf, y / along if along > 0.0 else inf)
        _require_fit(self, room)
        return self

    def loads_outline(self) -> list[tuple[str, str]]:
        path = self.load_path
        return _outline(self.structure.shape, "no structure", path, f"{path.P:g} N")


class LineBodiesWearCase(WearCase):
    """Two bodies that wear along a line, in plane strain: everything is per length of it."""

    title: Title = entry("one line", "Cylinder that wears on a flat")
    structure: Annotated[
        Cylinder | FlatRounded | FlatStrip | Heights, Field(discriminator="shape")
    ] = entry("the bodies: no finite elements; body 2 has the form")
    materials: BodyMaterials = entry("the two bodies in contact")
    load_path: LineReciprocation = entry("of body 2 on body 1, forces per length")
    contact: LineWearGrid = entry("half-plane grid")
    wear: Wear = entry("law, length of the run and step")

    @classmethod
    def suits(cls, source: Source) -> bool:
        return touches_along_a_line(source, (HEIGHTS, FLAT))

    @model_validator(mode="after")
    def _can_run(self) -> LineBodiesWearCase:
        _require_fit(self, self.contact.size)
        return self

    def loads_outline(self) -> list[tuple[str, str]]:
        path = self.load_path
        return _outline(self.structure.shape, "line contact", path, f"{path.P:g} N/mm")


def _require_fit(case: BodiesWearCase | LineBodiesWearCase, room: float) -> None:
    """Raise unless the grid is that of the heights and has room for the stroke.

    ``room`` is its length along the stroke [mm], which matters where the stroke is to be followed.
    """
    if isinstance(case.structure, Heights):
        require_shape(case.structure.file, case.contact.grid)
    stroke = case.load_path.stroke
    if stroke >= room and case.wear.motion != "neglect":
        raise disagreement(
            f"{stroke:g} mm: the grid reaches over {room:g} mm along it; allowed: shorter strokes, "
            "a larger contact.size, or wear.motion: neglect",
            *("load_path.stroke", "contact.size"),
        )


def _outline(
    shape: str, kind: str, path: Reciprocation | LineReciprocation, load: str
) -> list[tuple[str, str]]:
    steps = f"{2 * path.increments} increments, tilt {path.tilt}"
    return [
        ("structure", f"{shape}, {kind}"),
        ("load path", f"{load}, stroke {path.stroke:g} mm in {steps}"),
    ]
