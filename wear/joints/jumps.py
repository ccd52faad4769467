"""Jumps over many cycles, of which a long test consists."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.polynomial import Chebyshev
from scipy.optimize import brentq

SMALLEST = 1e-300
"""Absolute tolerance of an energy: it is solved to its last digit, however small it is."""


@dataclass(frozen=True)
class Jump:
    """A panel of a long test, or a single counted cycle.

    Parameters
    ----------
    start, end
        Energies at its ends [N mm].
    cycles
        Cycles before it.
    count
        Cycles since its start as a polynomial of the energy; None for a single counted cycle.
    error
        Largest error of the cycles anywhere in it.
    """

    start: float
    end: float
    cycles: float
    count: Chebyshev | None
    error: float

    @property
    def length(self) -> float:
        """Number of its cycles."""
        return self.since(self.end)

    def since(self, energy: float) -> float:
        """Return the cycles from its start to an ``energy`` in it [N mm]."""
        if self.count is None:
            return (energy - self.start) / (self.end - self.start)
        return float(self.count(energy))

    def energy_at(self, cycles: float) -> float:
        """Return the energy [N mm] after ``cycles`` of the test, which lie in this jump."""
        since = cycles - self.cycles
        if since <= 0.0:
            return self.start
        if since >= self.length:
            return self.end
        if self.count is None:
            return self.start + since * (self.end - self.start)
        root = brentq(
            lambda energy: self.since(energy) - since, self.start, self.end, xtol=SMALLEST
        )
        return float(root)
