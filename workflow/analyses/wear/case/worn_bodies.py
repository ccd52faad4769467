"""Wear of one body: a section of the case for every law."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from contextlib import suppress
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from wear.laws import ArchardLaw, EnergyAmplitudeLaw, EnergyLaw, EvolvingLaw, WearLaw
from workflow.analyses.wear.case.evolution import Evolution
from workflow.case import units
from workflow.case.fields import Quantity, shown
from workflow.case.sections import Length, Section, disagreement, entry
from workflow.case.text.plain import entries, merged_rows

# Metals wear 1e2 to 1e6 um^3 per joule; a forgotten unit gives 1e16.
VolumePerEnergy = Annotated[
    float, Quantity("1/MPa", at_least=0.0, at_most=1e-3, range_text="0 to 1e9 um^3/J")
]

ARCHARDS = "coefficient", "hardness", "specific_wear_rate"

LawName = Literal["energy", "energy_amplitude", "archard"]


class Worn(Section):
    """Wear of one body, whatever its law."""

    law: str  # first in the section; each law narrows it to its own name
    evolution: Evolution | None = entry(
        "change of the coefficient with dissipated energy; without it none", default=None
    )

    def described(self) -> WearLaw:
        """Return the wear law as the wear steps take it."""
        law = self._base()
        if self.evolution is None:
            return law
        return EvolvingLaw(law, self.evolution.described(), self.evolution.scope)

    @abstractmethod
    def rate(self, friction: float) -> float:
        """Return worn volume per load and sliding distance, without evolution [1/MPa]."""

    @abstractmethod
    def _base(self) -> WearLaw:
        """Return the law without its evolution."""


class EnergyBody(Section):
    """Wear of one body by dissipated energy."""

    refused: ClassVar[Mapping[str, str]] = {
        "specific_wear_rate": "belongs to archard; allowed: coefficient, which is that rate over "
        "the coefficient of friction, or law: archard",
        "hardness": "belongs to archard; allowed: coefficient alone, or law: archard",
    }

    coefficient: VolumePerEnergy = entry(
        "α = V / Ed, worn volume over dissipated energy: k / µ of archard's k = V / (P s) [1/MPa]",
        "1e4 um^3/J",
    )


# A body that names no law gets that of the section around it, before validation
# (:class:`workflow.analyses.wear.case.sections.Laws`); the defaults of ``law`` are never used.


class WornByEnergy(Worn, EnergyBody):
    """Depth = coefficient x dissipated energy per area."""

    law: Literal["energy"] = entry(
        "law of this body; without it wear.law",
        "energy",
        default=None,
    )

    def rate(self, friction: float) -> float:
        return self.coefficient * friction

    def _base(self) -> WearLaw:
        return EnergyLaw(self.coefficient)


class WornByEnergyAmplitude(Worn, EnergyBody):
    """Energy law whose coefficient grows with the slip amplitude over a reference amplitude."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("reference_amplitude",)

    law: Literal["energy_amplitude"] = entry(
        "law of this body; without it wear.law", "energy_amplitude", default=None
    )
    reference_amplitude: Length | None = entry(
        "amplitude at which the coefficient holds; without it wear.reference_amplitude [mm]",
        "75 um",
        default=None,
    )

    def rate(self, friction: float) -> float:
        return self.coefficient * friction

    def _base(self) -> WearLaw:
        assert self.reference_amplitude is not None
        return EnergyAmplitudeLaw(self.coefficient, self.reference_amplitude)


class WornByArchard(Worn):
    """Depth = k x pressure x slip, with k = K / H: give K and H, or k."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("coefficient", "hardness")

    law: Literal["archard"] = entry(
        "law of this body; without it wear.law", "archard", default=None
    )
    coefficient: Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)] | None = entry(
        "Archard's wear coefficient K = V H / (P s), given with hardness [1]", 1e-4, default=None
    )
    hardness: (
        Annotated[
            float, Quantity("MPa", above=0.0, at_most=1e5, range_text="above 0 and at most 100 GPa")
        ]
        | None
    ) = entry("hardness H of the worn body, given with coefficient [MPa]", "3.5 GPa", default=None)
    specific_wear_rate: (
        Annotated[
            float,
            Quantity("1/MPa", at_least=0.0, at_most=1e-3, range_text="0 to 1 mm^3/(N*m)"),
        ]
        | None
    ) = entry(
        "instead of coefficient and hardness: k = V / (P s) = K / H, worn volume over load and "
        "sliding distance [1/MPa]",
        "3e-5 mm^3/(N*m)",
        default=None,
    )

    @model_validator(mode="before")
    @classmethod
    def _is_no_rate(cls, data: Any) -> Any:
        """Refuse a specific wear rate k given as coefficient K, recognised by its dimension."""
        written = data.get("coefficient") if isinstance(data, dict) else None
        if isinstance(written, str):
            with suppress(units.UnitError, ArithmeticError):
                units.to_base(written, "1/MPa")
                raise disagreement(
                    f"{shown(written)}: volume over load and distance, not Archard's K; allowed: "
                    "as specific_wear_rate, without hardness",
                    "coefficient",
                )
        return data

    @model_validator(mode="after")
    def _given_once(self) -> WornByArchard:
        given = [key for key in ARCHARDS if getattr(self, key) is not None]
        if given in (["coefficient", "hardness"], ["specific_wear_rate"]):
            return self
        if "specific_wear_rate" in given:
            raise disagreement(
                f"given with {given[0]}; allowed: it alone, or coefficient and hardness",
                "specific_wear_rate",
            )
        key = next(key for key in ARCHARDS if key not in given)
        field = type(self).model_fields[key]
        (example,) = field.examples or ("",)
        raise disagreement(
            f"missing; allowed: {field.description}, such as {example}; or specific_wear_rate, "
            "which includes both",
            key,
        )

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        reference = handler(schema)
        given = [{"required": ["coefficient", "hardness"]}, {"required": ["specific_wear_rate"]}]
        handler.resolve_ref_schema(reference)["oneOf"] = given
        return reference

    def rate(self, friction: float) -> float:
        law = self._base()
        return law.coefficient / law.hardness

    def _base(self) -> ArchardLaw:
        if self.specific_wear_rate is not None:
            return ArchardLaw(self.specific_wear_rate, 1.0)  # k is K over a hardness of 1 MPa
        assert self.coefficient is not None
        assert self.hardness is not None
        return ArchardLaw(self.coefficient, self.hardness)


def wearing(bodies: Mapping[str, Worn]) -> list[tuple[str, str]]:
    """Return outline rows with the law and coefficients of each body, by name."""
    texts = {}
    for name, body in bodies.items():
        changes = "" if body.evolution is None else ", changing with dissipated energy"
        texts[name] = f"{body.law}, {entries(body)}{changes}"
    return merged_rows("wear law", texts)


class _LawMayBeLeftOut:
    """Schema change: a body without a law may match more than one law, so ``anyOf`` is used."""

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
    """Return the plain data of ``bodies``, with missing laws and amplitudes filled in."""
    filled: dict[str, object] = {}
    for name, body in bodies.items():
        if isinstance(body, dict):
            body = {"law": law} | body
            if body["law"] == "energy_amplitude" and amplitude is not None:
                body = {"reference_amplitude": amplitude} | body
        filled[name] = body
    return filled
