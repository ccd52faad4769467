"""Meshes whose elements are divided in the middle of their edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fe_models.meshes.curved_face import edge_numbers
from fe_models.meshes.structure_mesh import Body, mesh_edges, named_mesh, numbered_as
from sa_solver.types import Array, Indices

if TYPE_CHECKING:
    import scipy.sparse as sp
    from skfem import MeshTet, MeshTri


def halved(body: Body) -> Body:
    """Return a body whose vertices are the nodes of the second-order elements of ``body``.

    The elements of ``body`` carry its displacements; its own mesh, of half their size, has every
    node as a vertex: contact, gaps, worn depths and results are found at all of them.

    Examples
    --------
    Two triangles with nine nodes, four of them vertices:

    >>> from skfem import MeshTri
    >>> from fe_models import Body
    >>> from fe_models.meshes.halving import halved
    >>> square = Body("square", MeshTri().with_boundaries({"low": lambda x: x[1] == 0}))
    >>> fine = halved(square)
    >>> print(fine.mesh.nvertices, fine.mesh.nelements, fine.elements.mesh.nelements)
    9 8 2
    """
    return Body(body.name, halved_mesh(body), elements=body)


def halved_mesh(body: Body) -> MeshTet | MeshTri:
    """Return the mesh of elements of half the size, with the same boundaries.

    The vertices of the body come first, then the midside nodes in the order of its edges. Where the
    body has midside nodes, these are the new vertices.
    """
    mesh = body.mesh
    plain = numbered_as(mesh, type(mesh)(mesh.p, mesh.t))
    cells = np.asarray(plain.refined().t.T)
    corners = {
        name: _halved_facets(body, mesh.facets[:, facets].T)
        for name, facets in mesh.boundaries.items()
    }
    middles = mesh.p.T[mesh_edges(mesh)].mean(axis=1) if body.midsides is None else body.midsides
    return named_mesh(np.concatenate([mesh.p.T, middles]), cells, corners)


def _halved_facets(body: Body, facets: Indices) -> Indices:
    """Return the corners of the halves or quarters of facets ``(m, dim)``."""
    count, edges = body.mesh.nvertices, mesh_edges(body.mesh)

    def middle(one: int, two: int) -> Indices:
        return count + edge_numbers(edges, facets[:, [one, two]])

    if facets.shape[1] == 2:
        half = middle(0, 1)
        return np.concatenate([np.stack([end, half], axis=1) for end in facets.T])
    middles = middle(0, 1), middle(1, 2), middle(2, 0)
    parts = [np.stack(middles, axis=1)]
    for k, corner in enumerate(facets.T):
        parts.append(np.stack([corner, middles[k], middles[k - 1]], axis=1))
    return np.concatenate(parts)


def moments_on_halves(body: Body, facets: Indices) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Return ∫ φ_i φ_k dA and ∫ φ_i N_j dA over plane facets of second-order elements [mm²].

    φ are linear on the halves or quarters of the facets, which are given by number, and N quadratic
    on the whole ones. The matrices are ``(n, n)`` for all nodes of the elements of ``body``.
    """
    import scipy.sparse as sp

    nodes, size = body.facet_nodes(facets), body.mesh.nvertices + len(mesh_edges(body.mesh))
    areas = np.linalg.norm(body.outward_of(facets), axis=1)
    shape = nodes.shape + nodes.shape[1:]
    rows = np.broadcast_to(nodes[:, :, None], shape).ravel()
    columns = np.broadcast_to(nodes[:, None, :], shape).ravel()
    products, moments = (
        sp.csr_matrix(((areas[:, None, None] * on_facet).ravel(), (rows, columns)), (size, size))
        for on_facet in _moments_on_facet(body.mesh.dim())
    )
    return products, moments


def _moments_on_facet(dimension: int) -> tuple[Array, Array]:
    """Return the integrals of :func:`moments_on_halves` over a facet of unit area.

    They are in the order of :meth:`Body.facet_nodes`.
    """
    from skfem import (
        Basis,
        BilinearForm,
        ElementLineP1,
        ElementLineP2,
        ElementTriP1,
        ElementTriP2,
        LinearForm,
        MeshLine,
        MeshTri,
    )

    kind, linear, quadratic = (
        (MeshTri, ElementTriP1, ElementTriP2)
        if dimension == 3
        else (MeshLine, ElementLineP1, ElementLineP2)
    )
    whole = kind.init_refdom()
    halves, element = Basis(whole.refined(), linear(), intorder=3), quadratic()
    points = np.asarray(halves.global_coordinates())
    functions = [element.lbasis(points, j)[0] for j in range(len(element.doflocs))]
    apart = np.linalg.norm(halves.doflocs[:, None, :] - element.doflocs.T[:, :, None], axis=0)
    products = BilinearForm(lambda u, v, w: u * v).assemble(halves).toarray()
    form = LinearForm(lambda v, w: w.f * v)
    moments = np.stack([form.assemble(halves, f=function) for function in functions], axis=1)
    order = apart.argmin(axis=1)
    area = products.sum()
    return products[np.ix_(order, order)] / area, moments[order] / area
