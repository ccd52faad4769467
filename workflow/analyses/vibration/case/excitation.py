"""Excitations of a steady vibration, as a case gives them: forces, records, ground motions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from workflow.analyses.rig.excitation import DrivingForce
from workflow.analyses.rig.places import NAMED, Direction, Moved
from workflow.case.fields import Ascending, File, Quantity, Whole
from workflow.case.files.input_files import InputFileError
from workflow.case.files.table_file import read_table_file
from workflow.case.sections import Section, Title, disagreement, entry
from workflow.case.text.plain import counted, shares
from workflow.models.vibration.amount import FORCE, LEVEL, ExcitationSize

if TYPE_CHECKING:
    from fe_models.dynamics.periodic.record import PeriodicRecord

HIGHEST = 999
Level = Annotated[float, Quantity("1", above=0.0, at_most=1e9)]
Phase = Annotated[float, Quantity("rad", at_least=-6.3, at_most=6.3, range_text="-360 to 360 deg")]
Harmonic = Annotated[int, Whole(1, HIGHEST)]
# Columns of a record of one period. The phase is used in place of the time if it is there.
TIME, TURN = Quantity("s", at_least=-1e9, at_most=1e9), Quantity("rad", at_least=-1e3, at_most=1e3)
PULL = Quantity("N", at_least=-1e9, at_most=1e9)
TURNED = 2.0 * np.pi
# Largest deviation from a whole turn, due to rounding of a phase in degrees.
WHOLE_TURN = 1e-6
# Share of the largest harmonic of a record, below which a harmonic is rounding.
NOTHING = 1e-9


def amount_in(numbers: Mapping[str, Any]) -> tuple[ExcitationSize, float]:
    """Return the kind of factor, force or level, and its value, from numbers of a response."""
    amount = FORCE if FORCE.name in numbers else LEVEL
    return amount, float(numbers[amount.name])


def load_text(numbers: Mapping[str, Any]) -> str:
    """Return the force or level of a response, as text."""
    amount, number = amount_in(numbers)
    return amount.as_text(number)


def under_in(numbers: Mapping[str, Any]) -> str:
    """Return the text "under" or "at" the force or level of a response."""
    amount, number = amount_in(numbers)
    return amount.under(number)


class ForceAt(Moved):
    """A force a sin(2π k f t + phase) that points share evenly."""

    points: Title = entry(NAMED, "m1")
    direction: Direction = entry(
        "direction along which it acts: x, y, z, -x, -y or -z", "x", default="x"
    )
    amplitude: DrivingForce = entry("amplitude at level 1 [N]", "10 N")
    phase: Phase = entry("phase at t = 0 [rad]", "90 deg", default=0.0)
    harmonic: Harmonic = entry("harmonic k of the frequency", 1, default=1)

    @property
    def wave(self) -> complex:
        """Complex amplitude w of the force Re w exp(ikωt) [N]."""
        return complex(-1j * self.amplitude * np.exp(1j * self.phase))


class RecordAt(Moved):
    """A force that is recorded over one period."""

    points: Title = entry(NAMED, "m1")
    direction: Direction = entry(
        "direction along which it acts: x, y, z, -x, -y or -z", "x", default="x"
    )
    file: Annotated[str, File((".csv",))] = entry(
        "file with columns time or phase, and force, of one period at level 1; straight between "
        "rows, the last force equal to the first",
        "period.csv",
    )
    highest: Harmonic | None = entry(
        "highest harmonic used; without it the highest of resolution.harmonics",
        15,
        default=None,
    )

    @model_validator(mode="after")
    def _is_a_period(self) -> RecordAt:
        from fe_models.dynamics.excitation import ExcitationError

        try:
            self.read()
        except (InputFileError, ExcitationError) as error:
            raise disagreement(
                f"{error}; allowed: one period, its first force again at its end", "file"
            ) from error
        return self

    def read(self) -> PeriodicRecord:
        """Return the record of the file.

        Raises InputFileError, and ExcitationError if it is not one period.
        """
        from fe_models.dynamics.periodic.record import PeriodicRecord

        table = read_table_file(self.file)
        column, quantity = ("phase", TURN) if "phase" in table.names else ("time", TIME)
        table.require((column, "force"), "time and force, or phase and force")
        at, force = table.column(column, quantity), table.column("force", PULL)
        turns = at - at[0]
        if column == "phase":
            turns = turns / TURNED
            if abs(turns[-1] - 1.0) > WHOLE_TURN:
                raise InputFileError(
                    f"{table.place}: phase: from {np.degrees(at[0]):g} to {np.degrees(at[-1]):g} "
                    "deg; allowed: over 360 deg"
                )
        return PeriodicRecord(turns / turns[-1] if turns[-1] > 0.0 else turns, force)


class GroundMotion(Section):
    """Motion of everything that holds the structure, along one direction."""

    kind: str  # named first; each narrows it to its own name
    direction: Literal["x", "y", "z"] = entry("x, y or z", "x", default="x")
    phase: Phase = entry("phase at t = 0 [rad]", "0 deg", default=0.0)
    harmonic: Harmonic = entry("harmonic k of the frequency", 1, default=1)


class GroundDisplacement(GroundMotion):
    """Ground motion with the same displacement at every frequency."""

    kind: Literal["displacement"] = entry("displacement or acceleration", "displacement")
    amplitude: Annotated[float, Quantity("mm", above=0.0, at_most=1e3)] = entry(
        "amplitude at level 1 [mm]", "10 um"
    )


class GroundAcceleration(GroundMotion):
    """Ground motion with the same acceleration at every frequency."""

    kind: Literal["acceleration"] = entry("a given acceleration", "acceleration")
    amplitude: Annotated[float, Quantity("mm/s^2", above=0.0, at_most=1e9)] = entry(
        "amplitude at level 1 [mm/s^2]", "5 m/s^2"
    )


class VibrationExcitation(Section):
    """Forces, records and ground motions together, and the levels that multiply them."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("forces",)

    levels: Annotated[
        tuple[Level, ...], Field(min_length=1, max_length=100), Ascending("ascending levels")
    ] = entry(
        "factors of the whole excitation, ascending, each followed through the frequencies [1]",
        [1, 4],
        default=(1.0,),
    )
    forces: tuple[ForceAt, ...] = entry("sinusoidal forces at places", default=())
    records: tuple[RecordAt, ...] = entry("recorded forces of one period", default=())
    base: tuple[
        Annotated[GroundDisplacement | GroundAcceleration, Field(discriminator="kind")], ...
    ] = entry("motion of the ground, to which displacements are then relative", default=())

    @model_validator(mode="after")
    def _drives(self) -> VibrationExcitation:
        if not (self.forces or self.records or self.base):
            raise disagreement("nothing drives; allowed: forces, records or base", "forces")
        return self

    @property
    def moves_by_a_way(self) -> bool:
        """True if a ground displacement is given, whose forces change with the frequency."""
        return any(isinstance(motion, GroundDisplacement) for motion in self.base)

    def harmonics(self, highest: int) -> set[int]:
        """Return all harmonics of the excitation.

        Records count up to their own highest harmonic, or else the ``highest``.
        """
        every = {part.harmonic for part in (*self.forces, *self.base)}
        for record in self.records:
            every |= {order for order, _ in waves_of(record, highest)}
        return every

    def left_out(self, highest: int) -> list[float]:
        """Return, for each record, the share above its highest harmonic that is left out."""
        return [record.read().left_out(record.highest or highest) for record in self.records]

    def text(self, highest: int) -> str:
        """Return a short description, with records up to their own or the ``highest`` harmonic."""
        levels = ", ".join(f"{level:g}" for level in self.levels)
        kinds = (
            (self.forces, "force"),
            (self.records, "record"),
            (self.base, "ground motion"),
        )
        parts = [counted(len(those), thing) for those, thing in kinds if those]
        if self.records:
            most = max(self.left_out(highest))
            parts.append(f"{shares(most)} of a record above its highest harmonic")
        return f"{', '.join(parts)}, level{'s' if len(self.levels) > 1 else ''} {levels}"


def waves_of(record: RecordAt, highest: int) -> Iterator[tuple[int, complex]]:
    """Yield harmonics of a record and their w of Re w exp(ikωt) [N], without mere rounding."""
    amplitudes = record.read().amplitudes(record.highest or highest)
    most = float(np.abs(amplitudes).max())
    for order, amplitude in enumerate(amplitudes):
        if abs(amplitude) > NOTHING * most:
            yield order, complex(amplitude)
