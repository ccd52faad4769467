"""Vibration cases: a structure with joints under a harmonic force, its steady motions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import radians
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, StrictBool, model_validator

from workflow.analyses.rig.doubts import RIGID, about_modes
from workflow.analyses.rig.excitation import DrivingForce, Frequency, MassNumber
from workflow.analyses.rig.joint_sections import (
    ElasticJoint,
    FrictionContactJoint,
    VibrationLaw,
)
from workflow.analyses.rig.structure import (
    FrictionRig,
    ReducedBody,
    Rig,
    driven_place,
    refuse_missing_mass,
    structure_outline,
)
from workflow.case.fields import Entry, Quantity, Whole
from workflow.case.plain import entries, shares
from workflow.case.sections import Case, Section, Title, disagreement, entry
from workflow.case.source import Source

MOST_ODD, HIGHEST = 100, 999
ODD = (1, 3, 5, 7, 9, 11, 13, 15)
Step = Annotated[float, Quantity("1", at_least=1e-12, at_most=10.0)]


@dataclass(frozen=True)
class HarmonicNumbers(Entry):
    """How many odd harmonics from the first on, or the harmonics themselves: read as these."""

    @property
    def allowed(self) -> str:
        return (
            f"how many odd harmonics, 1 to {MOST_ODD}, or harmonics from 0 to {HIGHEST}, "
            "ascending, 1 among them, such as [1, 3, 5]"
        )

    def parse(self, value: object) -> tuple[int, ...]:
        if isinstance(value, list | tuple):
            if not all(type(number) is int and 0 <= number <= HIGHEST for number in value):
                raise self.refusal(value, "not all of them harmonics")
            if any(after <= before for before, after in pairwise(value)):
                raise self.refusal(value, "not ascending, each once")
            if 1 not in value:
                raise self.refusal(value, "without harmonic 1")
            return tuple(value)
        if type(value) is not int:
            raise self.refusal(value, "not harmonics")
        if not 1 <= value <= MOST_ODD:
            raise self.refusal(value, "out of range")
        return tuple(range(1, 2 * value, 2))

    def json_schema(self) -> dict[str, Any]:
        harmonic = {"type": "integer", "minimum": 0, "maximum": HIGHEST}
        number = {"type": "integer", "minimum": 1, "maximum": MOST_ODD}
        return {"anyOf": [number, {"type": "array", "items": harmonic, "minItems": 1}]}


class MotionResolution(Section):
    """Harmonics of the motion, and samples of a period in which the joint's force is found."""

    harmonics: Annotated[Sequence[int], HarmonicNumbers()] = entry(
        "how many odd ones, or a list; those to begin with if there is a tolerance; for contacts "
        "and what else moves the mean, 0 is added",
        8,
        default=ODD,
    )
    samples: Annotated[int, Whole(8, 65536)] = entry(
        "of a period, more than two for each period of the highest harmonic", 256, default=256
    )
    tolerance: Annotated[float, Quantity("1", at_least=1e-8, at_most=0.1)] | None = entry(
        "of the joint's vibration, to which harmonics and samples grow; without it they stay [1]",
        "1 %",
        default=None,
    )

    @model_validator(mode="after")
    def _shows_the_highest(self) -> MotionResolution:
        highest = self.harmonics[-1]
        if self.samples <= 2 * highest:
            raise disagreement(
                f"{self.samples}: too few for harmonic {highest}; allowed: above {2 * highest}, "
                "better ten times as many as the harmonic",
                *("samples", "harmonics"),
            )
        return self


