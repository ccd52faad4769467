"""Sections that all wear cases have: materials, contact, laws and steps of wear, coupling."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Generic, Literal, TypeVar, get_args

from pydantic import StrictBool, model_validator
from pydantic_core import PydanticCustomError

from workflow.analyses.wear.case.worn_bodies import (
    BodyWear,
    LawName,
    WornByEnergyAmplitude,
    with_laws,
)
from workflow.case.fields import Quantity, Whole
from workflow.case.sections import (
    ElasticSection,
    FaceCells,
    Length,
    Section,
    Stress,
    Tolerance,
    disagreement,
    entry,
)
from workflow.case.text.plain import plain, shares, times
from workflow.models.checks.limits import MOST_JUMPS, MOST_POINTS

if TYPE_CHECKING:
    from workflow.models import structure_model
    from workflow.models.stress import settings as stress_settings

# The sizes that a wear step may be given.
SIZES = ("cycles", "depth", "volume", "fraction")

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual machine.
Density = Annotated[
    float,
    Quantity("t/mm^3", above=0.0, at_most=2.5e-8, range_text="above 0 and at most 25000 kg/m^3"),
]
Poisson = Annotated[float, Quantity("1", above=0.0, below=0.5)]
Volume = Annotated[float, Quantity("mm^3", above=0.0, at_most=1e9)]
Cycles = Annotated[float, Quantity("1", at_least=1.0, at_most=1e12)]
Ratio = Annotated[float, Quantity("1", above=0.0, at_most=1.0)]
Share = Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)]
PressingForce = Annotated[
    float, Quantity("N", above=0.0, at_most=1e9, range_text="above 0 and at most 1e6 kN")
]
Place = Annotated[float, Quantity("mm", at_least=-1e4, at_most=1e4)]

# Tolerance on the sum of shares, which is 1 except for rounding in the case file.
SHARES_DIFFERENCE = 1e-6


def check_shares(shares: Sequence[float]) -> None:
    """Refuse a mix of missions whose shares do not add up to 1."""
    if abs(sum(shares) - 1.0) > SHARES_DIFFERENCE:
        raise disagreement(
            f"shares that add up to {sum(shares):g}; allowed: shares that add up to 1", "mix"
        )


Part = TypeVar("Part", bound=Section)


class BladeAndDisk(Section, Generic[Part]):
    """The two bodies of a dovetail."""

    blade: Part = entry("the upper, moving body")
    disk: Part = entry("the lower, fixed body")


class TwoBodies(Section, Generic[Part]):
    """The two bodies of a structure other than a dovetail."""

    body_1: Part = entry("the lower, fixed body")
    body_2: Part = entry("the upper, moving body")


class Solid(ElasticSection):
    """Isotropic linear elastic material of finite elements."""

    young: Stress = entry("Young's modulus [MPa]", "115 GPa")
    poisson: Poisson = entry("Poisson's ratio [1]", 0.29)
    yield_stress: Stress | None = entry(
        "a run warns of pressures above it; without it never [MPa]", "900 MPa", default=None
    )


class MaterialSection(Solid):
    """Isotropic linear elastic material with a mass."""

    density: Density = entry("mass per volume [t/mm^3]", "4430 kg/m^3")


class BladeAndDiskMaterials(BladeAndDisk[MaterialSection]):
    """The two bodies in contact."""


class TwoMaterials(TwoBodies[MaterialSection]):
    """The two bodies in contact."""


class ContactSection(Section):
    """Half-space solution on a grid over each contact face."""

    grid: FaceCells = entry(
        "number of cells along x, along y of every face; for line contacts along x alone, "
        "256 or [256, 1]",
        [96, 192],
        default=(96, 192),
    )
    method: Literal["normal", "full", "nodes"] = entry(
        "normal: pressure of the half-space, slips of the structure; full: both of the "
        "half-space; nodes: finite elements alone, whose nodes wear: no half-space, slow on fine "
        "meshes",
        "normal",
        default="normal",
    )
    link: Literal["corrected", "half_space"] = entry(
        "corrected: the bodies deform as the structure does, where its nodes tell; half_space: "
        "as half-spaces",
        "corrected",
        default="corrected",
    )
    gross_slip: Literal["force", "energies"] = entry(
        "direction in which a face slides as a whole (method full): force: that of the "
        "structure's shear force; energies: shares of x and y in the structure's energy",
        "force",
        default="force",
    )
    tolerance: Tolerance | None = entry(
        "relative tolerance of equilibrium and complementarity, of shear a hundredth of it but not "
        "below 1e-8; by default a thousandth of accuracy [1]",
        1e-8,
        default=None,
    )


def check_rows(grid: tuple[int, int], line: bool, key: str | None = None) -> None:
    """Refuse, at ``key``, a single row of cells in a contact that is not a line contact."""
    if grid[1] == 1 and not line:
        raise disagreement(
            f"{grid[0]}: of line contacts; allowed: [x, y], cells along both",
            key or "contact.grid",
        )


class Step(Section):
    """Kind and size of a wear step; without a size, an error estimate chooses it."""

    filled_in: ClassVar[bool] = False

    kind: Literal["explicit", "implicit", "second_order"] = entry(
        "implicit and second_order are stable at any size, explicit only below a limit",
        "implicit",
        default="implicit",
    )
    cycles: Cycles | None = entry("cycles that a step jumps [1]", 30000, default=None)
    depth: Length | None = entry("largest depth worn in a step [mm]", "1 um", default=None)
    volume: Volume | None = entry(
        "volume worn in a step; per length in two dimensions [mm^3]", "0.01 mm^3", default=None
    )
    fraction: Annotated[float, Quantity("1", above=0.0, at_most=10.0)] | None = entry(
        "share of the stability limit, for explicit steps [1]", 0.9, default=None
    )

    @model_validator(mode="after")
    def _one_size(self) -> Step:
        sizes = [key for key in SIZES if getattr(self, key) is not None]
        if len(sizes) > 1:
            allowed = f"one of {', '.join(SIZES)}, or none"
            raise disagreement(f"{' and '.join(sizes)} given; allowed: {allowed}", *sizes[1:])
        if self.fraction is not None and self.kind != "explicit":
            raise disagreement(
                f"{self.kind} steps have no stability limit; allowed: fraction with explicit",
                *("fraction", "kind"),
            )
        if not sizes and self.kind == "explicit":
            raise disagreement(
                f"explicit steps without a size; allowed: one of {', '.join(SIZES)}", "kind"
            )
        return self

    @property
    def automatic(self) -> bool:
        """True if an error estimate chooses the size."""
        return all(getattr(self, key) is None for key in SIZES)


class StopSection(Section):
    """Limits that end the run before its cycles are over; the first is reached to within 0.1 %."""

    depth: Length | None = entry("largest depth of either body [mm]", "0.5 mm", default=None)
    volume: Volume | None = entry(
        "volume worn from both bodies; per length in two dimensions [mm^3]", "10 mm^3", default=None
    )


class Duration(Section):
    """Length, steps and tolerances of wear, for every wear law."""

    law: str  # first in every wear section; each law narrows it to its own name
    cycles: Cycles = entry("number of cycles of the whole run [1]", 3e5)
    step: Step = entry("size of a wear step", default=Step())
    tolerance: Annotated[float, Quantity("1", above=0.0, at_most=1.0)] = entry(
        "error of the depth that steps of no given size may cause, root mean square over the "
        "worn area, relative to the depth at the end [1]",
        "1 %",
        default=0.01,
    )
    depth_tolerance: Length | None = entry(
        "the same error in absolute terms, instead of tolerance [mm]", "0.05 um", default=None
    )
    motion: Literal["auto", "follow", "neglect"] = entry(
        "motion of the surfaces over each other within a cycle: auto follows it where it exceeds "
        "a tenth of the contact's width and the grid resolves it",
        "auto",
        default="auto",
    )
    stop: StopSection = entry("ends the run early", default=StopSection())

    @model_validator(mode="after")
    def _jumps_end(self) -> Duration:
        least = self.cycles / MOST_JUMPS
        if self.step.cycles is not None and self.step.cycles < least:
            raise disagreement(
                f"{self.step.cycles:g}: {self.cycles / self.step.cycles:.3g} jumps; "
                f"allowed: {least:g} cycles or more, which makes {MOST_JUMPS} jumps",
                "step.cycles",
                "cycles",
            )
        return self

    @property
    def step_size(self) -> str:
        """Size of a wear step, with the number of jumps where it is known beforehand."""
        step = self.step
        if step.cycles is not None:
            jumps = ceil(self.cycles / step.cycles)
            return f"{times(step.cycles)} cycles each: {jumps} jumps"
        if step.depth is not None:
            return f"{plain(step.depth, 'mm')} deep each"
        if step.volume is not None:
            return f"{step.volume:g} mm^3 each"
        if step.fraction is not None:
            return f"{shares(step.fraction)} of their stability limit each"
        if self.depth_tolerance is not None:
            return f"for an error of {plain(self.depth_tolerance, 'mm')}"
        return f"for an error of {shares(self.tolerance)} of the depth"


class Laws(Section):
    """Wear law of both bodies; a body may name another one."""

    law: LawName = entry("energy, energy_amplitude or archard; a body may name its own", "energy")
    reference_amplitude: Length | None = entry(
        "slip amplitude at which coefficients of energy_amplitude hold [mm]", "75 um", default=None
    )

    @model_validator(mode="before")
    @classmethod
    def _fill_in_laws(cls, data: Any) -> Any:
        """Give the law of this section to the bodies that do not name one."""
        if not isinstance(data, dict):
            return data
        law: Any = data.get("law")
        if law not in get_args(LawName):
            # This is pydantic's message for a section that is one of several kinds.
            context = {"discriminator": "law"}
            raise PydanticCustomError("union_tag_invalid", "{discriminator}", context)
        bodies = {name: data[name] for name in cls._names() if name in data}
        return data | with_laws(bodies, law, data.get("reference_amplitude"))

    @model_validator(mode="after")
    def _amplitude_is_needed(self) -> Laws:
        amplitudes = [
            body.reference_amplitude
            for body in (getattr(self, name) for name in self._names())
            if isinstance(body, WornByEnergyAmplitude)
        ]
        if None in amplitudes:
            field = type(self).model_fields["reference_amplitude"]
            raise disagreement(
                f"missing; allowed: {field.description}, such as 75 um", "reference_amplitude"
            )
        if self.reference_amplitude is not None and not amplitudes:
            raise disagreement(
                f"{self.reference_amplitude:g} mm: no body wears by energy_amplitude; "
                "allowed: leave it out",
                *("reference_amplitude", "law"),
            )
        return self

    @classmethod
    def _names(cls) -> list[str]:
        """Return the keys of the two bodies."""
        pairs = [pair for pair in (BladeAndDisk, TwoBodies) if issubclass(cls, pair)]
        return [name for pair in pairs for name in pair.model_fields]


class BodiesThatWear(Laws, Duration):
    """Wear laws of both bodies, and length of the run."""


class DovetailWear(BladeAndDisk[BodyWear], BodiesThatWear):
    """Wear laws of blade and disk, and length of the run."""


class WearSection(TwoBodies[BodyWear], BodiesThatWear):
    """Wear laws of two bodies, and length of the run."""


class NonlinearitySection(Section):
    """Geometric nonlinearity: its effect is small for stiff joints, and the check measures it."""

    stiffness: Literal["linear", "stress_stiffened", "relinearised"] = entry(
        "linear; stress_stiffened: with the stress and spin at peak load; relinearised: tangent "
        "to the nonlinear structure there",
        "linear",
        default="linear",
    )
    check: StrictBool = entry(
        "compare with a total Lagrangian model at peak load (takes two more condensations)",
        False,
        default=False,
    )

    @property
    def asked(self) -> tuple[str, ...]:
        """Keys of the entries that request more than a linear structure."""
        beyond = {"stiffness": self.stiffness != "linear", "check": self.check}
        return tuple(key for key, asks in beyond.items() if asks)

    def described(self) -> structure_model.Nonlinearity:
        """Return the settings as the model takes them."""
        from workflow.models import structure_model

        return structure_model.Nonlinearity(self.stiffness, self.check)


class Coupling(Section):
    """How often the loads are computed again with the worn surfaces."""

    resultants: Literal["constant", "drift", "every"] = entry(
        "constant: those of the unworn structure; drift: updated when wear has changed them "
        "enough; every: updated after every jump",
        "drift",
        default="drift",
    )
    drift: Ratio = entry(
        "change of resultants, or half the share of the load that wear moves over a face, after "
        "which drift updates them [1]",
        "2 %",
        default=0.02,
    )


class Life(Section):
    """Map of a fretting parameter over each contact face."""

    parameter: Literal["ruiz", "smith_watson_topper", "findley", "none"] = entry(
        "ruiz: friction work times tension; smith_watson_topper, findley: on the worst plane, "
        "tens of times slower; or none",
        "ruiz",
        default="ruiz",
    )
    depth: Length = entry(
        "critical distance below the surface, at which the map lies and the section begins [mm]",
        "20 um",
        default=0.02,
    )
    sensitivity: Annotated[float, Quantity("1", at_least=0.0, at_most=10.0)] = entry(
        "k of findley, the weight of the normal stress [1]", 0.3, default=0.3
    )


class ContactStress(Section):
    """Stress of both bodies under each contact face, unworn and worn."""

    section: Literal["x", "y", "none"] = entry(
        "plane at peak load: x, across the face; y, along it (not for line contacts); or none",
        "x",
        default="x",
    )
    at: Place = entry(
        "position of the plane on the other axis, from the middle [mm]", "0 mm", default=0.0
    )
    depth: Length = entry("depth of the plane [mm]", "2 mm", default=2.0)
    points: Annotated[int, Whole(2, MOST_POINTS)] = entry(
        "number of points over the depth, denser towards the surface", 24, default=24
    )
    life: Life = entry("fretting life: where cracks would start", default=Life())

    @model_validator(mode="after")
    def _section_has_depth(self) -> ContactStress:
        if self.depth <= self.life.depth:
            raise disagreement(
                f"{self.depth:g} mm: not below the critical distance; allowed: above life.depth, "
                f"{self.life.depth:g} mm",
                *("depth", "life.depth"),
            )
        return self

    def described(self) -> stress_settings.Stress:
        """Return the settings as the model takes them."""
        from workflow.models.stress import settings as stress_settings

        return stress_settings.Stress(
            section=self.section,
            at=self.at,
            depth=self.depth,
            points=self.points,
            parameter=self.life.parameter,
            critical_distance=self.life.depth,
            sensitivity=self.life.sensitivity,
        )
