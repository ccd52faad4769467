"""Transfer of fields between the nodes of a contact face and the cells of a grid over it.

The face has a piecewise linear field on its facets. With W the share of each cell's area that
belongs to each node's shape function, a cell takes the mean W s / ΣW over the part of it that the
face covers, and a node the mean Wᵀ h / A of the cells over its area A. Both preserve constants and
integrals where the grid covers the face. The nodes of a weighted face instead have the values of
the linear field whose means under the nodes' shape functions are those of the cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.ndimage import map_coordinates
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from fe_models.meshes.structure_mesh import Face
from sa_solver.types import Array, Grid, Indices, Mask

# Two points integrate the quadratics under a straight edge exactly (Gauss).
GAUSS = np.sqrt(1.0 / 3.0)
# Share of a triangle's area below which its area in a cell is a rounding error.
ROUNDING = 1e-12
# Relative difference up to which areas count as equal, of a node and of half a cell.
SHARED = 1e-6
# Number of pairs of lines near triangles that are treated together.
AT_ONCE = 20_000


@dataclass(frozen=True)
class FaceTransfer:
    """Transfer between the ``n`` nodes of a face and a grid's ``(nx, ny)`` cells.

    Attributes
    ----------
    face
        The face.
    grid
        The grid, in the same frame.
    shared
        Areas W ``(nx ny, n)`` [mm²].
    nearest
        Node closest to each cell ``(nx ny,)``, which is used where the face does not cover the
        cell.
    areas
        Areas of the nodes ``(n,)`` [mm²].
    """

    face: Face
    grid: Grid
    shared: sp.csr_matrix
    nearest: Array
    areas: Array

    @classmethod
    def between(cls, face: Face, grid: Grid) -> FaceTransfer:
        """Measure the shared areas of a face's facets and a grid in the same frame."""
        _, nearest = cKDTree(face.coordinates).query(grid.centres.reshape(2, -1).T)
        if face.line:
            return cls(face, grid, _shared_lengths(face, grid), nearest, face.facet_shares)
        return cls(face, grid, _shared_areas(face, grid), nearest, face.facet_shares)

    @property
    def nodes(self) -> Array:
        """Coordinates ``(n, 2)`` of the nodes [mm]."""
        return self.face.coordinates

    @property
    def opposed(self) -> Array:
        """Area of each node ``(n,)`` [mm²] that the other body's face covers."""
        return self.face.nodal_areas

    def spacing(self, region: Array) -> Array:
        """Return the distance of neighbouring nodes along x and along y ``(2,)`` [mm].

        It is the median over the facets in a ``region`` ``(2, 2)``, given by its smallest and
        largest x and y. On a weighted face midside nodes count as nodes.
        """
        corners = self.face.coordinates[self.face.facets]
        middles = corners.mean(axis=1)
        within = np.all((middles >= region[0]) & (middles <= region[1]), axis=1)
        near = corners[within] if within.any() else corners
        spacing: Array = np.median(np.ptp(near, axis=1), axis=0)
        return spacing / self.per_facet

    @property
    def per_facet(self) -> int:
        """Number of node distances along a facet: 2 with midside nodes, else 1."""
        return 2 if self.face.weighted else 1

    @cached_property
    def places(self) -> Array:
        """Position of each cell ``(2, nx, ny)`` [mm]; off the face, that of the closest node."""
        cells = self.grid.centres.reshape(2, -1)
        places = np.where(self.covered > 0.0, cells, self.nodes[self.nearest].T)
        return places.reshape(2, *self.grid.shape)

    @cached_property
    def covered(self) -> Array:
        """Area of each cell that the face covers ``(nx ny,)`` [mm²]."""
        return np.asarray(self.shared.sum(axis=1)).ravel()

    @cached_property
    def inside(self) -> Mask:
        """Flags of the cells ``(nx, ny)`` of which the face covers at least half."""
        covered = self.covered.reshape(self.grid.shape)
        return np.asarray(covered >= (0.5 - SHARED) * self.grid.cell_area)

    def to_cells(self, nodal: Array) -> Array:
        """Return cell means ``(..., nx, ny)`` of nodal values ``(..., n)``."""
        rows = nodal.reshape(-1, nodal.shape[-1])
        means = (self.shared @ rows.T).T
        inside = self.covered > 0.0
        cells = rows[:, self.nearest]
        cells[:, inside] = means[:, inside] / self.covered[inside]
        return cells.reshape(*nodal.shape[:-1], *self.grid.shape)

    @cached_property
    def reached(self) -> Mask:
        """Flags of the nodes ``(n,)`` for which the grid has all that :meth:`sample` needs."""
        if not self.face.weighted:
            return np.ones(len(self.nodes), dtype=np.bool_)
        return np.asarray(self.shared.sum(axis=0)).ravel() > (1.0 - SHARED) * self.areas

    def spread(self, forces: Array) -> Array:
        """Return tractions ``(..., nx, ny)`` [MPa] of nodal ``forces`` ``(..., n)`` [N].

        The sum of the forces is preserved.
        """
        rows = forces.reshape(-1, forces.shape[-1])
        tractions = self._factors.solve(rows.T) if self.face.weighted else (rows / self.areas).T
        cells = (self.shared @ tractions).T / self.grid.cell_area
        return cells.reshape(*forces.shape[:-1], *self.grid.shape)

    def means(self, nodal: Array) -> Array:
        """Return what :meth:`sample` gives for a field with ``nodal`` values ``(..., n)``."""
        if not self.face.weighted:
            return nodal
        rows = nodal.reshape(-1, nodal.shape[-1])
        return np.asarray((self._products @ rows.T).T / self.areas).reshape(nodal.shape)

    def sample(self, cells: Array) -> Array:
        """Return nodal values ``(..., n)`` of fields ``(..., nx, ny)``, linear between cells.

        On a weighted face the values are means under the nodes' shape functions.
        """
        if self.face.weighted:
            rows = cells.reshape(-1, self.grid.shape[0] * self.grid.shape[1])
            return ((self.shared.T @ rows.T).T / self.areas).reshape(*cells.shape[:-2], -1)
        pitch, shape = np.array(self.grid.pitch), np.array(self.grid.shape)
        at = (self.nodes / pitch + 0.5 * (shape - 1)).T
        fields = cells.reshape(-1, *self.grid.shape)
        values = [map_coordinates(field, at, order=1, mode="nearest") for field in fields]
        return np.reshape(values, (*cells.shape[:-2], -1))

    def fitted(self, cells: Array) -> Array:
        """Return nodal values ``(n,)`` of the linear field closest to ``cells`` ``(nx, ny)``.

        The fit is by least squares: the means of the field under the nodes' shape functions are
        those of the cells, and so is its integral over a face that the grid covers. For a plane,
        sampled in n cells per facet, the error is about 1/(2 n²) of its rise over a facet.
        """
        values: Array = self._factors.solve(self.shared.T @ cells.ravel())
        return values

    @cached_property
    def _products(self) -> sp.csr_matrix:
        """Products ∫ φ_i φ_k dA of the nodes' functions φ ``(n, n)`` [mm²]; on a line [mm]."""
        facets = self.face.facets
        count = facets.shape[1]
        # On a facet of size 1 with k = 2 or 3 corners the integrals are 2 on and 1 off the
        # diagonal, divided by k (k + 1).
        local = (np.eye(count) + 1.0) / (count * (count + 1))
        values = self.face.facet_sizes[:, None, None] * local
        rows, columns = np.broadcast_arrays(facets[:, :, None], facets[:, None, :])
        places = rows.ravel(), columns.ravel()
        return sp.csr_matrix((values.ravel(), places), shape=(len(self.face),) * 2)

    @cached_property
    def _factors(self) -> Any:
        return splu(self._products.tocsc())

    def to_nodes(self, cells: Array) -> Array:
        """Return nodal values ``(n,)`` of cell values ``(nx, ny)``, zero beyond the grid."""
        return (self.shared.T @ cells.ravel()) / self.areas


