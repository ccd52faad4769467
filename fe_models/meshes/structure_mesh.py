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
# Global axes of the coordinates and displacements of a mesh, by its dimension.
AXES = {2: (0, 2), 3: (0, 1, 2)}
# gmsh's type numbers of cells and of their facets, by dimension: first order, then second order.
GMSH_CELL, GMSH_FACET = {2: 2, 3: 4}, {2: 1, 3: 2}
GMSH_CURVED_CELL, GMSH_CURVED_FACET = {2: 9, 3: 11}, {2: 8, 3: 9}
# gmsh and scikit-fem list the last two edges of a tetrahedron in opposite order.
GMSH_NODES = {2: range(6), 3: (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)}
# Attributes in which a scikit-fem mesh caches the connectivity of its elements.
NUMBERED = frozenset({"_facets", "_t2f", "_f2t", "_edges", "_t2e", "_f2e"})
# Last line of a complete gmsh file.
MSH_END = b"$EndElements\n"


class MeshError(InputError):
    """Error of a geometry or mesh that cannot be used; the message says what to change."""


class MatchError(MeshError):
    """Error of two faces that do not meet node to node."""


@dataclass(frozen=True)
class Body:
    """Meshed body: tetrahedra, or triangles in the plane (X, Z) for plane strain.

    Sizes and normals from this class are those of the straight elements between the vertices.

    Attributes
    ----------
    name
        Name of the body.
    mesh
        Mesh of scikit-fem [mm], with named boundaries.
    midsides
        Positions of the midside nodes of elements of second order ``(edges, dim)`` [mm], in the
        order of the mesh's edges (in the plane: its facets). If None, they are in the middle of the
        edges.
    elements
        Body of second-order elements whose vertices and midside nodes are the vertices of this
        mesh, in that order (:func:`fe_models.meshes.halving.halved`). If None, the mesh itself
        has the elements.

    Examples
    --------
    A cube of 2 mm has a top whose facets together have the area of the face:

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
    elements: Body | None = field(default=None, kw_only=True)

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
        """Vertices in space ``(n, 3)`` [mm], followed by the midside nodes if it has any."""
        if self.midsides is None:
            return self.points
        return np.concatenate([self.points, in_space(self.midsides)])

    @property
    def element_nodes(self) -> Indices:
        """Vertices and midside nodes of the elements ``(m, 10 or 6)``, in scikit-fem's order."""
        mesh = self.mesh
        middles = mesh.t2f if mesh.dim() == 2 else mesh.t2e
        return np.asarray(np.vstack([mesh.t, mesh.nvertices + middles]).T)

    def facet_nodes(self, facets: Indices) -> Indices:
        """Return the vertices and midside nodes of facets, by facet number, ``(m, 6 or 3)``."""
        mesh = self.mesh
        middles = facets[None] if mesh.dim() == 2 else mesh.f2e[:, facets]
        return np.asarray(np.vstack([mesh.facets[:, facets], mesh.nvertices + middles]).T)

    def facets(self, boundary: str) -> Indices:
        """Return the vertices of a boundary's triangles (in the plane: edges), ``(n, dim)``."""
        return self.mesh.facets[:, self.mesh.boundaries[boundary]].T

    def outward(self, boundary: str) -> Array:
        """Return outward normals ``(n, 3)`` of the facets of a boundary, each as long as its area.

        In the plane a facet extends by 1 mm along Y.
        """
        return self.outward_of(self.mesh.boundaries[boundary])

    def outward_of(self, facets: Indices) -> Array:
        """Return outward normals as :meth:`outward`, of facets of the surface given by number."""
        corners = self.points[self.mesh.facets[:, facets].T]
        edge = corners[:, 1] - corners[:, 0]
        other = 0.5 * (corners[:, 2] - corners[:, 0]) if corners.shape[1] == 3 else [0.0, 1.0, 0.0]
        normals = np.cross(edge, other)
        out = corners.mean(axis=1) - self.points[self._behind(facets)].mean(axis=1)
        return normals * np.sign(np.einsum("ma,ma->m", normals, out))[:, None]

    def depth(self, boundary: str) -> float:
        """Return the median depth to which the elements of a boundary reach below it [mm]."""
        normals = self.outward(boundary)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        corners = self.points[self.facets(boundary)]
        below = corners[:, :1] - self.points[self._behind(self.mesh.boundaries[boundary])]
        return float(np.median(np.einsum("mia,ma->mi", below, normals).max(axis=1)))

    def _behind(self, facets: Indices) -> Indices:
        """Return the vertices ``(m, dim + 1)`` of the elements behind facets of the surface."""
        cells: Indices = self.mesh.t[:, self.mesh.f2t[0, facets]].T
        return cells

    def vertices(self, boundary: str) -> Indices:
        """Return the vertices on a named boundary, sorted, ``(n,)``."""
        return np.unique(self.facets(boundary))


