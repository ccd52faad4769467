"""How the parameters of a joint change with the energy that it has dissipated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from workflow.analyses import wear
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.case.evolution import PositiveEnergy, Table, TotalEnergy
from workflow.case.fields import Quantity
from workflow.case.loading import YAML, CaseFile
from workflow.case.sections import Section, at_entry, disagreement, entry

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual material.
Change = Annotated[float, Quantity("1", at_least=-1.0, at_most=1e6)]
PerEnergy = Annotated[
    float, Quantity("1/(N*mm)", at_least=0.0, at_most=1e12, range_text="0 to 1e15 1/J")
]
Slope = Annotated[
    float, Quantity("1/(N*mm)", at_least=-1e12, at_most=1e12, range_text="-1e15 to 1e15 1/J")
]
Final = Annotated[float, Quantity("1", at_least=0.0, at_most=1e6)]
Part = Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)]
WEAR_CASES = tuple(wear.ANALYSIS.cases.values())


class Logarithmic(Section):
    """Factor 1 + change ln(1 + rate E)."""

    kind: Literal["logarithmic"] = entry("1 + change ln(1 + rate E)", "logarithmic")
    change: Change = entry("change of the factor with the logarithm [1]", 0.26)
    rate: PerEnergy = entry("rate, multiplied by the energy [1/(N*mm)]", "1.3e9 1/J")


class Arrhenius(Section):
    """Factor 1 + change exp(-scale / E)."""

    kind: Literal["arrhenius"] = entry("1 + change exp(-scale / E)", "arrhenius")
    change: Change = entry("change of the factor in the end [1]", 1.32)
    scale: PositiveEnergy = entry("energy scale [N*mm]", "150 J")


class Linear(Section):
    """Factor 1 + slope E, at least 0."""

    kind: Literal["linear"] = entry("1 + slope E", "linear")
    slope: Slope = entry("rate against energy [1/(N*mm)]", "0.24 1/kJ")


class Exponential(Section):
    """Factor final + (1 - final) (share exp(-rate E) + (1 - share) exp(-second_rate E))."""

    kind: Literal["exponential"] = entry(
        "final + (1 - final) (share exp(-rate E) + (1 - share) exp(-second_rate E))",
        "exponential",
    )
    final: Final = entry("factor in the end [1]", 0.72)
    rate: PerEnergy = entry("rate of the first exponential [1/(N*mm)]", "0.3 1/kJ")
    share: Part = entry("share of the first exponential [1]", 0.8, default=1.0)
    second_rate: PerEnergy = entry(
        "rate of the second exponential [1/(N*mm)]", "5 1/kJ", default=0.0
    )


class FactorTable(Table):
    """A table of factors."""

    kind: Literal["table"] = entry("factors against energies", "table")
    energy: tuple[TotalEnergy, ...] = entry(
        "energy dissipated so far in the joint, ascending [N*mm]", ["0 J", "1 kJ"], default=(0.0,)
    )


Factor = Annotated[
    Logarithmic | Arrhenius | Linear | Exponential | FactorTable, Field(discriminator="kind")
]


def _unfit(worn: WearCase) -> str:
    """Return why a wear case cannot describe a joint, or an empty text if it can."""
    return (
        ""
        if worn.loops.wanted
        else "writes no table of loops; allowed: a case with loops.amplitude or force"
    )


class EvolutionSection(Section):
    """Factors of the joint's parameters against the energy E that it has dissipated so far."""

    friction: Factor | None = entry("evolution of joint.friction", default=None)
    stiffness: Factor | None = entry("evolution of joint.stiffness", default=None)
    residual_stiffness: Factor | None = entry("evolution of joint.residual_stiffness", default=None)
    normal_load: Factor | None = entry("evolution of joint.normal_load", default=None)
    file: Annotated[str, CaseFile((".csv", YAML), WEAR_CASES, "wear with loops", _unfit)] | None = (
        entry(
            "instead of friction and stiffness: loops_<interface>.csv of a wear run or measured "
            "kt (the whole stuck slope, joint.residual_stiffness included) and mu against "
            "energy; or the wear case itself, which is run first",
            "loops.csv",
            default=None,
        )
    )

    @model_validator(mode="after")
    def _file_stands_alone(self) -> EvolutionSection:
        for key in ("friction", "stiffness"):
            if self.file is not None and getattr(self, key) is not None:
                raise disagreement(f"given with {key}; allowed: one of them", "file", key)
        return self

    @model_validator(mode="after")
    def _file_is_of_a_whole_joint(self) -> EvolutionSection:
        if self.file is None or not self.file.endswith(".csv"):
            return self
        # Imported here to avoid a cycle: that module reads units, which belong to this package.
        from workflow.analyses.wear.output.loop_table import read_loop_table

        with at_entry("file"):
            table = read_loop_table(Path(self.file))
        if table.per_length:
            raise disagreement(
                "loops of a line contact, per mm; allowed: those of a whole joint", "file"
            )
        return self

    @property
    def text(self) -> str:
        """Short description of the parameters that change with the energy, and of the laws."""
        if self.file is not None:
            return f"friction and stiffness of {Path(self.file).name}"
        given = {name: getattr(self, name) for name in type(self).model_fields if name != "file"}
        reported = (
            f"{name.replace('_', ' ')} {f.kind}" for name, f in given.items() if f is not None
        )
        return ", ".join(reported) or "none"

    @property
    def is_empty(self) -> bool:
        """True if no parameter changes."""
        return all(getattr(self, name) is None for name in type(self).model_fields)
