"""Cubic springs in place of joints, for which harmonic balance has closed forms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array


@dataclass(frozen=True)
class CubicCycle:
    """Cycle of springs, which have no states and dissipate nothing.

    See :class:`wear.joints.periodic.march.PeriodicMarch`.
    """

    force: Array
    jacobian: Array
    samples: Array
    states: Array
    dissipated: Array
    change: Array


@dataclass(frozen=True)
class CubicSprings:
    """Springs with F = k u³ at every joint, ``stiffness`` [N/mm³]."""

    stiffness: float
    directions = 1

    def settle(self, coefficients: Array, basis: Array, weights: Array, lead: Array) -> CubicCycle:
        way = (basis @ coefficients)[..., 0]
        force = self.stiffness * way**3
        slopes = 3.0 * self.stiffness * way**2
        jacobian = np.einsum("mt,jt,tn->jmn", weights, slopes, basis)
        return CubicCycle(
            np.einsum("mt,jt->jm", weights, force)[..., None],
            jacobian[:, :, None, :, None],
            force.T[..., None],
            np.zeros(force.T.shape, dtype=np.int8),
            np.zeros(len(force)),
            np.zeros(len(force)),
        )
