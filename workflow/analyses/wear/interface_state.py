"""What an interface remembers between two jumps, and what its contact problems have taken."""

from __future__ import annotations

from dataclasses import dataclass

from sa_solver.types import Array, LoadHistory
from wear.stepping import WearState


@dataclass(frozen=True)
class InterfaceState(WearState):
    """What an interface must remember between two jumps.

    ``loads`` and nodal ``slip`` ``(t, 2, n)`` are those of the last structural solution; ``ends``
    ``(t, 2, 2)`` [mm] are where body 2 is before and after each increment, none where its motion is
    too little to follow (:func:`wear.moving.followed`).
    """

    loads: LoadHistory
    slip: Array
    ends: Array


@dataclass(frozen=True)
class Spent:
    """Contact problems of an increment solved, convolutions they took, and wear steps."""

    contact_solves: int = 0
    convolutions: int = 0
    steps: int = 0

    def __add__(self, other: Spent) -> Spent:
        return Spent(
            self.contact_solves + other.contact_solves,
            self.convolutions + other.convolutions,
            self.steps + other.steps,
        )
