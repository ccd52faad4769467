"""Load paths of two bodies: legs one after the other, or a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Generic, Self, TypeVar

import numpy as np
from pydantic import model_validator

from workflow.case.fields import File, Quantity, Whole
from workflow.case.files.table_file import read_columns
from workflow.case.sections import (
    Section,
    at_entry,
    disagreement,
    entry,
    one_of,
    quantities_of,
    sections_of,
)
from workflow.case.text.plain import between, plain
from workflow.models.uncoupled.load_table import LoadTable, conflict

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual contact.
NormalForce = Annotated[float, Quantity("N", at_least=0.0, at_most=1e9, range_text="0 to 1e6 kN")]
Force = Annotated[float, Quantity("N", at_least=-1e9, at_most=1e9, range_text="-1e6 kN to 1e6 kN")]
Moment = Annotated[
    float, Quantity("N*mm", at_least=-1e9, at_most=1e9, range_text="-1e6 N*m to 1e6 N*m")
]
NormalLineForce = Annotated[
    float, Quantity("N/mm", at_least=0.0, at_most=1e9, range_text="0 to 1e6 kN/mm")
]
LineForce = Annotated[
    float, Quantity("N/mm", at_least=-1e9, at_most=1e9, range_text="-1e6 kN/mm to 1e6 kN/mm")
]
LineMoment = Annotated[
    float, Quantity("N", at_least=-1e9, at_most=1e9, range_text="-1e6 kN to 1e6 kN")
]
Travel = Annotated[float, Quantity("mm", at_least=-1e3, at_most=1e3)]
Turn = Annotated[float, Quantity("rad", at_least=-1.0, at_most=1.0)]
BulkStress = Annotated[
    float, Quantity("MPa", at_least=-1e5, at_most=1e5, range_text="-100 GPa to 100 GPa")
]
Increments = Annotated[int, Whole(1, 100_000)]


class Leg(Section):
    """A part of the path, passed at equal steps; quantities that it does not name stay constant.

    Forces act on body 2. Motions are of body 1 relative to body 2, far from the contact.
    """

    P: NormalForce | None = entry("normal force [N]", "60 N", default=None)
    approach: Travel | None = entry("approach, instead of P [mm]", "13 um", default=None)
    Qx: Force | None = entry("tangential force along x [N]", "15 N", default=None)
    shift_x: Travel | None = entry("motion along x, instead of Qx [mm]", "5 um", default=None)
    Qy: Force | None = entry("tangential force along y [N]", "0 N", default=None)
    shift_y: Travel | None = entry("motion along y, instead of Qy [mm]", "0 um", default=None)
    Mx: Moment | None = entry("moment of the pressure about x [N*mm]", "0 N*mm", default=None)
    tilt_x: Turn | None = entry("rotation about x, instead of Mx [rad]", "0 deg", default=None)
    My: Moment | None = entry("moment of the pressure about y [N*mm]", "0 N*mm", default=None)
    tilt_y: Turn | None = entry("rotation about y, instead of My [rad]", "0 deg", default=None)
    Mz: Moment | None = entry("moment of the shear [N*mm]", "10 N*mm", default=None)
    twist: Turn | None = entry("rotation about z, instead of Mz [rad]", "0.01 deg", default=None)
    bulk_stress_1: BulkStress | None = entry(
        "bulk stress along x in body 1, which is held along y [MPa]", "100 MPa", default=None
    )
    bulk_stress_2: BulkStress | None = entry(
        "bulk stress along x in body 2, which is held along y [MPa]", "0 MPa", default=None
    )
    increments: Increments = entry("number of equal steps to the end of this leg", 1, default=1)


class LineLeg(Section):
    """A part of the path of a line contact; forces and moments are per length."""

    P: NormalLineForce | None = entry("normal force [N/mm]", "400 N/mm", default=None)
    approach: Travel | None = entry(
        "approach, instead of P; see contact.datum [mm]", "13 um", default=None
    )
    Qx: LineForce | None = entry("tangential force along x [N/mm]", "100 N/mm", default=None)
    shift_x: Travel | None = entry("motion along x, instead of Qx [mm]", "5 um", default=None)
    Qy: LineForce | None = entry("tangential force along y [N/mm]", "0 N/mm", default=None)
    shift_y: Travel | None = entry("motion along y, instead of Qy [mm]", "0 um", default=None)
    My: LineMoment | None = entry("moment of the pressure about y [N]", "0 N", default=None)
    tilt_y: Turn | None = entry("rotation about y, instead of My [rad]", "0 deg", default=None)
    bulk_stress_1: BulkStress | None = entry(
        "bulk stress along x in body 1, in plane strain [MPa]", "100 MPa", default=None
    )
    bulk_stress_2: BulkStress | None = entry(
        "bulk stress along x in body 2, in plane strain [MPa]", "0 MPa", default=None
    )
    increments: Increments = entry("number of equal steps to the end of this leg", 1, default=1)


HistoryFile = Annotated[str, File((".csv",))]
LegT = TypeVar("LegT", Leg, LineLeg)


class LegsOrFile(Section, Generic[LegT]):
    """Legs one after the other from the unloaded state, or a file."""

    # Whether the path returns to its beginning, as a cycle that repeats.
    closed: ClassVar[bool] = False
    in_schema: ClassVar[Mapping[str, Any]] = one_of("legs", "file")

    legs: tuple[LegT, ...] = entry("legs, one after the other, from no load", default=())
    file: HistoryFile | None = entry(
        "CSV instead of legs: a row per increment, columns named like the entries of a leg, "
        "base units",
        "history.csv",
        default=None,
    )

    @model_validator(mode="after")
    def _can_be_followed(self) -> Self:
        """Raise an error unless the path is given once, presses, and no two entries conflict."""
        if (self.file is None) == (not self.legs):
            problem = "both given" if self.legs else "neither given"
            raise disagreement(
                f"{problem}; allowed: either legs or file", "file" if self.legs else "legs"
            )
        with at_entry("file"):
            places = dict.fromkeys(self.table().columns, "file")
        for number, leg in reversed(list(enumerate(self.legs))):
            given = [key for key in places if getattr(leg, key) is not None]
            places |= {key: f"legs.{number}.{key}" for key in given}
        if wrong := conflict(places):
            key, message = wrong
            raise disagreement(message, places.get(key, "legs" if self.legs else "file"))
        return self

    def _quantities(self) -> dict[str, Quantity]:
        """Return the quantities of a leg, by name."""
        (leg,) = sections_of(type(self).model_fields["legs"].annotation)
        return quantities_of(leg)

    def table(self) -> LoadTable:
        """Return every increment of the path."""
        quantities = self._quantities()
        if self.file is not None:
            return LoadTable(read_columns(self.file, quantities))
        targets = {key: [getattr(leg, key) for leg in self.legs] for key in quantities}
        return LoadTable.legs(targets, [leg.increments for leg in self.legs], self.closed)

    def ranges(self) -> Iterator[str]:
        """Yield the range of values of each load, with 0 included."""
        units = {name: quantity.unit for name, quantity in self._quantities().items()}
        for name, values in self.table().columns.items():
            low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
            upwards = f"up to {plain(high, units[name])}"
            yield f"{name} {upwards if low == 0.0 else between(low, high, units[name])}"

    def place(self, row: int) -> str:
        """Return the entry of the case that sets the length of increment ``row``."""
        if self.file is not None:
            return "load_path.file"
        ends = np.cumsum([leg.increments for leg in self.legs])
        return f"load_path.legs.{np.searchsorted(ends, row, side='right')}.increments"


class ContactPath(LegsOrFile[Leg]):
    """Legs one after the other from the unloaded state, or a file."""


class LineContactPath(LegsOrFile[LineLeg]):
    """Legs one after the other from the unloaded state, or a file; forces are per length."""
