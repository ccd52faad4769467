"""Wear laws: the depth one body loses in a cycle, from pressure and slip.

Every law here is linear in the pressure once the slips of the cycle are known. A law therefore
gives the depth per pressure of each increment, which serves the explicit step (depth = Σ w p) and
the implicit one (w ΔN is a local compliance) alike.

Slip is the size of the slip of each increment, ``(t, nx, ny)`` [mm]; depth per pressure has the
same shape [mm/MPa per cycle].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from sa_solver.types import Array


class WearLaw(Protocol):
    """Wear of one body."""

    def depth_per_pressure(self, slip: Array, friction: float) -> Array: ...


@dataclass(frozen=True)
class Archard:
    """V = K s P / H: ``coefficient`` K [1], ``hardness`` H [MPa] (Archard 1953)."""

    coefficient: float
    hardness: float

    def depth_per_pressure(self, slip: Array, friction: float) -> Array:
        return self.coefficient / self.hardness * slip


@dataclass(frozen=True)
class Energy:
    """V = α Σ Ed: ``coefficient`` α [1/MPa] (Fouvry; Gallego 2007, eq. 1)."""

    coefficient: float

    def depth_per_pressure(self, slip: Array, friction: float) -> Array:
        return self.coefficient * friction * slip


@dataclass(frozen=True)
class EnergyAmplitude:
    """Energy law whose coefficient grows with the local slip amplitude (Gallego 2007, eq. 3).

    Depth per cycle = α / (4 δ_ref) (Σ|Δs|) (Σ|q·Δs|): ``coefficient`` α [1/MPa] holds at the
    amplitude ``reference_amplitude`` δ_ref [mm]; one cycle slides four amplitudes.
    """

    coefficient: float
    reference_amplitude: float

    def depth_per_pressure(self, slip: Array, friction: float) -> Array:
        amplitude: Array = slip.sum(axis=0) / 4.0
        depth: Array = self.coefficient * friction * slip * (amplitude / self.reference_amplitude)
        return depth
