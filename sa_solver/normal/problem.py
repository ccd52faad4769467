"""Discrete normal contact problem and its residuals, independent of the method of solution."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from sa_solver.half_space.operator import HalfSpace
from sa_solver.rigid_modes import APPROACH, NormalModes, Window
from sa_solver.types import Array

Work = Counter[tuple[int, int]]
"""Number of convolutions done, by the shape of their transforms."""


@dataclass(frozen=True)
class NormalProblem:
    """Problem p >= 0, g = h + (K + D) p - R c >= 0, p g = 0, with given resultants of free modes.

    Attributes
    ----------
    height
        Gap h before loading ``(nx, ny)`` [mm], minus imposed rigid motions.
    target
        Imposed sums of pressure times free mode ``(k,)`` [MPa].
    modes
        Free modes R of rigid motion.
    half_space
        Half-space K.
    compliance
        Local compliance D ``(nx, ny)`` [mm/MPa], or None for 0.
    work
        Counter of convolutions, shared with all problems derived from this one.
    """

    height: Array
    target: Array
    modes: NormalModes
    half_space: HalfSpace
    compliance: Array | None
    work: Work

    def displacement(self, pressure: Array) -> Array:
        """Return ``(K + D) p`` [mm], by one convolution."""
        self.work[self.half_space.padded] += 1
        elastic = self.half_space.normal(pressure)
        return elastic if self.compliance is None else elastic + self.compliance * pressure

    def local_displacement(self, pressure: Array) -> Array | float:
        """Return ``D p`` [mm]."""
        return 0.0 if self.compliance is None else self.compliance * pressure

    def cropped(self, window: Window, half_space: HalfSpace) -> NormalProblem:
        """Return the problem with pressure only on the cells of ``window``.

        ``half_space`` covers these cells.
        """
        return replace(
            self,
            height=np.ascontiguousarray(self.height[window]),
            modes=self.modes.cropped(window),
            half_space=half_space,
            compliance=None if self.compliance is None else self.compliance[window],
        )


@dataclass(frozen=True)
class Iterate:
    """Iterate of a solver: pressure, displacement ``(K + D) p`` and free rigid motions ``(k,)``."""

    pressure: Array
    displacement: Array
    rigid: Array

    def gap(self, problem: NormalProblem) -> Array:
        """Return the gap ``g = h + (K + D) p - R c`` [mm]."""
        gap = problem.height + self.displacement
        problem.modes.subtract(gap, self.rigid, out=gap)
        return gap


@dataclass(frozen=True)
class NormalResiduals:
    """Dimensionless residuals of a state, which do not depend on the method of solution.

    The pressure itself is never negative.

    Attributes
    ----------
    force
        |Σ p S - P| / P, if P is imposed.
    moment
        Larger of |Σ p y S - Mx| / (P Ly) and |Σ p x S + My| / (P Lx), of imposed moments; Lx and Ly
        are half the size of the grid.
    penetration
        Largest negative gap over the largest displacement (K + D) p.
    complementarity
        Largest |p g| over the largest pressure times the largest displacement.
    wear
        Largest of min(D p, |g|) over the largest displacement: what a step of wear would remove
        where there is a gap. The complementarity alone lets small pressures do that.
    """

    force: float
    moment: float
    penetration: float
    complementarity: float
    wear: float

    @property
    def largest(self) -> float:
        """Largest of all residuals."""
        return max(self.force, self.moment, self.penetration, self.complementarity, self.wear)


def contact_residuals(pressure: Array, displacement: Array, gap: Array) -> tuple[float, float]:
    """Return penetration and complementarity as in :class:`NormalResiduals`."""
    scale = float(displacement.max())
    if not scale > 0.0:
        return np.inf, np.inf
    product = pressure * gap
    largest = max(product.max(), -product.min())
    return max(0.0, -float(gap.min())) / scale, float(largest / (pressure.max() * scale))


def normal_residuals(problem: NormalProblem, iterate: Iterate) -> NormalResiduals:
    """Return all residuals of ``iterate``."""
    total = iterate.pressure.sum()
    if not total > 0.0:
        return NormalResiduals(np.inf, np.inf, np.inf, np.inf, np.inf)
    missing = np.abs(problem.modes.sums(iterate.pressure) - problem.target) / total
    first = 1 if APPROACH in problem.modes.free else 0
    gap = iterate.gap(problem)
    penetration, complementarity = contact_residuals(iterate.pressure, iterate.displacement, gap)
    worn = float(np.minimum(problem.local_displacement(iterate.pressure), np.abs(gap)).max())
    return NormalResiduals(
        float(missing[:first].max(initial=0.0)),
        float(missing[first:].max(initial=0.0)),
        penetration,
        complementarity,
        worn / float(iterate.displacement.max()) if worn else 0.0,
    )


def border_share(pressure: Array) -> float:
    """Return the share of the load on the outermost cells.

    Directions along which the grid has only one or two cells do not count.
    """
    border = np.zeros(pressure.shape, dtype=bool)
    if pressure.shape[0] > 2:
        border[[0, -1], :] = True
    if pressure.shape[1] > 2:
        border[:, [0, -1]] = True
    total = float(pressure.sum())
    return float(pressure[border].sum()) / total if total > 0.0 else 0.0


def messages(failure: str, border_load: float) -> str:
    """Return the message of a state: its ``failure``, and a warning if the grid is too small."""
    border = (
        f"the contact reaches the border of its grid, where cells carry {border_load:.2g} of the "
        "load, and is cut off there: take a larger grid, unless the bodies end there as well"
    )
    return "; ".join(text for text in (failure, border if border_load > 0.0 else "") if text)
