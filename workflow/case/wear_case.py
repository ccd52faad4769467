"""A wear case: a dovetail's mission, its contacts and how they wear."""

from __future__ import annotations

from math import cos, pi, radians, sin, tan
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator

from workflow.case.fields import Quantity, Whole
from workflow.case.sections import (
    DottedPath,
    ElasticBody,
    Expectation,
    Friction,
    GridCells,
    Length,
    Output,
    RoundingRadius,
    Scene,
    Section,
    Stress,
    Title,
    Tolerance,
    disagreement,
    entry,
)

if TYPE_CHECKING:
    from fe_models.geometry.dovetail import Dovetail as Geometry

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual machine.
Density = Annotated[
    float,
    Quantity("t/mm^3", above=0.0, at_most=2.5e-8, range_text="above 0 and at most 25000 kg/m^3"),
]
Mass = Annotated[float, Quantity("t", at_least=0.0, at_most=1.0, range_text="0 to 1000 kg")]
Poisson = Annotated[float, Quantity("1", above=0.0, below=0.5)]
FlankAngle = Annotated[
    float,
    Quantity("rad", at_least=radians(10), at_most=radians(80), range_text="10 deg to 80 deg"),
]
Skew = Annotated[
    float,
    Quantity("rad", at_least=radians(-30), at_most=radians(30), range_text="-30 deg to 30 deg"),
]
RotationSpeed = Annotated[
    float,
    Quantity(
        "rad/s", above=0.0, at_most=1e5 * pi / 30, range_text="above 0 and at most 100000 rpm"
    ),
]
Moment = Annotated[
    float, Quantity("N*mm", at_least=-1e9, at_most=1e9, range_text="-1e6 N*m to 1e6 N*m")
]
Volume = Annotated[float, Quantity("mm^3", above=0.0, at_most=1e9)]
Cycles = Annotated[float, Quantity("1", at_least=1.0, at_most=1e12)]
# Metals wear 1e2 to 1e6 um^3 per joule; a forgotten unit gives 1e16.
VolumePerEnergy = Annotated[
    float, Quantity("1/MPa", at_least=0.0, at_most=1e-3, range_text="0 to 1e9 um^3/J")
]
Ratio = Annotated[float, Quantity("1", above=0.0, at_most=1.0)]
FlankNodes = Annotated[int, Whole(3, 2000)]


class Dovetail(Section):
    """Blade root in a disk sector, in contact along two flanks (dovetail attachment)."""

    kind: Literal["dovetail"] = entry("what the structure is", "dovetail")
    flank_angle: FlankAngle = entry("between the flank and the radial axis [rad]", "45 deg")
    flank_length: Length = entry("flat part of the flank, across the slot [mm]", "8 mm")
    edge_radius: RoundingRadius = entry(
        "rounding of the two flank edges along the slot [mm]", "30 mm"
    )
    edge_width: Length = entry("width of each rounded edge, beyond the flat [mm]", "1.5 mm")
    end_radius: RoundingRadius = entry("rounding of the flank at the slot ends [mm]", "150 mm")
    end_width: Length = entry("width of each rounded end, inside the slot length [mm]", "3 mm")
    neck_width: Length = entry("blade, between the tops of the flanks [mm]", "20 mm")
    neck_fillet: Length = entry("blade, radius between neck and flank [mm]", "3 mm")
    slot_length: Length = entry("of the slot, along its direction [mm]", "60 mm")
    slot_fillet: Length = entry("disk, radius at the bottom of the slot [mm]", "3 mm")
    root_depth: Length = entry("blade, below the flanks [mm]", "6 mm")
    shank_height: Length = entry("blade, from the top of the flanks outwards [mm]", "30 mm")
    slot_clearance: Length = entry("play under the blade root [mm]", "1 mm")
    lug_height: Length = entry("disk, above the top of the flanks [mm]", "6 mm")
    blades: Annotated[int, Whole(3, 1000)] = entry("the sector spans 360°/blades", 24)
    rim_radius: Length = entry("rotor axis to the top of the flanks [mm]", "250 mm")
    disk_height: Length = entry("radial height of the sector below the rim [mm]", "60 mm")
    skew: Skew = entry("slot direction against the rotor axis [rad]", "0 deg", default=0.0)

    @property
    def face_width(self) -> float:
        """Flat and both rounded edges of a flank, across the slot [mm]."""
        return self.flank_length + 2.0 * self.edge_width

    @property
    def face_depth(self) -> float:
        """Radial extent of the flank below the rim [mm]."""
        return self.face_width * cos(self.flank_angle)

    @property
    def root_width(self) -> float:
        """Width of the blade root at the bottom of the flanks [mm]."""
        return self.neck_width + 2.0 * self.face_width * sin(self.flank_angle)

    @model_validator(mode="after")
    def _roundings_fit(self) -> Dovetail:
        for name in ("edge", "end"):
            width, radius = getattr(self, f"{name}_width"), getattr(self, f"{name}_radius")
            if width >= radius:
                raise disagreement(
                    f"{width:g} mm: the rounding ends beyond its own arc; "
                    f"allowed: below {name}_radius, {radius:g} mm",
                    f"{name}_width",
                    f"{name}_radius",
                )
        _require_below(self, "edge_width", self.flank_length / 2, "half the flank_length")
        _require_below(self, "end_width", self.slot_length / 2, "half the slot_length")
        return self

    @model_validator(mode="after")
    def _root_fits_sector(self) -> Dovetail:
        _require_below(self, "disk_height", self.rim_radius, "the rim_radius")
        depth = self.face_depth + self.slot_fillet
        if depth >= self.disk_height:
            raise disagreement(
                f"{self.disk_height:g} mm: too shallow for flanks and slot_fillet, which reach "
                f"{depth:.4g} mm below the rim; allowed: above {depth:.4g} mm",
                *("disk_height", "flank_length", "edge_width", "flank_angle", "slot_fillet"),
            )
        sector = 2.0 * (self.rim_radius - self.face_depth) * tan(pi / self.blades)
        if self.root_width >= sector:
            raise disagreement(
                f"{self.blades} blades: the sector is {sector:.4g} mm wide at the bottom of the "
                f"flanks, the blade root {self.root_width:.4g} mm; allowed: fewer blades or a "
                "narrower root",
                *("blades", "neck_width", "flank_length", "edge_width", "flank_angle"),
                "rim_radius",
            )
        return self

    @model_validator(mode="after")
    def _can_be_drawn(self) -> Dovetail:
        from fe_models.mesh import MeshError

        try:
            self.geometry().check()
        except MeshError as error:
            raise disagreement(str(error)) from error
        return self

    def geometry(self) -> Geometry:
        """The joint as the mesher takes it."""
        from fe_models.geometry.dovetail import Dovetail as Geometry

        return Geometry(**self.model_dump(exclude={"kind"}))