class Continuation(Section):
    """How a curve of motions is followed: steps are shares of the motion and of the frequency."""

    first_step: Step = entry("with which a curve begins [1]", 0.02, default=0.02)
    shortest_step: Step = entry("at which the curve is given up [1]", 1e-6, default=1e-6)
    longest_step: Step = entry("shorter ones draw a smoother curve [1]", 0.1, default=0.1)
    iterations: Annotated[int, Whole(1, 50)] = entry(
        "of Newton's method that are wanted in a step: with more it shrinks", 4, default=4
    )
    most_iterations: Annotated[int, Whole(1, 100)] = entry(
        "after which a step is halved", 8, default=8
    )
    largest_angle: Annotated[
        float, Quantity("rad", above=0.0, at_most=1.6, range_text="above 0 to 90 deg")
    ] = entry("by which the curve may turn in a step [rad]", "30 deg", default=radians(30.0))
    most_points: Annotated[int, Whole(2, 1_000_000)] = entry("of one curve", 2000, default=2000)
    tolerance: Annotated[float, Quantity("1", at_least=1e-13, at_most=1e-3)] = entry(
        "of the balance of forces at every point [1]", 1e-10, default=1e-10
    )
    start: Literal["lower", "upper"] = entry(
        "end of the frequencies from which the curve is followed, lower or upper",
        "lower",
        default="lower",
    )

    @model_validator(mode="after")
    def _steps_ascend(self) -> Continuation:
        if not self.shortest_step <= self.first_step <= self.longest_step:
            raise disagreement(
                f"{self.first_step:g}: not between the shortest and the longest step; allowed: "
                f"{self.shortest_step:g} to {self.longest_step:g}",
                *("first_step", "shortest_step", "longest_step"),
            )
        return self


class LoopsAt(Section):
    """Loops of the joints at one frequency, under each force."""

    frequency: Frequency = entry("of the force [Hz]", "100 Hz")
    harmonics: Annotated[
        tuple[Annotated[Sequence[int], HarmonicNumbers()], ...], Field(max_length=10)
    ] = entry(
        "resolutions in which each loop is found, the finest last, such as [5, 15] odd harmonics; "
        "none: that of the motion",
        [5, 15],
        default=(),
    )

    @property
    def text(self) -> str:
        """Where they are found, and how finely."""
        highest = " and to ".join(str(harmonics[-1]) for harmonics in self.harmonics)
        return f"at {self.frequency:g} Hz" + (f", harmonics to {highest}" if highest else "")

    @model_validator(mode="after")
    def _finer_and_finer(self) -> LoopsAt:
        if any(after[-1] <= before[-1] for before, after in pairwise(self.harmonics)):
            raise disagreement(
                "not finer and finer; allowed: each with a higher last harmonic than the one "
                "before",
                "harmonics",
            )
        return self


class FurtherStart(Section):
    """Where a branch is looked for that does not come from an end of the frequencies."""

    force: DrivingForce = entry("one of forces [N]", "40 N")
    frequency: Frequency = entry("of motions that may be on it [Hz]", "200 Hz")
    amplitude: Annotated[float, Quantity("mm", above=0.0, at_most=1e3)] = entry(
        "of what is looked at in such a motion, roughly [mm]", "50 um"
    )


