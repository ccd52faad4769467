"""Meshed structures: bodies with named boundaries, and the interfaces where they meet."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from skfem import MeshTet

from fe_models.gmsh_session import gmsh_model
from sa_solver.types import Array, Frame

# Two nodes are the same point when they are closer than this share of the interface's size.
MATCHING_TOLERANCE = 1e-9


class MeshError(ValueError):
    """The geometry or its mesh cannot be used; the message says what to change."""


@dataclass(frozen=True)
class Body:
    """One meshed body. Its named boundaries are those of the mesh."""

    name: str
    mesh: MeshTet

    def facets(self, boundary: str) -> NDArray[np.int64]:
        """Vertices of the triangles of a named boundary, ``(n, 3)``."""
        return self.mesh.facets[:, self.mesh.boundaries[boundary]].T

    def vertices(self, boundary: str) -> NDArray[np.int64]:
        """Vertices on a named boundary, sorted, ``(n,)``."""
        return np.unique(self.facets(boundary))


@dataclass(frozen=True)
class Interface:
    """Two faces that meet node to node.

    ``nodes_1`` and ``nodes_2`` ``(n,)`` are vertices of body 1 and body 2; ``coordinates``
    ``(n, 2)`` their place in the interface frame [mm]; ``facets`` ``(m, 3)`` the triangles of body
    2's face, numbered within the interface; ``gap`` ``(n,)`` the distance of the unloaded, unworn
    faces [mm].
    """

    name: str
    frame: Frame
    nodes_1: NDArray[np.int64]
    nodes_2: NDArray[np.int64]
    coordinates: Array
    facets: NDArray[np.int64]
    gap: Array

    def __len__(self) -> int:
        return len(self.nodes_1)

    @property
    def nodal_areas(self) -> Array:
        """Area that belongs to each node, a third of each of its triangles, ``(n,)`` [mm²]."""
        a, b, c = (self.coordinates[self.facets[:, k]] for k in range(3))
        u, v = b - a, c - a
        area = 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
        total = np.zeros(len(self))
        np.add.at(total, self.facets, area[:, None] / 3.0)
        return total


@dataclass(frozen=True)
class StructureMesh:
    """Body 1 and body 2, and the interfaces between them."""

    body_1: Body
    body_2: Body
    interfaces: tuple[Interface, ...]


def named_mesh(
    points: Array, tets: NDArray[np.int64], boundaries: dict[str, NDArray[np.int64]]
) -> MeshTet:
    """A tetrahedral mesh whose boundaries are given by the vertices of their triangles.

    ``points`` ``(n, 3)``, ``tets`` ``(m, 4)``, each boundary ``(k, 3)``.
    """
    mesh = MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(tets.T))
    lookup = cKDTree(np.sort(mesh.facets, axis=0).T)
    named = {}
    for name, triangles in boundaries.items():
        distance, index = lookup.query(np.sort(triangles, axis=1))
        if np.any(distance > 0):
            raise MeshError(f"boundary {name} has triangles that are no faces of the mesh")
        named[name] = index
    return mesh.with_boundaries(named)


def matched_interface(
    name: str, body_1: Body, body_2: Body, boundary: str, frame: Frame
) -> Interface:
    """Pair the vertices of the boundary of that name on both bodies; their gap is zero.

    Raises :class:`MeshError` if a vertex of one face has no partner on the other.
    """
    nodes_2 = body_2.vertices(boundary)
    nodes_1 = body_1.vertices(boundary)
    points_2 = body_2.mesh.p[:, nodes_2].T
    distance, partner = cKDTree(body_1.mesh.p[:, nodes_1].T).query(points_2)
    size = np.ptp(points_2, axis=0).max()
    if len(nodes_1) != len(nodes_2) or distance.max() > MATCHING_TOLERANCE * size:
        raise MeshError(
            f"the two faces of interface {name} do not match node to node: "
            f"{len(nodes_1)} and {len(nodes_2)} nodes, {distance.max():.3g} mm apart"
        )
    local = frame.coordinates(points_2)[:, :2]
    return Interface(
        name=name,
        frame=frame,
        nodes_1=nodes_1[partner],
        nodes_2=nodes_2,
        coordinates=local,
        facets=np.searchsorted(nodes_2, body_2.facets(boundary)),
        gap=np.zeros(len(nodes_2)),
    )


def write_msh(path: Path, structure: StructureMesh) -> None:
    """Write both bodies and all their named boundaries to one gmsh 4.1 file (text)."""
    with gmsh_model("structure") as gmsh:
        offset = 0
        for tag, body in enumerate((structure.body_1, structure.body_2), start=1):
            gmsh.model.addDiscreteEntity(3, tag)
            gmsh.model.addPhysicalGroup(3, [tag], name=body.name)
            node_tags = offset + 1 + np.arange(body.mesh.nvertices)
            gmsh.model.mesh.addNodes(3, tag, node_tags, body.mesh.p.T.ravel())
            gmsh.model.mesh.addElementsByType(tag, 4, [], node_tags[body.mesh.t.T].ravel())
            for name in body.mesh.boundaries:
                surface = gmsh.model.addDiscreteEntity(2)
                gmsh.model.addPhysicalGroup(2, [surface], name=f"{body.name}_{name}")
                gmsh.model.mesh.addElementsByType(
                    surface, 2, [], node_tags[body.facets(name)].ravel()
                )
            offset += body.mesh.nvertices
        gmsh.write(str(path))
