"""What every wear case has: materials, contact, laws and steps of wear, coupling."""

from __future__ import annotations

from typing import Annotated, Generic, Literal, TypeVar

from pydantic import Field, StrictBool, model_validator

from workflow.case.fields import Quantity, Whole
from workflow.case.sections import (
    ElasticBody,
    GridCells,
    Length,
    Section,
    Stress,
    Tolerance,
    disagreement,
    entry,
)

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual machine.
Density = Annotated[
    float,
    Quantity("t/mm^3", above=0.0, at_most=2.5e-8, range_text="above 0 and at most 25000 kg/m^3"),
]
Poisson = Annotated[float, Quantity("1", above=0.0, below=0.5)]
Volume = Annotated[float, Quantity("mm^3", above=0.0, at_most=1e9)]
Cycles = Annotated[float, Quantity("1", at_least=1.0, at_most=1e12)]
# Metals wear 1e2 to 1e6 um^3 per joule; a forgotten unit gives 1e16.
VolumePerEnergy = Annotated[
    float, Quantity("1/MPa", at_least=0.0, at_most=1e-3, range_text="0 to 1e9 um^3/J")
]
Ratio = Annotated[float, Quantity("1", above=0.0, at_most=1.0)]
Place = Annotated[float, Quantity("mm", at_least=-1e4, at_most=1e4)]

Part = TypeVar("Part", bound=Section)


class BladeAndDisk(Section, Generic[Part]):
    """The two bodies of a dovetail."""

    blade: Part = entry("the upper, moving body")
    disk: Part = entry("the lower, fixed body")


class TwoBodies(Section, Generic[Part]):
    """The two bodies of any other structure."""

    body_1: Part = entry("the lower, fixed body")
    body_2: Part = entry("the upper, moving body")


class Material(ElasticBody):
    """Isotropic linear elastic material."""

    young: Stress = entry("Young's modulus [MPa]", "115 GPa")
    poisson: Poisson = entry("Poisson's ratio [1]", 0.29)
    density: Density = entry("mass per volume [t/mm^3]", "4430 kg/m^3")
    yield_stress: Stress | None = entry(
        "pressures above it are warned of; without it none [MPa]", "900 MPa", default=None
    )


class BladeAndDiskMaterials(BladeAndDisk[Material]):
    """The two bodies in contact."""


class TwoMaterials(TwoBodies[Material]):
    """The two bodies in contact."""


class Contact(Section):
    """Half-space solution on a grid over each contact face."""

    grid: tuple[GridCells, GridCells] = entry(
        "cells along x, along y of every face", [128, 256], default=(128, 256)
    )
    method: Literal["normal", "full"] = entry(
        "normal: pressure of the half-space, slips of the structure; full: both of the half-space",
        "normal",
        default="normal",
    )
    gross_slip: Literal["force", "energies"] = entry(
        "direction in which a face slides as a whole (method full): force: with the structure's "
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
    volume: Volume | None = entry(
        "worn in a step; in the plane per length [mm^3]", "0.01 mm^3", default=None
    )

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
    volume: Volume | None = entry(
        "worn from both bodies; in the plane per length [mm^3]", "10 mm^3", default=None
    )


class Duration(Section):
    """What every wear law needs."""

    law: str  # named first in every wear section; each law narrows it to its own name
    cycles: Cycles = entry("of the whole run [1]", 3e5)
    step: Step = entry("how far one wear step jumps")
    stop: Stop = entry("ends the run early", default=Stop())


class EnergyBody(Section):
    """Wear of one body by dissipated energy."""

    coefficient: VolumePerEnergy = entry("volume per dissipated energy [1/MPa]", "1e4 um^3/J")


class EnergyLaw(Duration):
    """Depth = coefficient x dissipated energy per area."""

    law: Literal["energy"] = entry("energy, energy_amplitude or archard", "energy")


class EnergyAmplitudeLaw(Duration):
    """Energy law whose coefficient grows with the slip amplitude over a reference amplitude."""

    law: Literal["energy_amplitude"] = entry(
        "energy, energy_amplitude or archard", "energy_amplitude"
    )
    reference_amplitude: Length = entry("at which the coefficients hold [mm]", "75 um")


class ArchardBody(Section):
    """Wear of one body by pressure times slip over hardness."""

    coefficient: Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)] = entry(
        "Archard's wear coefficient K [1]", 1e-4
    )
    hardness: Annotated[
        float, Quantity("MPa", above=0.0, at_most=1e5, range_text="above 0 and at most 100 GPa")
    ] = entry("of the worn body [MPa]", "3.5 GPa")


