"""Stress at the vertices of a body, recovered from the displacements of the nodes around each.

Nodal displacements are more accurate than their derivatives in the elements. Round each vertex a
polynomial of one degree more than the elements is fitted to them by least squares, and its gradient
gives the stress (polynomial preserving recovery: Zhang and Naga 2005,
doi:10.1137/S1064827503402837). A stress of the elements' degree is found exactly, on any mesh and
at the boundary too, where the superconvergent patches of Zienkiewicz and Zhu (1992,
doi:10.1002/nme.1620330702) have few points and no partner: at the rim of a hole, 24 elements round
it, it leaves two thirds of their error with elements of order 1 and a fifth with those of order 2.
On surfaces that nothing touches the tractions left are taken off. Curved elements have their nodes
and normals where they are.
"""

from __future__ import annotations

from functools import cached_property
from itertools import product

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.elasticity.body import ElasticBody, components, tensors
from fe_models.meshes.isoparametric import facet_normals
from sa_solver.types import Array, Indices

Flags = NDArray[np.bool_]

# Vertices inside take the elements beside them if these have so many nodes per coefficient.
NODES_PER_COEFFICIENT = 1.5
# Weight of a node, (REACH - r)^2 at a distance r relative to that of the farthest.
REACH = 1.05
# A degree is one too many for the nodes where it makes slopes so many times as uncertain as a plane
# through them: through a single layer of elements 1e8 times and more, at a corner 300 times.
UNCERTAIN = 400.0
# Share of the normal matrix's trace that keeps it regular there: a thousand times rounding.
REGULAR = 1e-13
# Numbers of the fits' matrices at a time: few enough to stay in a processor's cache.
AT_ONCE = 200_000
# A surface is smooth where its facets turn by no more than 20 degrees from the mean normal, as of a
# fillet with nine round the circle; else it has an edge, of directions with more than such a share
# of the normals' squares.
SMOOTH, EDGE = 0.94, 0.1


