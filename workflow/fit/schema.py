"""Schema of the file of a fit: measurements, free parameters, and the law."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field, model_validator

from workflow.analyses.rig.joint_evolution import Change, Final, Part, PerEnergy, Slope
from workflow.analyses.rig.joint_sections import (
    Coefficient,
    JointStiffness,
    Preload,
    ResidualStiffness,
)
from workflow.analyses.wear.case.evolution import PositiveEnergy
from workflow.case.fields import Entry, Quantity, Word
from workflow.case.loading import check_command, validated, word_at
from workflow.case.sections import Length, Section, Title, disagreement, entry
from workflow.case.source import Source, read_text
from workflow.fit.measurement import KIND, Heading, Measurement
from workflow.fit.profile_schema import ProfileFit

FREE: Literal["free"] = "free"
Free = Literal["free"]


@dataclass(frozen=True)
class FreeOr(Entry):
    """Word ``free``, or a quantity that is held fixed."""

    quantity: Quantity

    @property
    def allowed(self) -> str:
        return f"free, or a value to hold it at: {self.quantity.allowed}"

    def parse(self, value: object) -> Any:
        if value == FREE:
            return FREE
        if isinstance(value, str) and value.isalpha():
            raise self.refusal(value, "not known")
        return self.quantity.parse(value)

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [{"const": FREE}, *self.quantity.json_schema()["anyOf"]]}


def _or_free(annotated: Any) -> FreeOr:
    """Return the type of an entry that is either the annotated quantity or the word ``free``."""
    return FreeOr(get_args(annotated)[1])


FreeChange = Annotated[float | Free, _or_free(Change)]
FreeRate = Annotated[float | Free, _or_free(PerEnergy)]
FreeScale = Annotated[float | Free, _or_free(PositiveEnergy)]
FreeSlope = Annotated[float | Free, _or_free(Slope)]
FreeFinal = Annotated[float | Free, _or_free(Final)]
FreeShare = Annotated[float | Free, _or_free(Part)]

RESIDUAL = "slope when all slides"


# --- joints -------------------------------------------------------------------------------------


class JointHeadings(Section):
    """Headings of the columns of a file, where they differ from those of `fretscale loops`."""

    filled_in: ClassVar[bool] = False

    energy: Heading | None = entry("energy dissipated so far", "E", default=None)
    mu: Heading | None = entry("friction coefficient", "friction coefficient", default=None)
    kt: Heading | None = entry("stuck slope of the loop", "contact stiffness", default=None)
    residual_stiffness: Heading | None = entry(RESIDUAL, "macroslip slope", default=None)
    P: Heading | None = entry("normal load", "bolt preload", default=None)


class JointDeviations(Section):
    """Standard deviations of the measured values; if not given, estimated from the residuals."""

    filled_in: ClassVar[bool] = False

    mu: Annotated[float, Quantity("1", above=0.0)] | None = entry(
        "deviation of friction coefficients [1]", 0.01, default=None
    )
    kt: Annotated[float, Quantity("N/mm", above=0.0)] | None = entry(
        "deviation of stuck slopes [N/mm]", "1 N/um", default=None
    )
    residual_stiffness: Annotated[float, Quantity("N/mm", above=0.0)] | None = entry(
        "deviation of sliding slopes [N/mm]", "0.05 N/um", default=None
    )
    P: Annotated[float, Quantity("N", above=0.0)] | None = entry(
        "deviation of normal loads [N]", "5 N", default=None
    )


class JointMeasurement(Measurement):
    """Table of loops of a joint as it wore: energy, and mu, kt, residual_stiffness or P."""

    columns: JointHeadings = entry("other headings", default=JointHeadings())
    deviations: JointDeviations = entry(
        "one standard deviation; or columns such as mu_deviation", default=JointDeviations()
    )


class NewJoint(Section):
    """Joint before it has dissipated any energy."""

    normal_load: Annotated[float | Free, _or_free(Preload)] = entry(
        "normal load that presses the joint [N]", "free", default=FREE
    )
    friction: Annotated[float | Free, _or_free(Coefficient)] = entry(
        "limit of the friction force over the normal load [1]", "free", default=FREE
    )
    stiffness: Annotated[float | Free, _or_free(JointStiffness)] = entry(
        "stiffness of the stuck joint [N/mm]", "free", default=FREE
    )
    residual_stiffness: Annotated[float | Free, _or_free(ResidualStiffness)] = entry(
        f"{RESIDUAL} [N/mm]", "free", default=FREE
    )


class FreeLogarithmic(Section):
    """1 + change ln(1 + rate E)."""

    kind: Literal["logarithmic"] = entry("1 + change ln(1 + rate E)", "logarithmic")
    change: FreeChange = entry("change of the factor with the logarithm [1]", "free", default=FREE)
    rate: FreeRate = entry("rate, multiplied by the energy [1/(N*mm)]", "free", default=FREE)


class FreeArrhenius(Section):
    """1 + change exp(-scale / E)."""

    kind: Literal["arrhenius"] = entry("1 + change exp(-scale / E)", "arrhenius")
    change: FreeChange = entry("change of the factor in the end [1]", "free", default=FREE)
    scale: FreeScale = entry("energy scale [N*mm]", "free", default=FREE)


class FreeLinear(Section):
    """1 + slope E."""

    kind: Literal["linear"] = entry("1 + slope E", "linear")
    slope: FreeSlope = entry("rate against energy [1/(N*mm)]", "free", default=FREE)


class FreeExponential(Section):
    """final + (1 - final) (share exp(-rate E) + (1 - share) exp(-second_rate E))."""

    kind: Literal["exponential"] = entry(
        "final + (1 - final) (share exp(-rate E) + (1 - share) exp(-second_rate E))",
        "exponential",
    )
    final: FreeFinal = entry("factor in the end [1]", "free", default=FREE)
    rate: FreeRate = entry("rate of the first exponential [1/(N*mm)]", "free", default=FREE)
    share: FreeShare = entry(
        "share of the first exponential: 1, or free with second_rate [1]", 1.0, default=1.0
    )
    second_rate: FreeRate = entry("rate of the second exponential [1/(N*mm)]", 0.0, default=0.0)

    @model_validator(mode="after")
    def _two_exponentials_or_one(self) -> FreeExponential:
        if self.share == 1.0 and self.second_rate != 0.0:
            raise disagreement(
                "a second exponential with a share of 0; allowed: share: free, or below 1",
                *("share", "second_rate"),
            )
        return self


FreeFactor = Annotated[
    FreeLogarithmic | FreeArrhenius | FreeLinear | FreeExponential, Field(discriminator="kind")
]


class FreeEvolution(Section):
    """Factors of the joint's parameters against the energy E that it has dissipated so far."""

    friction: FreeFactor | None = entry("evolution of mu", default=None)
    stiffness: FreeFactor | None = entry("evolution of kt", default=None)
    residual_stiffness: FreeFactor | None = entry("evolution of residual_stiffness", default=None)
    normal_load: FreeFactor | None = entry("evolution of P", default=None)

    @model_validator(mode="after")
    def _of_something(self) -> FreeEvolution:
        if not self.given:
            names = ", ".join(type(self).model_fields)
            raise disagreement(f"nothing evolves; allowed: at least one of {names}")
        return self

    @property
    def given(self) -> dict[str, Section]:
        """Functions by the parameter that they describe."""
        sections = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: section for name, section in sections.items() if section is not None}


