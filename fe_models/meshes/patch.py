"""Part of a body's mesh around a place, cut out and refined, as a body of its own."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy.sparse as sp

from fe_models.meshes.curved_face import edge_numbers
from fe_models.meshes.halving import halved_mesh
from fe_models.meshes.isoparametric import folded
from fe_models.meshes.structure_mesh import Body, MeshError, mesh_edges, named_mesh
from sa_solver.types import Array, Indices

CUT = "cut"
"""Name of the boundary of a patch inside the body."""


@dataclass(frozen=True)
class MeshPatch:
    """Elements cut out of a body's mesh.

    Attributes
    ----------
    body
        The elements as a body. Its boundary :data:`CUT` is inside the body they are cut out of; the
        others keep their names.
    of_nodes
        Matrix ``(nodes, nodes of the whole)`` of quadratic fields: values at the nodes of the
        patch, midside nodes included, from those of the whole body.
    of_vertices
        The same of linear fields, from vertices to vertices.

    Examples
    --------
    The lower corner of a square, with four times as many elements:

    >>> import numpy as np
    >>> from skfem import MeshTri
    >>> from fe_models import Body
    >>> from fe_models.meshes.patch import MeshPatch
    >>> square = Body("square", MeshTri().refined(2).with_boundaries({"low": lambda x: x[1] == 0}))
    >>> patch = MeshPatch.around(square, np.array([0]), rings=1)
    >>> fine = patch.refined()
    >>> print(patch.body.mesh.nelements, fine.body.mesh.nelements, len(fine.body.facets("low")))
    1 4 2
    """

    body: Body
    of_nodes: sp.csr_matrix
    of_vertices: sp.csr_matrix

    @classmethod
    def around(cls, body: Body, vertices: Indices, rings: int) -> MeshPatch:
        """Cut out the elements at some ``vertices`` and ``rings`` - 1 layers of elements more."""
        mesh = body.mesh
        reached = np.zeros(mesh.nvertices, bool)
        reached[vertices] = True
        for _ in range(rings):
            chosen = reached[mesh.t].any(axis=0)
            reached[mesh.t[:, chosen]] = True
        kept = np.flatnonzero(reached)
        facets = np.unique(mesh.t2f[:, chosen])
        inside = chosen[mesh.f2t[:, facets]] & (mesh.f2t[:, facets] >= 0)
        on_surface = mesh.f2t[1, facets] < 0
        named = {CUT: facets[(inside.sum(axis=0) == 1) & ~on_surface]}
        for name, of_boundary in (mesh.boundaries or {}).items():
            common = np.intersect1d(of_boundary, facets[on_surface])
            if len(common):
                named[name] = common
        corners = {
            name: np.searchsorted(kept, mesh.facets[:, of_boundary].T)
            for name, of_boundary in named.items()
        }
        cells = np.searchsorted(kept, mesh.t[:, chosen]).T
        part = named_mesh(mesh.p.T[kept], cells, corners)
        edges = edge_numbers(mesh_edges(mesh), kept[mesh_edges(part)])
        nodes = np.append(kept, mesh.nvertices + edges)
        midsides = None if body.midsides is None else body.midsides[edges]
        return cls(
            Body(body.name, part, midsides=midsides),
            _selection(nodes, mesh.nvertices + len(mesh_edges(mesh))),
            _selection(kept, mesh.nvertices),
        )

    def inside(self, elements: Indices) -> np.ndarray:
        """Return flags ``(vertices,)`` of vertices in ``elements``, given by their corners."""
        within = np.zeros(self.of_vertices.shape[1])
        within[elements] = 1.0
        return np.isclose(self.of_vertices @ within, 1.0)

    def refined(self) -> MeshPatch:
        """Return the patch with elements of half the size, on the same curved surface.

        Raises :class:`MeshError` if a curved element folds.
        """
        fine, count = halved_mesh(self.body), self.body.mesh.nvertices
        edges = mesh_edges(self.body.mesh)
        ends = sp.csr_matrix(
            (np.full(2 * len(edges), 0.5), (np.repeat(np.arange(len(edges)), 2), edges.ravel())),
            shape=(len(edges), count),
        )
        linear = sp.vstack([sp.identity(count), ends], format="csr")
        nodes = fine.p.T
        between = self._between(mesh_edges(fine))
        quadratic = sp.vstack([sp.identity(len(nodes)), between], format="csr")
        midsides = None if self.body.midsides is None else np.asarray(between @ nodes)
        body = Body(self.body.name, fine, midsides=midsides)
        if midsides is not None and folded(body).any():
            raise MeshError(f"curved elements of {body.name} fold when they are refined")
        return MeshPatch(body, quadratic @ self.of_nodes, linear @ self.of_vertices)

    def _between(self, fine_edges: Indices) -> sp.csr_matrix:
        """Return the values of quadratic fields in the middle of the edges of the refined mesh.

        The matrix is ``(m, nodes)``. In barycentric coordinates the middle is that of the
        coordinates of both ends, which are vertices or middles of edges of the patch.
        """
        mesh, edges = self.body.mesh, mesh_edges(self.body.mesh)
        count = mesh.nvertices
        both = np.concatenate([np.tile(np.arange(count)[:, None], 2), edges])
        places = both[fine_edges].reshape(len(fine_edges), 4)
        rows = np.repeat(np.arange(len(places)), 4)
        shares = sp.csr_matrix(
            (np.full(places.size, 0.25), (rows, places.ravel())), shape=(len(places), count)
        )
        shares.sum_duplicates()
        found: list[tuple[Indices, Indices, Array]] = []
        for corners in np.unique(np.diff(shares.indptr)).tolist():
            (these,) = np.nonzero(np.diff(shares.indptr) == corners)
            at = shares.indptr[these][:, None] + np.arange(corners)
            vertices, weights = shares.indices[at], shares.data[at]
            for k in range(corners):
                found.append((these, vertices[:, k], weights[:, k] * (2.0 * weights[:, k] - 1.0)))
            for k, other in combinations(range(corners), 2):
                number = count + edge_numbers(edges, vertices[:, [k, other]])
                found.append((these, number, 4.0 * weights[:, k] * weights[:, other]))
        row, column, value = (np.concatenate(part) for part in zip(*found, strict=True))
        return sp.csr_matrix((value, (row, column)), shape=(len(places), count + len(edges)))


def _selection(chosen: Indices, count: int) -> sp.csr_matrix:
    """Return the matrix ``(m, count)`` that selects entries."""
    return sp.identity(count, format="csr")[chosen]