class StressRecovery:
    """The stress of a body at its vertices; ``free`` are facets on which nothing acts."""

    def __init__(self, elastic: ElasticBody, free: Indices) -> None:
        self._elastic = elastic
        self._free = free

    def stress(
        self, displacement: Array, thermal: Array | None = None, vertices: Indices | None = None
    ) -> Array:
        """Cauchy stress of displacements ``(size,)`` at all vertices, ``(6, vertices)`` [MPa].

        Or at some. Ordered xx, yy, zz, xy, yz, zx of the global axes. Of the strain an expansion
        ``thermal`` ``(all vertices,)`` makes no stress (:mod:`fe_models.elasticity.thermal`).
        """
        if vertices is None:
            vertices = np.arange(self._elastic.body.mesh.nvertices)
        patches = self._patches[vertices]
        return self._of(displacement, vertices, patches, self._elastic.order + 1, thermal)

    def histories(
        self, displacements: Array, vertices: Indices, thermal: Array | None = None
    ) -> Array:
        """The same of several displacements ``(size, t)`` at some vertices, ``(t, 6, n)`` [MPa].

        With expansions ``(vertices, t)`` of all vertices. The fits are those of the vertices,
        whatever the displacements: all take them at once.
        """
        elastic, axes = self._elastic, list(self._elastic.body.axes)
        count, d = displacements.shape[1], self._elastic.dimension
        nodes = self._nodes_near(self._patches[vertices])
        values = displacements.reshape(-1, d, count).swapaxes(1, 2).reshape(-1, count * d)
        slopes = _gradients(elastic.nodes[:, axes], values, vertices, nodes, elastic.order + 1)
        stress = np.empty((count, 6, len(vertices)))
        for t, slope in enumerate(slopes.reshape(count, d, d, -1)):
            expansion = 0.0 if thermal is None else thermal[vertices, t]
            stress[t] = self._of_slopes(slope, expansion, vertices)
        return stress

    def alternatives(
        self, displacement: Array, vertices: Indices, thermal: Array | None = None
    ) -> Array:
        """The same at a few ``vertices`` by other fits, ``(k, 6, vertices)``: what is uncertain.

        From patches that reach an element farther; of elements of order 1 also by a polynomial of
        one degree less, since their displacements are of that order.
        """
        order, beside = self._elastic.order, self._elements_of_vertices
        reached = self._neighbours[vertices]
        near, wide = ((r @ beside).tocsr() for r in (reached, reached @ self._neighbours))
        found = [self._of(displacement, vertices, wide, order + 1, thermal)]
        if order == 1:
            found.append(self._of(displacement, vertices, near, order, thermal))
        return np.array(found)

    @cached_property
    def untouched(self) -> Indices:
        """Vertices of the surface on whose facets nothing acts."""
        mesh = self._elastic.body.mesh
        touched = mesh.facets[:, np.setdiff1d(mesh.boundary_facets(), self._free)]
        return np.setdiff1d(mesh.facets[:, self._free], touched)

    def _of(
        self,
        displacement: Array,
        vertices: Indices,
        elements: sp.csr_matrix,
        degree: int,
        thermal: Array | None,
    ) -> Array:
        """By a polynomial of a ``degree`` on so many rows of ``elements`` around ``vertices``."""
        points = self._elastic.nodes[:, list(self._elastic.body.axes)]
        values = displacement.reshape(-1, self._elastic.dimension)
        nodes = self._nodes_near(elements)
        slopes = _gradients(points, values, vertices, nodes, degree)
        return self._of_slopes(slopes, 0.0 if thermal is None else thermal[vertices], vertices)

    def _nodes_near(self, elements: sp.csr_matrix) -> sp.csr_matrix:
        """Nodes of each row of ``elements``, in their order."""
        nodes = (elements @ self._nodes_of_elements).tocsr()
        nodes.sort_indices()
        return nodes

    def _of_slopes(self, slopes: Array, thermal: Array | float, vertices: Indices) -> Array:
        """Stress ``(6, n)`` of derivatives ``(d, d, n)`` of the displacement and expansions."""
        axes = self._elastic.body.axes
        gradient = np.zeros((3, 3, len(vertices)))
        gradient[np.ix_(axes, axes)] = slopes
        gradient -= thermal * np.eye(3)[:, :, None]
        return self._without_tractions(self._elastic.cauchy(gradient), thermal, vertices)

    @cached_property
    def _elements_of_vertices(self) -> sp.csr_matrix:
        """Elements at each vertex, ``(vertices, elements)``."""
        mesh = self._elastic.body.mesh
        return _incidence(mesh.t, mesh.nvertices).T.tocsr()

    @cached_property
    def _nodes_of_elements(self) -> sp.csr_matrix:
        """Nodes of each element, ``(elements, nodes)``."""
        return _incidence(self._elastic.element_nodes, len(self._elastic.nodes))

    @cached_property
    def _neighbours(self) -> sp.csr_matrix:
        """Vertices that share an element, ``(vertices, vertices)``."""
        beside = self._elements_of_vertices
        return (beside @ beside.T).tocsr()

    @cached_property
    def _patches(self) -> sp.csr_matrix:
        """Elements whose nodes each vertex takes: two rings, inside one if that has enough."""
        mesh, near = self._elastic.body.mesh, self._elements_of_vertices
        reached = np.diff((near @ self._nodes_of_elements).tocsr().indptr)
        coefficients = len(_exponents(mesh.dim(), self._elastic.order + 1))
        few = reached < NODES_PER_COEFFICIENT * coefficients
        few[mesh.boundary_nodes()] = True
        wide = sp.diags(few.astype(float)) @ self._neighbours
        return (near + wide @ near).tocsr()

    def _without_tractions(self, stress: Array, thermal: Array | float, vertices: Indices) -> Array:
        """P σ P with P along the surface, where nothing acts on it."""
        along = self._along_surface[vertices]
        tensor = np.moveaxis(along @ np.moveaxis(tensors(stress), -1, 0) @ along, 0, -1)
        if self._elastic.dimension == 2:
            tensor[1, 1] = self._elastic.material.poisson * (tensor[0, 0] + tensor[2, 2])
            tensor[1, 1] -= self._elastic.material.young * thermal
        return components(tensor)

    @cached_property
    def _along_surface(self) -> Array:
        """Projectors on the surface ``(vertices, 3, 3)`` where it is free, else the identity.

        On an edge that sticks out both its surfaces are free and nothing but the stress along it is
        left; in one that goes inwards stress has no bound, and is left as it is.
        """
        mean, smooth, inwards, squares = self._surface(self._free)
        along = np.tile(np.eye(3), (len(mean), 1, 1))
        plane = self.untouched[smooth[self.untouched]]
        along[plane] -= mean[plane, :, None] * mean[plane, None, :]
        edge = self.untouched[~(smooth | inwards)[self.untouched]]
        share, direction = np.linalg.eigh(squares[edge])
        kept = share <= EDGE * share.sum(axis=1, keepdims=True)
        along[edge] = np.einsum("nak,nk,nbk->nab", direction, kept, direction)
        return along

    @cached_property
    def inward_edges(self) -> Indices:
        """Vertices of edges and corners of the body that go inwards: stress there has no bound."""
        return np.flatnonzero(self._surface(self._elastic.body.mesh.boundary_facets())[2])

    def beside(self, vertices: Indices) -> Indices:
        """The vertices and those that share an element with them."""
        return np.unique(self._neighbours[vertices].indices)

    def _surface(self, facets: Indices) -> tuple[Array, Flags, Flags, Array]:
        """Of a surface at all vertices: unit normals, smooth or not, going inwards or not.

        And the sums of the dyads of facet normals, ``(vertices, 3, 3)``.
        """
        body, count = self._elastic.body, self._elastic.body.mesh.nvertices
        corners, normals = body.mesh.facets[:, facets].T, body.outward_of(facets)
        area = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals / area
        if self._elastic.curved:
            here = facet_normals(body, facets)[:, : corners.shape[1]]
            mean, squares = _curved_normals(corners, here, count)
            here = here / np.linalg.norm(here, axis=2, keepdims=True)
        else:
            here = np.broadcast_to(normals[:, None], (*corners.shape, 3))
            mean = _vertex_normals(body.points, corners, normals, area, count)
            squares = _incidence(corners.T, count).T @ _dyads(area, normals)
        towards = body.points[corners].mean(axis=1)[:, None, :] - body.points[corners]
        towards /= np.linalg.norm(towards, axis=2, keepdims=True)
        turned, inward, sunk = np.ones(count), np.zeros((count, 3)), np.full(count, -np.inf)
        for k, corner in enumerate(corners.T):
            np.minimum.at(turned, corner, np.einsum("fa,fa->f", mean[corner], here[:, k]))
            np.add.at(inward, corner, towards[:, k])
        for k, corner in enumerate(corners.T):
            np.maximum.at(sunk, corner, np.einsum("fa,fa->f", inward[corner], here[:, k]))
        smooth = turned > SMOOTH
        return mean, smooth, ~smooth & (sunk > 0.0), squares.reshape(-1, 3, 3)