def _require_below(section: Section, key: str, limit: float, name: str) -> None:
    """Raise unless the length ``key`` is below ``limit`` [mm], called ``name`` in the message."""
    length = getattr(section, key)
    if length >= limit:
        other = name.rsplit(" ", 1)[-1]
        raise disagreement(
            f"{length:g} mm: too large; allowed: below {name}, {limit:g} mm", key, other
        )


class Material(ElasticBody):
    """Isotropic linear elastic material."""

    young: Stress = entry("Young's modulus [MPa]", "115 GPa")
    poisson: Poisson = entry("Poisson's ratio [1]", 0.29)
    density: Density = entry("mass per volume [t/mm^3]", "4430 kg/m^3")
    yield_stress: Stress | None = entry(
        "pressures above it are warned of; without it none [MPa]", "900 MPa", default=None
    )


class Materials(Section):
    """The two bodies in contact."""

    blade: Material = entry("the upper, moving body")
    disk: Material = entry("the lower, fixed body")


class LoadPath(Section):
    """One mission: the speed rises linearly to its peak and falls back to zero.

    Centrifugal force and aerodynamic moment follow the square of the speed.
    """

    increments: Annotated[int, Whole(2, 10_000)] = entry("of one cycle", 22)
    peak_at: Annotated[int, Whole(1, 10_000)] = entry("increment at which the speed peaks", 8)
    rotation_speed: RotationSpeed = entry("at the peak [rad/s]", "6000 rpm")
    airfoil_mass: Mass = entry("of the blade outside the model [t]", "0.8 kg")
    airfoil_radius: Length = entry(
        "of the airfoil's centre of mass, from the rotor axis [mm]", "400 mm"
    )
    aerodynamic_moment: Moment = entry(
        "at peak speed, about the slot; presses on the intrados [N*mm]", "30 N*m", default=0.0
    )

    @model_validator(mode="after")
    def _peak_inside_cycle(self) -> LoadPath:
        if self.peak_at >= self.increments:
            raise disagreement(
                f"{self.peak_at}: the peak comes after the cycle; "
                f"allowed: below increments, {self.increments}",
                *("peak_at", "increments"),
            )
        return self


class Mesh(Section):
    """Tetrahedra of the structure."""

    flank_nodes: tuple[FlankNodes, FlankNodes] = entry(
        "nodes across the flank, along the slot", [20, 34], default=(20, 34)
    )
    size: Length = entry("of the elements away from the flanks [mm]", "5 mm", default=5.0)
    order: Literal[1, 2] = entry("of the tetrahedra, 1 or 2", 1, default=1)


class Contact(Section):
    """Half-space solution on a grid over each contact face."""

    grid: tuple[GridCells, GridCells] = entry(
        "cells across the flank, along the slot", [128, 256], default=(128, 256)
    )
    method: Literal["normal", "full"] = entry(
        "normal: pressure of the half-space, slips of the structure; full: both of the half-space",
        "normal",
        default="normal",
    )
    gross_slip: Literal["force", "energies"] = entry(
        "direction in which a flank slides as a whole (method full): force: with the structure's "
        "shear force; energies: sharing the structure's energy between x and y",
        "force",
        default="force",
    )
    tolerance: Tolerance = entry(
        "relative, on equilibrium and complementarity [1]", 1e-8, default=1e-8
    )


