"""Friction of contact cases: Coulomb's law, with a coefficient that may depend on the place."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import model_validator

from sa_solver.types import Array
from workflow.case.fields import File, Quantity
from workflow.case.files.input_files import InputFileError, read_heights
from workflow.case.sections import Friction, Section, at_entry, disagreement, entry

if TYPE_CHECKING:
    # Checking a case needs no solver.
    from sa_solver.contact import FrictionFactor

Pressure = Annotated[float, Quantity("MPa", at_least=0.0, at_most=2e6)]
Factor = Annotated[float, Quantity("1", at_least=0.0, at_most=100.0)]


class FactorByPressure(Section):
    """A factor of the coefficient against pressure: linear between points, constant beyond."""

    pressure: tuple[Pressure, ...] = entry("pressures, ascending [MPa]", ["0 MPa", "1 GPa"])
    factor: tuple[Factor, ...] = entry("factors of the coefficient there [1]", [1.0, 0.6])

    @model_validator(mode="after")
    def _is_a_table(self) -> FactorByPressure:
        pressures, factors = len(self.pressure), len(self.factor)
        if not pressures or pressures != factors:
            raise disagreement(
                f"{factors} factors for {pressures} pressures; allowed: as many of both, one or "
                "more",
                *("factor", "pressure"),
            )
        if any(after <= before for before, after in pairwise(self.pressure)):
            raise disagreement("not ascending; allowed: each pressure above the last", "pressure")
        return self


class FrictionByPlace(Friction):
    """Coulomb friction, with a coefficient that may depend on the place and the pressure."""

    field: Annotated[str, File((".npy", ".csv", ".h5"))] | None = entry(
        "file with the factor of the coefficient in each cell; for .h5 add :dataset",
        "factors.npy",
        default=None,
    )
    by_pressure: FactorByPressure | None = entry(
        "factor of the coefficient by the local pressure; without it none", default=None
    )

    @property
    def varies(self) -> bool:
        """True if the coefficient depends on place or pressure."""
        return self.field is not None or self.by_pressure is not None

    def check_field(self, grid: tuple[int, int]) -> None:
        """Refuse a file of factors that are negative or not as many as the cells of ``grid``."""
        if self.field is None:
            return
        with at_entry("friction.field"):
            factors = read_heights(self.field)
            if factors.shape != grid:
                raise InputFileError(
                    f"{self.field}: {factors.shape[0]} x {factors.shape[1]} factors; allowed: one "
                    f"for each of the {grid[0]} x {grid[1]} cells of contact.grid"
                )
            if factors.min() < 0.0:
                raise InputFileError(
                    f"{self.field}: a factor of {factors.min():g}; allowed: 0 or more"
                )

    def factor(self) -> FrictionFactor | None:
        """Return the factor of the coefficient as a function of the pressure, None for 1."""
        if not self.varies:
            return None
        by_place = 1.0 if self.field is None else read_heights(self.field)
        table = self.by_pressure

        def factor(pressure: Array) -> Array:
            if table is None:
                return by_place * np.ones_like(pressure)
            return by_place * np.interp(pressure, table.pressure, table.factor)

        return factor

    @property
    def text(self) -> str:
        """Short description."""
        if not self.coefficient:
            return "none"
        parts = [f"{self.coefficient:g}"]
        if self.field is not None:
            parts.append(f"times the factors in {self.field.rpartition('/')[2]}")
        if self.by_pressure is not None:
            parts.append("times a factor that depends on pressure")
        return " ".join(parts)
