"""The two worn surfaces of an interface."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sa_solver.types import Array


@dataclass(frozen=True)
class Surfaces:
    """Unworn gap and the depths both bodies have lost, ``(nx, ny)`` [mm]."""

    initial_gap: Array
    depth_1: Array
    depth_2: Array

    @classmethod
    def unworn(cls, initial_gap: Array) -> Surfaces:
        """Surfaces before the first cycle."""
        return cls(initial_gap, np.zeros_like(initial_gap), np.zeros_like(initial_gap))

    @property
    def gap(self) -> Array:
        """Distance of the unloaded surfaces [mm]."""
        return self.initial_gap + self.depth_1 + self.depth_2

    @property
    def heights(self) -> tuple[Array, Array]:
        """Heights of body 1 and body 2 in the interface frame [mm]; body 1 starts flat."""
        return -self.depth_1, self.initial_gap + self.depth_2

    def worn(self, depth_1: Array, depth_2: Array) -> Surfaces:
        """The surfaces after losing these further depths."""
        return replace(self, depth_1=self.depth_1 + depth_1, depth_2=self.depth_2 + depth_2)
