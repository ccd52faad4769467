"""Wear laws: the depth one body loses in a cycle, from pressure and slip.

Every law here is linear in the pressure once the slips of the cycle are known. A law therefore
gives the depth per pressure of each increment, which serves the explicit step (depth = Σ w p) and
the implicit one (w ΔN is a local compliance) alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from sa_solver.types import Array
from wear.evolution import EnergyTable


@dataclass(frozen=True)
class SlidingConditions:
    """What one body's wear during a step may depend on.

    ``slip`` ``(t, ...)`` is the size of the slip in each increment of the cycle [mm], by cell or
    node, and ``friction`` Coulomb's coefficient. ``work`` is the energy dissipated per area of this
    body's surface since it was new, ``(...)`` [N/mm], and ``energy`` that of the whole contact
    [N mm], each before the step and, as predicted, after it.
    """

    slip: Array
    friction: float | Array
    work: tuple[Array, Array]
    energy: tuple[float, float]


class WearLaw(Protocol):
    """Wear of one body."""

    def depth_per_pressure(self, sliding: SlidingConditions) -> Array:
        """Depth per pressure worn in each increment ``(t, ...)`` [mm/MPa per cycle]."""
        ...


@dataclass(frozen=True)
class ArchardLaw:
    """V = K s P / H: ``coefficient`` K [1], ``hardness`` H [MPa] (Archard 1953)."""

    coefficient: float
    hardness: float

    def depth_per_pressure(self, sliding: SlidingConditions) -> Array:
        return self.coefficient / self.hardness * sliding.slip


@dataclass(frozen=True)
class EnergyLaw:
    """V = α Σ Ed: ``coefficient`` α [1/MPa] (Fouvry; Gallego 2007, eq. 1)."""

    coefficient: float

    def depth_per_pressure(self, sliding: SlidingConditions) -> Array:
        return self.coefficient * sliding.friction * sliding.slip


@dataclass(frozen=True)
class EnergyAmplitudeLaw:
    """Energy law whose coefficient grows with the local slip amplitude (Gallego 2007, eq. 3).

    Depth per cycle = α / (4 δ_ref) (Σ|Δs|) (Σ|q·Δs|): ``coefficient`` α [1/MPa] holds at the
    amplitude ``reference_amplitude`` δ_ref [mm]; one cycle slides four amplitudes.
    """

    coefficient: float
    reference_amplitude: float

    def depth_per_pressure(self, sliding: SlidingConditions) -> Array:
        amplitude = sliding.slip.sum(axis=0) / 4.0 / self.reference_amplitude
        depth: Array = self.coefficient * sliding.friction * sliding.slip * amplitude
        return depth


@dataclass(frozen=True)
class EvolvingLaw:
    """Any law, times a factor that changes with cumulative energy.

    ``scope`` local: with the energy per area of this body's own surface [N/mm]; global: with that
    of the whole contact [N mm]. During a step it is the exact mean between its two ends.
    """

    law: WearLaw
    factor: EnergyTable
    scope: Literal["local", "global"]

    def depth_per_pressure(self, sliding: SlidingConditions) -> Array:
        before, after = sliding.work if self.scope == "local" else sliding.energy
        return self.factor.mean(before, after) * self.law.depth_per_pressure(sliding)
