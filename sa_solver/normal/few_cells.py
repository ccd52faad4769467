"""Exact solution of normal contacts of few cells by a dense active-set method.

Where a load is so small, or so close to the edge of the possible contact, that a handful of cells
carry it, the pressure is determined by resultants rather than by elasticity, and conjugate
gradients fail. The active-set method is exact there: it starts from the points on which rigid
bodies would rest, adds the cells that penetrate most and drops those in tension. The energy never
rises.

Source: Nocedal & Wright 2006, *Numerical Optimization*, section 16.5 (active-set methods for convex
quadratic programmes).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sa_solver.normal.problem import Iterate, NormalProblem
from sa_solver.rigid_modes import APPROACH
from sa_solver.types import Array

Cells = NDArray[np.intp]

LARGEST = 400
"""Number of cells up to which the dense systems take less time than the splitting."""

STEPS = 500
"""Most changes of the set; each takes a convolution or a dense solve."""

CUTS = 100
"""Most points that bound the rigid position; rough surfaces take up to 40."""

TOUCHING = 1e-6
"""Gap, relative to the range of heights, below which cells touch: the linear programme is accurate
to about 1e-7."""

DROPPED = 1e-12
"""Share of the largest pressure below which a pressure is rounding of the dense solve."""


def solve_few_cells(problem: NormalProblem, tolerance: float) -> Iterate | None:
    """Return the solution of ``problem``, or None if it needs too many cells or steps."""
    if APPROACH in problem.modes.free:
        start = _rigid_contact(problem)
    else:
        start = None if problem.target.any() else (np.zeros(0, dtype=np.intp), np.zeros(0))
    if start is None:
        return None
    search = _ActiveSet(problem, *start)
    for _ in range(STEPS):
        iterate = search.improve(tolerance)
        if iterate is not None or len(search.cells) > LARGEST:
            return iterate
    return None


def _rigid_contact(problem: NormalProblem) -> tuple[Cells, Array] | None:
    """Return the cells at which rigid bodies touch, and the pressures there ``(n,)`` [MPa].

    The rigid position solves a linear programme: it maximises Σ target · motion such that no gap is
    negative. The forces are the multipliers. Points that penetrate are added until there are none.
    None is returned if the programme fails.
    """
    modes, height = problem.modes, problem.height.ravel()
    shapes = modes.fields().reshape(len(modes.free), -1)
    columns = problem.height.shape[1]
    points = [0, columns - 1, height.size - columns, height.size - 1]
    # Imported here because it is rarely needed and slow to import.
    import scipy.optimize

    scale, target = float(np.ptp(height)) or 1.0, problem.target / problem.target[0]
    for _ in range(CUTS):
        programme = scipy.optimize.linprog(
            -target,
            shapes[:, points].T,
            (height[points] - height.min()) / scale,
            bounds=(None, None),
        )
        if not programme.success:
            return None
        gap = (height - height.min()) / scale - programme.x @ shapes
        lowest = int(np.argmin(gap))
        if gap[lowest] >= -TOUCHING or lowest in points:
            # Cells that touch without force determine the tilt that the others leave free.
            touching = programme.slack <= TOUCHING
            pressure = -programme.ineqlin.marginals * problem.target[0]
            return np.array(points)[touching], np.maximum(pressure[touching], 0.0)
        points.append(lowest)
    return None


class _ActiveSet:
    """Active set of ``cells`` with pressures >= 0 that meet the resultants."""

    def __init__(self, problem: NormalProblem, cells: Cells, pressure: Array) -> None:
        self._problem = problem
        self._shapes = problem.modes.fields().reshape(len(problem.modes.free), -1)
        corner = np.zeros(problem.height.shape)
        corner[0, 0] = 1.0
        self._kernel = problem.half_space.normal(corner)
        problem.work[problem.half_space.padded] += 1
        self.cells, self._pressure = cells, pressure

    def improve(self, tolerance: float) -> Iterate | None:
        """Change the set once; return the iterate if it solves the problem, or None."""
        closing, rigid = self._close_gaps()
        negative = closing < -DROPPED * np.abs(closing).max(initial=0.0)
        if negative.any():
            self._drop(closing, negative)
            return None
        self._pressure = np.maximum(closing, 0.0)
        pressure = np.zeros(self._problem.height.size)
        pressure[self.cells] = self._pressure
        field = pressure.reshape(self._problem.height.shape)
        iterate = Iterate(field, self._problem.displacement(field), rigid)
        gap = iterate.gap(self._problem).ravel()
        gap[self.cells] = 0.0
        if gap.min() >= -0.5 * tolerance * iterate.displacement.max():
            return iterate
        self._add(gap)
        return None

    def _close_gaps(self) -> tuple[Array, Array]:
        """Return the pressures, of any sign, and the rigid motion that close all gaps."""
        count, modes = len(self.cells), len(self._shapes)
        unit, shapes = self._kernel[0, 0], self._shapes[:, self.cells]
        matrix = np.block(
            [[self._compliance() / unit, -shapes.T], [shapes, np.zeros((modes, modes))]]
        )
        heights = -self._problem.height.ravel()[self.cells] / unit
        right = np.concatenate([heights, self._problem.target])
        solution = np.linalg.lstsq(matrix, right, rcond=None)[0]
        return solution[:count], solution[count:] * unit

    def _compliance(self) -> Array:
        i, j = np.unravel_index(self.cells, self._problem.height.shape)
        matrix: Array = self._kernel[np.abs(i[:, None] - i), np.abs(j[:, None] - j)]
        if self._problem.compliance is not None:
            matrix[np.diag_indices(len(i))] += self._problem.compliance.ravel()[self.cells]
        return matrix

    def _drop(self, closing: Array, negative: Array) -> None:
        """Change the pressures towards ``closing`` until the first vanish, and drop these cells."""
        parts = self._pressure[negative] / (self._pressure - closing)[negative]
        self._pressure = self._pressure + parts.min() * (closing - self._pressure)
        first = np.flatnonzero(negative)[parts <= parts.min() * (1.0 + DROPPED)]
        self.cells = np.delete(self.cells, first)
        self._pressure = np.maximum(np.delete(self._pressure, first), 0.0)

    def _add(self, gap: Array) -> None:
        """Add the cells that penetrate most, at most half as many as the set has."""
        most = max(1, len(self.cells) // 2)
        deepest = np.argsort(gap)[:most]
        new = deepest[gap[deepest] < 0.0]
        self.cells = np.concatenate([self.cells, new])
        self._pressure = np.concatenate([self._pressure, np.zeros(len(new))])