def _dyads(size: Array, normals: Array) -> Array:
    """Of unit normals ``(m, 3)``, each times its size ``(m, 1)``: ``(m, 9)``."""
    return np.asarray(size[:, :, None] * normals[:, :, None] * normals[:, None, :]).reshape(-1, 9)


def _curved_normals(corners: Indices, normals: Array, count: int) -> tuple[Array, Array]:
    """Unit normals ``(count, 3)`` of curved facets at their vertices, and sums of their dyads.

    ``normals`` ``(m, corners, 3)`` are as long as the facets are large.
    """
    mean, squares = np.zeros((count, 3)), np.zeros((count, 9))
    for k, corner in enumerate(corners.T):
        size = np.linalg.norm(normals[:, k], axis=1, keepdims=True)
        np.add.at(mean, corner, normals[:, k])
        np.add.at(squares, corner, _dyads(size, normals[:, k] / size))
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    return np.divide(mean, length, out=mean, where=length > 0.0), squares


def _incidence(rows: Indices, count: int) -> sp.csr_matrix:
    """``(m, count)`` with ones at the ``rows`` ``(k, m)`` of its columns."""
    k, m = rows.shape
    places = np.tile(np.arange(m), k), rows.ravel()
    return sp.csr_matrix((np.ones(k * m), places), shape=(m, count))


