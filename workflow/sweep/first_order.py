"""95 % bands to first order, of what is linear in normal parameters: a few runs for a sample.

Parameters are normal numbers tied by their correlation C, of which the symmetric root makes
independent ones. Runs are their middle, and each independent number alone at the ends of its own
95 %. With g the derivatives by the parameters in deviations, the sum of the squares of half the
differences is 1.96² g C gᵀ, and its root half the width of the band (the law of propagation of
uncertainty, JCGM 100:2008, 5.1.2 and 5.2.2).

What is not linear shows: both ends of a pair are then not as far from the middle, which moves a
side by as much along the steepest way, and by 1/1.96² of that across it, where the number's mean
square counts. That it is the sum of what each number does alone is seen on a last pair, all numbers
together; of several products that cancel there it sees nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array, Mask
from workflow.sweep.fitted import REACH

# What the ends of a pair may lie beside a line, of half the width of the band.
LINEAR = 0.1
# Of the number itself: less is rounding, of one that no parameter changes.
ROUNDING = 1e-9


def positions(count: int) -> Array:
    """Independent normal numbers ``(runs, count)`` of the runs that so many parameters take.

    Examples
    --------
    Two take seven runs, one of them three:

    >>> from workflow.sweep.first_order import positions
    >>> print(len(positions(1)), len(positions(2)))
    3 7
    >>> print((positions(2) / 1.959963984540054).round(3)[[0, 1, 2, 5]].tolist())
    [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.707, 0.707]]
    """
    directions = np.eye(count)
    if count > 1:
        directions = np.vstack([directions, np.full(count, count**-0.5)])
    pairs = np.stack([directions, -directions], axis=1).reshape(-1, count)
    return REACH * np.vstack([np.zeros(count), pairs])


@dataclass(frozen=True)
class FirstOrder:
    """The band of numbers ``(...)``: its ``middle``, ``half`` its width, and how far it is off."""

    middle: Array
    half: Array
    error: Array

    @property
    def linear(self) -> Mask:
        """Which of the numbers are linear enough."""
        return np.asarray(self.error <= np.maximum(LINEAR * self.half, self._still))

    @property
    def _still(self) -> Array:
        """A band of no more is that of a number that no parameter changes."""
        return ROUNDING * np.abs(self.middle)

    @property
    def bent(self) -> float | None:
        """Of one number: its error over half the width of its band; None where that is none."""
        return float(self.error / self.half) if self.half > self._still else None

    def told(self) -> dict[str, object] | None:
        """Of one number: its band, and what its sides may be off; None where it is not linear."""
        if not self.linear:
            return None
        middle, half = float(self.middle), float(self.half)
        return {"lower": middle - half, "upper": middle + half, "error": float(self.error)}


def sides(values: Array) -> Array:
    """Lower side, middle and upper side ``(3, ...)`` of bands; NaN where they are not linear."""
    found = first_order(values)
    half = np.where(found.linear, found.half, np.nan)
    return np.stack([found.middle - half, found.middle, found.middle + half])


def first_order(values: Array) -> FirstOrder:
    """The bands of numbers ``(runs, ...)`` of the runs that :func:`positions` has."""
    middle, ends = values[0], values[1:].reshape(-1, 2, *values.shape[1:])
    rising = 0.5 * (ends[:, 0] - ends[:, 1])
    bent = 0.5 * (ends[:, 0] + ends[:, 1]) - middle
    if len(rising) == 1:
        return FirstOrder(middle, np.abs(rising[0]), np.abs(bent[0]))
    alone, bends = rising[:-1], bent[:-1]
    half = np.sqrt(np.sum(alone**2, axis=0))
    # Along the steepest way, on whose ends the sides of the band are.
    steep = np.divide(alone, half, out=np.zeros_like(alone), where=half > 0.0) ** 2
    along = np.abs(np.sum(bends * steep, axis=0))
    across = np.sum(np.abs(bends) * (1.0 - steep), axis=0) / REACH**2
    together = np.abs(bent[-1] - bends.mean(axis=0))
    further = np.abs(rising[-1] - alone.sum(axis=0) / np.sqrt(len(alone)))
    return FirstOrder(middle, half, along + across + together + further)
