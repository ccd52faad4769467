"""Vibration cases: a rig with a joint under a harmonic force, its steady motions by harmonics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from workflow.case.excitation import DrivingForce, Frequency, MassNumber
from workflow.case.fields import Entry, Quantity, Whole
from workflow.case.joint_sections import JointLaw
from workflow.case.rig_structure import Rig
from workflow.case.sections import (
    DottedPath,
    Expectation,
    Output,
    Scene,
    Section,
    Title,
    disagreement,
    entry,
)

MOST_ODD, HIGHEST = 100, 999
ODD = (1, 3, 5, 7, 9, 11, 13, 15)


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
            if not all(type(own) is int and 0 <= own <= HIGHEST for own in value):
                raise self.refusal(value, "not all of them harmonics")
            if any(after <= before for before, after in pairwise(value)) or 1 not in value:
                raise self.refusal(value, "not ascending from 0 or 1, each once")
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
        "how many odd ones, or a list of them; those to begin with if there is a tolerance",
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


class VibrationCase(Scene):
    """A rig with a joint under forces a sin(2π frequency t), for all frequencies of a span."""

    title: Title = entry("one line", "Forced response of a friction rig")
    analysis: Literal["vibration"] = entry("what is computed", "vibration")
    structure: Rig = entry("what holds the joint")
    joint: JointLaw = entry("its law and its parameters")
    forces: Annotated[tuple[DrivingForce, ...], Field(min_length=1, max_length=100)] = entry(
        "amplitudes, ascending, each followed through the frequencies [N]", ["10 N", "40 N"]
    )
    frequencies: tuple[Frequency, Frequency] = entry(
        "lower and upper end [Hz]", ["20 Hz", "400 Hz"]
    )
    mass: MassNumber = entry("that is driven, counted from the ground", 1, default=1)
    resolution: MotionResolution = entry("of a period", default=MotionResolution())
    output: Output = entry("files beside summary and results", default=Output())
    assumed: tuple[DottedPath, ...] = entry(
        "inputs that are ours because the source does not print them",
        ["structure.damping_ratio", "resolution"],
        default=(),
    )
    expect: tuple[Expectation, ...] = entry("values the run must reproduce", default=())

    @model_validator(mode="after")
    def _ascending(self) -> VibrationCase:
        if any(after <= before for before, after in pairwise(self.forces)):
            raise disagreement("not ascending; allowed: each force above the last", "forces")
        if self.frequencies[0] >= self.frequencies[1]:
            raise disagreement("not ascending; allowed: lower, then upper end", "frequencies")
        return self

    @model_validator(mode="after")
    def _drives_a_mass(self) -> VibrationCase:
        count = len(self.structure.masses)
        if self.mass > count:
            raise disagreement(f"{self.mass}: no such mass; allowed: 1 to {count}", "mass")
        return self

    @model_validator(mode="after")
    def _assumed_exist(self) -> VibrationCase:
        self.require_entries(self.assumed)
        return self

    def outline(self) -> list[tuple[str, str]]:
        """What would run, in a few rows of name and text."""
        structure, joint, own = self.structure, self.joint, self.resolution
        forces = ", ".join(f"{force:g}" for force in self.forces)
        low, high = self.frequencies
        resolution = f"{len(own.harmonics)} harmonics to {own.harmonics[-1]}, {own.samples} samples"
        if own.tolerance is not None:
            resolution += f", growing to a tolerance of {own.tolerance:g}"
        return [
            ("structure", f"{structure.text}, damping ratio {structure.damping_ratio:g}"),
            ("joint", f"{joint.law} under {joint.normal_load:g} N"),
            ("forces", f"{forces} N on mass {self.mass}, {low:g} to {high:g} Hz"),
            ("resolution", resolution),
        ]
