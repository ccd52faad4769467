"""Permanent tie of plane faces whose meshes do not match, for elements of either order.

The method is that of :mod:`fe_models.joints.mortar` for contact, with the elements' own functions
on both sides: ψ dual to the slave's φ carries the traction, and the slave follows the master,
u = N u_master. A constant traction is transmitted exactly, and so is every displacement that the
slave's functions can represent.

For second order ∫φ of a corner is zero or negative, so φ has no dual. Corners therefore take a
share α of the neighbouring midsides,

    φ̃_corner = φ_corner + α Σ φ_midside,   φ̃_midside = (1 - 2α) φ_midside,

which span the same displacements. The nodal displacements are T ũ, and N = T D⁻¹ M.
Popp, Wohlmuth, Gee & Wall 2012, doi:10.1137/110848190.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_models.joints.mortar import ProjectedFace, coupling_of, dual_functions, overlap_of
from fe_models.meshes.curved_face import EDGES
from sa_solver.types import Array, Indices

# Share α of a midside's function that corners take (Popp et al. 2012).
SHIFTED = 0.2
# A facet covered by a smaller share of its area is left out: the displacements at its nodes can
# hardly be told apart from their values on a sliver, so its ψ would be ill-conditioned.
SLIVER_SHARE = 0.05


def tied_projection(
    slave_points: Array,
    slave_facets: Indices,
    master_points: Array,
    master_facets: Indices,
    order: int,
) -> tuple[sp.csr_matrix, float]:
    """Return N ``(n, m)`` of two faces in one plane z = const, and the tied share of the slave.

    Rows of nodes that the master does not cover are empty. Raises :class:`MeshError` if the faces
    have nothing in common.

    Parameters
    ----------
    slave_points, master_points
        Points ``(n, 3)`` and ``(m, 3)`` [mm].
    slave_facets, master_facets
        Nodes of the facets: first their corners, of triangles or of segments along x, then their
        midsides (:meth:`ElasticBody.facet_nodes`).
    order
        Order of the elements, 1 or 2.

    Examples
    --------
    Two elements of a segment follow three of another:

    >>> import numpy as np
    >>> from fe_models.joints.tied_faces import tied_projection
    >>> slave, master = (np.outer(np.linspace(0.0, 6.0, n), [1.0, 0.0, 0.0]) for n in (3, 4))
    >>> facets = np.array([[0, 1], [1, 2], [2, 3]])
    >>> follows, tied = tied_projection(slave, facets[:2], master, facets, order=1)
    >>> print((follows @ master[:, 0]).round(12), round(tied, 12))
    [0. 3. 6.] 1.0
    """
    slave, slave_nodes = _face(slave_points, slave_facets, order)
    master, master_nodes = _face(master_points, master_facets, order)
    overlap = overlap_of(slave, master, 2 * order)
    corners = slave.facets.shape[1]
    mixing = _mixing(corners, order)
    shapes = _functions(slave.shapes(overlap.slave, overlap.points), order) @ mixing
    dual, integrals = dual_functions(shapes, overlap, slave.sizes, SLIVER_SHARE)
    areas = np.bincount(slave_nodes.ravel(), integrals.ravel(), minlength=len(slave_points))
    tested = _functions(master.shapes(overlap.master, overlap.points), order)
    shape = len(slave_points), len(master_points)
    coupling = coupling_of(overlap, dual, tested, slave_nodes, master_nodes, shape)
    scale = np.divide(1.0, areas, out=np.zeros_like(areas), where=areas > 0.0)
    follows = _nodal(slave_nodes, mixing, len(slave_points)) @ sp.diags(scale) @ coupling
    return follows.tocsr(), float(areas.sum() / slave.sizes.sum())


def _face(points: Array, facets: Indices, order: int) -> tuple[ProjectedFace, Indices]:
    """Return a face, and the nodes of its facets with the corners in the face's order."""
    corners = facets.shape[1] if order == 1 else {3: 2, 6: 3}[facets.shape[1]]
    face = ProjectedFace(points, facets[:, :corners])
    turned = facets.copy()
    turned[:, :corners] = face.facets
    if facets.shape[1] == 6:
        # The corners are reversed, so the midsides of the first two edges change places.
        turned[face.clockwise, 3:5] = facets[face.clockwise, 4:2:-1]
    return face, turned


def _functions(linear: Array, order: int) -> Array:
    """Return the elements' functions ``(q, k)`` from those of the corners ``(q, corners)``."""
    if order == 1:
        return linear
    middles = [4.0 * linear[:, a] * linear[:, b] for a, b in EDGES[linear.shape[1]]]
    return np.column_stack([linear * (2.0 * linear - 1.0), *middles])


def _mixing(corners: int, order: int) -> Array:
    """Return the matrix ``(k, k)`` that turns the functions φ ``(k,)`` of a facet into φ̃."""
    if order == 1:
        return np.eye(corners)
    ends = EDGES[corners]
    mixing = np.eye(corners + len(ends))
    for middle, (a, b) in enumerate(ends, start=corners):
        mixing[middle, [a, b]] = SHIFTED
        mixing[middle, middle] = 1.0 - 2.0 * SHIFTED
    return mixing


def _nodal(facet_nodes: Indices, mixing: Array, count: int) -> sp.csr_matrix:
    """Return T ``(count, count)``: displacements of nodes from the coefficients of φ̃."""
    shape = (len(facet_nodes), *mixing.shape)
    rows = np.broadcast_to(facet_nodes[:, :, None], shape)
    columns = np.broadcast_to(facet_nodes[:, None, :], shape)
    places = np.stack([rows.ravel(), columns.ravel()])[:, np.tile(mixing.ravel() != 0.0, shape[0])]
    values = np.tile(mixing.ravel()[mixing.ravel() != 0.0], shape[0])
    # Facets that share an edge have the same values for it, which must count once.
    places, first = np.unique(places, axis=1, return_index=True)
    return sp.csr_matrix((values[first], places), shape=(count, count))
