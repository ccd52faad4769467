"""Coefficients that change with the dissipated energy, as sections of a case."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from wear.evolution import CoulombFriction, EnergyTable
from workflow.case.fields import Quantity
from workflow.case.sections import Friction, Section, disagreement, entry

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual material.
EnergyPerArea = Annotated[
    float, Quantity("N/mm", at_least=0.0, at_most=1e9, range_text="0 to 1e6 J/mm^2")
]
PositiveEnergy = Annotated[
    float, Quantity("N*mm", above=0.0, at_most=1e15, range_text="above 0 and at most 1e12 J")
]
TotalEnergy = Annotated[
    float, Quantity("N*mm", at_least=0.0, at_most=1e15, range_text="0 to 1e12 J")
]
Factor = Annotated[float, Quantity("1", at_least=0.0, at_most=1e6)]
TOTAL = entry(
    "energy dissipated so far in the contact, ascending [N*mm]", ["0 J", "1 kJ"], default=(0.0,)
)
LARGEST_FRICTION = 2.0  # as for the coefficient itself


class Table(Section):
    """A factor against cumulative energy: linear between points, constant beyond its ends."""

    energy: tuple[float, ...]  # each table narrows it to its own unit
    factor: tuple[Factor, ...] = entry(
        "factor of the coefficient at these energies; linear between, constant beyond [1]",
        [1.0, 0.3],
        default=(1.0,),
    )

    @model_validator(mode="after")
    def _is_a_table(self) -> Table:
        energies, factors = len(self.energy), len(self.factor)
        if not energies or energies != factors:
            raise disagreement(
                f"{factors} factors for {energies} energies; allowed: as many of both, one or more",
                *("factor", "energy"),
            )
        if any(after <= before for before, after in pairwise(self.energy)):
            raise disagreement("not ascending; allowed: each energy above the last", "energy")
        return self

    def described(self) -> EnergyTable:
        """Return the table as the wear laws take it."""
        return EnergyTable(self.energy, self.factor)


class _Scope(Section):
    scope: str  # first in the section; each evolution narrows it to its own name


class _WearEvolution(Table, _Scope):
    """A wear coefficient against energy, with the energy needed before wear starts."""

    threshold: float  # each scope narrows it to its own unit

    def described(self) -> EnergyTable:
        return replace(super().described(), threshold=self.threshold)


class LocalEvolution(_WearEvolution):
    """The coefficient at each place against the local energy per area of this body's surface."""

    scope: Literal["local"] = entry("local: by place; global: of the whole contact", "local")
    energy: tuple[EnergyPerArea, ...] = entry(
        "energy dissipated so far per area, ascending [N/mm]",
        ["0 J/mm^2", "10 J/mm^2"],
        default=(0.0,),
    )
    threshold: EnergyPerArea = entry(
        "energy per area below which nothing wears [N/mm]",
        "1 J/mm^2",
        default=0.0,
    )


class GlobalEvolution(_WearEvolution):
    """The coefficient against the energy of the whole contact."""

    scope: Literal["global"] = entry("local: by place; global: of the whole contact", "global")
    energy: tuple[TotalEnergy, ...] = TOTAL
    threshold: TotalEnergy = entry("energy below which nothing wears [N*mm]", "100 J", default=0.0)


Evolution = Annotated[LocalEvolution | GlobalEvolution, Field(discriminator="scope")]


class FrictionEvolution(Table):
    """The coefficient of friction against the energy of the whole contact."""

    energy: tuple[TotalEnergy, ...] = TOTAL


class EvolvingFriction(Friction):
    """Coulomb friction that wear may change."""

    evolution: FrictionEvolution | None = entry(
        "change of the coefficient with dissipated energy; without it none", default=None
    )

    @model_validator(mode="after")
    def _stays_in_range(self) -> EvolvingFriction:
        factors = (1.0,) if self.evolution is None else self.evolution.factor
        largest = self.coefficient * max(factors)
        if largest > LARGEST_FRICTION:
            raise disagreement(
                f"a coefficient of {largest:g}; allowed: up to {LARGEST_FRICTION:g}",
                *("evolution.factor", "coefficient"),
            )
        return self

    def described(self) -> CoulombFriction:
        """Return the friction as the model takes it."""
        evolution = None if self.evolution is None else self.evolution.described()
        return CoulombFriction(self.coefficient, evolution)

    def at(self, energy: float) -> float:
        """Return the coefficient after a contact has dissipated ``energy`` [N mm]."""
        return self.described().at(energy)