class ArchardLaw(Duration):
    """Depth = coefficient / hardness x pressure x slip."""

    law: Literal["archard"] = entry("energy, energy_amplitude or archard", "archard")


class DovetailEnergyWear(BladeAndDisk[EnergyBody], EnergyLaw):
    """Depth = coefficient x dissipated energy per area."""


class DovetailEnergyAmplitudeWear(BladeAndDisk[EnergyBody], EnergyAmplitudeLaw):
    """Energy law whose coefficient grows with the slip amplitude over a reference amplitude."""


class DovetailArchardWear(BladeAndDisk[ArchardBody], ArchardLaw):
    """Depth = coefficient / hardness x pressure x slip."""


class EnergyWear(TwoBodies[EnergyBody], EnergyLaw):
    """Depth = coefficient x dissipated energy per area."""


class EnergyAmplitudeWear(TwoBodies[EnergyBody], EnergyAmplitudeLaw):
    """Energy law whose coefficient grows with the slip amplitude over a reference amplitude."""


class ArchardWear(TwoBodies[ArchardBody], ArchardLaw):
    """Depth = coefficient / hardness x pressure x slip."""


DovetailWear = Annotated[
    DovetailEnergyWear | DovetailEnergyAmplitudeWear | DovetailArchardWear,
    Field(discriminator="law"),
]
Wear = Annotated[EnergyWear | EnergyAmplitudeWear | ArchardWear, Field(discriminator="law")]


class Nonlinearity(Section):
    """What large displacements change: small for stiff joints, and measured by the check."""

    stiffness: Literal["linear", "stress_stiffened", "relinearised"] = entry(
        "linear; stress_stiffened: with the stress and spin of peak load; relinearised: tangent to "
        "the nonlinear structure there",
        "linear",
        default="linear",
    )
    check: StrictBool = entry(
        "compare with a total Lagrangian model at peak load (two more condensations)",
        False,
        default=False,
    )


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


class Life(Section):
    """Map of a fretting parameter over each contact face."""

    parameter: Literal["ruiz", "smith_watson_topper", "findley", "none"] = entry(
        "ruiz: friction work times tension; smith_watson_topper, findley: worst plane, tens of "
        "times slower; or none",
        "ruiz",
        default="ruiz",
    )
    depth: Length = entry(
        "critical distance below the surface, where the map lies and the section begins [mm]",
        "20 um",
        default=0.02,
    )
    sensitivity: Annotated[float, Quantity("1", at_least=0.0, at_most=10.0)] = entry(
        "k of findley, to normal stress [1]", 0.3, default=0.3
    )


class ContactStress(Section):
    """Stress of both bodies under each contact face, unworn and worn."""

    section: Literal["x", "y", "none"] = entry(
        "plane at peak load: x, across the face; y, along it (not for line contacts); or none",
        "x",
        default="x",
    )
    at: Place = entry(
        "where the plane cuts the other axis, 0 being the middle [mm]", "0 mm", default=0.0
    )
    depth: Length = entry("of the plane [mm]", "2 mm", default=2.0)
    points: Annotated[int, Whole(2, 1000)] = entry(
        "over the depth, denser towards the surface", 24, default=24
    )
    life: Life = entry("where fretting cracks would start", default=Life())

    @model_validator(mode="after")
    def _section_has_depth(self) -> ContactStress:
        if self.depth <= self.life.depth:
            raise disagreement(
                f"{self.depth:g} mm: not below the critical distance; "
                f"allowed: above life.depth, {self.life.depth:g} mm",
                *("depth", "life.depth"),
            )
        return self

    @property
    def wanted(self) -> bool:
        """Whether there is anything to compute."""
        return self.section != "none" or self.life.parameter != "none"
