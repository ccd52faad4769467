"""Meshed structures: bodies with named boundaries, and the interfaces where they meet."""

from __future__ import annotations

import errno
import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fe_models.meshes.curved_face import Surface
from fe_models.meshes.gmsh_session import gmsh_model
from sa_solver.errors import InputError
from sa_solver.types import Array, Frame, Indices

if TYPE_CHECKING:
    import scipy.sparse as sp
    from skfem import MeshTet, MeshTri

# Two nodes are the same point when they are closer than this share of the interface's size.
MATCHING_TOLERANCE = 1e-9
# Global axes that the coordinates and displacements of a mesh of each dimension run along.
AXES = {2: (0, 2), 3: (0, 1, 2)}
# gmsh's numbers for cells and their facets, by dimension: of first order, of second order.
GMSH_CELL, GMSH_FACET = {2: 2, 3: 4}, {2: 1, 3: 2}
GMSH_CURVED_CELL, GMSH_CURVED_FACET = {2: 9, 3: 11}, {2: 8, 3: 9}
# gmsh lists the last two edges of a tetrahedron the other way round than scikit-fem.
GMSH_NODES = {2: range(6), 3: (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)}
# What a mesh of scikit-fem keeps, once asked for, of how its elements are connected.
NUMBERED = frozenset({"_facets", "_t2f", "_f2t", "_edges", "_t2e", "_f2e"})
# How a file of gmsh ends that is whole.
MSH_END = b"$EndElements\n"


class MeshError(InputError):
    """The geometry or its mesh cannot be used; the message says what to change."""


class MatchError(MeshError):
    """Two faces do not meet node to node."""


@dataclass(frozen=True)
class Body:
    """One meshed body: tetrahedra, or triangles in the plane (X, Z) for plane strain.

    ``name`` is its own, ``mesh`` scikit-fem's [mm]; its named boundaries are those of the mesh.
    ``midsides`` ``(edges, dim)`` [mm] are where the midside nodes of elements of second order are,
    by the mesh's edges (in the plane: its facets). Without them they are in the middle. What this
    class tells of sizes and normals is that of the straight elements between the vertices.

    Examples
    --------
    A cube of 2 mm and its top, whose facets are as large as the face together:

    >>> import numpy as np
    >>> from skfem import MeshTet
    >>> from fe_models import Body
    >>> side = np.linspace(0.0, 2.0, 3)
    >>> mesh = MeshTet.init_tensor(side, side, side)
    >>> cube = Body("cube", mesh.with_boundaries({"top": lambda x: x[2] == 2.0}))
    >>> print(cube.outward("top").sum(axis=0), len(cube.vertices("top")), "vertices")
    [0. 0. 4.] 9 vertices
    """

    name: str
    mesh: MeshTet | MeshTri
    midsides: Array | None = field(default=None, kw_only=True)

    @property
    def axes(self) -> tuple[int, ...]:
        """Global axes of its coordinates and displacements: three, or X and Z in the plane."""
        return AXES[self.mesh.dim()]

    @property
    def points(self) -> Array:
        """Vertices in space ``(n, 3)`` [mm]; Y is 0 in the plane."""
        return in_space(self.mesh.p.T)

    @property
    def nodes(self) -> Array:
        """Vertices in space ``(n, 3)`` [mm], and the midsides after them if it has any."""
        if self.midsides is None:
            return self.points
        return np.concatenate([self.points, in_space(self.midsides)])

    @property
    def element_nodes(self) -> Indices:
        """Vertices and midsides of the elements ``(m, 10 or 6)``, as scikit-fem orders them."""
        mesh = self.mesh
        beside = mesh.t2f if mesh.dim() == 2 else mesh.t2e
        return np.asarray(np.vstack([mesh.t, mesh.nvertices + beside]).T)

    def facet_nodes(self, facets: Indices) -> Indices:
        """Vertices and midsides of facets of the mesh, by their numbers, ``(m, 6 or 3)``."""
        mesh = self.mesh
        beside = facets[None] if mesh.dim() == 2 else mesh.f2e[:, facets]
        return np.asarray(np.vstack([mesh.facets[:, facets], mesh.nvertices + beside]).T)

    def facets(self, boundary: str) -> Indices:
        """Vertices of the triangles (in the plane: edges) of a named boundary, ``(n, dim)``."""
        return self.mesh.facets[:, self.mesh.boundaries[boundary]].T

    def outward(self, boundary: str) -> Array:
        """Outward normals ``(n, 3)`` of the facets of a boundary, as long as the facet is large.

        In the plane a facet goes on along Y for 1 mm.
        """
        return self.outward_of(self.mesh.boundaries[boundary])

    def outward_of(self, facets: Indices) -> Array:
        """The same of facets of the surface, by their numbers."""
        corners = self.points[self.mesh.facets[:, facets].T]
        edge = corners[:, 1] - corners[:, 0]
        other = 0.5 * (corners[:, 2] - corners[:, 0]) if corners.shape[1] == 3 else [0.0, 1.0, 0.0]
        normals = np.cross(edge, other)
        out = corners.mean(axis=1) - self.points[self._behind(facets)].mean(axis=1)
        return normals * np.sign(np.einsum("ma,ma->m", normals, out))[:, None]

    def depth(self, boundary: str) -> float:
        """How deep the elements of a boundary usually reach below it [mm]."""
        normals = self.outward(boundary)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        corners = self.points[self.facets(boundary)]
        below = corners[:, :1] - self.points[self._behind(self.mesh.boundaries[boundary])]
        return float(np.median(np.einsum("mia,ma->mi", below, normals).max(axis=1)))

    def _behind(self, facets: Indices) -> Indices:
        """Vertices of the elements that facets of the surface belong to, ``(m, dim + 1)``."""
        cells: Indices = self.mesh.t[:, self.mesh.f2t[0, facets]].T
        return cells

    def vertices(self, boundary: str) -> Indices:
        """Vertices on a named boundary, sorted, ``(n,)``."""
        return np.unique(self.facets(boundary))


