"""Coarser grids over the same area, and the transfer of fields between grids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.half_space.operator import HalfSpace
from sa_solver.types import Array, Grid, Indices

COARSEST = 32
"""Number of cells along a side up to which it is not coarsened: a solve on so few cells costs less
than its preparation."""


def coarsened(fine: HalfSpace) -> tuple[HalfSpace, GridTransfer] | None:
    """Return the same bodies on a grid of half as many cells, and the transfer between the grids.

    Sides of :data:`COARSEST` or fewer cells are kept; None is returned where all sides are so
    short. Half of an odd number of cells is rounded up.
    """
    nx, ny = ((n + 1) // 2 if n > COARSEST else n for n in fine.grid.shape)
    if (nx, ny) == fine.grid.shape:
        return None
    grid = Grid.over(fine.grid.size, (nx, ny), fine.grid.line)
    return fine.on(grid), GridTransfer(fine.grid, grid)


class GridTransfer:
    """Transfer of fields between a ``fine`` and a ``coarse`` grid over the same area."""

    def __init__(self, fine: Grid, coarse: Grid) -> None:
        self.fine = fine
        pairs = list(zip(fine.shape, coarse.shape, strict=True))
        self._averages = [_averages(n, m) for n, m in pairs]
        self._interpolation = [_interpolation(n, m) for n, m in pairs]

    def averaged(self, field: Array) -> Array:
        """Return the means of a ``field`` on the fine grid over the coarse cells."""
        return _along_both(self._averages, field)

    def interpolated(self, field: Array) -> Array:
        """Return a ``field`` on the coarse grid, interpolated bilinearly at the fine cells."""
        return _along_both(self._interpolation, field)


@dataclass(frozen=True)
class _Sums:
    """Weighted sums of rows: sum i is that of row ``cells[i, k]`` times ``weights[i, k]``."""

    cells: Indices
    weights: Array

    def of(self, field: Array) -> Array:
        """Return the weighted sums of the rows of a ``field`` ``(n, k)``."""
        first, *others = zip(self.cells.T, self.weights.T[:, :, None], strict=True)
        total: Array = field[first[0]] * first[1]
        for cells, weights in others:
            part = field[cells]
            part *= weights
            total += part
        return total


def _along_both(sums: list[_Sums], field: Array) -> Array:
    along_x, along_y = sums
    return np.ascontiguousarray(along_y.of(np.ascontiguousarray(along_x.of(field).T)).T)


def _averages(fine: int, coarse: int) -> _Sums:
    """Return the overlaps of the coarse cells with fine ones, over the length of a coarse cell."""
    edges = np.arange(coarse + 1) * (fine / coarse)
    first = np.floor(edges[:-1]).astype(int)
    # Fine cells are at least half as long as coarse ones, so that three of them cover one.
    cells = first[:, None] + np.arange(3)
    overlap = np.minimum(cells + 1, edges[1:, None]) - np.maximum(cells, edges[:-1, None])
    # Fine cells beyond the last one have no weight.
    return _Sums(np.minimum(cells, fine - 1), np.maximum(overlap, 0.0) * (coarse / fine))


def _interpolation(fine: int, coarse: int) -> _Sums:
    """Return the weights of coarse cells in the interpolation at the centres of fine ones."""
    place = np.clip((np.arange(fine) + 0.5) * (coarse / fine) - 0.5, 0.0, coarse - 1)
    first = np.floor(place).astype(int)
    right = place - first
    cells = np.minimum(first[:, None] + np.arange(2), coarse - 1)
    return _Sums(cells, np.stack([1.0 - right, right], axis=1))