class VibrationCaseBase(Case):
    """A structure under forces a sin(2π frequency t), for all frequencies of a span."""

    title: Title = entry("one line", "Forced response of a friction rig")
    analysis: Literal["vibration"] = entry("what is computed", "vibration")
    structure: Rig | ReducedBody | FrictionRig = entry("what holds the joints")
    forces: Annotated[tuple[DrivingForce, ...], Field(min_length=1, max_length=100)] = entry(
        "amplitudes, ascending, each followed through the frequencies [N]", ["10 N", "40 N"]
    )
    frequencies: tuple[Frequency, Frequency] = entry(
        "lower and upper end [Hz]", ["20 Hz", "400 Hz"]
    )
    resolution: MotionResolution = entry("of a period", default=MotionResolution())
    continuation: Continuation = entry("of each curve", default=Continuation())

    @model_validator(mode="after")
    def _ascending(self) -> VibrationCaseBase:
        if any(after <= before for before, after in pairwise(self.forces)):
            raise disagreement("not ascending; allowed: each force above the last", "forces")
        if self.frequencies[0] >= self.frequencies[1]:
            raise disagreement("not ascending; allowed: lower, then upper end", "frequencies")
        return self

    @property
    def contacts(self) -> bool:
        """Whether joints are contacts, with a normal direction."""
        return False

    @property
    def moves_mean(self) -> bool:
        """Whether joints may move the mean of a vibration: contacts do."""
        return self.contacts

    @property
    def harmonics(self) -> tuple[int, ...]:
        """Those of the motion: what moves the mean needs harmonic 0 too."""
        return self.with_mean(self.resolution.harmonics)

    def with_mean(self, harmonics: Sequence[int]) -> tuple[int, ...]:
        """Harmonics, with 0 where joints may move the mean."""
        return tuple(sorted({0, *harmonics} if self.moves_mean else harmonics))

    def doubts(self) -> Iterator[str]:
        joint = getattr(self, "joint", None)
        # Nonlinear springs may take a mode anywhere above that without them.
        free = joint is None or isinstance(joint, ElasticJoint)
        stiffness = RIGID if free else getattr(joint, "stiffness", RIGID)
        yield from about_modes("frequencies", self.frequencies, self.structure, stiffness)

    @property
    def driving(self) -> str:
        """Forces, where they act, and their frequencies, for an outline."""
        forces = ", ".join(f"{force:g}" for force in self.forces)
        low, high = self.frequencies
        place = driven_place(self.structure, self._driven_mass)
        return f"{forces} N on {place}, at {low:g} to {high:g} Hz"

    @property
    def resolved(self) -> str:
        """How the motion is found, for an outline."""
        resolution, harmonics = self.resolution, self.harmonics
        text = f"harmonic balance, {len(harmonics)} harmonics to {harmonics[-1]}"
        text += f", {resolution.samples} samples"
        if resolution.tolerance is not None:
            text += f", growing to a tolerance of {shares(resolution.tolerance)}"
        return text

    @property
    def _driven_mass(self) -> int | None:
        """The number of the mass that is driven, as far as it is given."""
        return None


def wears(source: Source) -> bool:
    """Whether the joints of a vibration case wear: it has a section on that."""
    return any(source.at((section,)) is not None for section in ("wear", "contact"))


class DrivenMass(VibrationCaseBase):
    """The same of a structure that may be a row of masses, of which any is driven."""

    mass: MassNumber | None = entry(
        "of a row, that is driven, counted from the ground; without it the first", 1, default=None
    )

    @model_validator(mode="after")
    def _drives_a_mass(self) -> DrivenMass:
        otherwise = f"{self.structure.kind}; allowed: for a rig"
        refuse_missing_mass(self.structure, self.mass, "mass", otherwise)
        return self

    @property
    def _driven_mass(self) -> int | None:
        return self.mass


