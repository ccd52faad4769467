"""Normal contact on one grid: started from coarser ones, searched in a box around the contact.

Both only save time: the answer is verified by a convolution on the whole grid.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from sa_solver.half_space.active_box import Box
from sa_solver.half_space.nested_grids import GridTransfer, coarsened
from sa_solver.half_space.operator import HalfSpace
from sa_solver.half_space.preconditioner import NormalPreconditioner
from sa_solver.normal.bound_cg import BoundConjugateGradients, SearchResult
from sa_solver.normal.few_cells import solve_few_cells
from sa_solver.normal.problem import Iterate, NormalProblem, normal_residuals
from sa_solver.normal.splitting import solve_by_splitting
from sa_solver.rigid_modes import APPROACH, TILT_X, TILT_Y, NormalModes
from sa_solver.types import Array

COARSE_TOLERANCE = 1e-3
"""Of residuals on coarser grids, whose pressure is off by more than that at the contact's edge."""

ENOUGH = 3.0
"""Load over the moments' least, where the approach is imposed: a start that can be balanced."""

BOXES = 4
"""Boxes whose transforms are kept, the last used: a wear run needs two or three."""


class NestedSolver:
    """Solves normal contact problems on one grid; owns what was planned for it."""

    def __init__(self, half_space: HalfSpace) -> None:
        self.half_space = half_space
        self._boxed = lru_cache(BOXES)(self._plan)

    def cold_start(self, problem: NormalProblem) -> Array | None:
        """A balanced pressure >= 0, from coarser grids where there are any.

        None where no pressure on this grid can be balanced or, if the approach is imposed, nothing
        presses on cells of this size.
        """
        imposed = APPROACH not in problem.modes.free and not problem.target.any()
        if imposed and problem.height.min() >= 0.0:
            return None
        nested = self._from_coarser(problem)
        return nested if nested is not None else _uniform(problem)

    def solve(
        self, problem: NormalProblem, pressure: Array, displacement: Array | None, tolerance: float
    ) -> tuple[Iterate, str]:
        """Solve from a balanced ``pressure`` >= 0, whose ``displacement`` may be known.

        The last iterate on the whole grid, and by which method it was found.
        """
        box = Box.around(pressure > 0.0)
        while True:
            box, result = self._search(problem, box, pressure, displacement, tolerance)
            iterate = result.iterate
            if not result.converged:
                return self._rescue(problem, box.placed(iterate.pressure), tolerance)
            if box.size == box.shape:
                return iterate, "conjugate gradients"
            pressure = box.placed(iterate.pressure)
            displacement = problem.displacement(pressure)
            iterate = Iterate(pressure, displacement, iterate.rigid)
            missed = iterate.gap(problem) < -tolerance * displacement.max()
            missed[box.window] = False
            if not missed.any():
                return iterate, "conjugate gradients"
            missed[box.window] = True
            box = Box.around(missed)

    def _search(
        self,
        problem: NormalProblem,
        box: Box,
        pressure: Array,
        displacement: Array | None,
        tolerance: float,
    ) -> tuple[Box, SearchResult]:
        """Solve with pressure in a box only, enlarged while the contact reaches its sides."""
        while True:
            preconditioner = self._preconditioner(box)
            inner = problem.cropped(box.window, preconditioner.half_space)
            preconditioner.include(inner.compliance)
            inside = np.ascontiguousarray(pressure[box.window])
            moved = inner.displacement(inside) if displacement is None else displacement[box.window]
            search = BoundConjugateGradients(inner, preconditioner, inside, moved, box.left_by)
            result = search.solve(tolerance)
            if not result.left:
                return box, result
            pressure, displacement = box.placed(result.iterate.pressure), None
            box = box.grown()

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
        """The solver on the next coarser grid, and how fields pass to and from it."""
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
        box = Box.around(start > 0.0)
        box, result = solver._search(coarse, box, start, None, COARSE_TOLERANCE)
        pressure = transfer.interpolated(box.placed(result.iterate.pressure))
        return problem.modes.balance(pressure, problem.target)

    def _coarse(self, problem: NormalProblem, transfer: GridTransfer) -> NormalProblem:
        """``problem`` with heights and compliances averaged over this solver's larger cells."""
        grid, compliance = self.half_space.grid, problem.compliance
        return replace(
            problem,
            height=transfer.averaged(problem.height),
            target=problem.target * (transfer.fine.cell_area / grid.cell_area),
            modes=NormalModes.on(grid, problem.modes.free),
            half_space=self.half_space,
            compliance=None if compliance is None else transfer.averaged(compliance),
        )

    # -- boxes --------------------------------------------------------------------------------
    def _preconditioner(self, box: Box) -> NormalPreconditioner:
        """That of the half-space on a box."""
        return self._whole if box.size == box.shape else self._boxed(box.size)

    @cached_property
    def _whole(self) -> NormalPreconditioner:
        return NormalPreconditioner(self.half_space)

    def _plan(self, size: tuple[int, int]) -> NormalPreconditioner:
        grid = replace(self.half_space.grid, shape=size)
        return NormalPreconditioner(self.half_space.on(grid))


def _uniform(problem: NormalProblem) -> Array | None:
    """Uniform pressure on the largest rectangle of cells centred on the load, balanced.

    Where the approach is imposed, on the cells that penetrate if that can be balanced, of a size
    that lifts the deepest.
    """
    modes, target = problem.modes, problem.target
    if APPROACH not in modes.free:
        for cells in (problem.height < 0.0, np.ones(problem.height.shape, dtype=bool)):
            if not cells.any():
                continue
            pressure = cells.astype(np.float64)
            depth = max(-problem.height.min(), 1e-3 * np.ptp(problem.height))
            pressure *= depth / problem.displacement(pressure).max()
            # Balanced as if that load were imposed, or one that can carry the moments.
            load = max(float(pressure.sum()), ENOUGH * float(np.abs(target).max(initial=0.0)))
            loaded = replace(modes, free=(APPROACH, *modes.free))
            balanced = loaded.balance(pressure, np.concatenate([[load], target]))
            if balanced is not None:
                return balanced
        return None
    sums = dict(zip(modes.free, target / target[0], strict=True))
    at = -sums.get(TILT_Y, 0.0), sums.get(TILT_X, 0.0)
    near = []
    for centres, place in zip((modes.x, modes.y), at, strict=True):
        pitch = 2.0 / len(centres)
        near.append(np.abs(centres - place) <= max(1.0 - abs(place), pitch))
    return modes.balance(np.outer(near[0], near[1]).astype(np.float64), target)
