"""Force recorded over one period, and the exact harmonics of its piecewise linear signal.

Let f(τ) be the signal over the time τ in periods, from 0 to 1. Its slope jumps by Δs_j at its
samples, so that

    f(τ) = Re Σ w_k exp(2πikτ),   w_k = -2/(2πk)² Σ Δs_j exp(-2πikτ_j) for k > 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_models.dynamics.excitation import ExcitationError
from fe_models.dynamics.periodic.harmonics import ComplexArray
from sa_solver.types import Array

# Largest difference between the last and the first force of a record, over its range.
CLOSURE = 1e-6


@dataclass(frozen=True)
class PeriodicRecord:
    """Piecewise linear force over one period.

    Parameters
    ----------
    turns
        Times ``(s,)`` of the samples in periods, ascending from 0 to 1.
    force
        Samples ``(s,)`` [N]. The last one equals the first one.

    Raises
    ------
    ExcitationError
        If times do not ascend from 0 to 1, if the forces do not close, or if numbers are not
        finite.

    Examples
    --------
    The first harmonic of a triangle of height 1 is 8/π², and the third is a ninth of it:

    >>> import numpy as np
    >>> from fe_models.dynamics.periodic.record import PeriodicRecord
    >>> triangle = PeriodicRecord(np.linspace(0.0, 1.0, 5), np.array([0.0, 1.0, 0.0, -1.0, 0.0]))
    >>> print((np.abs(triangle.amplitudes(3)) * np.pi**2 / 8.0).round(6))
    [0.       1.       0.       0.111111]
    """

    turns: Array
    force: Array

    def __post_init__(self) -> None:
        turns, force = self.turns, self.force
        if not (len(turns) == len(force) >= 3 and np.isfinite(turns).all()):
            raise ExcitationError("a period needs three or more finite times, and as many forces")
        if turns[0] != 0.0 or turns[-1] != 1.0 or np.any(np.diff(turns) <= 0.0):
            raise ExcitationError(
                "the times of a period, in periods, do not ascend from 0 to 1: sort and scale them"
            )
        if not np.isfinite(force).all():
            raise ExcitationError("a recorded force is not a finite number: remove or correct it")
        if abs(force[-1] - force[0]) > CLOSURE * np.ptp(force):
            raise ExcitationError(
                "the recorded period does not end with the force that it begins with: record one "
                "full period"
            )

    def amplitudes(self, highest: int) -> ComplexArray:
        """Return w_k ``(k + 1,)`` [N] of harmonics 0 to ``highest``; w_0 is the mean."""
        orders = np.arange(1, highest + 1)
        turning = np.exp(-2j * np.pi * np.outer(orders, self.turns[:-1]))
        above = -2.0 / np.square(2.0 * np.pi * orders) * (turning @ self._slope_jumps)
        return np.concatenate([[self._mean], above])

    def left_out(self, highest: int) -> float:
        """Return the share of harmonics above ``highest`` in the root mean square without mean."""
        steps, swing = np.diff(self.turns), self.force - self._mean
        starts, ends = swing[:-1], swing[1:]
        square = float(steps @ (starts * starts + starts * ends + ends * ends)) / 3.0
        if square == 0.0:
            return 0.0
        kept = 0.5 * float(np.square(np.abs(self.amplitudes(highest)[1:])).sum())
        return float(np.sqrt(max(1.0 - kept / square, 0.0)))

    def value(self, turns: Array) -> Array:
        """Return the force [N] at any times ``turns`` in periods."""
        return np.asarray(np.interp(np.mod(turns, 1.0), self.turns, self.force))

    @cached_property
    def _mean(self) -> float:
        return float(np.diff(self.turns) @ (self.force[1:] + self.force[:-1])) / 2.0

    @cached_property
    def _slope_jumps(self) -> Array:
        """Change of the slope at every sample but the last ``(s - 1,)``."""
        # The last force is set to the first one exactly: a remaining difference would act as a jump
        # of the force.
        closed_force = np.append(self.force[:-1], self.force[0])
        slopes = np.diff(closed_force) / np.diff(self.turns)
        return np.asarray(slopes - np.roll(slopes, 1))
