"""Coarser grids over the same area, and how fields pass between them."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse

from sa_solver.half_space import HalfSpace
from sa_solver.types import Array, Grid

COARSEST = 32
"""Cells across below which a grid is not coarsened: there a solve costs less than its set-up."""


def coarsened(fine: HalfSpace) -> tuple[HalfSpace, GridTransfer] | None:
    """The same bodies on half as many cells along each side of more than 32, and the transfer.

    None where no side is that long. Any number of cells will do: an odd one is rounded up.
    """
    nx, ny = ((n + 1) // 2 if n > COARSEST else n for n in fine.grid.shape)
    if (nx, ny) == fine.grid.shape:
        return None
    grid = Grid.over(fine.grid.size, (nx, ny), fine.grid.line)
    return fine.on(grid), GridTransfer(fine.grid, grid)


class GridTransfer:
    """Passes fields between a ``fine`` and a ``coarse`` grid over the same area."""

    def __init__(self, fine: Grid, coarse: Grid) -> None:
        self.fine = fine
        pairs = list(zip(fine.shape, coarse.shape, strict=True))
        self._averages = [_averages(n, m) for n, m in pairs]
        self._interpolation = [_interpolation(n, m) for n, m in pairs]

    def averaged(self, field: Array) -> Array:
        """Means over the coarse cells of a field on the fine ones."""
        return _along_both(self._averages, field)

    def interpolated(self, field: Array) -> Array:
        """Bilinear interpolation at the fine cells of a field on the coarse ones."""
        return _along_both(self._interpolation, field)


def _along_both(matrices: Any, field: Array) -> Array:
    along_x, along_y = matrices
    return np.ascontiguousarray((along_y @ (along_x @ field).T).T)


def _averages(fine: int, coarse: int) -> Any:
    """Overlap of coarse cells with fine ones over a coarse cell's length, ``(coarse, fine)``."""
    edges = np.arange(coarse + 1) * (fine / coarse)
    first = np.floor(edges[:-1]).astype(int)
    # Fine cells are between half as long and as long as coarse ones: three cover one.
    cells = first[:, None] + np.arange(3)
    overlap = np.minimum(cells + 1, edges[1:, None]) - np.maximum(cells, edges[:-1, None])
    return _sparse(np.maximum(overlap, 0.0) * (coarse / fine), cells, fine)


def _interpolation(fine: int, coarse: int) -> Any:
    """Weights of coarse cells at the centres of fine ones, ``(fine, coarse)``."""
    place = np.clip((np.arange(fine) + 0.5) * (coarse / fine) - 0.5, 0.0, coarse - 1)
    first = np.floor(place).astype(int)
    right = place - first
    return _sparse(np.stack([1.0 - right, right], axis=1), first[:, None] + np.arange(2), coarse)


def _sparse(weights: Array, columns: Any, size: int) -> Any:
    kept = weights > 0.0
    starts = np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
    return scipy.sparse.csr_array((weights[kept], columns[kept], starts), (len(weights), size))
