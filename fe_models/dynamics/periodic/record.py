"""A force that is recorded over one period, and its harmonics: exactly, of straight lines between.

The slope of such a signal f(τ), τ in turns from 0 to 1, jumps by Δs_j at its rows, so that

    f(τ) = Re Σ w_k exp(2πikτ),   w_k = -2/(2πk)² Σ Δs_j exp(-2πikτ_j) for k > 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_models.dynamics.excitation import ExcitationError
from fe_models.dynamics.periodic.harmonics import ComplexArray
from sa_solver.types import Array

# Of the range of a record: its last force may differ by so much from its first.
CLOSES = 1e-6


@dataclass(frozen=True)
class PeriodicRecord:
    """Samples ``force`` ``(s,)`` [N] of one period at ``turns`` ``(s,)`` of it, straight between.

    Turns ascend from 0 to 1, and the last force is the first one. Raises
    :class:`~fe_models.dynamics.excitation.ExcitationError` for turns that do not, forces that do
    not close, and numbers that are not finite.

    Examples
    --------
    A triangle of height 1 has 8/π² of the first harmonic, and a ninth of that of the third:

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
            raise ExcitationError("give three or more turns of a period, and as many forces")
        if turns[0] != 0.0 or turns[-1] != 1.0 or np.any(np.diff(turns) <= 0.0):
            raise ExcitationError("turns of a period do not ascend from 0 to 1")
        if not np.isfinite(force).all():
            raise ExcitationError("a recorded force is not a number: give finite ones")
        if abs(force[-1] - force[0]) > CLOSES * np.ptp(force):
            raise ExcitationError("a period does not end with the force that it begins with")

    def amplitudes(self, highest: int) -> ComplexArray:
        """w_k ``(k + 1,)`` [N] of harmonics 0 to ``highest``; the mean is that of harmonic 0."""
        orders = np.arange(1, highest + 1)
        turning = np.exp(-2j * np.pi * np.outer(orders, self.turns[:-1]))
        above = -2.0 / np.square(2.0 * np.pi * orders) * (turning @ self._jumps)
        return np.concatenate([[self._mean], above])

    def left_out(self, highest: int) -> float:
        """Of the root mean square without the mean, the share that harmonics above have."""
        steps, swing = np.diff(self.turns), self.force - self._mean
        begin, end = swing[:-1], swing[1:]
        square = float(steps @ (begin * begin + begin * end + end * end)) / 3.0
        if square == 0.0:
            return 0.0
        kept = 0.5 * float(np.square(np.abs(self.amplitudes(highest)[1:])).sum())
        return float(np.sqrt(max(1.0 - kept / square, 0.0)))

    def value(self, turns: Array) -> Array:
        """The force [N] at any ``turns``, periods counted from the beginning."""
        return np.asarray(np.interp(np.mod(turns, 1.0), self.turns, self.force))

    @cached_property
    def _mean(self) -> float:
        return float(np.diff(self.turns) @ (self.force[1:] + self.force[:-1])) / 2.0

    @cached_property
    def _jumps(self) -> Array:
        """By how much the slope changes at every row but the last ``(s - 1,)``."""
        # Closed exactly: what is missing would be a jump of the force.
        closed = np.append(self.force[:-1], self.force[0])
        slopes = np.diff(closed) / np.diff(self.turns)
        return np.asarray(slopes - np.roll(slopes, 1))
