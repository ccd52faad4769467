"""Fallback solver of contacts of dissimilar bodies: Douglas-Rachford splitting, padded grid.

The elastic step uses the exact inverse of the coupled half-space. The contact law is Coulomb's,
with a local compliance of the pressure.
"""

from __future__ import annotations

import numpy as np

from sa_solver.contact_law import coulomb
from sa_solver.dissimilar.problem import CoupledProblem
from sa_solver.half_space.influence import Z
from sa_solver.half_space.operator import ALL, HalfSpace, HalfSpaceResolvent
from sa_solver.padded_splitting import PaddedSplitting, RigidResponse
from sa_solver.rigid_modes import RigidModes
from sa_solver.types import Array

SHIFT = 0.75
"""Shift ρ over the geometric mean of the extreme eigenvalues of K. On spheres and flats 0.5, 0.75,
1 and 1.5 took 57, 51, 50 and 60 iterations on average; lines take fewer with the lower values."""

LARGEST_WEIGHT = 60.0
"""Largest ratio of the shift ρ of shear to that of pressure, which is β/µ but at least 1. Where
pressure makes all cells slip and µ is small, shear changes its sign from one cell to the next. With
a single ρ, lines of 1024 cells at β = 0.5 and µ = 0.02 took up to 1000 iterations; with this ratio
they take 100 to 300."""


class CoupledSplitting:
    """Splittings of the problems on one grid, with shared transforms."""

    def __init__(self, half_space: HalfSpace, friction: float, modes: RigidModes) -> None:
        """Prepare the splitting for ``half_space``, ``friction`` µ and the motions ``modes``."""
        self._friction, self._present = friction, list(modes.present)
        shares = _shift_shares(half_space, friction)
        self.resolvent = HalfSpaceResolvent(half_space, ALL, shares)
        motions = np.array([modes.motion(np.eye(6)[k]) for k in self._present])
        self._response = RigidResponse.of(
            self.resolvent, motions, lambda traction: modes.sums(traction)[self._present]
        )

    def of(self, problem: CoupledProblem) -> PaddedSplitting:
        """Return the two steps for ``problem``."""
        shift = self.resolvent.shift[Z]
        shrinkage = shift / (shift + problem.compliance)

        def law(trial: Array) -> Array:
            """Apply Coulomb's law, with the local compliance of the pressure."""
            reduced = trial.copy()
            reduced[Z] *= shrinkage
            return coulomb(reduced, self._friction)

        return PaddedSplitting(
            self.resolvent,
            self._response.only([self._present.index(k) for k in problem.free]),
            problem.target,
            problem.offset,
            law,
        )

    def state(self, traction: Array, elastic: Array) -> Array:
        """Return the state ``t + v/ρ`` on the padded grid, for t and v ``(3, nx, ny)``.

        ``elastic`` is v without the displacement of the local compliance.
        """
        return self.resolvent.padded(traction + elastic / self.resolvent.shift)

    def touching(self, problem: CoupledProblem) -> Array:
        """Return the state of bodies that touch without load."""
        gap = problem.offset[Z]
        lowest = float(gap.min()) if problem.load is not None else 0.0
        elastic = np.zeros_like(problem.offset)
        elastic[Z] = np.maximum(0.0, gap - lowest)
        return self.state(np.zeros_like(elastic), elastic)


def _shift_shares(half_space: HalfSpace, friction: float) -> Array:
    """Return ρ of qx, qy and p over the geometric mean of K's extreme eigenvalues ``(3,)``."""
    pair = half_space.pair
    beta = max(abs(pair.dundurs_beta), abs(pair.surface.dundurs_beta))
    weight = max(1.0, min(LARGEST_WEIGHT, beta / max(friction, np.finfo(float).tiny)))
    return SHIFT * np.array([weight, weight, 1.0])
