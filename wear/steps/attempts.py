"""Attempts at a wear step whose length is too uncertain to be right at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic

import numpy as np

from wear.worn import Cost, State, WearStep

SHORTEST = 0.01
"""Length, over the explicit limit, below which a step is not repeated: its error then has another
cause than its length.
"""


@dataclass(frozen=True)
class Trial(Generic[State]):
    """A step that was tried, and whether its error ``fits``.

    If not, it is repeated with the ``shorter`` length; steps of the ``shortest`` length are
    accepted in any case [cycles].
    """

    step: WearStep[State]
    fits: bool
    shorter: float
    shortest: float


def accepted_step(attempt: Callable[[float], Trial[State]], cycles: float) -> WearStep[State]:
    """Repeat a step until its error fits, starting with ``cycles``, and add up the cost."""
    cost = Cost()
    while True:
        trial = attempt(cycles)
        cost += trial.step.cost
        if trial.fits or cycles <= trial.shortest:
            return replace(trial.step, cost=replace(cost, steps=trial.step.cost.steps))
        cycles = max(trial.shorter, trial.shortest)


def shortest_step(stable: float) -> float:
    """Return the length of a step that is not repeated [cycles].

    It is 0 while nothing wears and any length is stable, as before an energy threshold.
    """
    return SHORTEST * stable if np.isfinite(stable) else 0.0