class JointFit(Section):
    """Evolution of a joint's parameters with the energy that it has dissipated."""

    title: Title = entry("one line", "Joint of the friction rig, test 1")
    fit: Literal["joint_evolution"] = entry(KIND, "joint_evolution")
    measurements: tuple[JointMeasurement, ...] = entry("tables", min_length=1)
    law: Literal["bouc_wen", "jenkins", "uniform_iwan", "four_parameter_iwan"] = entry(
        "bouc_wen: its stiffness is the whole kt; jenkins, uniform_iwan or four_parameter_iwan: "
        "kt less residual_stiffness",
        "bouc_wen",
    )
    joint: NewJoint = entry("initial values", default=NewJoint())
    evolution: FreeEvolution = entry(
        "functions of the energy E, each a factor of the initial value"
    )
    shared: tuple[Annotated[str, Word(("rate", "second_rate", "scale"))], ...] = entry(
        "parameters that have one value in all functions in which they are free",
        ["rate"],
        default=(),
    )

    @model_validator(mode="after")
    def _shared_are_free(self) -> JointFit:
        sections = self.evolution.given.values()
        for name in self.shared:
            if not any(getattr(section, name, None) == FREE for section in sections):
                raise disagreement(f"{name}: free in no function; allowed: one that is", "shared")
        return self


