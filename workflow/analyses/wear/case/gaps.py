"""Gap of the unloaded bodies over a contact face, as sections of a case."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from workflow.case.fields import File
from workflow.case.files.input_files import InputFileError, read_heights
from workflow.case.sections import (
    Length,
    RoundingRadius,
    Section,
    disagreement,
    entry,
    one_of,
    together,
)

# Relative tolerance for rounding errors of a face's size.
ROUNDING = 1e-9


class RoundedGap(Section):
    """Gap of a flat face with rounded edges along x and rounded ends along y."""

    in_schema: ClassVar[Mapping[str, Any]] = together("end_width", "end_radius")

    shape: Literal["rounded"] = entry("rounded, paraboloid or heights", "rounded")
    edge_width: Length = entry("width of each rounded edge, within the size along x [mm]", "1.5 mm")
    edge_radius: RoundingRadius = entry("radius of the rounded edges [mm]", "30 mm")
    end_width: Length | None = entry(
        "width of each rounded end, within the size along y; ignored in 2 dimensions [mm]",
        "3 mm",
        default=None,
    )
    end_radius: RoundingRadius | None = entry(
        "radius of the rounded ends [mm]", "150 mm", default=None
    )

    @model_validator(mode="after")
    def _arcs_exist(self) -> RoundedGap:
        check_arcs(self)
        return self


def check_arcs(face: Section) -> None:
    """Refuse a rounded end with only one of its entries, and a rounding wider than its radius."""
    given = [key for key in ("end_width", "end_radius") if getattr(face, key) is not None]
    if len(given) == 1:
        raise disagreement(
            f"{given[0]} alone; allowed: end_width and end_radius, or neither", *given
        )
    for name in ("edge", "end"):
        width, radius = getattr(face, f"{name}_width"), getattr(face, f"{name}_radius")
        if width is not None and width >= radius:
            raise disagreement(
                f"{width:g} mm: the rounding ends beyond its own arc; allowed: below "
                f"{name}_radius, {radius:g} mm",
                *(f"{name}_width", f"{name}_radius"),
            )


class ParaboloidGap(Section):
    """Paraboloid gap x² / 2 Rx + y² / 2 Ry; straight along an axis without a radius."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("radius_x", "radius_y")
    in_schema: ClassVar[Mapping[str, Any]] = one_of("radius_x", "radius_y")

    shape: Literal["paraboloid"] = entry("rounded, paraboloid or heights", "paraboloid")
    radius_x: RoundingRadius | None = entry(
        "relative radius of the section along x; without it straight [mm]", "300 mm", default=None
    )
    radius_y: RoundingRadius | None = entry(
        "relative radius of the section along y; without it straight [mm]", "10 m", default=None
    )

    @model_validator(mode="after")
    def _is_curved(self) -> ParaboloidGap:
        if self.radius_x is None and self.radius_y is None:
            raise disagreement("no radius; allowed: radius_x, radius_y or both", "radius_x")
        return self


class HeightsGap(Section):
    """Gap from a file, with one value for every cell of ``contact.grid``."""

    shape: Literal["heights"] = entry("rounded, paraboloid or heights", "heights")
    file: Annotated[str, File((".npy", ".csv", ".h5"))] = entry(
        "file with the gap in mm, rows along x, columns along y; for .h5 add :dataset", "gap.npy"
    )


GapShape = RoundedGap | ParaboloidGap | HeightsGap
Gap = Annotated[GapShape, Field(discriminator="shape")]


def check_gap(
    gap: GapShape,
    size: tuple[float, float],
    cells: tuple[int, int],
    line: bool,
    key: str,
    *beside: str,
) -> None:
    """Refuse, at ``key``, a gap that does not fit a face of ``size`` [mm] or its ``cells``.

    ``beside`` names the other entries that set the size of the face.
    """
    match gap:
        case RoundedGap():
            _check_roundings(gap, size, line, key, *beside)
        case ParaboloidGap():
            if line and gap.radius_x is None:
                raise disagreement("no radius_x; allowed: one, in 2 dimensions", key)
        case HeightsGap():
            try:
                shape = read_heights(gap.file).shape
            except InputFileError as error:
                raise disagreement(str(error), f"{key}.file") from error
            check_cells(shape, gap.file, cells)


def check_cells(shape: tuple[int, ...], file: str, cells: tuple[int, int]) -> None:
    """Refuse heights whose shape is not that of the contact grid."""
    if shape != cells:
        raise disagreement(
            f"{cells[0]} x {cells[1]} cells: the heights of {file} are {shape[0]} x {shape[1]}; "
            f"allowed: [{shape[0]}, {shape[1]}]",
            "contact.grid",
        )


def _check_roundings(
    gap: RoundedGap, size: tuple[float, float], line: bool, key: str, *beside: str
) -> None:
    """Refuse roundings that do not fit into the face."""
    widths: dict[str, tuple[float | None, float]] = {"edge_width": (gap.edge_width, size[0])}
    if not line:
        widths["end_width"] = gap.end_width, size[1]
    for name, (width, extent) in widths.items():
        if width is not None and width > 0.5 * extent * (1.0 + ROUNDING):
            raise disagreement(
                f"{width:g} mm: too large; allowed: up to half the size of the face, "
                f"{0.5 * extent:g} mm",
                *(f"{key}.{name}", *beside),
            )
