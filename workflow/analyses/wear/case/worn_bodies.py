"""Wear of one body as a case gives it: a section for every law."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from wear.laws import ArchardLaw, EnergyAmplitudeLaw, EnergyLaw, EvolvingLaw, WearLaw
from workflow.analyses.wear.case.evolution import Evolution
from workflow.case.fields import Quantity
from workflow.case.plain import alike, entries
from workflow.case.sections import Length, Section, entry

# Metals wear 1e2 to 1e6 um^3 per joule; a forgotten unit gives 1e16.
VolumePerEnergy = Annotated[
    float, Quantity("1/MPa", at_least=0.0, at_most=1e-3, range_text="0 to 1e9 um^3/J")
]

LawName = Literal["energy", "energy_amplitude", "archard"]


class Worn(Section):
    """What the wear of a body may have, whatever its law."""

    law: str  # named first; each law narrows it to its own name
    evolution: Evolution | None = entry(
        "of the coefficient with dissipated energy; without it none", default=None
    )

    def described(self) -> WearLaw:
        """As the wear steps take it."""
        law = self._base()
        if self.evolution is None:
            return law
        return EvolvingLaw(law, self.evolution.described(), self.evolution.scope)

    @abstractmethod
    def _base(self) -> WearLaw:
        """The law without its evolution."""


class EnergyBody(Section):
    """Wear of one body by dissipated energy."""

    coefficient: VolumePerEnergy = entry("volume per dissipated energy [1/MPa]", "1e4 um^3/J")


# A body that names no law has that of the section around it, which is filled in before it is read
# (wear_sections.BodiesThatWear): the defaults of ``law`` are never seen.


class WornByEnergy(Worn, EnergyBody):
    """Depth = coefficient x dissipated energy per area."""

    law: Literal["energy"] = entry("of this body; without it wear.law", "energy", default=None)

    def _base(self) -> WearLaw:
        return EnergyLaw(self.coefficient)


class WornByEnergyAmplitude(Worn, EnergyBody):
    """Energy law whose coefficient grows with the slip amplitude over a reference amplitude."""

    law: Literal["energy_amplitude"] = entry(
        "of this body; without it wear.law", "energy_amplitude", default=None
    )
    reference_amplitude: Length | None = entry(
        "at which the coefficient holds; without it wear.reference_amplitude [mm]",
        "75 um",
        default=None,
    )

    def _base(self) -> WearLaw:
        assert self.reference_amplitude is not None
        return EnergyAmplitudeLaw(self.coefficient, self.reference_amplitude)


class WornByArchard(Worn):
    """Depth = coefficient / hardness x pressure x slip."""

    law: Literal["archard"] = entry("of this body; without it wear.law", "archard", default=None)
    coefficient: Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)] = entry(
        "Archard's wear coefficient K [1]", 1e-4
    )
    hardness: Annotated[
        float, Quantity("MPa", above=0.0, at_most=1e5, range_text="above 0 and at most 100 GPa")
    ] = entry("of the worn body [MPa]", "3.5 GPa")

    def _base(self) -> WearLaw:
        return ArchardLaw(self.coefficient, self.hardness)


def wearing(bodies: Mapping[str, Worn]) -> list[tuple[str, str]]:
    """Rows of an outline with the law of each body, by name, and its coefficients."""
    texts = {}
    for name, body in bodies.items():
        changes = "" if body.evolution is None else ", changing with dissipated energy"
        texts[name] = f"{body.law}, {entries(body)}{changes}"
    return alike("wear law", texts)


class _LawMayBeLeftOut:
    """In the JSON schema a body without a law may suit more than one of them."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        json = handler(schema)
        return {"anyOf": json["oneOf"]}


BodyWear = Annotated[
    WornByEnergy | WornByEnergyAmplitude | WornByArchard,
    Field(discriminator="law"),
    _LawMayBeLeftOut(),
]


def with_laws(bodies: dict[str, object], law: str, amplitude: object) -> dict[str, object]:
    """The plain data of ``bodies``, each with what it leaves to the section around it."""
    filled: dict[str, object] = {}
    for name, body in bodies.items():
        if isinstance(body, dict):
            body = {"law": law} | body
            if body["law"] == "energy_amplitude" and amplitude is not None:
                body = {"reference_amplitude": amplitude} | body
        filled[name] = body
    return filled
