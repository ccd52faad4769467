"""Form of meshed contact faces between their nodes, where facets are straight.

A contact may be narrower than an element, and the sagitta of a facet larger than the deformation of
the bodies. A fine grid must therefore use the surface that was meshed, not its facets. On each
facet the height over the frame's plane is quadratic: linear between the vertices, plus a *bulge* in
the middle of each edge. Bulges come from midside nodes, which a mesh of second order has and gmsh
puts on the surfaces of a CAD file, or else from quadratics fitted to the heights of the surrounding
vertices (least squares over two rings, as in the recovery of Zienkiewicz and Zhu 1992,
doi:10.1002/nme.1620330702). Edges stay straight where a quadratic does not fit their surroundings,
as at a corner or at the transition from a flat to a radius.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sa_solver.types import Array, Indices, Mask

# Corners of the edges of a segment and of a triangle, by the number of their corners.
EDGES = {2: ((0, 1),), 3: ((0, 1), (1, 2), (2, 0))}
# Order of the edges of a facet whose corners are listed in reverse, by the number of its edges.
TURNED = {1: [0], 3: [1, 0, 2]}
# Tolerated residual of a fit over the bulge that it gives. The ratio is 3 at a corner and at the
# transition from a flat to a radius, and 0.1 on a circle with ten edges per quadrant.
SMOOTH = 1.0
# Residual of a fit, as a share of the edge, up to which it is due to the rounding of a file.
ROUNDING = 1e-6
# Singular values of a fit below this share of the largest count as 0: there are too few vertices.
RANK = 1e-6
# Distance, as a share of a facet, up to which a point outside is still on it, so that edges belong
# to both sides.
INSIDE = 1e-9


def edge_numbers(edges: Indices, wanted: Indices) -> Indices:
    """Return the rows of ``wanted`` edges ``(m, 2)`` among ``edges`` ``(k, 2)``, -1 for others.

    The ends of an edge may be in any order. Of equal edges the first one counts.
    """
    count = 1 + max(edges.max(initial=0), wanted.max(initial=0))
    known, asked = (np.sort(e, axis=1).astype(np.int64) @ (count, 1) for e in (edges, wanted))
    order = np.argsort(known, kind="stable")
    place = np.searchsorted(known[order], asked)
    numbers = np.append(order, -1)[place]
    return np.where(np.append(known, -1)[numbers] == asked, numbers, -1)


@dataclass(frozen=True)
class Midsides:
    """Midside points of edges, whose ends are the vertices ``edges`` ``(k, 2)``.

    ``points`` are ``(k, 3)`` [mm]; ``rows`` ``(k,)`` are the rows of their nodes in the file, or -1
    for points that are not nodes. An edge may occur more than once.
    """

    edges: Indices
    points: Array
    rows: Indices | None = None

    def at(self, edges: Indices) -> Array:
        """Return the points of ``edges`` ``(m, 2)``, ``(m, 3)`` [mm]; NaN where there is none."""
        numbers = edge_numbers(self.edges, edges)
        found = np.full((len(edges), 3), np.nan)
        found[numbers >= 0] = self.points[numbers[numbers >= 0]]
        return found


@dataclass(frozen=True)
class Surface:
    """Heights of a face over its frame [mm]: of nodes ``(n,)``, and bulges ``(m, edges)``.

    ``left`` ``(n,)`` [mm] is the residual of the heights in the fit around each node, which
    estimates the error of the bulges there; None if midside nodes give the bulges. ``straight`` is
    the number of edges without a bulge because no quadratic fits their surroundings.
    """

    heights: Array
    bulges: Array
    form_error: Array | None = None
    straight: int = 0

    @classmethod
    def flat(cls, nodes: int, facets: Indices) -> Surface:
        """Return a plane surface with a number of ``nodes`` and straight facets."""
        return cls(np.zeros(nodes), np.zeros(edges_of(facets).shape[:2]))

    @classmethod
    def of(cls, points: Array, facets: Indices, midsides: Array | None) -> Surface:
        """Return the surface of points ``(n, 3)`` in the frame and facets ``(m, corners)``.

        ``midsides`` ``(m, edges, 3)`` are in the frame [mm], NaN where there is none. Bulges are
        fitted to the vertices unless all midsides are given.
        """
        if midsides is None or np.isnan(midsides).any():
            return _fitted(points, facets)
        return cls(points[:, 2], _from_midsides(points, facets, midsides))

    @property
    def error(self) -> float:
        """Largest estimated error of the bulges [mm]."""
        return 0.0 if self.form_error is None else float(self.form_error.max(initial=0.0))

    def part(self, nodes: Indices, facets: Mask) -> Surface:
        """Return the surface on some nodes and facets."""
        return self._with(nodes, self.bulges[facets])

    def mirrored(self, nodes: Indices, facets: int) -> Surface:
        """Return the surface with its images: all ``nodes``, and the number of ``facets``.

        Every image has the reverse orientation.
        """
        bulges = self.bulges
        while len(bulges) < facets:
            bulges = np.concatenate([bulges, bulges[:, TURNED[bulges.shape[1]]]])
        return self._with(nodes, bulges)

    def _with(self, nodes: Indices, bulges: Array) -> Surface:
        left = None if self.form_error is None else self.form_error[nodes]
        return replace(self, heights=self.heights[nodes], bulges=bulges, form_error=left)

    def over(self, coordinates: Array, facets: Indices, x: Array, y: Array) -> Array:
        """Return the height ``(nx, ny)`` [mm] at grid points, NaN beside the face.

        The points have rising ``x`` ``(nx, 1)`` and ``y`` ``(1, ny)``; ``coordinates`` ``(n, 2)``
        and ``facets`` are those of the face.
        """
        height = np.full((x.size, y.size), np.nan)
        for facet, bulges in zip(facets, self.bulges, strict=True):
            window, shares = _shares(coordinates[facet], x.ravel(), y.ravel())
            met = np.all(shares >= -INSIDE, axis=-1)
            inside = shares[met]
            height[window][met] = inside @ self.heights[facet] + bulge_of(inside, bulges)
        return height


def edges_of(facets: Indices) -> Indices:
    """Return the ends of the edges ``(m, edges, 2)`` of facets ``(m, corners)``."""
    return np.asarray(facets[:, EDGES[facets.shape[1]]])


def _shares(corners: Array, x: Array, y: Array) -> tuple[tuple[slice, slice], Array]:
    """Return the window of cells around a facet, and their barycentric coordinates on it.

    ``corners`` are ``(corners, 2)``; ``x`` ``(nx,)`` and ``y`` ``(ny,)`` rise. The coordinates are
    ``(..., corners)``.
    """
    if len(corners) == 2:
        window = slice(None), slice(None)
        others = ((x - corners[0, 0]) / (corners[1, 0] - corners[0, 0]))[:, None, None]
    else:
        low, high = corners.min(axis=0), corners.max(axis=0)
        i = slice(*np.searchsorted(x, (low[0], high[0])))
        j = slice(*np.searchsorted(y, (low[1], high[1])))
        window = i, j
        places = np.stack(np.meshgrid(x[i], y[j], indexing="ij"), axis=-1)
        others = (places - corners[0]) @ np.linalg.inv(corners[1:] - corners[0])
    return window, np.concatenate([1.0 - others.sum(axis=-1, keepdims=True), others], axis=-1)


def bulge_of(shares: Array, bulges: Array) -> Array:
    """Return the height that bulges ``(..., edges)`` add at barycentric coordinates.

    These are the ``shares`` ``(..., corners)``.
    """
    first, second = np.array(EDGES[shares.shape[-1]]).T
    return np.asarray(4.0 * (shares[..., first] * shares[..., second] * bulges).sum(axis=-1))


def _from_midsides(points: Array, facets: Indices, midsides: Array) -> Array:
    """Return the heights of midside points above their facets, along z.

    Where two facets share an edge, it is their mean.
    """
    corners = points[facets]
    bulges = np.empty(midsides.shape[:2])
    first, second = corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]
    normals = np.cross(first, second if facets.shape[1] == 3 else [0.0, 1.0, 0.0])
    for k, (a, b) in enumerate(EDGES[facets.shape[1]]):
        off = midsides[:, k] - 0.5 * (corners[:, a] + corners[:, b])
        bulges[:, k] = np.einsum("ma,ma->m", off, normals) / normals[:, 2]
    return _shared(facets, bulges)


def _shared(facets: Indices, values: Array) -> Array:
    """Return the mean over the facets that share each edge of ``values`` ``(m, edges)``."""
    pairs = np.sort(edges_of(facets), axis=2).reshape(-1, 2)
    _, edge, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    total = np.bincount(edge.ravel(), values.ravel())
    return np.asarray((total / count)[edge.ravel()].reshape(values.shape))


def _fitted(points: Array, facets: Indices) -> Surface:
    """Return the surface with bulges from quadratics through the surrounding vertices."""
    curvature, left = _quadratics(points, facets)
    pairs = edges_of(facets)
    along = points[pairs[..., 1], :2] - points[pairs[..., 0], :2]
    bulges = -0.0625 * np.einsum("mea,meiab,meb->me", along, curvature[pairs], along)
    residual = left[pairs].max(axis=2)
    bent = residual > SMOOTH * np.abs(bulges)
    seen = bent & (residual > ROUNDING * np.linalg.norm(along, axis=2))
    kept = np.where(bent, 0.0, bulges)
    straight = len(np.unique(np.sort(pairs[seen], axis=1), axis=0))
    return Surface(points[:, 2], kept, left, straight)


def _quadratics(points: Array, facets: Indices) -> tuple[Array, Array]:
    """Return second derivatives ``(n, 2, 2)`` of the fits at the vertices, and their residuals."""
    # The import takes a tenth of a second, for which `fretscale check` need not wait.
    import scipy.sparse as sp

    count, corners = len(points), facets.shape[1]
    pairs = np.concatenate([facets[:, [a, b]] for a in range(corners) for b in range(corners)])
    adjacency = sp.csr_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
    around = (adjacency @ adjacency).tocsr()
    powers = [(0, 0), (1, 0), (2, 0)]
    if corners == 3:
        powers += [(0, 1), (1, 1), (0, 2)]
    curvature, left = np.zeros((count, 2, 2)), np.zeros(count)
    for node in range(count):
        ring = around.indices[around.indptr[node] : around.indptr[node + 1]]
        x, y, z = (points[ring] - points[node]).T
        reach = np.hypot(x, y).max()
        terms = np.stack([(x / reach) ** i * (y / reach) ** j for i, j in powers], axis=1)
        fit = np.linalg.lstsq(terms, z, rcond=RANK)[0]
        left[node] = np.abs(terms @ fit - z).max()
        second = dict(zip(powers, fit / reach**2, strict=True))
        curvature[node, 0, 0] = 2.0 * second[2, 0]
        if corners == 3:
            curvature[node, 1, 1] = 2.0 * second[0, 2]
            curvature[node, 0, 1] = curvature[node, 1, 0] = second[1, 1]
    return curvature, left
