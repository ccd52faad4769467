"""Meshes whose elements are divided in the middle of their edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fe_models.meshes.curved_face import edge_numbers
from fe_models.meshes.structure_mesh import Body, mesh_edges, named_mesh, numbered_as
from sa_solver.types import Indices

if TYPE_CHECKING:
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
