"""Sections of vibration cases: resolution, continuation, loops, modes and further branches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import radians
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from workflow.analyses.rig.excitation import DrivingForce, Frequency
from workflow.case.fields import Ascending, Entry, Quantity, Whole
from workflow.case.sections import Section, disagreement, entry

MOST_ODD, HIGHEST = 100, 999
ODD = (1, 3, 5, 7, 9, 11, 13, 15)
Amplitude = Annotated[float, Quantity("mm", above=0.0, at_most=1e3)]
Step = Annotated[float, Quantity("1", at_least=1e-12, at_most=10.0)]


@dataclass(frozen=True)
class HarmonicNumbers(Entry):
    """A number of odd harmonics, counted from harmonic 1, or a list of harmonics."""

    @property
    def allowed(self) -> str:
        return (
            f"number of odd harmonics, 1 to {MOST_ODD}, or harmonics from 0 to {HIGHEST}, "
            "ascending, 1 among them, such as [1, 3, 5]"
        )

    def parse(self, value: object) -> tuple[int, ...]:
        if isinstance(value, list | tuple):
            if not all(type(number) is int and 0 <= number <= HIGHEST for number in value):
                raise self.refusal(value, "not all of them harmonics")
            if any(after <= before for before, after in pairwise(value)):
                raise self.refusal(value, "not ascending, or repeated")
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
    """Harmonics of the motion, and samples per period for the joint force."""

    harmonics: Annotated[Sequence[int], HarmonicNumbers()] = entry(
        "number of odd harmonics, or a list; the first ones if there is a tolerance; where the "
        "mean can move, as in contacts, 0 is added",
        8,
        default=ODD,
    )
    samples: Annotated[int, Whole(8, 65536)] = entry(
        "samples of a period, more than two for each period of the highest harmonic",
        256,
        default=256,
    )
    tolerance: Annotated[float, Quantity("1", at_least=1e-8, at_most=0.1)] | None = entry(
        "tolerance of the joint's vibration, for which harmonics and samples are raised; "
        "without it they stay [1]",
        "1 %",
        default=None,
    )

    @model_validator(mode="after")
    def _shows_the_highest(self) -> MotionResolution:
        highest = self.harmonics[-1]
        if self.samples <= 2 * highest:
            raise disagreement(
                f"{self.samples}: too few for harmonic {highest}; allowed: above {2 * highest}, "
                "better ten times the harmonic",
                *("samples", "harmonics"),
            )
        return self


class Continuation(Section):
    """Continuation of a curve of motions; steps are shares of the motion and of the frequency."""

    first_step: Step = entry("first step of a curve [1]", 0.02, default=0.02)
    shortest_step: Step = entry("step below which the curve ends [1]", 1e-6, default=1e-6)
    longest_step: Step = entry(
        "largest step; shorter ones draw a smoother curve [1]", 0.1, default=0.1
    )
    iterations: Annotated[int, Whole(1, 50)] = entry(
        "iterations of Newton's method per step that are aimed at: with more the step shrinks",
        4,
        default=4,
    )
    most_iterations: Annotated[int, Whole(1, 100)] = entry(
        "iterations after which a step is halved", 8, default=8
    )
    largest_angle: Annotated[
        float, Quantity("rad", above=0.0, at_most=1.6, range_text="above 0 to 90 deg")
    ] = entry("angle by which the curve may turn in a step [rad]", "30 deg", default=radians(30.0))
    most_points: Annotated[int, Whole(2, 1_000_000)] = entry(
        "number of points of one curve", 2000, default=2000
    )
    tolerance: Annotated[float, Quantity("1", at_least=1e-13, at_most=1e-3)] = entry(
        "tolerance of the balance of forces at every point [1]", 1e-10, default=1e-10
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

    frequency: Frequency = entry("frequency of the force [Hz]", "100 Hz")
    harmonics: Annotated[
        tuple[Annotated[Sequence[int], HarmonicNumbers()], ...], Field(max_length=10)
    ] = entry(
        "resolutions with which each loop is computed, the finest last, such as [5, 15] odd "
        "harmonics; none: that of the motion",
        [5, 15],
        default=(),
    )
    joints: Annotated[int, Whole(1, 1000)] | None = entry(
        "entry of structure.joints, counted from 1; without it all of them together, if they "
        "have one law",
        1,
        default=None,
    )

    @property
    def text(self) -> str:
        """Frequency, joints and resolution of the loops, for an outline."""
        highest = " and to ".join(str(harmonics[-1]) for harmonics in self.harmonics)
        of = "" if self.joints is None else f", of joint {self.joints}"
        return f"at {self.frequency:g} Hz{of}" + (f", harmonics to {highest}" if highest else "")

    @model_validator(mode="after")
    def _finer_and_finer(self) -> LoopsAt:
        if any(after[-1] <= before[-1] for before, after in pairwise(self.harmonics)):
            raise disagreement(
                "not increasing; allowed: each with a higher last harmonic than the one before",
                "harmonics",
            )
        return self


class NonlinearModes(Section):
    """Modes with joints, over their amplitude: no force or phase has to be chosen."""

    numbers: Annotated[tuple[Annotated[int, Whole(1, 1000)], ...], Field(min_length=1)] = entry(
        "numbers of the modes with joints as stiff as at rest, from the lowest, 1, on",
        [1],
        default=(1,),
    )
    amplitudes: Annotated[
        tuple[Amplitude, Amplitude], Ascending("the smallest, then the largest")
    ] = entry("smallest and largest amplitude of the reported point [mm]", ["0.1 um", "20 um"])

    @model_validator(mode="after")
    def _names_modes_once(self) -> NonlinearModes:
        if len(set(self.numbers)) < len(self.numbers):
            raise disagreement("a mode twice; allowed: each once", "numbers")
        return self

    @property
    def text(self) -> str:
        """Numbers and amplitudes of the modes, for an outline."""
        least, largest = (1e3 * amplitude for amplitude in self.amplitudes)
        modes = ", ".join(map(str, self.numbers))
        return f"{modes}, at amplitudes of {least:g} to {largest:g} µm"


class FurtherStart(Section):
    """A start of the search for a branch not reached from an end of the frequencies."""

    force: DrivingForce = entry("one of forces, or of the excitation's levels [N]", "40 N")
    frequency: Frequency = entry("frequency of motions that may be on the branch [Hz]", "200 Hz")
    amplitude: Amplitude = entry(
        "rough amplitude of the reported point in such a motion [mm]", "50 um"
    )
