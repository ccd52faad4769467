"""The form of meshed contact faces between their nodes, where facets are straight.

A contact may be narrower than an element, and the sagitta of a facet larger than the bodies yield:
what a fine grid sees must be the surface that was meshed, not its facets. On each facet the height
over the frame's plane is quadratic: linear between the vertices, and off the chord of each edge in
its middle by a *bulge*. Bulges come from midside nodes, which a mesh of second order has and gmsh
puts on the surfaces of a CAD file, or else from quadratics fitted to the heights of the vertices
around (least squares over two rings, as in the recovery of Zienkiewicz and Zhu 1992,
doi:10.1002/nme.1620330702). Edges whose surroundings are no quadratic, as at a corner or where a
flat goes over into a radius, stay straight.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sa_solver.types import Array, Indices, Mask

# Corners of the edges of a segment and of a triangle, by the number of their corners.
EDGES = {2: ((0, 1),), 3: ((0, 1), (1, 2), (2, 0))}
# Edges of a facet whose corners are listed in the other order, by how many it has.
TURNED = {1: [0], 3: [1, 0, 2]}
# What a fit may leave of the heights, over the bulge that it gives: at a corner and where a flat
# goes over into a radius it leaves 3 times that, on a circle of ten edges a quadrant 0.1.
SMOOTH = 1.0
# Heights this share of an edge off a fit are the rounding of a file.
ROUNDING = 1e-6
# Singular values of a fit below this share of the largest are none: too few vertices around.
RANK = 1e-6
# A point is still on a facet when it is off by this share of it: edges belong to both sides.
INSIDE = 1e-9


@dataclass(frozen=True)
class Midsides:
    """Points of a surface in the middle of edges, whose ends are vertices ``edges`` ``(k, 2)``.

    ``points`` ``(k, 3)`` [mm]; ``rows`` ``(k,)`` are those of their nodes among the file's, -1 of
    points that are none. An edge may be there more than once.
    """

    edges: Indices
    points: Array
    rows: Indices | None = None

    def at(self, edges: Indices) -> Array:
        """Those of ``edges`` ``(m, 2)``, ``(m, 3)`` [mm]; NaN where there is none."""
        count = 1 + max(self.edges.max(initial=0), edges.max(initial=0))
        known, wanted = (np.sort(e, axis=1) @ (count, 1) for e in (self.edges, edges))
        order = np.argsort(known, kind="stable")
        place = np.searchsorted(known[order], wanted)
        found = np.full((len(edges), 3), np.nan)
        there = place < len(known)
        there[there] = known[order[place[there]]] == wanted[there]
        found[there] = self.points[order[place[there]]]
        return found


@dataclass(frozen=True)
class Surface:
    """Heights over the frame of a face [mm]: of nodes ``(n,)`` and bulges of facets ``(m, edges)``.

    Bulges at a node are off by up to about what the fit through the nodes around it has ``left`` of
    their heights ``(n,)`` [mm], None where midsides say; ``straight`` edges have none because their
    surroundings are no quadratic.
    """

    heights: Array
    bulges: Array
    left: Array | None = None
    straight: int = 0

    @classmethod
    def flat(cls, nodes: int, facets: Indices) -> Surface:
        """So many nodes in the plane of the frame, and facets that are straight."""
        return cls(np.zeros(nodes), np.zeros(edges_of(facets).shape[:2]))

    @classmethod
    def of(cls, points: Array, facets: Indices, midsides: Array | None) -> Surface:
        """From points ``(n, 3)`` in the frame, facets ``(m, corners)`` and maybe midsides.

        These are ``(m, edges, 3)`` in the frame [mm], NaN where there is none.
        """
        if midsides is None or np.isnan(midsides).any():
            return _fitted(points, facets)
        return cls(points[:, 2], _from_midsides(points, facets, midsides))

    @property
    def error(self) -> float:
        """How far bulges are off anywhere, as far as the vertices tell [mm]."""
        return 0.0 if self.left is None else float(self.left.max(initial=0.0))

    def part(self, nodes: Indices, facets: Mask) -> Surface:
        """On some nodes and facets alone."""
        return self._with(nodes, self.bulges[facets])

    def mirrored(self, nodes: Indices, facets: int) -> Surface:
        """With its images: all ``nodes``, and so many facets, every image turned round."""
        bulges = self.bulges
        while len(bulges) < facets:
            bulges = np.concatenate([bulges, bulges[:, TURNED[bulges.shape[1]]]])
        return self._with(nodes, bulges)

    def _with(self, nodes: Indices, bulges: Array) -> Surface:
        left = None if self.left is None else self.left[nodes]
        return replace(self, heights=self.heights[nodes], bulges=bulges, left=left)

    def over(self, coordinates: Array, facets: Indices, x: Array, y: Array) -> Array:
        """Height ``(nx, ny)`` [mm] at rising ``x`` ``(nx, 1)`` and ``y`` ``(1, ny)``; else NaN.

        ``coordinates`` ``(n, 2)`` and ``facets`` are those of the face.
        """
        height = np.full((x.size, y.size), np.nan)
        for facet, bulges in zip(facets, self.bulges, strict=True):
            window, shares = _shares(coordinates[facet], x.ravel(), y.ravel())
            met = np.all(shares >= -INSIDE, axis=-1)
            inside = shares[met]
            height[window][met] = inside @ self.heights[facet] + bulge_of(inside, bulges)
        return height


def edges_of(facets: Indices) -> Indices:
    """Ends of the edges ``(m, edges, 2)`` of facets ``(m, corners)``."""
    return np.asarray(facets[:, EDGES[facets.shape[1]]])


def _shares(corners: Array, x: Array, y: Array) -> tuple[tuple[slice, slice], Array]:
    """Cells about a facet, and their barycentric coordinates ``(..., corners)`` on it.

    ``corners`` are ``(corners, 2)``; ``x`` ``(nx,)`` and ``y`` ``(ny,)`` rise.
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
    """What bulges ``(..., edges)`` add at barycentric coordinates ``(..., corners)``."""
    first, second = np.array(EDGES[shares.shape[-1]]).T
    return np.asarray(4.0 * (shares[..., first] * shares[..., second] * bulges).sum(axis=-1))


