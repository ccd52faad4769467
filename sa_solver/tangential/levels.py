"""Nested grids for shear: initial guesses come from the solution on cells twice as large."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from sa_solver.half_space.nested_grids import GridTransfer, coarsened
from sa_solver.half_space.operator import HalfSpace
from sa_solver.tangential.disk_newton import newton_on_disks
from sa_solver.tangential.problem import BoxOperator, TangentialProblem
from sa_solver.types import Array

COARSE_TOLERANCE = 3e-3
"""Residual of solutions on coarser grids. With thirty times this residual the finest grid takes a
third more convolutions; with a third of it no fewer."""

COARSE_ITERATIONS = 60
"""Most conjugate directions on coarser grids: a poor initial guess is not worth more."""


class ShearLevel:
    """Operators on a box of cells and on its coarser grids."""

    def __init__(self, half_space: HalfSpace) -> None:
        """Prepare the operators on the box that ``half_space`` covers."""
        self.half_space = half_space
        self.operator = BoxOperator(half_space)

    def begin(self, problem: TangentialProblem, shear: Array) -> Array | None:
        """Return an admissible, balanced shear ``(2, nx, ny)`` near ``shear`` as initial guess.

        It is corrected by the solutions on coarser grids. None is returned if there is no such
        shear.
        """
        improved = self._improved(problem, shear)
        return problem.balanced(shear) if improved is None else improved

    def _improved(self, problem: TangentialProblem, shear: Array) -> Array | None:
        """Return ``shear`` corrected by the solution on the next coarser grid; None without one."""
        if self._coarser is None:
            return None
        level, transfer = self._coarser
        coarse = level.restricted(problem, transfer)
        before = np.array([transfer.averaged(component) for component in shear])
        start = level.begin(coarse, before)
        if start is None:
            return None
        solution = newton_on_disks(coarse, start, COARSE_TOLERANCE, COARSE_ITERATIONS)
        changes = solution.shear - before
        change = np.array([transfer.interpolated(component) for component in changes])
        slipping = transfer.interpolated(solution.slipping.astype(np.float64)) > 0.5
        return problem.balanced((shear + change) * problem.pressed, slipping & problem.pressed)

    def restricted(self, fine: TangentialProblem, transfer: GridTransfer) -> TangentialProblem:
        """Return the problem ``fine`` of the next finer grid, averaged over this level's cells."""
        grid = self.half_space.grid
        length = fine.modes.length
        centre_x, centre_y = float(fine.modes.x.mean()), float(fine.modes.y.mean())
        modes = replace(
            fine.modes, x=grid.x[:, 0] / length + centre_x, y=grid.y[0] / length + centre_y
        )
        return TangentialProblem(
            limit=transfer.averaged(fine.limit),
            offset=np.array([transfer.averaged(component) for component in fine.offset]),
            modes=modes,
            target=fine.target * (transfer.fine.cell_area / grid.cell_area),
            operator=self.operator,
        )

    @cached_property
    def _coarser(self) -> tuple[ShearLevel, GridTransfer] | None:
        coarser = coarsened(self.half_space)
        return None if coarser is None else (ShearLevel(coarser[0]), coarser[1])
