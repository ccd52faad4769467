"""A wear case whose structure is a mesh or CAD file of the user's."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from workflow.case.fields import File, Quantity, Text, Whole
from workflow.case.sections import Length, Section, Title, disagreement, entry
from workflow.case.wear_case import WearCase
from workflow.case.wear_sections import Coupling, TwoMaterials, Wear

# What the readers take; other endings are refused with advice.
ENDINGS = (
    ".msh", ".inp", ".step", ".stp", ".brep", ".vtu", ".vtk", ".xdmf", ".med", ".bdf", ".mesh",
    ".nas", ".cdb", ".odb", ".cae", ".db", ".igs", ".iges",
)  # fmt: skip

Name = Annotated[str, Text()]
Factor = Annotated[float, Quantity("1", at_least=-1e6, at_most=1e6)]
Coordinate = Annotated[float, Quantity("mm", at_least=-1e6, at_most=1e6)]
Component = Annotated[float, Quantity("1", at_least=-1e6, at_most=1e6)]
Pull = Annotated[float, Quantity("N", at_least=-1e9, at_most=1e9)]
Push = Annotated[float, Quantity("MPa", at_least=-1e5, at_most=1e5)]
Travel = Annotated[float, Quantity("mm", at_least=-1e3, at_most=1e3)]
Speed = Annotated[float, Quantity("rad/s", above=0.0, at_most=1e5)]
Pace = Annotated[float, Quantity("mm/s^2", at_least=-1e12, at_most=1e12)]

HOLDS = (
    "all", "normal", "x", "y", "z", "xy", "xz", "yz", "mean_x", "mean_y", "mean_z",
)  # fmt: skip


class ContactPair(Section):
    """Two faces that meet; their meshes need not match."""

    name: Name = entry("of the interface in all results", "pad")
    face_1: Name = entry("boundary of body 1", "top")
    face_2: Name = entry("boundary of body 2", "bottom")
    x: tuple[Component, Component, Component] = entry(
        "direction in which body 2 would slide under the load; x of the interface frame",
        [1.0, 0.0, 0.0],
    )


class Support(Section):
    """Displacements held at a boundary or a node set, of whichever body has it."""

    group: Name = entry("boundary or node set", "base")
    hold: Literal[
        "all", "normal", "x", "y", "z", "xy", "xz", "yz", "mean_x", "mean_y", "mean_z"
    ] = entry(
        "all, normal, global axes such as xz, or mean_x: only the mean of a boundary along x", "all"
    )


class _Load(Section):
    """What every load needs."""

    kind: str  # named first; each load narrows it to its own name
    path: tuple[Factor, ...] = entry(
        "factor of the load at the end of each leg of load_path; from 0, linearly", [1.0, 0.0]
    )


class PressureLoad(_Load):
    """Pressure on a boundary, into the body."""

    kind: Literal["pressure"] = entry(
        "pressure, force, displacement, rotation or acceleration", "pressure"
    )
    group: Name = entry("boundary", "top")
    pressure: Push = entry("into the body [MPa]", "10 MPa")


class ForceLoad(_Load):
    """Force on a boundary, spread evenly."""

    kind: Literal["force"] = entry(
        "pressure, force, displacement, rotation or acceleration", "force"
    )
    group: Name = entry("boundary", "top")
    force: tuple[Pull, Pull, Pull] = entry(
        "along the global axes [N]; per length in the plane, as if in N", [0.0, 0.0, "-1 kN"]
    )


class DisplacementLoad(_Load):
    """Displacement imposed on a boundary along its own direction; free across it."""

    kind: Literal["displacement"] = entry(
        "pressure, force, displacement, rotation or acceleration", "displacement"
    )
    group: Name = entry("boundary", "top")
    displacement: tuple[Travel, Travel, Travel] = entry(
        "along the global axes [mm]", ["10 um", 0.0, 0.0]
    )

    @model_validator(mode="after")
    def _moves(self) -> DisplacementLoad:
        if not any(self.displacement):
            raise disagreement("no displacement; allowed: one that is not zero", "displacement")
        return self


class RotationLoad(_Load):
    """Rotation of both bodies; its path is that of the speed, whose square the forces follow."""

    kind: Literal["rotation"] = entry(
        "pressure, force, displacement, rotation or acceleration", "rotation"
    )
    axis: tuple[Component, Component, Component] = entry("direction of the axis", [0.0, 1.0, 0.0])
    through: tuple[Coordinate, Coordinate, Coordinate] = entry(
        "a point on the axis [mm]", [0.0, 0.0, 0.0]
    )
    speed: Speed = entry("[rad/s]", "6000 rpm")

    @model_validator(mode="after")
    def _has_axis(self) -> RotationLoad:
        if not any(self.axis):
            raise disagreement("no direction; allowed: one that is not zero", "axis")
        return self


class AccelerationLoad(_Load):
    """Acceleration of the frame of reference: both bodies are pulled against it."""

    kind: Literal["acceleration"] = entry(
        "pressure, force, displacement, rotation or acceleration", "acceleration"
    )
    acceleration: tuple[Pace, Pace, Pace] = entry(
        "along the global axes [mm/s^2]", [0.0, 0.0, "9.81 m/s^2"]
    )


Load = Annotated[
    PressureLoad | ForceLoad | DisplacementLoad | RotationLoad | AccelerationLoad,
    Field(discriminator="kind"),
]


class ImportedStructure(Section):
    """Two bodies from a file; lengths in mm.

    Tetrahedra and hexahedra, or triangles and quadrilaterals in plane strain: coordinates of a
    plane mesh are called X and Z.
    """

    kind: Literal["mesh"] = entry("what the structure is", "mesh")
    file: Annotated[str, File(ENDINGS)] = entry(
        "mesh (.msh, .inp, .vtu, ...) or CAD (.step, .brep)", "joint.msh"
    )
    size: Length | None = entry("of the elements, for CAD files only [mm]", "2 mm", default=None)
    order: Literal[1, 2] = entry("of the elements, 1 or 2", 1, default=1)
    body_1: Name = entry("name in the file of the lower, fixed body", "disk")
    body_2: Name = entry("name in the file of the upper, moving body", "blade")
    contacts: Annotated[tuple[ContactPair, ...], Field(min_length=1)] = entry("faces that meet")
    supports: Annotated[tuple[Support, ...], Field(min_length=1)] = entry("what is held")
    loads: Annotated[tuple[Load, ...], Field(min_length=1)] = entry("what is applied")

    @model_validator(mode="after")
    def _names_differ(self) -> ImportedStructure:
        names = [pair.name for pair in self.contacts]
        if len(set(names)) < len(names):
            raise disagreement("two contacts of one name; allowed: names that differ", "contacts")
        if self.body_1 == self.body_2:
            raise disagreement("the same body twice; allowed: two bodies", "body_2", "body_1")
        return self


class Legs(Section):
    """Every load goes linearly from leg to leg; the last legs are one cycle."""

    increments: Annotated[tuple[Annotated[int, Whole(1, 10_000)], ...], Field(min_length=1)] = (
        entry("of each leg", [8, 14])
    )
    cycle_from: Annotated[int, Whole(1, 1000)] = entry(
        "first leg of the cycle; those before it are passed once", 1, default=1
    )
    peak_leg: Annotated[int, Whole(1, 1000)] = entry(
        "leg of the cycle at whose end the load peaks: stress is shown there", 1, default=1
    )

    @model_validator(mode="after")
    def _peak_is_a_leg(self) -> Legs:
        if not self.cycle_from <= self.peak_leg <= len(self.increments):
            raise disagreement(
                f"{self.peak_leg}: no leg of the cycle; "
                f"allowed: {self.cycle_from} to {len(self.increments)}",
                *("peak_leg", "cycle_from"),
            )
        return self


class MeshCase(WearCase):
    """Bodies from a file under loads of the user's."""

    bodies: ClassVar[tuple[str, str]] = ("body_1", "body_2")

    title: Title = entry("one line", "Two bodies of a mesh file")
    structure: ImportedStructure = entry("bodies, contacts, supports and loads, named by groups")
    materials: TwoMaterials = entry("the two bodies in contact")
    load_path: Legs = entry("one cycle")
    wear: Wear = entry("law, length of the run and step")
    coupling: Coupling = entry("worn surfaces back to the structure", default=Coupling())

    @property
    def recoupling(self) -> Coupling:
        return self.coupling

    def outline(self) -> list[tuple[str, str]]:
        structure, legs = self.structure, self.load_path.increments
        names = ", ".join(pair.name for pair in structure.contacts)
        return [
            ("structure", f"{structure.file}: {structure.body_1} and {structure.body_2}, {names}"),
            ("load path", f"{sum(legs)} increments in {len(legs)} legs"),
        ]

    @model_validator(mode="after")
    def _paths_fit_legs(self) -> MeshCase:
        legs = len(self.load_path.increments)
        for index, load in enumerate(self.structure.loads):
            if len(load.path) != legs:
                raise disagreement(
                    f"{len(load.path)} factors for {legs} legs of load_path; "
                    "allowed: one for each leg",
                    f"structure.loads.{index}.path",
                )
        return self
