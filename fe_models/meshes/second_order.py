"""Bodies whose elements of second order are as curved as the midside nodes of their file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fe_models.elasticity.body import ElasticBody
from fe_models.geometry.imported import ImportedMesh
from fe_models.meshes.curved_face import Midsides, edges_of
from fe_models.meshes.structure_mesh import (
    Body,
    Interface,
    MeshError,
    StructureMesh,
    in_space,
    mesh_edges,
)
from sa_solver.types import Array, Indices

# Distance from the middle of an edge, as a share of its length, up to which a midside node counts
# as in the middle: coordinates in files are rounded.
MIDDLE = 1e-6


@dataclass(frozen=True)
class Curvature:
    """Numbers of a body's ``edges``, of those ``given`` midside nodes, and of those ``curved``.

    Midside nodes are up to ``off`` [mm] away from the middle of their edges. ``straightened`` edges
    are straight in the body, because their midside nodes would fold an element.
    """

    edges: int
    given: int
    curved: int
    off: float
    straightened: int = 0


def with_midsides(mesh: StructureMesh, imported: ImportedMesh) -> StructureMesh:
    """Return the mesh with the file's midside nodes in bodies with elements of second order.

    Bodies whose midside nodes are all in the middle of their edges, or that have none, are
    unchanged. Edges of elements that their midside nodes would fold are made straight;
    :func:`curvature` counts them. Raises :class:`MeshError` if elements that share an edge do not
    share its midside node.
    """
    return replace(mesh, bodies=tuple(_curved(body, imported) for body in mesh.bodies))


def curvature(body: Body, imported: ImportedMesh) -> Curvature | None:
    """Return how curved a body's edges are, or None if the file has no midside nodes for it."""
    if body.name not in imported.midsides:
        return None
    edges = mesh_edges(body.mesh)
    points, given, off = _places(body, edges, imported.midsides[body.name])
    least = MIDDLE * _lengths(body, edges)
    moved = np.zeros(0)
    if body.midsides is not None:
        moved = np.linalg.norm(in_space(body.midsides) - points, axis=1) > least
    return Curvature(
        edges=len(edges),
        given=int(given.sum()),
        curved=int(np.sum(off > least) - moved.sum()),
        off=float(off.max(initial=0.0)),
        straightened=int(moved.sum()),
    )


def distance_of_midsides(interface: Interface, bodies: Sequence[Body]) -> float:
    """Return the largest distance between midside nodes of faces that meet node to node [mm]."""
    if interface.projection is not None or all(body.midsides is None for body in bodies):
        return 0.0
    facets = interface.facets
    ends = np.unique(np.sort(_sides(facets), axis=1), axis=0)
    points = [
        _middles(body, nodes[ends])
        for body, nodes in zip(bodies, (interface.nodes_1, interface.nodes_2), strict=True)
    ]
    return float(np.linalg.norm(points[1] - points[0], axis=1).max(initial=0.0))


def set_nodes(elastic: ElasticBody, imported: ImportedMesh, group: str) -> Indices:
    """Return the nodes of a body in a node set, with midside nodes for elements of second order.

    If the file has no midside nodes, they are those of the facets of the surface with all corners
    in the set.
    """
    body = elastic.body
    vertices = imported.points[body.name][group]
    if elastic.order == 1:
        return vertices
    if body.name in imported.middles:
        ends = imported.middles[body.name][group]
    else:
        surface = body.mesh.facets[:, body.mesh.boundary_facets()]
        ends = _sides(surface[:, np.isin(surface, vertices).all(axis=0)].T)
    count = body.mesh.nvertices
    key = np.array([count, 1])
    places = np.isin(np.sort(mesh_edges(body.mesh), axis=1) @ key, np.sort(ends, axis=1) @ key)
    return np.append(vertices, count + np.flatnonzero(places))


def _curved(body: Body, imported: ImportedMesh) -> Body:
    if body.name not in imported.midsides:
        return body
    edges = mesh_edges(body.mesh)
    points, _, off = _places(body, edges, imported.midsides[body.name])
    if np.all(off <= MIDDLE * _lengths(body, edges)):
        return body
    return _unfolded(replace(body, midsides=np.ascontiguousarray(points[:, body.axes])))


def _unfolded(body: Body) -> Body:
    """Return the body with straight edges in folded elements: inner edges first, then all."""
    from fe_models.meshes.isoparametric import folded

    mesh, corners = body.mesh, len(body.mesh.t)
    middle = mesh.p.T[mesh_edges(body.mesh)].mean(axis=1)
    on_surface = mesh.boundary_facets()
    if mesh.dim() == 3:
        on_surface = np.unique(mesh.f2e[:, on_surface])
    wrong = folded(body)
    for inside in (True, False):
        straight = -1
        while wrong.any() and straight != wrong.sum():
            straight = wrong.sum()
            edges = np.unique(body.element_nodes[wrong][:, corners:] - mesh.nvertices)
            if inside:
                edges = np.setdiff1d(edges, on_surface)
            assert body.midsides is not None
            midsides = body.midsides.copy()
            midsides[edges] = middle[edges]
            body = replace(body, midsides=midsides)
            wrong = folded(body)
    return body


def _lengths(body: Body, edges: Indices) -> Array:
    return np.asarray(np.linalg.norm(np.diff(body.points[edges], axis=1)[:, 0], axis=1))


def _places(body: Body, edges: Indices, midsides: Midsides) -> tuple[Array, Array, Array]:
    """Return the midside points of edges, whether the file has them, and their offsets.

    The points are ``(m, 3)``, the offsets from the middle ``(m,)`` [mm]. Without a midside node in
    the file the point is the middle of the edge.
    """
    middle = body.points[edges].mean(axis=1)
    found = midsides.at(edges)
    given = ~np.isnan(found[:, 0])
    points = np.where(given[:, None], found, middle)
    _check_shared(body, midsides)
    return points, given, np.linalg.norm(points - middle, axis=1)


def _check_shared(body: Body, midsides: Midsides) -> None:
    """Raise if elements that share an edge have different nodes in its middle, as at a crack."""
    spread = np.linalg.norm(midsides.points - midsides.at(midsides.edges), axis=1)
    torn = spread > MIDDLE * _lengths(body, midsides.edges)
    if torn.any():
        raise MeshError(
            f"{len(np.unique(np.sort(midsides.edges[torn], axis=1), axis=0))} edges of body "
            f"{body.name} have midside nodes at several places: merge those of neighbouring "
            "elements"
        )


def _sides(facets: Indices) -> Indices:
    """Return the ends of the edges of facets, ``(m, 2)``."""
    return edges_of(facets).reshape(-1, 2)


def _middles(body: Body, ends: Indices) -> Array:
    """Return the midside points ``(m, 3)`` of edges of a body between vertices ``(m, 2)``."""
    if body.midsides is None:
        return np.asarray(body.points[ends].mean(axis=1))
    return Midsides(mesh_edges(body.mesh), in_space(body.midsides)).at(ends)
