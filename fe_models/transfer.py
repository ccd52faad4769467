"""Fields between the nodes of a contact face and the cells of a grid over it.

The face carries a piecewise linear field on its facets. With W the share of each cell's area
that belongs to each node's shape function, a cell takes the mean W s / ΣW over the part of it that
the face covers, and a node the mean Wᵀ h / ΣWᵀ of the cells around it. Both keep constants and
integrals: rows of W add up to the covered areas exactly, columns to the nodal areas to 1e-5 (in a
line contact, exactly).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from fe_models.mesh import Face
from sa_solver.types import Array, Grid

# Sample points per cell and direction for the areas that cells and triangles share.
SAMPLES = 4
# Sampling leaves 1e-2 in the areas of the columns, these sweeps 1e-6; 20 left 7e-5 on skewed faces.
BALANCING_SWEEPS = 100
# Barycentric coordinates above this are inside: a point on an edge belongs to either triangle.
INSIDE = -1e-9


@dataclass(frozen=True)
class FaceTransfer:
    """Transfer between the ``n`` nodes of a face and a grid's ``(nx, ny)`` cells.

    ``shared`` ``(nx ny, n)`` holds the areas W [mm²]; ``nearest`` ``(nx ny,)`` the node next to
    each cell, which stands in where the face does not cover the cell.
    """

    grid: Grid
    shared: sp.csr_matrix
    nearest: Array

    @classmethod
    def between(cls, face: Face, grid: Grid) -> FaceTransfer:
        """Measure the shared areas of a face's facets and a grid in the same frame."""
        x, y = np.broadcast_arrays(grid.x, grid.y)
        _, nearest = cKDTree(face.coordinates).query(np.stack([x.ravel(), y.ravel()], 1))
        if face.line:
            return cls(grid, _shared_lengths(face, grid), nearest)
        return cls(grid, _balanced(_sampled_areas(face, grid), face.nodal_areas), nearest)

    def to_cells(self, nodal: Array) -> Array:
        """Cell means ``(..., nx, ny)`` of nodal values ``(..., n)``."""
        covered = np.asarray(self.shared.sum(axis=1)).ravel()
        rows = nodal.reshape(-1, nodal.shape[-1])
        means = (self.shared @ rows.T).T
        inside = covered > 0.0
        cells = rows[:, self.nearest]
        cells[:, inside] = means[:, inside] / covered[inside]
        return cells.reshape(*nodal.shape[:-1], *self.grid.shape)

    def to_nodes(self, cells: Array) -> Array:
        """Nodal values ``(n,)`` of cell values ``(nx, ny)``."""
        areas = np.asarray(self.shared.sum(axis=0)).ravel()
        return (self.shared.T @ cells.ravel()) / areas


def _shared_lengths(face: Face, grid: Grid) -> sp.csr_matrix:
    """Integrals of the nodes' shape functions over the strips of a line contact, exact."""
    borders = np.append(grid.x.ravel() - 0.5 * grid.pitch[0], grid.x.max() + 0.5 * grid.pitch[0])
    shared = np.zeros((grid.shape[0], len(face)))
    for first, second in face.facets:
        start, end = face.coordinates[[first, second], 0]
        # Share of the segment passed at each border; its shape function integrates to t²/2.
        passed = np.clip((borders - start) / (end - start), 0.0, 1.0)
        rising = 0.5 * (end - start) * np.diff(passed**2)
        shared[:, second] += rising
        shared[:, first] += (end - start) * np.diff(passed) - rising
    return sp.csr_matrix(np.abs(shared))


def _sampled_areas(face: Face, grid: Grid) -> sp.csr_matrix:
    """Shared areas from midpoints of SAMPLES x SAMPLES parts of each cell."""
    fine = Grid(
        (grid.shape[0] * SAMPLES, grid.shape[1] * SAMPLES),
        (grid.pitch[0] / SAMPLES, grid.pitch[1] / SAMPLES),
    )
    x, y = fine.x.ravel(), fine.y.ravel()
    free = np.ones(fine.shape, dtype=bool)
    rows, columns, values = [], [], []
    for triangle in face.facets:
        corners = face.coordinates[triangle]
        low, high = corners.min(axis=0), corners.max(axis=0)
        i = slice(*np.searchsorted(x, (low[0], high[0])))
        j = slice(*np.searchsorted(y, (low[1], high[1])))
        shape = _barycentric(corners, x[i, None], y[None, j])
        inside = np.all(shape > INSIDE, axis=0) & free[i, j]
        free[i, j] &= ~inside
        at_x, at_y = np.nonzero(inside)
        cell = ((at_x + i.start) // SAMPLES) * grid.shape[1] + (at_y + j.start) // SAMPLES
        for corner, node in enumerate(triangle):
            rows.append(cell)
            columns.append(np.full(len(cell), node))
            values.append(shape[corner][inside] * fine.cell_area)
    place = np.concatenate(rows), np.concatenate(columns)
    shape_2d = (grid.shape[0] * grid.shape[1], len(face))
    areas = sp.csr_matrix((np.maximum(np.concatenate(values), 0.0), place), shape=shape_2d)
    areas.eliminate_zeros()
    return areas


def _barycentric(corners: Array, x: Array, y: Array) -> Array:
    """Barycentric coordinates ``(3, ...)`` of points in a triangle ``(3, 2)``."""
    (ax, ay), (bx, by), (cx, cy) = corners
    twice = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    second = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / twice
    third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / twice
    return np.stack([1.0 - second - third, second, third])


def _balanced(areas: sp.csr_matrix, nodal_areas: Array) -> sp.csr_matrix:
    """Scale rows and columns in turn until both add up (Sinkhorn & Knopp 1967)."""
    covered = np.asarray(areas.sum(axis=1)).ravel()
    covered *= nodal_areas.sum() / covered.sum()
    for _ in range(BALANCING_SWEEPS):
        columns = np.asarray(areas.sum(axis=0)).ravel()
        areas = areas @ sp.diags(nodal_areas / columns)
        rows = np.asarray(areas.sum(axis=1)).ravel()
        areas = sp.diags(np.divide(covered, rows, out=np.zeros_like(rows), where=rows > 0)) @ areas
    return areas.tocsr()