def _from_midsides(points: Array, facets: Indices, midsides: Array) -> Array:
    """How far midsides are above the planes of their facets, along z; of two facets the mean."""
    corners = points[facets]
    bulges = np.empty(midsides.shape[:2])
    first, second = corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]
    normals = np.cross(first, second if facets.shape[1] == 3 else [0.0, 1.0, 0.0])
    for k, (a, b) in enumerate(EDGES[facets.shape[1]]):
        off = midsides[:, k] - 0.5 * (corners[:, a] + corners[:, b])
        bulges[:, k] = np.einsum("ma,ma->m", off, normals) / normals[:, 2]
    return _shared(facets, bulges)


def _shared(facets: Indices, values: Array) -> Array:
    """The mean over the facets beside each edge of ``values`` ``(m, edges)``."""
    pairs = np.sort(edges_of(facets), axis=2).reshape(-1, 2)
    _, edge, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    total = np.bincount(edge.ravel(), values.ravel())
    return np.asarray((total / count)[edge.ravel()].reshape(values.shape))


def _fitted(points: Array, facets: Indices) -> Surface:
    """From quadratics through the heights of the vertices around."""
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
    """Second derivatives ``(n, 2, 2)`` of the fits at the vertices, and the most they leave."""
    # A tenth of a second to import, which `fretscale check` need not wait for.
    import scipy.sparse as sp

    count, corners = len(points), facets.shape[1]
    pairs = np.concatenate([facets[:, [a, b]] for a in range(corners) for b in range(corners)])
    beside = sp.csr_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
    around = (beside @ beside).tocsr()
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