def _vertex_normals(
    points: Array, corners: Indices, normals: Array, area: Array, count: int
) -> Array:
    """Unit normals ``(count, 3)`` of a faceted surface at its vertices, exact on a sphere.

    Weights of Max (1999, doi:10.1080/10867651.1999.10487501): small facets count more.
    """
    total = np.zeros((count, 3))
    for k in range(corners.shape[1]):
        here = points[corners[:, k]]
        sides = [points[corners[:, j]] - here for j in range(corners.shape[1]) if j != k]
        weight = area if len(sides) == 2 else np.ones_like(area)
        for side in sides:
            square = np.einsum("fa,fa->f", side, side)[:, None]
            weight = weight / (square if len(sides) == 2 else np.sqrt(square))
        np.add.at(total, corners[:, k], weight * normals)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=total, where=length > 0.0)


def _exponents(dimension: int, degree: int) -> Indices:
    """Exponents ``(m, dimension)`` of the monomials up to a degree."""
    every = product(range(degree + 1), repeat=dimension)
    # By degree: first the constant, then those of the axes in their order.
    up = sorted((e for e in every if sum(e) <= degree), key=lambda e: (sum(e), e[::-1]))
    return np.array(up)


def _gradients(
    points: Array, values: Array, vertices: Indices, nodes: sp.csr_matrix, degree: int
) -> Array:
    """``(k, d, len(vertices))``: derivatives along axis b, the second, of component a of values.

    Fitted to the nodes in each row of ``nodes``, by as high a ``degree`` as they can tell;
    ``points`` are ``(n, d)`` and ``values`` ``(n, k)``.
    """
    k, d, exponents = values.shape[1], points.shape[1], _exponents(points.shape[1], degree)
    regular = REGULAR * np.diag((exponents.sum(axis=1) > 1).astype(float))
    slopes = slice(1, d + 1)
    poor = np.zeros(len(vertices), bool)
    counts = np.diff(nodes.indptr)
    gradient = np.empty((k, d, len(vertices)))
    # Rows of like lengths together, filled up with nodes of no weight.
    order = np.argsort(counts, kind="stable")
    per_chunk = max(AT_ONCE // (len(exponents) * int(counts.max(initial=1))), 1)
    for part in np.array_split(order, range(per_chunk, len(order), per_chunk)):
        places = np.arange(counts[part].max())
        real = places < counts[part, None]
        near = nodes.indices[np.where(real, nodes.indptr[part, None] + places, 0)]
        own = vertices[part, None]
        arms = points[near] - points[own]
        distance = np.where(real, np.linalg.norm(arms, axis=2), 0.0)
        size = distance.max(axis=1)[:, None]
        weight = np.where(real, (REACH - distance / size) ** 2, 0.0)
        terms = _monomials(arms / size[:, :, None], exponents)
        weighted = (weight[:, :, None] * terms).swapaxes(1, 2)
        normal = weighted @ terms
        normal += np.trace(normal, axis1=1, axis2=2)[:, None, None] * regular
        right = weighted @ (values[near] - values[own])
        unit = np.broadcast_to(np.eye(len(exponents))[:, slopes], (len(part), len(exponents), d))
        solved = np.linalg.solve(normal, np.concatenate([right, unit], axis=2))[:, slopes]
        gradient[:, :, part] = (solved[:, :, :k] / size[:, :, None]).transpose(2, 1, 0)
        plane = np.linalg.inv(normal[:, : d + 1, : d + 1])[:, slopes, slopes]
        inflated = np.linalg.solve(plane, solved[:, :, k:])
        poor[part] = np.trace(inflated, axis1=1, axis2=2) > d * UNCERTAIN
    if poor.any() and degree > 1:
        gradient[:, :, poor] = _gradients(points, values, vertices[poor], nodes[poor], degree - 1)
    return gradient


def _monomials(x: Array, exponents: Indices) -> Array:
    """``(..., m)`` at points ``(..., d)``."""
    powers = [np.ones_like(x)]
    for _ in range(exponents.max()):
        powers.append(powers[-1] * x)
    terms = np.ones((*x.shape[:-1], len(exponents)))
    for term, exponent in enumerate(exponents):
        for axis in np.flatnonzero(exponent):
            terms[..., term] *= powers[exponent[axis]][..., axis]
    return terms