@dataclass(frozen=True)
class Face:
    """Contact face, on which fields are linear between the nodes.

    Nodal forces are pressures times areas, and nodal displacements those of the nodes. If the face
    is ``weighted``, nodal forces are integrals of a linear traction, ∫ φ_i t dA, and nodal
    displacements the values of the linear field closest to the displacement (least squares).

    Attributes
    ----------
    name
        Name of the face.
    frame
        Frame in which it lies.
    coordinates
        Coordinates of its nodes in the frame ``(n, 2)`` [mm].
    facets
        Triangles ``(m, 3)``, or segments ``(m, 2)`` of a line contact, whose nodes have y = 0.
    weighted
        Whether nodal values are weighted, as for elements of second order.
    surface
        Surface that its mesh approximates, if known (:mod:`fe_models.meshes.curved_face`).
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
        """Return the face of body ``number``, 1 or 2, with its own nodes.

        By default both bodies have the same face.
        """
        return self

    @property
    def line(self) -> bool:
        """True if it is the face of a line contact, where forces are per length."""
        return self.facets.shape[1] == 2

    @property
    def nodal_areas(self) -> Array:
        """Area of contact that belongs to each node ``(n,)`` [mm²]; in a line contact [mm]."""
        return self.facet_shares

    @property
    def facet_shares(self) -> Array:
        """Equal share of its facets' area at each node ``(n,)`` [mm²]; in a line contact [mm]."""
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
    """Two faces that meet; as a face it is that of body 2.

    Faces that meet node to node list their nodes in the same order. Otherwise ``projection``,
    ``face_1`` and ``areas`` are given.

    Attributes
    ----------
    nodes_1, nodes_2
        Vertices of body 1 and of body 2.
    gap
        Distance of the unloaded, unworn faces ``(n,)`` [mm].
    projection
        Matrix ``(n, n_1)`` that gives a field of body 1's nodes at those of body 2.
    face_1
        Face of body 1.
    areas
        Area of each node that body 1 covers ``(n,)`` [mm²].
    bulged
        Part of the gap due to the form of the faces between vertices ``(n,)`` [mm].
    planes
        Axes of the frame that are normal to planes of symmetry; the frame's origin is on these
        planes (:mod:`fe_models.meshes.cut_face`).
    bodies
        Positions of body 1 and body 2 among the bodies of a :class:`StructureMesh`, from 0.

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
        """Area of contact that belongs to each node ``(n,)`` [mm²]; in a line contact [mm]."""
        return self.facet_shares if self.areas is None else self.areas

    def face(self, number: int) -> Face:
        return self.face_1 if number == 1 and self.face_1 is not None else self

    def nodes(self, number: int) -> Indices:
        """Return the vertices of body ``number``, 1 or 2, on its own face."""
        return (self.nodes_1, self.nodes_2)[number - 1]

    def carried(self, field: Array) -> Array:
        """Return a field ``(n_1, ...)`` of body 1's nodes at those of body 2 ``(n, ...)``."""
        return field if self.projection is None else np.asarray(self.projection @ field)


