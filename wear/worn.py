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
    ``next_cycles`` how far a step that chooses its own length would go next. ``coarse`` is the
    state that steps of twice the length have led to, None before the first one and where none have
    been taken, and that of one that is half-way where both have begun its step; ``order`` that of
    the error of all these steps.
    """

    surfaces: Surfaces
    energy: float
    depth_rate: float
    volume_rate: float
    next_cycles: float
    coarse: Self | None = None
    order: float = 1.0

    @classmethod
    def unworn(cls, gap: Array, **further: Any) -> Self:
        """Before the first cycle, at the ``gap`` of the unloaded bodies, by cell or node [mm].

        ``further`` are the fields that a subclass adds and has no default for.
        """
        return cls(Surfaces.unworn(gap), 0.0, 0.0, 0.0, np.inf, **further)

    @property
    def companion(self) -> Self:
        """Where steps of twice the length go on from."""
        return self if self.coarse is None else self.coarse

    @property
    def half_way(self) -> bool:
        """Whether steps of twice the length are half-way through one: the next step ends it."""
        return self.companion.coarse is not None

    @property
    def errors(self) -> tuple[Array, Array]:
        """Estimated errors of the depth of body 1 and body 2 [mm], by cell or node: 0 if unknown.

        Those of a run by steps of order p are the difference to steps twice as long, over 2^p - 1.
        """
        fine, coarse, share = self.surfaces, self.companion.surfaces, 1.0 / (2.0**self.order - 1.0)
        error_1, error_2 = (
            share * (longer - shorter)
            for longer, shorter in zip(coarse.depths, fine.depths, strict=True)
        )
        return error_1, error_2


State = TypeVar("State", bound=WornState)


@dataclass(frozen=True)
class WearStep(Generic[State]):
    """A step, or several one after the other: ``state`` after it, ``cycles``, and what it took."""

    state: State
    cycles: float
    spent: Spent