# --- wear ---------------------------------------------------------------------------------------


class WearHeadings(Section):
    """Headings of the columns of a file, where they differ from the names here."""

    energy: Heading | None = entry("energy dissipated in the test", "E", default=None)
    amplitude: Heading | None = entry(
        "amplitude of the slip: half the stroke", "delta", default=None
    )
    volume: Heading | None = entry("volume worn off both bodies", "wear", default=None)
    volume_1: Heading | None = entry("volume worn off body 1", "wear flat", default=None)
    volume_2: Heading | None = entry("volume worn off body 2", "wear ball", default=None)


Deviation = Annotated[float, Quantity("mm^3", above=0.0, range_text="above 0 um^3")]


class WearDeviations(Section):
    """Standard deviations of volumes; if not given, they are estimated from the residuals."""

    volume: Deviation | None = entry(
        "deviation of the volume of both bodies [mm^3]", "1e5 um^3", default=None
    )
    volume_1: Deviation | None = entry(
        "deviation of the volume of body 1 [mm^3]", "1e5 um^3", default=None
    )
    volume_2: Deviation | None = entry(
        "deviation of the volume of body 2 [mm^3]", "1e5 um^3", default=None
    )


class WearMeasurement(Measurement):
    """Volumes worn in tests: energy, and volume, or volume_1 and volume_2 of the bodies."""

    columns: WearHeadings = entry("other headings", default=WearHeadings())
    deviations: WearDeviations = entry(
        "one standard deviation; or columns such as volume_deviation", default=WearDeviations()
    )


class FreeWear(Section):
    """Law of the worn volume."""

    law: Literal["energy", "energy_amplitude", "amplitude_power"] = entry(
        "energy: V = α E; energy_amplitude: times amplitude over reference_amplitude; "
        "amplitude_power: times a power of that, which is fitted",
        "energy",
    )
    offset: Literal["none", "threshold", "intercept"] = entry(
        "none; threshold: energy before anything wears; intercept: volume at no energy, as of "
        "faster wear at first, which a case does not have",
        "none",
        default="none",
    )
    reference_amplitude: Length | None = entry(
        "amplitude at which α holds, for the laws with an amplitude [mm]", "11 um", default=None
    )

    @model_validator(mode="after")
    def _amplitude_has_a_reference(self) -> FreeWear:
        if (self.law == "energy") != (self.reference_amplitude is None):
            wrong = "not of law: energy" if self.law == "energy" else "missing, such as 11 um"
            raise disagreement(
                f"{wrong}; allowed: with energy_amplitude and amplitude_power",
                "reference_amplitude",
            )
        return self


class WearFit(Section):
    """Wear coefficients from volumes against dissipated energy."""

    title: Title = entry("one line", "Wear coefficient of the fretting tests")
    fit: Literal["wear_coefficient"] = entry(KIND, "wear_coefficient")
    measurements: tuple[WearMeasurement, ...] = entry("tables: a row for each test", min_length=1)
    wear: FreeWear = entry("law that the volumes follow")


# --- loops --------------------------------------------------------------------------------------


class LoopHeadings(Section):
    """Headings of the columns of a file, where they differ from those of `fretscale loops`."""

    displacement: Heading | None = entry(
        "displacement between the two sides", "LDV difference", default=None
    )
    force: Heading | None = entry("force that resists it", "load cell", default=None)
    time: Heading | None = entry("time, if samples are not evenly spaced", "t", default=None)
    normal_load: Heading | None = entry(
        "normal load that presses the joint", "preload", default=None
    )


class LoopMeasurement(Measurement):
    """Record of loops, of one stroke or of several."""

    columns: LoopHeadings = entry("other headings", default=LoopHeadings())


FreeCoefficient = Annotated[float | Free, _or_free(Coefficient)]
FreeStiffness = Annotated[float | Free, _or_free(JointStiffness)]
FreeResidual = Annotated[float | Free, _or_free(ResidualStiffness)]