@dataclass(frozen=True)
class Face:
    """A contact face: ``coordinates`` ``(n, 2)`` of its nodes in the frame [mm] and their facets.

    It is called ``name`` and lies in ``frame``.
    ``facets`` are triangles ``(m, 3)``, or segments ``(m, 2)`` of a line contact, whose nodes have
    y = 0. Fields on it are linear between nodes. Forces of nodes are pressures times areas and
    displacements those of the nodes, unless it is ``weighted``: then they are integrals of a linear
    traction, ∫ φ_i t dA, and values of the linear field next to the displacement (least squares).

    ``surface`` is what it is a mesh of, if that is known (:mod:`fe_models.meshes.curved_face`).
    """

    name: str
    frame: Frame
    coordinates: Array
    facets: Indices
    weighted: bool = field(default=False, kw_only=True)
    surface: Surface | None = field(default=None, kw_only=True)

    def __len__(self) -> int:
        return len(self.coordinates)

    def face(self, number: int) -> Face:
        """The face of body ``number``, 1 or 2, with its own nodes; one for both unless it says."""
        return self

    @property
    def line(self) -> bool:
        """Whether the face is that of a line contact, and all it carries is per length."""
        return self.facets.shape[1] == 2

    @property
    def nodal_areas(self) -> Array:
        """Area of contact that belongs to each node ``(n,)`` [mm²]; in a line contact [mm]."""
        return self.facet_shares

    @property
    def facet_shares(self) -> Array:
        """Each node's equal share of its facets ``(n,)`` [mm²]; in a line contact [mm]."""
        total = np.zeros(len(self))
        np.add.at(total, self.facets, self.facet_sizes[:, None] / self.facets.shape[1])
        return total

    @property
    def facet_sizes(self) -> Array:
        """Area of each facet ``(m,)`` [mm²]; in a line contact its length [mm]."""
        corners = self.coordinates[self.facets]
        edges = corners[:, 1:] - corners[:, :1]
        sizes = np.hypot(*edges[:, 0].T) if self.line else 0.5 * np.abs(np.linalg.det(edges))
        return np.asarray(sizes)


