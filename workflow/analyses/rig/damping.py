"""Damping of a rig without its joints, as a case gives it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from workflow.analyses.rig.places import NAMED, Against, Direction
from workflow.case.fields import Ascending, Quantity, ScalarOrList
from workflow.case.sections import Section, Title, disagreement, entry
from workflow.case.text.plain import counted, shares

# Limits are wide: they catch a forgotten unit or a slipped exponent, not an unusual rig.
DampingRatio = Annotated[float, Quantity("1", at_least=0.0, below=1.0)]
DampingRatios = Annotated[
    tuple[DampingRatio, ...], ScalarOrList(), Field(min_length=1, max_length=999)
]
OF_MODES = (
    "damping ratio of every mode; or a list from the lowest mode on, rigid motions included, "
    "whose last value holds for all further modes [1]"
)
AnyRatio = Annotated[float, Quantity("1", at_least=0.0, at_most=10.0)]
ModeFrequency = Annotated[float, Quantity("Hz", above=0.0, at_most=1e7)]


class RayleighFactors(Section):
    """Damping in proportion to mass and stiffness."""

    kind: Literal["factors"] = entry("factors or ratios", "factors")
    mass_factor: Annotated[float, Quantity("1/s", at_least=0.0, at_most=1e8)] = entry(
        "factor of the mass [1/s]", "2 1/s"
    )
    stiffness_factor: Annotated[float, Quantity("s", at_least=0.0, at_most=1e3)] = entry(
        "factor of the stiffness [s]", "5 us"
    )

    @property
    def factors(self) -> tuple[float, float]:
        """Rayleigh factors of mass [1/s] and stiffness [s]."""
        return self.mass_factor, self.stiffness_factor


class RayleighRatios(Section):
    """Damping in proportion to mass and stiffness, given by two damping ratios."""

    kind: Literal["ratios"] = entry("two damping ratios", "ratios")
    frequencies: Annotated[tuple[ModeFrequency, ModeFrequency], Ascending("lower, then upper")] = (
        entry("frequencies at which damping is known, ascending [Hz]", ["40 Hz", "200 Hz"])
    )
    ratios: tuple[AnyRatio, AnyRatio] = entry(
        "damping ratios at these frequencies [1]", ["0.5 %", "1 %"]
    )

    @model_validator(mode="after")
    def _damps_everywhere(self) -> RayleighRatios:
        (low, high), (first, second) = self.frequencies, self.ratios
        if not low / high * first <= second <= high / low * first:
            raise disagreement(
                f"{first:g} and {second:g}: one factor would be below zero and feed energy into "
                f"other modes; allowed: the second from {low / high:.3g} to {high / low:.3g} "
                "times the first",
                *("ratios", "frequencies"),
            )
        return self

    @property
    def factors(self) -> tuple[float, float]:
        """Rayleigh factors of mass [1/s] and stiffness [s]."""
        from fe_models.dynamics.damping import rayleigh_factors

        mass, stiffness = rayleigh_factors(np.array(self.frequencies), np.array(self.ratios))
        # At the bounds that the validator allows, rounding can make a factor slightly negative.
        return max(mass, 0.0), max(stiffness, 0.0)


class Dashpot(Against):
    """A dashpot that points share evenly."""

    points: Title = entry(NAMED, "m1")
    against: Title | None = entry(
        "other points, as many, or one for all; without it the ground", "m2", default=None
    )
    direction: Direction = entry(
        "direction along which it acts: x, y, z, -x, -y or -z", "x", default="x"
    )
    coefficient: Annotated[float, Quantity("N*s/mm", at_least=0.0, at_most=1e9)] = entry(
        "force over velocity, of all dashpots together [N*s/mm]", "20 N*s/m"
    )


class Damping(Section):
    """Damping of the structure without its joints, in addition to the modal damping."""

    rayleigh: Annotated[RayleighFactors | RayleighRatios, Field(discriminator="kind")] | None = (
        entry("damping in proportion to mass and stiffness", default=None)
    )
    loss_factor: Annotated[float, Quantity("1", at_least=0.0, at_most=2.0)] = entry(
        "structural damping: imaginary over real part of the stiffness; in steady vibration only "
        "[1]",
        0,
        default=0.0,
    )
    dashpots: tuple[Dashpot, ...] = entry("dashpots between points, or to the ground", default=())

    @property
    def parts(self) -> Iterator[str]:
        """Short description of each kind of damping that is given."""
        if self.rayleigh is not None:
            mass, stiffness = self.rayleigh.factors
            yield f"Rayleigh {mass:.4g} 1/s and {stiffness:.4g} s"
        if self.loss_factor:
            yield f"loss factor {shares(self.loss_factor)}"
        if self.dashpots:
            yield counted(len(self.dashpots), "dashpot")


def damping_text(ratios: Sequence[float], more: Damping | None) -> str:
    """Return a short description of all damping of a rig."""
    of_modes = ", ".join(shares(ratio) for ratio in ratios)
    plural = "s" if len(ratios) > 1 else ""
    return ", ".join([f"damping ratio{plural} {of_modes}", *(more.parts if more else ())])