class FreeJoint(Section):
    """Base of the joint laws, with the entries that all of them have."""

    law: str  # named first; each law narrows it to its own name
    normal_load: Annotated[float | Free, _or_free(Preload)] | None = entry(
        "normal load; without it that of the files [N]", "60 N", default=None
    )
    friction: FreeCoefficient = entry(
        "limit of the friction force over the normal load [1]", "free", default=FREE
    )
    stiffness: FreeStiffness = entry("stiffness of the stuck joint [N/mm]", "free", default=FREE)
    residual_stiffness: FreeResidual = entry(f"{RESIDUAL} [N/mm]", "free", default=FREE)


class FreeBoucWen(FreeJoint):
    """Bouc and Wen's law, normalised."""

    law: Literal["bouc_wen"] = entry(
        "bouc_wen, jenkins, uniform_iwan or four_parameter_iwan", "bouc_wen"
    )
    sigma: Annotated[float | Free, FreeOr(Quantity("1", at_least=0.5, at_most=1.0))] = entry(
        "shape of the unloading branch: straight at first with 0.5 [1]", 0.5, default=0.5
    )
    exponent: Annotated[float | Free, FreeOr(Quantity("1", at_least=1.0, at_most=100.0))] = entry(
        "sharpness of the transition from sticking to sliding [1]", "free", default=FREE
    )


class FreeJenkins(FreeJoint):
    """A spring with a slider, and the residual slope beside it."""

    law: Literal["jenkins"] = entry("a spring with a slider", "jenkins")


class FreeUniformIwan(FreeJoint):
    """Iwan's sliders, their limits spread evenly from nothing."""

    law: Literal["uniform_iwan"] = entry("sliders with limits spread evenly", "uniform_iwan")


class FreeFourParameterIwan(FreeJoint):
    """Segalman's Iwan joint."""

    law: Literal["four_parameter_iwan"] = entry("Segalman 2005", "four_parameter_iwan")
    chi: Annotated[float | Free, FreeOr(Quantity("1", above=-1.0, at_most=10.0))] = entry(
        "the energy of a small cycle is proportional to the amplitude to the power of chi + 3 [1]",
        "free",
        default=FREE,
    )
    beta: Annotated[float | Free, FreeOr(Quantity("1", at_least=0.0, at_most=1e3))] = entry(
        "stiffness lost at once in full slip, relative to that of the spread sliders [1]",
        "free",
        default=FREE,
    )


class LoopFitSection(Section):
    """Joint law from measured hysteresis loops."""

    title: Title = entry("one line", "Joint of the friction rig, as new")
    fit: Literal["joint_law"] = entry(KIND, "joint_law")
    measurements: tuple[LoopMeasurement, ...] = entry(
        "records; those of several strokes are fitted together", min_length=1
    )
    joint: Annotated[
        FreeBoucWen | FreeJenkins | FreeUniformIwan | FreeFourParameterIwan,
        Field(discriminator="law"),
    ] = entry("the law")


AnyFile = JointFit | LoopFitSection | WearFit | ProfileFit
KINDS: Mapping[str, type[AnyFile]] = {
    "joint_evolution": JointFit,
    "joint_law": LoopFitSection,
    "wear_coefficient": WearFit,
    "wear_profiles": ProfileFit,
}


@dataclass(frozen=True)
class FitInput:
    """File of a fit as read, with the places of its entries."""

    name: str
    file: AnyFile
    source: Source
    text: str


def load_fit(path: Path) -> FitInput:
    """Read the file of a fit; raise CaseError with a line ``file:line: key: ...`` per error."""
    return parse_fit(read_text(path), str(path))


def parse_fit(text: str, name: str) -> FitInput:
    """Return a fit from ``text``, as :func:`load_fit`; ``name`` stands for the file in messages."""
    source = Source(name, text)
    check_command(source, "fit")
    kind = KINDS[word_at(source, ("fit",), tuple(KINDS))]
    return FitInput(name, validated(source, kind), source, text)


def text_of(entries: Mapping[str, Any]) -> str:
    """Return entries given in Python as a text."""
    return json.dumps(entries)
