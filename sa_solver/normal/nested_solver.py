"""Normal contact solved with initial guesses from coarser grids, in a box around the contact.

Both only save time: the solution is verified by a convolution on the whole grid.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from sa_solver.half_space.active_box import Box, OnBoxes
from sa_solver.half_space.nested_grids import GridTransfer, coarsened
from sa_solver.half_space.operator import HalfSpace
from sa_solver.half_space.preconditioner import NormalPreconditioner
from sa_solver.normal.bound_cg import BoundConjugateGradients, SearchResult
from sa_solver.normal.few_cells import solve_few_cells
from sa_solver.normal.problem import Iterate, NormalProblem, normal_residuals
from sa_solver.normal.splitting import solve_by_splitting
from sa_solver.rigid_modes import APPROACH, TILT_X, TILT_Y, NormalModes
from sa_solver.types import Array, Mask

COARSE_TOLERANCE = 1e-3
"""Tolerance of residuals on coarser grids, where the error of the pressure at the edge of the
contact is larger than this."""

ENOUGH = 3.0
"""Load of an initial guess over the least load that can carry the moments, where the approach is
imposed."""


class NestedSolver:
    """Solver of normal contact problems on one grid, with cached transforms and coarser grids."""

    def __init__(self, half_space: HalfSpace) -> None:
        self.half_space = half_space
        self._preconditioners = OnBoxes(half_space, NormalPreconditioner)

    def cold_start(self, problem: NormalProblem) -> Array | None:
        """Return a balanced pressure >= 0 as initial guess, from coarser grids if there are any.

        None is returned where no pressure on this grid can be balanced or, if the approach is
        imposed, no cell of this size is in contact.
        """
        imposed = APPROACH not in problem.modes.free and not problem.target.any()
        if imposed and problem.height.min() >= 0.0:
            return None
        nested = self._from_coarser(problem)
        return nested if nested is not None else _uniform_pressure(problem)

    def solve(
        self, problem: NormalProblem, pressure: Array, displacement: Array | None, tolerance: float
    ) -> tuple[Iterate, str]:
        """Solve from a balanced ``pressure`` >= 0 and its ``displacement``, if known.

        The last iterate on the whole grid and the name of the method that found it are returned.
        """
        box = self._box(pressure > 0.0)
        while True:
            box, result = self._search(problem, box, pressure, displacement, tolerance)
            iterate = result.iterate
            if not result.converged:
                return self._rescue(problem, box.on_whole_grid(iterate.pressure), tolerance)
            if box.size == box.shape:
                return iterate, "conjugate gradients"
            pressure = box.on_whole_grid(iterate.pressure)
            displacement = problem.displacement(pressure)
            iterate = Iterate(pressure, displacement, iterate.rigid)
            missed = iterate.gap(problem) < -tolerance * displacement.max()
            missed[box.window] = False
            if not missed.any():
                return iterate, "conjugate gradients"
            missed[box.window] = True
            box = Box.around(missed)

    def _box(self, cells: Mask) -> Box:
        """Return a box around ``cells``, or all cells of a periodic half-space."""
        return (
            Box.whole(self.half_space.grid.shape) if self.half_space.periodic else Box.around(cells)
        )

    def _search(
        self,
        problem: NormalProblem,
        box: Box,
        pressure: Array,
        displacement: Array | None,
        tolerance: float,
    ) -> tuple[Box, SearchResult]:
        """Solve with pressure in a box only, which is enlarged while the contact reaches its sides.

        The last box is returned as well.
        """
        while True:
            preconditioner = self._preconditioners.on(box)
            inner = problem.cropped(box.window, preconditioner.half_space)
            preconditioner.include(inner.compliance)
            inside = np.ascontiguousarray(pressure[box.window])
            known = None if displacement is None else displacement[box.window]
            moved = inner.displacement(inside) if known is None else known
            search = BoundConjugateGradients(
                inner, preconditioner, inside, moved, box.is_reached_by
            )
            result = search.solve(tolerance)
            if not result.left_bounds:
                return box, result
            pressure, displacement = box.on_whole_grid(result.iterate.pressure), None
            box = box.enlarged()

    def _rescue(
        self, problem: NormalProblem, pressure: Array, tolerance: float
    ) -> tuple[Iterate, str]:
        """Solve on the whole grid by slower methods, from the last ``pressure`` of the search."""
        few = solve_few_cells(problem, tolerance)
        if few is not None and normal_residuals(problem, few).largest <= tolerance:
            return few, "active set"
        rigid = np.zeros(len(problem.modes.free))
        last = Iterate(pressure, problem.displacement(pressure), rigid)
        return solve_by_splitting(problem, last, tolerance), "splitting"

    # -- coarser grids ------------------------------------------------------------------------
    @cached_property
    def _coarser(self) -> tuple[NestedSolver, GridTransfer] | None:
        """Solver on the next coarser grid, and the transfer of fields between the grids."""
        coarser = coarsened(self.half_space)
        return None if coarser is None else (NestedSolver(coarser[0]), coarser[1])

    def _from_coarser(self, problem: NormalProblem) -> Array | None:
        if self._coarser is None:
            return None
        solver, transfer = self._coarser
        coarse = solver._coarse(problem, transfer)
        start = solver.cold_start(coarse)
        if start is None:
            return None
        box = solver._box(start > 0.0)
        box, result = solver._search(coarse, box, start, None, COARSE_TOLERANCE)
        pressure = transfer.interpolated(box.on_whole_grid(result.iterate.pressure))
        return problem.modes.balance(pressure, problem.target)

    def _coarse(self, problem: NormalProblem, transfer: GridTransfer) -> NormalProblem:
        """Return ``problem`` with heights and compliances averaged over this solver's cells."""
        grid, compliance = self.half_space.grid, problem.compliance
        return replace(
            problem,
            height=transfer.averaged(problem.height),
            target=problem.target * (transfer.fine.cell_area / grid.cell_area),
            modes=NormalModes.on(grid, problem.modes.free),
            half_space=self.half_space,
            compliance=None if compliance is None else transfer.averaged(compliance),
        )


def _uniform_pressure(problem: NormalProblem) -> Array | None:
    """Return a balanced pressure that is uniform but for the balance, or None.

    It acts on the largest rectangle of cells that is centred on the load. Where the approach is
    imposed, it acts on the cells that penetrate, or on all cells if that cannot be balanced, and is
    large enough to separate the deepest cell.
    """
    modes, target = problem.modes, problem.target
    if APPROACH not in modes.free:
        for cells in (problem.height < 0.0, np.ones(problem.height.shape, dtype=bool)):
            if not cells.any():
                continue
            pressure = cells.astype(np.float64)
            depth = max(-problem.height.min(), 1e-3 * np.ptp(problem.height))
            pressure *= depth / problem.displacement(pressure).max()
            # Balance as if this load were imposed, or a load that can carry the moments.
            load = max(float(pressure.sum()), ENOUGH * float(np.abs(target).max(initial=0.0)))
            loaded = replace(modes, free=(APPROACH, *modes.free))
            balanced = loaded.balance(pressure, np.concatenate([[load], target]))
            if balanced is not None:
                return balanced
        return None
    sums = dict(zip(modes.free, target / target[0], strict=True))
    at = -sums.get(TILT_Y, 0.0), sums.get(TILT_X, 0.0)
    loaded_rows = []
    for centres, place in zip((modes.x, modes.y), at, strict=True):
        pitch = 2.0 / len(centres)
        loaded_rows.append(np.abs(centres - place) <= max(1.0 - abs(place), pitch))
    return modes.balance(np.outer(*loaded_rows).astype(np.float64), target)