def _shared_lengths(face: Face, grid: Grid) -> sp.csr_matrix:
    """Return the exact integrals of the nodes' functions over the cells of a line contact."""
    borders = _borders(grid)[0]
    shared = np.zeros((grid.shape[0], len(face)))
    for first, second in face.facets:
        start, end = face.coordinates[[first, second], 0]
        # The share t of the segment before each border; the second node's function has the
        # integral t²/2 over it.
        passed = np.clip((borders - start) / (end - start), 0.0, 1.0)
        rising = 0.5 * (end - start) * np.diff(passed**2)
        shared[:, second] += rising
        shared[:, first] += (end - start) * np.diff(passed) - rising
    return sp.csr_matrix(np.abs(shared))


def _shared_areas(face: Face, grid: Grid) -> sp.csr_matrix:
    """Return the exact integrals of the nodes' shape functions over the cells.

    Over the part of a triangle left of a line x = X and below a line y = Y, the integrals of 1, x
    and y are sums of the integrals under its edges (Green's theorem). Those over cells are their
    differences.
    """
    borders = _borders(grid)
    corners = face.coordinates[face.facets]
    first, count = _windows(corners, borders)
    parts = []
    # Triangles with windows of the same size are treated together, few enough at a time to stay in
    # the processor's cache.
    for size in np.unique(count, axis=0):
        same_size = np.flatnonzero((count == size).all(axis=1))
        for part in np.array_split(same_size, -(-len(same_size) * size.prod() // AT_ONCE)):
            lines = [
                near[first[part, axis, None] + np.arange(size[axis])]
                for axis, near in enumerate(borders)
            ]
            which, i, j, shares = _triangles(corners[part], *lines)
            at, nodes = first[part[which]], face.facets[part[which]]
            cells = (at[:, 0] + i) * grid.shape[1] + at[:, 1] + j
            parts.append((shares.ravel(), np.tile(cells, 3), nodes.T.ravel()))
    values, cells, nodes = (np.concatenate(part) for part in zip(*parts, strict=True))
    shape = grid.shape[0] * grid.shape[1], len(face)
    return sp.csr_matrix((values, (cells, nodes)), shape=shape)


def _borders(grid: Grid) -> list[Array]:
    """Return the borders of the cells along x and along y [mm]."""
    return [
        np.append(c.ravel() - 0.5 * d, c.max() + 0.5 * d)
        for c, d in zip((grid.x, grid.y), grid.pitch, strict=True)
    ]


def _windows(corners: Array, borders: list[Array]) -> tuple[Indices, Indices]:
    """Return the first border near each triangle along x and y, and the number of borders.

    Both are ``(m, 2)``.
    """
    low, high = corners.min(axis=1), corners.max(axis=1)
    first, last = (
        np.stack([np.searchsorted(lines, ends[:, axis]) for axis, lines in enumerate(borders)], 1)
        for ends in (low, high)
    )
    first = np.maximum(first - 1, 0)
    return first, np.minimum(last + 1, [len(lines) for lines in borders]) - first


def _triangles(corners: Array, x: Array, y: Array) -> tuple[Indices, Indices, Indices, Array]:
    """Return areas that triangles' shape functions share with cells between lines ``x`` and ``y``.

    ``corners`` are ``(m, 3, 2)``, lines ``(m, p)`` and ``(m, q)``. The result is the numbers of the
    triangle and of the cell's lines, ``(k,)`` each, and the areas of its corners ``(3, k)``.
    """
    middle = corners.mean(axis=1)
    local = corners - middle[:, None]
    moments = _left_and_below(local, x - middle[:, :1], y - middle[:, 1:])
    shapes = np.linalg.inv(np.concatenate([np.ones_like(local[..., :1]), local], axis=2))
    twice = np.linalg.det(local[:, 1:] - local[:, :1])[:, None, None]
    # The upper edges of a counter-clockwise triangle run in the negative direction of x.
    integrals = -np.sign(twice) * np.diff(np.diff(moments, axis=2), axis=3)
    met = integrals[0] > ROUNDING * np.abs(twice)
    which, i, j = np.nonzero(met)
    return which, i, j, np.einsum("kac,ak->ck", shapes[which], integrals[:, met])


def _left_and_below(corners: Array, x: Array, y: Array) -> Array:
    """Return integrals of 1, x and y over triangles, left of each x and below each y.

    The result is ``(3, m, p, q)``. Counter-clockwise triangles count as negative. The integrals
    start from y = 0, which cancels in differences.
    """
    x, y = x[:, :, None], y[:, None, :]
    start, end = corners.T[..., None, None], np.roll(corners, -1, axis=1).T[..., None, None]
    width, height = end - start
    upright = width == 0.0  # A vertical edge has no area under it.
    rise = np.divide(height, width, out=np.zeros_like(width), where=~upright)
    left, right = np.minimum(start[0], end[0]), np.maximum(start[0], end[0])
    stop = np.clip(x, left, right)
    # The edge crosses y at ``cross``: on one side the edge is the upper limit, on the other y is.
    above = y - start[1]
    level = np.broadcast_to(rise == 0.0, above.shape)
    passing = start[0] + np.divide(above, rise, out=np.zeros_like(above), where=~level)
    cross = np.clip(passing, left, stop)
    ends = np.stack(np.broadcast_arrays(left, cross, stop))
    half, middle = 0.5 * np.diff(ends, axis=0), 0.5 * (ends[1:] + ends[:-1])
    at = np.stack([middle - GAUSS * half, middle + GAUSS * half])
    top = np.minimum(start[1] + rise * (at - start[0]), y)
    weights = np.sign(width) * half
    return np.stack([np.sum(weights * f, axis=(0, 1, 2)) for f in (top, at * top, 0.5 * top**2)])
