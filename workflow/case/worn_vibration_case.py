"""A vibration case whose contact wears: its forced response, computed anew as wear grows."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from workflow.case.excitation import DrivingForce, Frequency, MassNumber
from workflow.case.fields import File
from workflow.case.joint_sections import JenkinsJoint
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
from workflow.case.vibration_case import Continuation, MotionResolution, VibrationCase
from workflow.case.wear_sections import Cycles


class WornContact(Section):
    """The contact that is the rig's joint."""

    file: Annotated[str, File((".yaml",))] = entry(
        "a wear case of two bodies: form, materials, friction, normal force, grid and wear are "
        "taken from it; its stroke, cycles and stop are not",
        "specimens_wear.yaml",
    )


class WearByVibration(Section):
    """The force under which the contact wears, and the cycles after which responses are found."""

    force: DrivingForce = entry("amplitude [N]", "75 N")
    frequency: Frequency = entry("of the force [Hz]", "100 Hz")
    cycles: Annotated[tuple[Cycles, ...], Field(min_length=1, max_length=100)] = entry(
        "so many in all, ascending; before the first of them the contact is unworn [1]",
        [1e3, 1e5],
    )

    @model_validator(mode="after")
    def _ascending(self) -> WearByVibration:
        if any(after <= before for before, after in pairwise(self.cycles)):
            raise disagreement("not ascending; allowed: each number above the last", "cycles")
        return self


class WornVibrationCase(Scene):
    """A rig on a contact that it wears, and its response to forces a sin(2π frequency t)."""

    title: Title = entry("one line", "Forced response of a friction rig as it wears")
    analysis: Literal["vibration"] = entry("what is computed", "vibration")
    structure: Rig = entry("what holds the contact")
    contact: WornContact = entry("between the last mass and the ground")
    wear: WearByVibration = entry("how the contact wears")
    forces: Annotated[tuple[DrivingForce, ...], Field(min_length=1, max_length=100)] = entry(
        "amplitudes, ascending, each followed through the frequencies [N]", ["10 N", "40 N"]
    )
    frequencies: tuple[Frequency, Frequency] = entry(
        "lower and upper end [Hz]", ["20 Hz", "400 Hz"]
    )
    mass: MassNumber | None = entry(
        "that is driven, counted from the ground; without it the first", 1, default=None
    )
    resolution: MotionResolution = entry("of a period", default=MotionResolution())
    continuation: Continuation = entry("of each curve", default=Continuation())
    output: Output = entry("files beside summary and results", default=Output())
    assumed: tuple[DottedPath, ...] = entry(
        "inputs that are ours because the source does not print them",
        ["structure.damping_ratio", "resolution"],
        default=(),
    )
    expect: tuple[Expectation, ...] = entry("values the run must reproduce", default=())

    @model_validator(mode="after")
    def _ascending(self) -> WornVibrationCase:
        if any(after <= before for before, after in pairwise(self.forces)):
            raise disagreement("not ascending; allowed: each force above the last", "forces")
        if self.frequencies[0] >= self.frequencies[1]:
            raise disagreement("not ascending; allowed: lower, then upper end", "frequencies")
        return self

    @model_validator(mode="after")
    def _drives_a_mass(self) -> WornVibrationCase:
        count = len(self.structure.masses)
        if self.mass is not None and self.mass > count:
            raise disagreement(f"{self.mass}: no such mass; allowed: 1 to {count}", "mass")
        return self

    @model_validator(mode="after")
    def _assumed_exist(self) -> WornVibrationCase:
        self.require_entries(self.assumed)
        return self

    def with_joint(self, normal_load: float, friction: float, stiffness: float) -> VibrationCase:
        """The vibration case of one state of the contact, whose joint is described by these."""
        joint = JenkinsJoint(
            law="jenkins", normal_load=normal_load, friction=friction, stiffness=stiffness
        )
        shared = (
            *("title", "structure", "forces", "frequencies", "mass", "resolution"),
            *("continuation", "output"),
        )
        entries = {name: getattr(self, name) for name in shared}
        return VibrationCase(analysis="vibration", joint=joint, **entries)

    def outline(self) -> list[tuple[str, str]]:
        """What would run, in a few rows of name and text."""
        forces = ", ".join(f"{force:g}" for force in self.forces)
        low, high = self.frequencies
        wear, own = self.wear, self.resolution
        return [
            ("structure", f"{self.structure.text}, damping ratio {self.structure.damping_ratio:g}"),
            ("contact", f"that of {Path(self.contact.file).name}"),
            ("wear", f"{wear.cycles[-1]:g} cycles of {wear.force:g} N at {wear.frequency:g} Hz"),
            ("forces", f"{forces} N on mass {self.mass or 1}, {low:g} to {high:g} Hz"),
            ("resolution", f"{len(own.harmonics)} harmonics to {own.harmonics[-1]}"),
        ]
