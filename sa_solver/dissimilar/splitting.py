"""The fallback of contacts of dissimilar bodies: Douglas-Rachford splitting on the padded grid.

The elastic relation has the exact inverse of the coupled half-space, the contact law is Coulomb's
with the compliance of the pressure.
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
"""ρ over the geometric mean of the extreme eigenvalues of K. On spheres and flats 0.5, 0.75, 1 and
1.5 took 57, 51, 50 and 60 iterations in the mean; lines prefer the lower ones."""

LARGEST_WEIGHT = 60.0
"""ρ of shear over that of pressure is β/µ between 1 and this. Where pressure drives all cells to
slip and µ is small, shear changes its sign from one cell to the next: with one ρ for all, lines of
1024 cells at β 0.5, µ 0.02 took up to 1000 iterations, with this 100 to 300."""


class CoupledSplitting:
    """Splittings of the problems on one grid; owns the planned transforms."""

    def __init__(self, half_space: HalfSpace, friction: float, modes: RigidModes) -> None:
        """Plan for ``half_space``, µ and the motions ``modes``."""
        self._friction, self._present = friction, list(modes.present)
        shares = _shift_shares(half_space, friction)
        self.resolvent = HalfSpaceResolvent(half_space, ALL, shares)
        motions = np.array([modes.motion(np.eye(6)[k]) for k in self._present])
        self._response = RigidResponse.of(
            self.resolvent, motions, lambda traction: modes.sums(traction)[self._present]
        )

    def of(self, problem: CoupledProblem) -> PaddedSplitting:
        """The two steps for ``problem``."""
        shift = self.resolvent.shift[Z]
        yielding = shift / (shift + problem.compliance)

        def law(trial: Array) -> Array:
            """Coulomb's law, with the compliance of the pressure."""
            yielded = trial.copy()
            yielded[Z] *= yielding
            return coulomb(yielded, self._friction)

        return PaddedSplitting(
            self.resolvent,
            self._response.only([self._present.index(k) for k in problem.free]),
            problem.target,
            problem.offset,
            law,
        )

    def state(self, traction: Array, elastic: Array) -> Array:
        """``t + v/ρ`` on the padded grid of t and v less the compliance's, ``(3, nx, ny)`` both."""
        return self.resolvent.padded(traction + elastic / self.resolvent.shift)

    def touching(self, problem: CoupledProblem) -> Array:
        """That of bodies that touch without load."""
        gap = problem.offset[Z]
        lowest = float(gap.min()) if problem.load is not None else 0.0
        elastic = np.zeros_like(problem.offset)
        elastic[Z] = np.maximum(0.0, gap - lowest)
        return self.state(np.zeros_like(elastic), elastic)


def _shift_shares(half_space: HalfSpace, friction: float) -> Array:
    """ρ of shear, shear and pressure over the geometric mean of K's extreme eigenvalues."""
    beta = abs(half_space.pair.dundurs_beta)
    weight = max(1.0, min(LARGEST_WEIGHT, beta / max(friction, np.finfo(float).tiny)))
    return SHIFT * np.array([weight, weight, 1.0])