@dataclass(frozen=True)
class Interface(Face):
    """Two faces that meet; as a face it is body 2's.

    ``nodes_1`` and ``nodes_2`` are vertices of body 1 and body 2; ``gap`` ``(n,)`` the distance of
    the unloaded, unworn faces [mm]. Faces that meet node to node list their nodes in the same
    order. Otherwise ``projection`` ``(n, n_1)`` gives a field of body 1's nodes at those of body 2,
    ``face_1`` is body 1's own face and ``areas`` ``(n,)`` what it covers of each node's area [mm²];
    ``bulged`` ``(n,)`` is what of the gap is due to the form of the faces between vertices [mm].
    Planes of symmetry may cut it: ``planes`` are the axes of the frame that are normal to them, and
    the frame's origin is on them (:mod:`fe_models.meshes.cut_face`).

    Its body 1 and body 2 are those of a :class:`StructureMesh` at the places ``bodies``, from 0.

    Examples
    --------
    Two cubes that meet node to node over 1 mm²:

    >>> import numpy as np
    >>> from skfem import MeshTet
    >>> from fe_models import Body
    >>> from fe_models.meshes.structure_mesh import matched_interface
    >>> from sa_solver import Frame
    >>> mesh = MeshTet().refined(1).with_boundaries({"contact": lambda x: x[2] == 0.0})
    >>> upper, lower = Body("upper", mesh), Body("lower", mesh.mirrored((0.0, 0.0, 1.0)))
    >>> frame = Frame(np.zeros(3), np.eye(3))
    >>> face = matched_interface("joint", lower, upper, "contact", frame)
    >>> print(len(face), f"nodes, {face.nodal_areas.sum():.3f} mm²")
    9 nodes, 1.000 mm²
    """

    nodes_1: Indices
    nodes_2: Indices
    gap: Array
    projection: sp.csr_matrix | None = None
    face_1: Face | None = None
    areas: Array | None = None
    bulged: Array | None = None
    planes: tuple[int, ...] = ()
    bodies: tuple[int, int] = (0, 1)

    @property
    def nodal_areas(self) -> Array:
        """What is in contact of the area of each node ``(n,)`` [mm²]; in a line contact [mm]."""
        return self.facet_shares if self.areas is None else self.areas

    def face(self, number: int) -> Face:
        return self.face_1 if number == 1 and self.face_1 is not None else self

    def nodes(self, number: int) -> Indices:
        """Vertices of body ``number``, 1 or 2, on its own face."""
        return (self.nodes_1, self.nodes_2)[number - 1]

    def carried(self, field: Array) -> Array:
        """A field ``(n_1, ...)`` of body 1's nodes at those of body 2 ``(n, ...)``."""
        return field if self.projection is None else np.asarray(self.projection @ field)


@dataclass(frozen=True)
class StructureMesh:
    """``bodies`` and the ``interfaces`` between them, each of which names its two by their places.

    Examples
    --------
    Two cubes on each other:

    >>> import numpy as np
    >>> from skfem import MeshTet
    >>> from fe_models import Body, StructureMesh
    >>> from fe_models.meshes.structure_mesh import matched_interface
    >>> from sa_solver import Frame
    >>> mesh = MeshTet().with_boundaries({"contact": lambda x: x[2] == 0.0})
    >>> upper, lower = Body("upper", mesh), Body("lower", mesh.mirrored((0.0, 0.0, 1.0)))
    >>> frame = Frame(np.zeros(3), np.eye(3))
    >>> face = matched_interface("joint", lower, upper, "contact", frame)
    >>> cubes = StructureMesh((lower, upper), (face,))
    >>> print(cubes.node_count(order=1), "nodes,", cubes.node_count(order=2), "with midsides")
    16 nodes, 52 with midsides
    """

    bodies: tuple[Body, ...]
    interfaces: tuple[Interface, ...]

    def faces_of(self, place: int) -> list[tuple[Interface, int]]:
        """Contact faces of the body at a ``place``: interfaces, and which body of each it is."""
        return [(self.interfaces[number], side) for number, side in self.sides_of(place)]

    def sides_of(self, place: int) -> list[tuple[int, int]]:
        """As :meth:`faces_of`, the interfaces by their numbers from 0."""
        return [
            (number, side)
            for number, interface in enumerate(self.interfaces)
            for side in (1, 2)
            if interface.bodies[side - 1] == place
        ]

    def weighted(self, order: int) -> StructureMesh:
        """With faces that are ``weighted`` where elements are of second order."""
        faces = (
            replace(
                face,
                weighted=order == 2,
                face_1=face.face_1 and replace(face.face_1, weighted=order == 2),
            )
            for face in self.interfaces
        )
        return replace(self, interfaces=tuple(faces))

    def node_count(self, order: int) -> int:
        """Nodes of all bodies, with elements of order 2 midsides included."""
        count = 0
        for mesh in (body.mesh for body in self.bodies):
            count += mesh.nvertices
            if order == 2:
                count += mesh.nedges if mesh.dim() == 3 else mesh.nfacets
        return int(count)


def in_space(components: Array) -> Array:
    """Vectors ``(..., 3)`` from ones ``(..., dim)``: those of the plane (X, Z) have no Y."""
    if components.shape[-1] == 3:
        return components
    spatial = np.zeros((*components.shape[:-1], 3))
    spatial[..., AXES[2]] = components
    return spatial


