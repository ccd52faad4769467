"""Stress at the vertices of a body, recovered from the displacements of the surrounding nodes.

Nodal displacements are more accurate than their derivatives in the elements. Around each vertex a
polynomial of one degree more than the elements is fitted to them by least squares, and its gradient
gives the stress (polynomial preserving recovery: Zhang and Naga 2005,
doi:10.1137/S1064827503402837). A stress of the elements' degree is recovered exactly, on any mesh
and also at the boundary, where the superconvergent patches of Zienkiewicz and Zhu (1992,
doi:10.1002/nme.1620330702) have few points and are one-sided. At the rim of a hole with 24 elements
around it, the error is two thirds of theirs with elements of order 1 and a fifth with those of
order 2. On free surfaces the remaining tractions are removed. For curved elements the actual
positions and normals are used.
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

# Inner vertices use the elements around them if these have this many nodes per coefficient.
NODES_PER_COEFFICIENT = 1.5
# The weight of a node is (REACH - r)^2 at a distance r relative to that of the farthest node.
REACH = 1.05
# The degree of a fit is lowered where its slopes are this many times as uncertain as those of a
# plane through the nodes. The factor is 1e8 or more in a single layer of elements, 300 at a corner.
UNCERTAIN = 400.0
# Share of the normal matrix's trace that is added to keep it regular: a thousand times rounding.
REGULAR = 1e-13
# Number of matrix entries of fits treated together: few enough to stay in a processor's cache.
AT_ONCE = 200_000
# SMOOTH is the cosine of 20 degrees: a surface is smooth where its facets deviate by no more than
# this from the mean normal, as on a fillet with nine facets around the circle. Otherwise it has an
# edge, and stress is removed along directions with more than EDGE of the normals' squares.
SMOOTH, EDGE = 0.94, 0.1


class StressRecovery:
    """Recovery of the stress of a body at its vertices.

    Parameters
    ----------
    elastic
        The elastic body.
    free
        Facets without traction.
    order
        Order of the elements whose displacements its nodes have; by default that of its own.
    """

    def __init__(self, elastic: ElasticBody, free: Indices, order: int | None = None) -> None:
        self._elastic = elastic
        self._free = free
        self._order = elastic.order if order is None else order

    def stress(
        self, displacement: Array, thermal: Array | None = None, vertices: Indices | None = None
    ) -> Array:
        """Return the Cauchy stress at all vertices, ``(6, vertices)`` [MPa], or at some of them.

        Components are ordered xx, yy, zz, xy, yz, zx of the global axes. A thermal expansion
        ``thermal`` ``(all vertices,)`` is subtracted from the strain of the displacements
        ``(size,)`` (:mod:`fe_models.elasticity.thermal`).
        """
        if vertices is None:
            vertices = np.arange(self._elastic.body.mesh.nvertices)
        patches = self._patches[vertices]
        return self._of(displacement, vertices, patches, self._order + 1, thermal)

    def histories(
        self, displacements: Array, vertices: Indices, thermal: Array | None = None
    ) -> Array:
        """Return stresses ``(t, 6, n)`` [MPa] of several displacements ``(size, t)`` at vertices.

        ``thermal`` ``(vertices, t)`` are expansions of all vertices. The fits depend on the
        vertices only, so all displacements are treated together.
        """
        elastic, axes = self._elastic, list(self._elastic.body.axes)
        count, d = displacements.shape[1], self._elastic.dimension
        nodes = self._nodes_near(self._patches[vertices])
        values = displacements.reshape(-1, d, count).swapaxes(1, 2).reshape(-1, count * d)
        slopes = _gradients(elastic.nodes[:, axes], values, vertices, nodes, self._order + 1)
        stress = np.empty((count, 6, len(vertices)))
        for t, slope in enumerate(slopes.reshape(count, d, d, -1)):
            expansion = 0.0 if thermal is None else thermal[vertices, t]
            stress[t] = self._of_slopes(slope, expansion, vertices)
        return stress

    def slopes(self, values: Array, vertices: Indices) -> Array:
        """Return the derivatives ``(k, d, n)`` at ``vertices`` of nodal ``values`` ``(nodes, k)``.

        They are those of the polynomials that give the stress.
        """
        points = self._elastic.nodes[:, list(self._elastic.body.axes)]
        nodes = self._nodes_near(self._patches[vertices])
        return _gradients(points, values, vertices, nodes, self._order + 1)

    def along_surface(self, vertices: Indices) -> Array:
        """Return the projectors ``(n, 3, 3)`` on the free surface at ``vertices``."""
        return self._along_surface[vertices]

    def alternatives(
        self, displacement: Array, vertices: Indices, thermal: Array | None = None
    ) -> Array:
        """Return the stress at a few ``vertices`` by other fits, as a measure of its uncertainty.

        The result is ``(k, 6, vertices)``. The other patches reach one element farther. With
        elements of order 1 there is also a fit with a polynomial of one degree less, since their
        displacements are of that order.
        """
        order, at_vertices = self._order, self._elements_of_vertices
        reached = self._neighbours[vertices]
        near, wide = ((r @ at_vertices).tocsr() for r in (reached, reached @ self._neighbours))
        found = [self._of(displacement, vertices, wide, order + 1, thermal)]
        if order == 1:
            found.append(self._of(displacement, vertices, near, order, thermal))
        return np.array(found)

    @cached_property
    def untouched(self) -> Indices:
        """Vertices of the surface of which all facets are free."""
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
        """Return the stress by polynomials of a ``degree`` on a row of ``elements`` per vertex."""
        points = self._elastic.nodes[:, list(self._elastic.body.axes)]
        values = displacement.reshape(-1, self._elastic.dimension)
        nodes = self._nodes_near(elements)
        slopes = _gradients(points, values, vertices, nodes, degree)
        return self._of_slopes(slopes, 0.0 if thermal is None else thermal[vertices], vertices)

    def _nodes_near(self, elements: sp.csr_matrix) -> sp.csr_matrix:
        """Return the nodes of each row of ``elements``, sorted."""
        nodes = (elements @ self._nodes_of_elements).tocsr()
        nodes.sort_indices()
        return nodes

    def _of_slopes(self, slopes: Array, thermal: Array | float, vertices: Indices) -> Array:
        """Return the stress ``(6, n)`` of displacement derivatives ``(d, d, n)`` and expansions."""
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
        elements = self._elements_of_vertices
        return (elements @ elements.T).tocsr()

    @cached_property
    def _patches(self) -> sp.csr_matrix:
        """Elements in the patch of each vertex: two rings, or one inside if it has enough nodes."""
        mesh, near = self._elastic.body.mesh, self._elements_of_vertices
        reached = np.diff((near @ self._nodes_of_elements).tocsr().indptr)
        coefficients = len(_exponents(mesh.dim(), self._order + 1))
        few = reached < NODES_PER_COEFFICIENT * coefficients
        few[mesh.boundary_nodes()] = True
        wide = sp.diags(few.astype(float)) @ self._neighbours
        return (near + wide @ near).tocsr()

    def _without_tractions(self, stress: Array, thermal: Array | float, vertices: Indices) -> Array:
        """Return P σ P, with P the projector along the surface where it is free."""
        along = self._along_surface[vertices]
        tensor = np.moveaxis(along @ np.moveaxis(tensors(stress), -1, 0) @ along, 0, -1)
        if self._elastic.dimension == 2:
            tensor[1, 1] = self._elastic.material.poisson * (tensor[0, 0] + tensor[2, 2])
            tensor[1, 1] -= self._elastic.material.young * thermal
        return components(tensor)

    @cached_property
    def _along_surface(self) -> Array:
        """Projectors on the surface ``(vertices, 3, 3)`` where it is free, else the identity.

        On a convex edge both surfaces are free, and only the stress along the edge remains. On a
        re-entrant edge stress is unbounded, and is left unchanged.
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
        """Vertices of re-entrant edges and corners of the body, where stress is unbounded."""
        return np.flatnonzero(self._surface(self._elastic.body.mesh.boundary_facets())[2])

    def with_neighbours(self, vertices: Indices) -> Indices:
        """Return the vertices and those that share an element with them."""
        return np.unique(self._neighbours[vertices].indices)

    def _surface(self, facets: Indices) -> tuple[Array, Flags, Flags, Array]:
        """Return unit normals of a surface at all vertices, and flags: smooth, and re-entrant.

        The last result is the sums of the dyads of facet normals, ``(vertices, 3, 3)``.
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
    """Return the dyads ``(m, 9)`` of unit normals ``(m, 3)``, each times its size ``(m, 1)``."""
    return np.asarray(size[:, :, None] * normals[:, :, None] * normals[:, None, :]).reshape(-1, 9)


def _curved_normals(corners: Indices, normals: Array, count: int) -> tuple[Array, Array]:
    """Return unit normals ``(count, 3)`` of curved facets at vertices, and sums of their dyads.

    The length of ``normals`` ``(m, corners, 3)`` is the area of the facets.
    """
    mean, squares = np.zeros((count, 3)), np.zeros((count, 9))
    for k, corner in enumerate(corners.T):
        size = np.linalg.norm(normals[:, k], axis=1, keepdims=True)
        np.add.at(mean, corner, normals[:, k])
        np.add.at(squares, corner, _dyads(size, normals[:, k] / size))
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    return np.divide(mean, length, out=mean, where=length > 0.0), squares


def _incidence(rows: Indices, count: int) -> sp.csr_matrix:
    """Return a matrix ``(m, count)`` with ones in row j at the columns ``rows[:, j]``.

    ``rows`` is ``(k, m)``.
    """
    k, m = rows.shape
    places = np.tile(np.arange(m), k), rows.ravel()
    return sp.csr_matrix((np.ones(k * m), places), shape=(m, count))


def _vertex_normals(
    points: Array, corners: Indices, normals: Array, area: Array, count: int
) -> Array:
    """Return unit normals ``(count, 3)`` of a faceted surface at vertices, exact on a sphere.

    The weights are those of Max (1999, doi:10.1080/10867651.1999.10487501), in which small facets
    count more.
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
    """Return the exponents ``(m, dimension)`` of the monomials up to a degree."""
    all_exponents = product(range(degree + 1), repeat=dimension)
    # They are sorted by degree: first the constant, then the linear ones in the order of the axes.
    up = sorted((e for e in all_exponents if sum(e) <= degree), key=lambda e: (sum(e), e[::-1]))
    return np.array(up)


