"""State of wearing surfaces between two wear steps, and the result and cost of a step."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from operator import add, sub
from typing import Any, Generic, Self, TypeVar

import numpy as np

from sa_solver.types import Array
from wear.surfaces import Surfaces


@dataclass(frozen=True)
class Cost:
    """Cost of a computation: solved contact increments, convolutions and wear steps."""

    contact_solves: int = 0
    convolutions: int = 0
    steps: int = 0

    def __add__(self, other: Cost) -> Cost:
        return Cost(*map(add, astuple(self), astuple(other)))

    def __sub__(self, other: Cost) -> Cost:
        return Cost(*map(sub, astuple(self), astuple(other)))


@dataclass(frozen=True)
class WornState:
    """State of wearing surfaces between two steps.

    Steps may be accompanied by a second run whose steps are twice as long, the coarse companion.
    The difference of both runs estimates the error.

    Parameters
    ----------
    surfaces
        The worn surfaces.
    energy
        Energy that the contact has dissipated so far [N mm].
    depth_rate, volume_rate
        Largest depth [mm] of any body, and volume of both bodies [mm³], worn per cycle of the last
        step.
    next_cycles
        Length of the next step [cycles], where steps choose their own length.
    coarse
        State of the coarse companion. It is None before the first step, and in runs without a
        companion. A companion that has done the first half of its step stores here the state from
        which that step began.
    order
        Order of the error of the steps.
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
        """Return the state before the first cycle.

        Parameters
        ----------
        gap
            Gap of the unloaded bodies, by cell or node [mm].
        **further
            Fields that a subclass adds without a default.
        """
        return cls(Surfaces.unworn(gap), 0.0, 0.0, 0.0, np.inf, **further)

    @property
    def coarse_run(self) -> Self:
        """State from which the coarse companion takes its next step."""
        return self if self.coarse is None else self.coarse

    @property
    def half_way(self) -> bool:
        """True if the coarse companion has done only the first half of its step."""
        return self.coarse_run.coarse is not None

    @property
    def errors(self) -> tuple[Array, Array]:
        """Estimated errors of the depths of body 1 and body 2 [mm], by cell or node; 0 if unknown.

        For steps of order p the estimate is the difference to the coarse companion over 2^p - 1.
        """
        fine, coarse, share = self.surfaces, self.coarse_run.surfaces, 1.0 / (2.0**self.order - 1.0)
        error_1, error_2 = (
            share * (longer - shorter)
            for longer, shorter in zip(coarse.depths, fine.depths, strict=True)
        )
        return error_1, error_2


State = TypeVar("State", bound=WornState)


@dataclass(frozen=True)
class WearStep(Generic[State]):
    """Result of one or several steps: the ``state`` after them, their ``cycles`` and their cost."""

    state: State
    cycles: float
    cost: Cost
