"""The two worn surfaces of an interface."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sa_solver.types import Array


@dataclass(frozen=True)
class Surfaces:
    """The unworn gap of an interface, and the depth and friction work of either surface.

    All fields are by cell ``(nx, ny)`` or by node ``(n,)``.

    Parameters
    ----------
    initial_gap
        Gap of the unloaded, unworn bodies [mm].
    depth_1, depth_2
        Depth lost by body 1 and body 2, each on the body's own surface [mm].
    work_1, work_2
        Energy dissipated per area of the surface of body 1 and body 2 [N/mm].
    """

    initial_gap: Array
    depth_1: Array
    depth_2: Array
    work_1: Array
    work_2: Array

    @classmethod
    def unworn(cls, initial_gap: Array) -> Surfaces:
        """Return the surfaces before the first cycle."""
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
        """Gap of the unloaded bodies [mm]."""
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
        """Return the surfaces after further wear.

        Parameters
        ----------
        depth_1, depth_2
            Further depth that body 1 and body 2 lose [mm].
        work_1, work_2
            Further energy per area dissipated on each surface [N/mm].
        """
        return replace(
            self,
            depth_1=self.depth_1 + depth_1,
            depth_2=self.depth_2 + depth_2,
            work_1=self.work_1 + work_1,
            work_2=self.work_2 + work_2,
        )