def named_mesh(points: Array, cells: Indices, boundaries: dict[str, Indices]) -> MeshTet | MeshTri:
    """A mesh whose boundaries are given by the vertices of their facets.

    Tetrahedra: ``points`` ``(n, 3)``, ``cells`` ``(m, 4)``, each boundary ``(k, 3)``; triangles in
    the plane (X, Z): ``(n, 2)``, ``(m, 3)`` and ``(k, 2)``.
    """
    # Finite elements take a second to load: where they are used.
    from scipy.spatial import cKDTree
    from skfem import MeshTet, MeshTri

    kind = MeshTet if points.shape[1] == 3 else MeshTri
    mesh = kind(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
    _number_facets(mesh)
    lookup = cKDTree(np.sort(mesh.facets, axis=0).T)
    named = {}
    for name, facets in boundaries.items():
        distance, index = lookup.query(np.sort(facets, axis=1))
        if np.any(distance > 0):
            raise MeshError(f"boundary {name} has facets that are no faces of the mesh")
        named[name] = index
    return numbered_as(mesh, mesh.with_boundaries(named))


def numbered_as(mesh: MeshTet | MeshTri, same: MeshTet | MeshTri) -> MeshTet | MeshTri:
    """The mesh of the ``same`` elements, with what is known of how those of ``mesh`` are connected.

    Facets and edges hang on the elements alone; scikit-fem would number them again.
    """
    vars(same).update({name: vars(mesh)[name] for name in NUMBERED & vars(mesh).keys()})
    return same


def _number_facets(mesh: MeshTet | MeshTri) -> None:
    """Number the facets as scikit-fem does, which sorts columns and takes ten times as long."""
    corners = np.sort(mesh.t[np.array(mesh.elem.refdom.facets)], axis=1).astype(np.int64)
    if mesh.nvertices ** corners.shape[1] > np.iinfo(np.int64).max:
        return
    keys = np.zeros(corners[:, 0].shape, dtype=np.int64)
    for k in range(corners.shape[1]):
        keys = mesh.nvertices * keys + corners[:, k]
    facets, places = np.unique(keys.ravel(), return_inverse=True)
    rows = np.unravel_index(facets, (mesh.nvertices,) * corners.shape[1])
    mesh._facets = np.array(rows, dtype=mesh.t.dtype)
    mesh._t2f = places.reshape(keys.shape)


def matched_interface(
    name: str, body_1: Body, body_2: Body, boundary: str, frame: Frame
) -> Interface:
    """Pair the vertices of the boundary of that name on both bodies; their gap is zero.

    Raises :class:`MatchError` if a vertex of one face has no partner on the other.
    """
    from scipy.spatial import cKDTree

    nodes_2 = body_2.vertices(boundary)
    nodes_1 = body_1.vertices(boundary)
    points_2 = body_2.points[nodes_2]
    distance, partner = cKDTree(body_1.points[nodes_1]).query(points_2)
    size = np.ptp(points_2, axis=0).max()
    if len(nodes_1) != len(nodes_2) or distance.max() > MATCHING_TOLERANCE * size:
        raise MatchError(
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
    """Write all bodies and all their named boundaries to one gmsh 4.1 file (text).

    Elements of bodies with midsides are of second order.

    Raises OSError where the disk is full, which gmsh does not notice.
    """
    with gmsh_model("structure") as gmsh:
        offset = 0
        for tag, body in enumerate(structure.bodies, start=1):
            dim = body.mesh.dim()
            points, cells, faces, kinds = _listed(body)
            gmsh.model.addDiscreteEntity(dim, tag)
            gmsh.model.addPhysicalGroup(dim, [tag], name=body.name)
            node_tags = offset + 1 + np.arange(len(points))
            gmsh.model.mesh.addNodes(dim, tag, node_tags, points.ravel())
            gmsh.model.mesh.addElementsByType(tag, kinds[0][dim], [], node_tags[cells].ravel())
            for name, facets in faces.items():
                face = gmsh.model.addDiscreteEntity(dim - 1)
                gmsh.model.addPhysicalGroup(dim - 1, [face], name=f"{body.name}_{name}")
                of_facets = node_tags[facets].ravel()
                gmsh.model.mesh.addElementsByType(face, kinds[1][dim], [], of_facets)
            offset += len(points)
        gmsh.write(str(path))
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - len(MSH_END)))
        if file.read(len(MSH_END)) != MSH_END:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))


def _listed(
    body: Body,
) -> tuple[Array, Indices, dict[str, Indices], tuple[dict[int, int], dict[int, int]]]:
    """Nodes of a body, those of its elements and of the facets of boundaries, and gmsh's kinds."""
    boundaries = body.mesh.boundaries
    if body.midsides is None:
        faces = {name: body.facets(name) for name in boundaries}
        return body.points, body.mesh.t.T, faces, (GMSH_CELL, GMSH_FACET)
    cells = body.element_nodes[:, GMSH_NODES[body.mesh.dim()]]
    faces = {name: body.facet_nodes(facets) for name, facets in boundaries.items()}
    return body.nodes, cells, faces, (GMSH_CURVED_CELL, GMSH_CURVED_FACET)
