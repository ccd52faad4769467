"""Legs of the load path of a user's mesh, and mixes of cycles."""

from __future__ import annotations

from typing import Annotated

from pydantic import model_validator

from workflow.analyses.wear.case.sections import Share, check_shares
from workflow.analyses.wear.structures.mesh.load import Factor
from workflow.case.fields import Auto, OrAuto, Whole
from workflow.case.sections import Section, disagreement, entry


class CycleOfMix(Section):
    """One of several cycles, with a factor on every load."""

    share: Share = entry("share of all cycles; the shares add up to 1 [1]", "100 %")
    factors: tuple[Factor, ...] = entry(
        "factor of every load, in the order of structure.loads; of the speed for a rotation [1]",
        [1.0],
    )


class Legs(Section):
    """Load path in which every load varies linearly along each leg; the last legs are one cycle."""

    increments: Annotated[tuple[Annotated[int, Whole(1, 10_000)], ...] | Auto, OrAuto()] = entry(
        "increments of each leg; auto: as many as wear.tolerance needs", [8, 14]
    )
    cycle_from: Annotated[int, Whole(1, 1000)] = entry(
        "first leg of the cycle; the legs before it run once", 1, default=1
    )
    peak_leg: Annotated[int, Whole(1, 1000)] = entry(
        "leg of the cycle that ends at peak load, at which stress is shown", 1, default=1
    )
    mix: tuple[CycleOfMix, ...] = entry(
        "cycles that alternate, all on these legs, the one to show first; without it there is one",
        default=(),
    )

    @model_validator(mode="after")
    def _are_some(self) -> Legs:
        if not self.increments:
            raise disagreement("none; allowed: one or more", "increments")
        if self.mix:
            check_shares([cycle.share for cycle in self.mix])
        return self

    @property
    def legs(self) -> tuple[int, ...]:
        """Increments of all legs, which must be chosen by then."""
        assert isinstance(self.increments, tuple)
        return self.increments

    def mixed(self, loads: int) -> list[tuple[tuple[float, ...], float]]:
        """Return the factors of all ``loads`` and the share of every cycle."""
        return [(cycle.factors, cycle.share) for cycle in self.mix] or [((1.0,) * loads, 1.0)]
