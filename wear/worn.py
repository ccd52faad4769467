"""What wears, whatever it is: its surfaces between two steps, a step, and what that takes."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from operator import add, sub
from typing import Any, Generic, Self, TypeVar

import numpy as np

from sa_solver.types import Array
from wear.surfaces import Surfaces


@dataclass(frozen=True)
class Spent:
    """Contact problems of an increment solved, convolutions they took, and wear steps."""

    contact_solves: int = 0
    convolutions: int = 0
    steps: int = 0

    def __add__(self, other: Spent) -> Spent:
        return Spent(*map(add, astuple(self), astuple(other)))

    def __sub__(self, other: Spent) -> Spent:
        return Spent(*map(sub, astuple(self), astuple(other)))


@dataclass(frozen=True)
class WornState:
    """What wear must remember between two steps.

    ``energy`` is what the contact has dissipated so far [N mm]; ``depth_rate`` the largest depth
    [mm] and ``volume_rate`` the volume of both bodies [mm³] worn per cycle of the last step;
    ``next_cycles`` how far a step that chooses its own length would go next.
    """

    surfaces: Surfaces
    energy: float
    depth_rate: float
    volume_rate: float
    next_cycles: float

    @classmethod
    def unworn(cls, gap: Array, **further: Any) -> Self:
        """Before the first cycle, at the ``gap`` of the unloaded bodies, by cell or node [mm].

        ``further`` are the fields that a subclass adds and has no default for.
        """
        return cls(Surfaces.unworn(gap), 0.0, 0.0, 0.0, np.inf, **further)


State = TypeVar("State", bound=WornState)


@dataclass(frozen=True)
class WearStep(Generic[State]):
    """A step, or several one after the other: the ``state`` after it, its ``cycles``, what it took.

    ``error`` is what a step whose length is judged by itself may have got wrong, over what it
    wears; of several steps the largest.
    """

    state: State
    cycles: float
    spent: Spent
    error: float = 0.0
