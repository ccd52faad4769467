"""95 % bands to first order, for results that are linear in normal parameters, from a few runs.

The parameters are normal numbers with the correlation C; the symmetric root of C makes them from
independent numbers. One run is at the middle; two runs for each independent number have it alone at
the ends of its 95 %. With g the derivatives by the parameters in deviations, the sum of the squares
of half the differences is 1.96² g C gᵀ, and its root is half the width of the band (the law of
propagation of uncertainty, JCGM 100:2008, 5.1.2 and 5.2.2).

Nonlinearity shows in pairs whose ends are not equally far from the middle. Along the steepest
direction this moves a side of the band by the same amount; across it, where the mean square of the
number counts, by 1/1.96² of it. That the effects of the numbers add up is checked with a last pair,
all numbers together; this pair does not detect several products that cancel there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array, Mask
from workflow.sweep.fitted import REACH

# Largest deviation of the ends of a pair from a line, relative to half the width of the band.
LINEAR = 0.1
# Relative width of a band below which it is rounding, of a number that no parameter changes.
ROUNDING = 1e-9


def positions(count: int) -> Array:
    """Return independent normal numbers ``(runs, count)`` of the runs for ``count`` parameters.

    Examples
    --------
    Two take seven runs, one of them three:

    >>> from workflow.sweep.first_order import positions
    >>> print(len(positions(1)), len(positions(2)))
    3 7
    >>> print((positions(2) / 1.959963984540054).round(3)[[0, 1, 2, 5]].tolist())
    [[0.0, 0.0], [1.0, 0.0], [-1.0, -0.0], [0.707, 0.707]]
    """
    directions = np.eye(count)
    if count > 1:
        directions = np.vstack([directions, np.full(count, count**-0.5)])
    pairs = np.stack([directions, -directions], axis=1).reshape(-1, count)
    return REACH * np.vstack([np.zeros(count), pairs])


@dataclass(frozen=True)
class FirstOrder:
    """Band of numbers ``(...)``: its ``middle``, ``half`` its width, and ``error`` of its sides."""

    middle: Array
    half: Array
    error: Array

    @property
    def linear(self) -> Mask:
        """Mask of the numbers that are linear enough."""
        return np.asarray(self.error <= np.maximum(LINEAR * self.half, self._still))

    @property
    def _still(self) -> Array:
        """Half width of a band below which no parameter changes the number."""
        return ROUNDING * np.abs(self.middle)

    @property
    def bent(self) -> float | None:
        """Error of one number over half the width of its band; None if the band has no width."""
        return float(self.error / self.half) if self.half > self._still else None

    def reported(self) -> dict[str, object] | None:
        """Return the band of one number with the error of its sides; None if it is not linear."""
        if not self.linear:
            return None
        middle, half = float(self.middle), float(self.half)
        return {"lower": middle - half, "upper": middle + half, "error": float(self.error)}


def sides(values: Array) -> Array:
    """Return lower side, middle and upper side ``(3, ...)`` of bands; NaN where not linear."""
    found = first_order(values)
    half = np.where(found.linear, found.half, np.nan)
    return np.stack([found.middle - half, found.middle, found.middle + half])


def first_order(values: Array) -> FirstOrder:
    """Return the bands of numbers ``(runs, ...)`` from the runs of :func:`positions`."""
    middle, ends = values[0], values[1:].reshape(-1, 2, *values.shape[1:])
    rising = 0.5 * (ends[:, 0] - ends[:, 1])
    bent = 0.5 * (ends[:, 0] + ends[:, 1]) - middle
    if len(rising) == 1:
        return FirstOrder(middle, np.abs(rising[0]), np.abs(bent[0]))
    alone, bends = rising[:-1], bent[:-1]
    half = np.sqrt(np.sum(alone**2, axis=0))
    # The sides of the band are at the ends of the steepest direction.
    steep = np.divide(alone, half, out=np.zeros_like(alone), where=half > 0.0) ** 2
    along = np.abs(np.sum(bends * steep, axis=0))
    across = np.sum(np.abs(bends) * (1.0 - steep), axis=0) / REACH**2
    together = np.abs(bent[-1] - bends.mean(axis=0))
    further = np.abs(rising[-1] - alone.sum(axis=0) / np.sqrt(len(alone)))
    return FirstOrder(middle, half, along + across + together + further)
