"""The discrete normal contact problem and its residuals, whichever method solves it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.convolution import HalfSpaceConvolution
from sa_solver.rigid_modes import RigidModes
from sa_solver.types import Array


@dataclass(frozen=True)
class NormalProblem:
    """p >= 0, g = h + K p + D p - rigid >= 0, p g = 0, with three resultants imposed.

    ``height`` and ``compliance`` (or None for 0) are ``(nx, ny)`` [mm], [mm/MPa]; ``target`` holds
    the scaled resultants of :meth:`RigidModes.scaled`.
    """

    height: Array
    target: Array
    modes: RigidModes
    convolution: HalfSpaceConvolution
    compliance: Array | None

    def displacement(self, pressure: Array) -> Array:
        """``(K + D) p`` [mm], one convolution."""
        elastic = self.convolution.displacement(pressure)
        return elastic if self.compliance is None else elastic + self.compliance * pressure


@dataclass(frozen=True)
class Iterate:
    """Pressure, its displacement ``(K + D) p`` and the scaled rigid motion ``(3,)``."""

    pressure: Array
    displacement: Array
    rigid: Array

    def gap(self, problem: NormalProblem) -> Array:
        """``g = h + (K + D) p - rigid`` [mm]."""
        return problem.height + self.displacement - problem.modes.motion(self.rigid)


@dataclass(frozen=True)
class NormalResiduals:
    """How far a state is from solving the problem, dimensionless, independent of the method.

    ``force``: |Σ p S - P| / P; ``moment``: the larger of |Σ p y S - Mx| / (P Ly) and
    |Σ p x S + My| / (P Lx) with Lx, Ly half the grid's size; ``penetration``: largest negative gap
    over the largest displacement (K + D) p; ``complementarity``: max |p g| over the largest
    pressure times the largest displacement. Pressure is never negative.
    """

    force: float
    moment: float
    penetration: float
    complementarity: float

    @property
    def largest(self) -> float:
        """The largest of the four."""
        return max(self.force, self.moment, self.penetration, self.complementarity)


def contact_residuals(pressure: Array, displacement: Array, gap: Array) -> tuple[float, float]:
    """Penetration and complementarity as in :class:`NormalResiduals`."""
    scale = float(displacement.max())
    if not scale > 0.0:
        return np.inf, np.inf
    complementarity = np.abs(pressure * gap).max() / (pressure.max() * scale)
    return max(0.0, -float(gap.min())) / scale, float(complementarity)


def residuals(problem: NormalProblem, iterate: Iterate) -> NormalResiduals:
    """All four residuals of ``iterate``."""
    sums = problem.modes.shapes @ iterate.pressure.ravel()
    missing = np.abs(sums - problem.target) / problem.target[0]
    penetration, complementarity = contact_residuals(
        iterate.pressure, iterate.displacement, iterate.gap(problem)
    )
    return NormalResiduals(
        float(missing[0]), float(missing[1:].max()), penetration, complementarity
    )