@dataclass(frozen=True)
class StructureMesh:
    """Meshed ``bodies`` and the ``interfaces`` between them, which give their bodies by position.

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
        """Return the interfaces of the body at ``place``, each with its number there, 1 or 2."""
        return [(self.interfaces[number], side) for number, side in self.sides_of(place)]

    def sides_of(self, place: int) -> list[tuple[int, int]]:
        """Return the same as :meth:`faces_of`, with the interfaces given by number from 0."""
        return [
            (number, side)
            for number, interface in enumerate(self.interfaces)
            for side in (1, 2)
            if interface.bodies[side - 1] == place
        ]

    def weighted(self, order: int) -> StructureMesh:
        """Return the mesh with faces that are ``weighted`` if elements are of second order."""
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
        """Return the number of nodes of all bodies, with midside nodes for elements of order 2."""
        count = 0
        for body in self.bodies:
            mesh = body.mesh
            count += mesh.nvertices
            if order == 2 and body.elements is None:
                count += mesh.nedges if mesh.dim() == 3 else mesh.nfacets
        return int(count)


def in_space(components: Array) -> Array:
    """Return vectors ``(..., 3)`` from components ``(..., dim)``; in the plane (X, Z) Y is 0."""
    if components.shape[-1] == 3:
        return components
    spatial = np.zeros((*components.shape[:-1], 3))
    spatial[..., AXES[2]] = components
    return spatial


def named_mesh(points: Array, cells: Indices, boundaries: dict[str, Indices]) -> MeshTet | MeshTri:
    """Return a mesh whose boundaries are given by the vertices of their facets.

    Parameters
    ----------
    points
        Coordinates ``(n, 3)``, or ``(n, 2)`` in the plane (X, Z).
    cells
        Vertices of tetrahedra ``(m, 4)`` or triangles ``(m, 3)``.
    boundaries
        Vertices of the facets of each boundary, ``(k, 3)`` or ``(k, 2)``.

    Raises
    ------
    MeshError
        If a boundary has a facet that is no facet of the mesh.
    """
    # Importing finite elements takes a second, so they are imported only where they are used.
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
            raise MeshError(
                f"boundary {name} has facets that are not faces of the mesh's elements; "
                "leave them out of the boundary"
            )
        named[name] = index
    return numbered_as(mesh, mesh.with_boundaries(named))


def mesh_edges(mesh: MeshTet | MeshTri) -> Indices:
    """Return the vertices of the edges ``(m, 2)``, in the order of :attr:`Body.midsides`."""
    return np.asarray((mesh.edges if mesh.dim() == 3 else mesh.facets).T)


def numbered_as(mesh: MeshTet | MeshTri, same: MeshTet | MeshTri) -> MeshTet | MeshTri:
    """Return the ``same`` mesh with the cached connectivity of ``mesh``, whose elements are equal.

    Facets and edges depend on the elements alone, and scikit-fem would number them again.
    """
    vars(same).update({name: vars(mesh)[name] for name in NUMBERED & vars(mesh).keys()})
    return same


def _number_facets(mesh: MeshTet | MeshTri) -> None:
    """Find and store the numbers of the facets in scikit-fem's order, ten times as fast."""
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
    """Pair the vertices of a boundary that has the same name on both bodies; their gap is zero.

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

    Elements of bodies with midside nodes are of second order. Raises OSError if the disk is full,
    which gmsh does not notice.
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
    """Return a body's nodes, those of its elements and boundary facets, and gmsh's type numbers."""
    boundaries = body.mesh.boundaries
    if body.midsides is None:
        faces = {name: body.facets(name) for name in boundaries}
        return body.points, body.mesh.t.T, faces, (GMSH_CELL, GMSH_FACET)
    cells = body.element_nodes[:, GMSH_NODES[body.mesh.dim()]]
    faces = {name: body.facet_nodes(facets) for name, facets in boundaries.items()}
    return body.nodes, cells, faces, (GMSH_CURVED_CELL, GMSH_CURVED_FACET)