class Step(Section):
    """Size of a wear step: exactly one of cycles, depth and volume."""

    kind: Literal["explicit", "implicit"] = entry("explicit or implicit", "implicit")
    cycles: Cycles | None = entry("jumped in a step [1]", 30000, default=None)
    depth: Length | None = entry("largest depth worn in a step [mm]", "1 um", default=None)
    volume: Volume | None = entry("worn in a step [mm^3]", "0.01 mm^3", default=None)

    @model_validator(mode="after")
    def _one_size(self) -> Step:
        sizes = [key for key in ("cycles", "depth", "volume") if getattr(self, key) is not None]
        if len(sizes) != 1:
            given = " and ".join(sizes) or "no size"
            message = f"{given} given; allowed: exactly one of cycles, depth, volume"
            raise disagreement(message, *sizes[1:])
        return self


class Stop(Section):
    """Ends the run before its cycles are over, at the first of these that is reached."""

    depth: Length | None = entry("largest depth of either body [mm]", "0.5 mm", default=None)
    volume: Volume | None = entry("worn from both bodies [mm^3]", "10 mm^3", default=None)


class _Wear(Section):
    """What every wear law needs."""

    law: str  # named first in every wear section; each law narrows it to its own name
    cycles: Cycles = entry("of the whole run [1]", 3e5)
    step: Step = entry("how far one wear step jumps")
    stop: Stop = entry("ends the run early", default=Stop())


class EnergyBody(Section):
    """Wear of one body by dissipated energy."""

    coefficient: VolumePerEnergy = entry("volume per dissipated energy [1/MPa]", "1e4 um^3/J")


class EnergyWear(_Wear):
    """Depth = coefficient x dissipated energy per area."""

    law: Literal["energy"] = entry("energy, energy_amplitude or archard", "energy")
    blade: EnergyBody = entry("the upper, moving body")
    disk: EnergyBody = entry("the lower, fixed body")


class EnergyAmplitudeWear(_Wear):
    """Energy law whose coefficient grows with the slip amplitude over a reference amplitude."""

    law: Literal["energy_amplitude"] = entry(
        "energy, energy_amplitude or archard", "energy_amplitude"
    )
    reference_amplitude: Length = entry("at which the coefficients hold [mm]", "75 um")
    blade: EnergyBody = entry("the upper, moving body")
    disk: EnergyBody = entry("the lower, fixed body")


class ArchardBody(Section):
    """Wear of one body by pressure times slip over hardness."""

    coefficient: Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)] = entry(
        "Archard's wear coefficient K [1]", 1e-4
    )
    hardness: Annotated[
        float, Quantity("MPa", above=0.0, at_most=1e5, range_text="above 0 and at most 100 GPa")
    ] = entry("of the worn body [MPa]", "3.5 GPa")


class ArchardWear(_Wear):
    """Depth = coefficient / hardness x pressure x slip."""

    law: Literal["archard"] = entry("energy, energy_amplitude or archard", "archard")
    blade: ArchardBody = entry("the upper, moving body")
    disk: ArchardBody = entry("the lower, fixed body")


Wear = Annotated[EnergyWear | EnergyAmplitudeWear | ArchardWear, Field(discriminator="law")]


class Coupling(Section):
    """How often the worn surfaces go back to the structure."""

    resultants: Literal["constant", "drift"] = entry(
        "constant: of the unworn structure; drift: computed again when wear changes them",
        "drift",
        default="drift",
    )
    drift: Ratio = entry(
        "change that asks for new resultants, when they may drift [1]", "2 %", default=0.02
    )


class WearCase(Scene):
    """One scene: a structure, its load, its contacts and how they wear."""

    title: Title = entry("one line", "Ti-6Al-4V dovetail, one mission per cycle")
    analysis: Literal["wear"] = entry("what is computed", "wear")
    structure: Dovetail = entry("lengths in the section across the slot unless named otherwise")
    materials: Materials = entry("the two bodies in contact")
    friction: Friction = entry("Coulomb's law on every contact face")
    load_path: LoadPath = entry("one cycle")
    mesh: Mesh = entry("tetrahedra of the structure", default=Mesh())
    contact: Contact = entry("half-space grid over each contact face", default=Contact())
    wear: Wear = entry("law, length of the run and step")
    coupling: Coupling = entry("worn surfaces back to the structure", default=Coupling())
    output: Output = entry("files beside summary and results", default=Output())
    assumed: tuple[DottedPath, ...] = entry(
        "inputs that are ours because the source does not print them",
        ["structure", "friction.coefficient"],
        default=(),
    )
    expect: tuple[Expectation, ...] = entry("values the run must reproduce", default=())

    @model_validator(mode="after")
    def _airfoil_outside_disk(self) -> WearCase:
        radius, rim = self.load_path.airfoil_radius, self.structure.rim_radius
        if radius <= rim:
            raise disagreement(
                f"{radius:g} mm: the airfoil is inside the disk; "
                f"allowed: above structure.rim_radius, {rim:g} mm",
                *("load_path.airfoil_radius", "structure.rim_radius"),
            )
        return self

    @model_validator(mode="after")
    def _assumed_exist(self) -> WearCase:
        self.require_entries(self.assumed)
        return self
