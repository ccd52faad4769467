"""Normal contacts of few cells, solved exactly: the rigid contact first, then cell by cell.

Where a load is so small, or so near the edge of what can carry it, that a handful of cells take it,
resultants rather than elasticity fix the pressure and conjugate gradients have nothing to search.
There a dense active-set method is exact: it starts from the points on which rigid bodies would
rest, adds the cells that penetrate most and drops those that would pull. The energy never rises.

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
"""Cells up to which the dense systems take less time than the splitting."""

STEPS = 500
"""Cap on the changes of the set: each takes a convolution, or a dense solve."""

CUTS = 100
"""Cap on the points that bound the rigid position; rough surfaces take up to 40."""

TOUCHING = 1e-6
"""Gap, over the range of heights, within the accuracy of the linear programme (1e-7)."""

DROPPED = 1e-12
"""A pressure below this share of the largest is rounding of the dense solve."""


def solve_few_cells(problem: NormalProblem, tolerance: float) -> Iterate | None:
    """The solution of ``problem``; None where it needs too many cells or steps."""
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
    """Cells that rigid bodies touch and pressures there ``(n,)`` [MPa]; None if unknown.

    The rigid position is the solution of a linear programme, largest Σ target · motion with no gap
    negative; the forces are its multipliers. Points that penetrate are added until none does.
    """
    modes, height = problem.modes, problem.height.ravel()
    shapes = modes.fields().reshape(len(modes.free), -1)
    columns = problem.height.shape[1]
    points = [0, columns - 1, height.size - columns, height.size - 1]
    # Rarely needed, and slow to import: where it is used.
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
            # Cells that touch without force hold the tilt that the others leave undetermined.
            touching = programme.slack <= TOUCHING
            pressure = -programme.ineqlin.marginals * problem.target[0]
            return np.array(points)[touching], np.maximum(pressure[touching], 0.0)
        points.append(lowest)
    return None


class _ActiveSet:
    """Pressures on the ``cells`` of the set, which meet the resultants and are nowhere negative."""

    def __init__(self, problem: NormalProblem, cells: Cells, pressure: Array) -> None:
        self._problem = problem
        self._shapes = problem.modes.fields().reshape(len(problem.modes.free), -1)
        corner = np.zeros(problem.height.shape)
        corner[0, 0] = 1.0
        self._kernel = problem.half_space.normal(corner)
        problem.work[problem.half_space.padded] += 1
        self.cells, self._pressure = cells, pressure

    def improve(self, tolerance: float) -> Iterate | None:
        """Change the set once; the iterate if it solves the problem."""
        wanted, rigid = self._on_set()
        falling = wanted < -DROPPED * np.abs(wanted).max(initial=0.0)
        if falling.any():
            self._drop(wanted, falling)
            return None
        self._pressure = np.maximum(wanted, 0.0)
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

    def _on_set(self) -> tuple[Array, Array]:
        """Pressure and rigid motion with no gap on the set, whatever the signs."""
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

    def _drop(self, wanted: Array, falling: Array) -> None:
        """Go towards ``wanted`` until the first cells carry nothing, and leave those out."""
        parts = self._pressure[falling] / (self._pressure - wanted)[falling]
        self._pressure = self._pressure + parts.min() * (wanted - self._pressure)
        first = np.flatnonzero(falling)[parts <= parts.min() * (1.0 + DROPPED)]
        self.cells = np.delete(self.cells, first)
        self._pressure = np.maximum(np.delete(self._pressure, first), 0.0)

    def _add(self, gap: Array) -> None:
        """Take in the cells that penetrate most, at most half as many as there are."""
        most = max(1, len(self.cells) // 2)
        deepest = np.argsort(gap)[:most]
        new = deepest[gap[deepest] < 0.0]
        self.cells = np.concatenate([self.cells, new])
        self._pressure = np.concatenate([self._pressure, np.zeros(len(new))])