def _gradients(
    points: Array, values: Array, vertices: Indices, nodes: sp.csr_matrix, degree: int
) -> Array:
    """Return the derivatives of ``values`` at ``vertices``, ``(k, d, len(vertices))``.

    The second axis is the direction of the derivative. A polynomial is fitted to the nodes in each
    row of ``nodes``, of the highest degree up to ``degree`` that they can determine. ``points`` are
    ``(n, d)`` and ``values`` ``(n, k)``.
    """
    k, d, exponents = values.shape[1], points.shape[1], _exponents(points.shape[1], degree)
    regular = REGULAR * np.diag((exponents.sum(axis=1) > 1).astype(float))
    slopes = slice(1, d + 1)
    poor = np.zeros(len(vertices), bool)
    counts = np.diff(nodes.indptr)
    gradient = np.empty((k, d, len(vertices)))
    # Rows of similar lengths are treated together, filled up with nodes of zero weight.
    order = np.argsort(counts, kind="stable")
    per_chunk = max(AT_ONCE // (len(exponents) * int(counts.max(initial=1))), 1)
    for part in np.array_split(order, range(per_chunk, len(order), per_chunk)):
        places = np.arange(counts[part].max())
        real = places < counts[part, None]
        near = nodes.indices[np.where(real, nodes.indptr[part, None] + places, 0)]
        centre = vertices[part, None]
        arms = points[near] - points[centre]
        distance = np.where(real, np.linalg.norm(arms, axis=2), 0.0)
        size = distance.max(axis=1)[:, None]
        weight = np.where(real, (REACH - distance / size) ** 2, 0.0)
        terms = _monomials(arms / size[:, :, None], exponents)
        weighted = (weight[:, :, None] * terms).swapaxes(1, 2)
        normal = weighted @ terms
        normal += np.trace(normal, axis1=1, axis2=2)[:, None, None] * regular
        right = weighted @ (values[near] - values[centre])
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
    """Return the monomials ``(..., m)`` at points ``(..., d)``."""
    powers = [np.ones_like(x)]
    for _ in range(exponents.max()):
        powers.append(powers[-1] * x)
    terms = np.ones((*x.shape[:-1], len(exponents)))
    for term, exponent in enumerate(exponents):
        for axis in np.flatnonzero(exponent):
            terms[..., term] *= powers[exponent[axis]][..., axis]
    return terms
