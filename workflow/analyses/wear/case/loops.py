"""The section of a case that requests tangential loops on worn contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import model_validator

from workflow.case.fields import Quantity, Whole
from workflow.case.sections import Length, Section, disagreement, entry

if TYPE_CHECKING:
    from workflow.models.loops import TangentialLoops

LoopForce = Annotated[float, Quantity("N", above=0.0, at_most=1e9, range_text="above 0 to 1e6 kN")]


class Loops(Section):
    """Tangential loops during wear: kt, µ and energy against wear, as input of joint laws.

    There are none unless ``amplitude`` or ``force`` is given.
    """

    amplitude: Length | None = entry("amplitude of the motion [mm]", "5 um", default=None)
    force: LoopForce | None = entry(
        "amplitude of the force instead, below µP; per length in two dimensions [N]",
        "100 N",
        default=None,
    )
    axis: Literal["x", "y"] = entry(
        "axis of the contact's frame along which it moves", "x", default="x"
    )
    increments: Annotated[int, Whole(2, 1000)] = entry(
        "increments of each branch: more give a finer picture and hardly change the energy",
        12,
        default=12,
    )
    normal_force: LoopForce | None = entry(
        "normal force; without it that at peak load; per length in two dimensions [N]",
        "60 N",
        default=None,
    )
    every: Literal["jump", "end"] = entry(
        "jump: unworn and after every jump; end: unworn and at the end", "jump", default="jump"
    )

    @model_validator(mode="after")
    def _one_drive(self) -> Loops:
        if self.amplitude is not None and self.force is not None:
            raise disagreement(
                "amplitude and force given; allowed: one of them, or neither for no loops", "force"
            )
        return self

    @property
    def wanted(self) -> bool:
        """True if any loops are requested."""
        return self.amplitude is not None or self.force is not None

    def described(self) -> TangentialLoops | None:
        """Return the loops as the model takes them, or None if none are requested."""
        if not self.wanted:
            return None
        from workflow.models.loops import TangentialLoops

        return TangentialLoops(**self.model_dump())