class VibrationCase(DrivenMass):
    """Steady vibration of a structure on friction joints that stay as they are."""

    about: ClassVar[str] = "the steady vibration of a rig with friction joints, over frequency"

    @classmethod
    def suits(cls, source: Source) -> bool:
        return not wears(source)

    structure: Annotated[Rig | ReducedBody | FrictionRig, Field(discriminator="kind")] = entry(
        "what holds the joints"
    )
    joint: VibrationLaw = entry("its law and its parameters; of all joints together")
    loops: LoopsAt | None = entry("of all joints together, at one frequency", default=None)
    force_sweeps: Annotated[tuple[Frequency, ...], Field(max_length=100)] = entry(
        "frequencies at which motions are followed along the force, from the least to the largest "
        "[Hz]",
        ["100 Hz"],
        default=(),
    )
    backbone: StrictBool = entry(
        "whether phase resonance, what is driven 90 degrees behind the force, is followed too",
        False,
        default=False,
    )

    further_branches: Annotated[tuple[FurtherStart, ...], Field(max_length=100)] = entry(
        "from where branches are looked for that no end of the frequencies leads to, as closed "
        "ones; none: nowhere",
        default=(),
    )
    stability: Literal["auto", "every", "none"] = entry(
        "of which motions it is found, and where it changes; auto: of every one in structures of "
        "up to 64 modes and 12 directions of joints, as with more one may take seconds",
        "every",
        default="auto",
    )

    @property
    def contacts(self) -> bool:
        return isinstance(self.joint, FrictionContactJoint)

    @property
    def moves_mean(self) -> bool:
        elastic = isinstance(self.joint, ElasticJoint) and self.joint.moves_mean
        return self.contacts or elastic

    def doubts(self) -> Iterator[str]:
        yield from super().doubts()
        elastic, harmonics = isinstance(self.joint, ElasticJoint), self.harmonics
        one_sided = elastic and self.moves_mean
        if one_sided and not any(number % 2 == 0 for number in harmonics if number > 0):
            yield (
                f"resolution.harmonics: without even ones, which a joint of law {self.joint.law} "
                "that is not alike on both sides has; list them, such as [0, 1, 2, 3, 4, 5]"
            )

    @model_validator(mode="after")
    def _joins_forces(self) -> VibrationCase:
        if (self.backbone or self.force_sweeps) and len(self.forces) < 2:
            raise disagreement(
                "a single force; allowed: two or more, between which motions are followed",
                *("forces", "backbone", "force_sweeps"),
            )
        return self

    @model_validator(mode="after")
    def _further_from_its_own(self) -> VibrationCase:
        low, high = self.frequencies
        for number, start in enumerate(self.further_branches):
            if start.force not in self.forces:
                allowed = ", ".join(f"{force:g}" for force in self.forces)
                raise disagreement(
                    f"{start.force:g} N: not among forces; allowed: {allowed} N",
                    f"further_branches.{number}.force",
                )
            if not low <= start.frequency <= high:
                raise disagreement(
                    f"{start.frequency:g} Hz: outside; allowed: within frequencies, {low:g} to "
                    f"{high:g} Hz",
                    f"further_branches.{number}.frequency",
                )
        return self

    @model_validator(mode="after")
    def _has_the_directions(self) -> VibrationCase:
        if self.contacts and isinstance(self.structure, Rig):
            raise disagreement(
                "friction_contact: has three directions; allowed: in a reduced structure or a "
                "friction_rig, or jenkins, which it is along one",
                "joint.law",
            )
        if isinstance(self.structure, FrictionRig):
            self._require_pad_contacts()
        return self

    def _require_pad_contacts(self) -> None:
        """Refuse joints that are not those of two pads."""
        joint = self.joint
        if not isinstance(joint, FrictionContactJoint):
            raise disagreement(
                f"{joint.law}: between two pads; allowed: friction_contact", "joint.law"
            )
        if joint.gap > 0.0:
            raise disagreement(
                f"{joint.gap:g} mm: given beside specimens; allowed: their own form, "
                "structure.form of their case",
                "joint.gap",
            )
        if joint.normal_load == 0.0:
            raise disagreement(
                "0 N: nothing presses the specimens together; allowed: above 0",
                "joint.normal_load",
            )

    @model_validator(mode="after")
    def _loops_inside(self) -> VibrationCase:
        low, high = self.frequencies
        if self.loops is not None and not low <= self.loops.frequency <= high:
            raise disagreement(
                f"{self.loops.frequency:g} Hz: outside; allowed: within frequencies, {low:g} to "
                f"{high:g} Hz",
                "loops.frequency",
            )
        return self

    def outline(self) -> list[tuple[str, str]]:
        structure, joint = self.structure, self.joint
        return [
            *structure_outline(structure),
            ("joint", f"{joint.law}, {entries(joint)}"),
            ("forces", self.driving),
            ("method", self.resolved),
            *([] if self.loops is None else [("loops", self.loops.text)]),
        ]
