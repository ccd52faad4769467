"""Coefficients that change with the energy dissipated by sliding."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array


@dataclass(frozen=True)
class EnergyTable:
    """A factor against cumulative energy: linear between points, constant beyond the ends.

    Parameters
    ----------
    energy
        Energies of the points, ascending [N mm, or N/mm where energy is per area].
    factor
        Factors at these energies, equally many.
    threshold
        Energy below which the factor is 0. With a constant factor the worn volume is then
        V = α (ΣEd - Ed_th) (Fouvry et al., Wear 255, 2003).

    Raises
    ------
    InputError
        If the table is empty, its columns differ in length, or its energies do not ascend.

    Examples
    --------
    Nothing wears before a threshold of 50 N mm:

    >>> from wear import EnergyTable
    >>> table = EnergyTable(energy=(0.0, 100.0), factor=(1.0, 0.5), threshold=50.0)
    >>> print(table.at(25.0), table.at(75.0), table.mean(0.0, 100.0))
    0.0 0.625 0.3125
    """

    energy: tuple[float, ...] = (0.0,)
    factor: tuple[float, ...] = (1.0,)
    threshold: float = 0.0

    def __post_init__(self) -> None:
        for name in ("energy", "factor"):
            column = checks.array(f"values of {name}", getattr(self, name), (None,))
            checks.settle(self, **{name: tuple(column.tolist())})
        checks.numbers(self, "threshold")
        if not self.energy or len(self.energy) != len(self.factor):
            raise InputError(
                f"an energy table has {len(self.energy)} energies and {len(self.factor)} factors: "
                "give equally many of both, at least one"
            )
        if any(after <= before for before, after in pairwise(self.energy)):
            raise InputError(
                "the energies of an energy table must ascend: give each once, the smallest first"
            )

    def at(self, energy: Array | float) -> Array:
        """Return the factor at an energy, in the shape of the energy."""
        return np.where(np.asarray(energy) >= self.threshold, self._line(energy), 0.0)

    def mean(self, before: Array | float, after: Array | float) -> Array:
        """Return the exact mean of the factor while the energy grows from ``before`` to ``after``.

        Where the energy does not grow, return the factor at that energy. The mean is summed over
        the segments of the table: a difference of antiderivatives would lose all digits of a small
        step.
        """
        before, after = np.asarray(before, dtype=float), np.asarray(after, dtype=float)
        total = np.zeros(np.broadcast_shapes(before.shape, after.shape))
        for ends in pairwise((-np.inf, *self.energy, np.inf)):
            low, high = (np.clip(e, max(ends[0], self.threshold), ends[1]) for e in (before, after))
            total += (high - low) * self._line(0.5 * (low + high))
        grown, mean = after - before, np.empty_like(total)
        mean[...] = self.at(before)
        return np.divide(total, grown, out=mean, where=grown > 0.0)

    def _line(self, energy: Array | float) -> Array:
        return np.asarray(np.interp(energy, self.energy, self.factor), dtype=np.float64)


@dataclass(frozen=True)
class CoulombFriction:
    """Coulomb's coefficient of friction, and how it changes with dissipated energy.

    Parameters
    ----------
    coefficient : float
        Coefficient µ before any wear.
    evolution : EnergyTable, optional
        Factor of the coefficient against the energy that the contact has dissipated [N mm].

    Examples
    --------
    >>> from wear import EnergyTable
    >>> from wear.evolution import CoulombFriction
    >>> friction = CoulombFriction(0.4, EnergyTable(energy=(0.0, 1e6), factor=(1.0, 1.5)))
    >>> print(f"{friction.at(0.0):.1f} {friction.at(1e6):.1f}")
    0.4 0.6
    """

    coefficient: float
    evolution: EnergyTable | None = None

    def __post_init__(self) -> None:
        checks.numbers(self, "coefficient", least=0.0)
        checks.instances(self, evolution=EnergyTable | None)

    def at(self, energy: float) -> float:
        """Return the coefficient after the contact has dissipated ``energy`` [N mm]."""
        if self.evolution is None:
            return self.coefficient
        return self.coefficient * float(self.evolution.at(energy))
