"""The two worn surfaces of an interface."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sa_solver.types import Array


@dataclass(frozen=True)
class Surfaces:
    """Unworn gap, and what both bodies have been through, by cell ``(nx, ny)`` or node ``(n,)``.

    ``depth_1`` and ``depth_2`` are the depths lost [mm], ``work_1`` and ``work_2`` the energies
    dissipated per area [N/mm], each on the body's own surface.
    """

    initial_gap: Array
    depth_1: Array
    depth_2: Array
    work_1: Array
    work_2: Array

    @classmethod
    def unworn(cls, initial_gap: Array) -> Surfaces:
        """Surfaces before the first cycle."""
        return cls(initial_gap, *(np.zeros_like(initial_gap) for _ in range(4)))

    @property
    def depth(self) -> Array:
        """Depth lost by both bodies together [mm]."""
        return self.depth_1 + self.depth_2

    @property
    def depths(self) -> tuple[Array, Array]:
        """Depths lost by body 1 and body 2 [mm]."""
        return self.depth_1, self.depth_2

    @property
    def gap(self) -> Array:
        """Distance of the unloaded surfaces [mm]."""
        return self.initial_gap + self.depth_1 + self.depth_2

    @property
    def heights(self) -> tuple[Array, Array]:
        """Heights of body 1 and body 2 in the interface frame [mm]; body 1 starts flat."""
        return -self.depth_1, self.initial_gap + self.depth_2

    def worn(
        self,
        depth_1: Array,
        depth_2: Array,
        work_1: Array | float = 0.0,
        work_2: Array | float = 0.0,
    ) -> Surfaces:
        """The surfaces after losing these further depths to these further energies."""
        return replace(
            self,
            depth_1=self.depth_1 + depth_1,
            depth_2=self.depth_2 + depth_2,
            work_1=self.work_1 + work_1,
            work_2=self.work_2 + work_2,
        )
