"""Excitations of a joint, or of the rig that holds it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from sa_solver.types import Array
from workflow.case.fields import Ascending, File, Quantity, Whole
from workflow.case.files.table_file import read_table_file
from workflow.case.sections import Length, Section, at_entry, disagreement, entry

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual rig.
Frequency = Annotated[float, Quantity("Hz", above=0.0, at_most=1e7)]
FrequencySpan = Annotated[tuple[Frequency, Frequency], Ascending("lower, then upper end")]
Time = Annotated[float, Quantity("s", above=0.0, at_most=1e5)]
DrivingForce = Annotated[
    float, Quantity("N", above=0.0, at_most=1e9, range_text="above 0 to 1e6 kN")
]
Change = Annotated[float, Quantity("1", above=0.0, at_most=0.1)]
MassNumber = Annotated[int, Whole(1, 20)]

# Factor on 1/duration. The spectrum of a half sine has its first zero at 1.5; this limit is far
# enough below it for an accurate quotient of the spectra.
SEEN = 1.4

# Columns of a recorded force.
RECORDED = {
    "time": Quantity("s", at_least=0.0, at_most=1e6),
    "force": Quantity("N", at_least=-1e9, at_most=1e9),
}


class PrescribedMotion(Section):
    """An alternating displacement imposed on the joint."""

    stroke: Length = entry("stroke of the joint, peak to peak [mm]", "14 um")
    frequency: Frequency = entry("frequency of the cycles [Hz]", "100 Hz")


class ForceOnMass(Section):
    """Entries that all excitations of a rig have."""

    kind: str  # named first; each narrows it to its own name
    mass: MassNumber | None = entry(
        "driven mass of a row, counted from the ground; without it the first", 1, default=None
    )


class Harmonic(ForceOnMass):
    """A force f sin(2π frequency t), until the response is periodic."""

    kind: Literal["harmonic"] = entry("harmonic, hammer or recorded", "harmonic")
    force: DrivingForce = entry("amplitude [N]", "75 N")
    frequency: Frequency = entry("frequency of the force [Hz]", "100 Hz")
    steady: Change = entry(
        "change of energy and stroke from one cycle to the next below which the state is "
        "steady [1]",
        1e-4,
        default=1e-4,
    )
    periods: Annotated[int, Whole(2, 100_000)] = entry(
        "number of cycles after which the search for a steady state ends", 2000, default=2000
    )


class Hammer(ForceOnMass):
    """A hammer blow: half a sine of force, and the response to it."""

    kind: Literal["hammer"] = entry("half a sine of force", "hammer")
    force: DrivingForce = entry("largest [N]", "100 N")
    duration: Time = entry("duration of the blow [s]", "0.4 ms")
    record: Time = entry("length of the record [s]", "1 s")
    band: FrequencySpan = entry(
        "band around the first mode, for its frequency and damping against amplitude [Hz]",
        ["20 Hz", "500 Hz"],
    )
    highest: Frequency = entry(
        "highest frequency of the frequency response [Hz]", "3 kHz", default=3000.0
    )

    @model_validator(mode="after")
    def _can_be_seen(self) -> Hammer:
        if self.record <= 2.0 * self.duration:
            raise disagreement(
                f"{self.record:g} s: ends with the blow; allowed: many times the duration",
                *("record", "duration"),
            )
        high = self.band[1]
        if self.highest > SEEN / self.duration:
            raise disagreement(
                f"{self.highest:g} Hz: a blow of {self.duration:g} s has no force at "
                f"1.5/duration; allowed: up to {SEEN / self.duration:g} Hz, or a shorter blow",
                *("highest", "duration"),
            )
        if high > self.highest:
            raise disagreement(f"up to {high:g} Hz; allowed: up to highest", "band", "highest")
        return self


class Recorded(ForceOnMass):
    """A force from a file."""

    kind: Literal["recorded"] = entry("a force from a file", "recorded")
    file: Annotated[str, File((".csv",))] = entry(
        "file with columns time and force, with a unit in brackets or in s and N; linear "
        "between rows",
        "force.csv",
    )

    @model_validator(mode="after")
    def _is_a_record(self) -> Recorded:
        with at_entry("file"):
            times, _ = self.read()
        if len(times) < 2 or not (times[1:] > times[:-1]).all():
            raise disagreement(
                "times that do not ascend; allowed: two or more ascending times", "file"
            )
        return self

    def read(self) -> tuple[Array, Array]:
        """Return times [s] and forces [N] ``(s,)`` of the file. Raises InputFileError."""
        table = read_table_file(self.file)
        table.require(RECORDED, " and ".join(RECORDED))
        times, forces = (table.column(name, quantity) for name, quantity in RECORDED.items())
        return times, forces


Excitation = Annotated[Harmonic | Hammer | Recorded, Field(discriminator="kind")]
