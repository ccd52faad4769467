"""Mesh as given in a file: nodes, elements of any shape, and their named groups.

Elements are split into triangles or tetrahedra in such a way that neighbours of any shape agree on
the diagonals of the quadrilaterals between them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from fe_models.meshes.curved_face import Midsides
from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.length_unit import LengthUnit
from fe_models.readers.scene import Scene
from sa_solver.types import Array, Indices

# Number of corner nodes of every shape that is read, and its dimension.
CORNERS = {
    "vertex": 1, "line": 2, "triangle": 3, "quad": 4, "tetra": 4, "pyramid": 5, "wedge": 6,
    "hexahedron": 8,
}  # fmt: skip
DIMENSION = {
    "vertex": 0, "line": 1, "triangle": 2, "quad": 2, "tetra": 3, "pyramid": 3, "wedge": 3,
    "hexahedron": 3,
}  # fmt: skip
# Shape of a face with that many corners.
FACE_SHAPES = {2: "line", 3: "triangle", 4: "quad"}
# Corners of the faces S1, S2, ... of every shape, in the order of the Abaqus manual (Elements:
# two-dimensional and three-dimensional solid element libraries), counted from zero.
FACES: dict[str, tuple[tuple[int, ...], ...]] = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetra": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "pyramid": ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "hexahedron": (
        (0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0),
    ),
}  # fmt: skip

HEXAHEDRON_DIAGONALS = ((0, 6), (1, 7), (2, 4), (3, 5))

# Largest distance of a midside node from the middle of its edge, as a share of the edge. At crack
# tips it is a quarter.
MIDDLE = 0.3

# Elements of one shape and their corner nodes ``(m, corners)``, as rows of the file's points.
Blocks = list[tuple[str, Indices]]


@dataclass(frozen=True)
class GroupedMesh:
    """Nodes and named groups of a file, without any checks.

    Attributes
    ----------
    points
        Nodes ``(n, 3)`` [mm]; a reader gives them in ``unit``.
    numbers
        The file's own node numbers ``(n,)``.
    bodies, surfaces, node_sets
        Elements of each body, facets of each surface, and rows of each node set, by name.
    midsides
        Points in the middle of edges, if there are elements of second order.
    unused
        Lines of the file that describe more than a mesh and are not imported.
    scene
        Materials, contacts, supports and loads of the file.
    unit
        Unit of length of the file.
    remarks
        Messages that the library which reads the file has printed.
    """

    points: Array
    numbers: Indices
    bodies: dict[str, Blocks]
    surfaces: dict[str, Blocks]
    node_sets: dict[str, Indices]
    midsides: Midsides | None = None
    unused: tuple[str, ...] = ()
    scene: Scene = field(default_factory=Scene)
    unit: LengthUnit = field(default_factory=LengthUnit)
    remarks: tuple[str, ...] = ()

    def in_millimetres(self) -> GroupedMesh:
        """Return the mesh with lengths in mm, and its scene in N, mm and t."""
        size, midsides = self.unit.size, self.midsides
        if size == 1.0:
            return self
        if midsides is not None:
            midsides = replace(midsides, points=size * midsides.points)
        scene = self.scene.converted(size, self.unit.force)
        return replace(self, points=size * self.points, midsides=midsides, scene=scene)


def midsides_of(points: Array, blocks: Iterable[tuple[str, Indices]]) -> Midsides | None:
    """Return the midside points of elements ``(m, nodes)`` of second order, by shape.

    Programs list midside nodes in different orders, but in the same order for all elements of a
    shape. They are assigned to the edges with the closest middles. Quadrilaterals also have a point
    in their middle, on both diagonals, since they are split along one of them; its position follows
    from the eight nodes of their edges. Hexahedra also have one in their centre. The result is None
    if all elements are of first order.
    """
    edges, middles, rows = [], [], []
    for shape, cells in blocks:
        corners, pairs = CORNERS[shape], edges_of_shape(shape)
        if cells.shape[1] < corners + len(pairs) or not len(pairs):
            continue
        # The import takes a tenth of a second, so it is done only where it is needed.
        from scipy.optimize import linear_sum_assignment

        chords = 0.5 * (points[cells[:, pairs[:, 0]]] + points[cells[:, pairs[:, 1]]])
        given = points[cells[:, corners : corners + len(pairs)]]
        apart = np.linalg.norm(given[:, None] - chords[:, :, None], axis=3).mean(axis=0)
        order = linear_sum_assignment(apart)[1]
        lengths = np.linalg.norm(np.diff(points[cells[:, pairs]], axis=2), axis=3)
        if np.any(apart[np.arange(len(order)), order] > MIDDLE * lengths.mean(axis=(0, 2))):
            raise MeshError(f"midside nodes of {shape} elements are not in the middle of its edges")
        given = given[:, order]
        edges.append(cells[:, pairs].reshape(-1, 2))
        middles.append(given.reshape(-1, 3))
        rows.append(cells[:, corners : corners + len(pairs)][:, order].ravel())
        place = {tuple(sorted(pair)): k for k, pair in enumerate(pairs.tolist())}
        inner: list[tuple[tuple[int, ...], Array]] = []
        for face in _quadrilaterals(shape):
            around = [place[tuple(sorted(pair))] for pair in pairwise([*face, face[0]])]
            middle = 0.5 * given[:, around].sum(axis=1) - 0.25 * points[cells[:, face]].sum(axis=1)
            diagonals = (face[0::2], face[1::2])
            inner += [(diagonal, middle) for diagonal in diagonals]
        if shape == "hexahedron":
            # One of its diagonals is an edge of the tetrahedra that it is split into.
            centre = 0.25 * (given.sum(axis=1) - points[cells[:, :corners]].sum(axis=1))
            inner += [(diagonal, centre) for diagonal in HEXAHEDRON_DIAGONALS]
        for diagonal, middle in inner:
            edges.append(cells[:, diagonal])
            middles.append(middle)
            rows.append(np.full(len(cells), -1))
    if not edges:
        return None
    return Midsides(np.concatenate(edges), np.concatenate(middles), np.concatenate(rows))


def edges_of_shape(shape: str) -> Indices:
    """Return the corners of the edges of a shape, ``(k, 2)``."""
    rings = FACES[shape] if DIMENSION[shape] > 1 else ((0, 1),) * (shape == "line")
    pairs = {tuple(sorted(pair)) for ring in rings for pair in pairwise([*ring, ring[0]])}
    return np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)


def _quadrilaterals(shape: str) -> list[tuple[int, ...]]:
    """Return the quadrilateral faces of a solid shape, or of a plane shape itself."""
    faces = FACES[shape] if DIMENSION[shape] == 3 else (tuple(range(CORNERS[shape])),)
    return [face for face in faces if len(face) == 4]


def simplices(shape: str, cells: Indices) -> Indices:
    """Split elements of a shape ``(m, corners)`` into lines, triangles or tetrahedra.

    Every quadrilateral is cut by the diagonal from its lowest node, so that the two elements that
    share it agree, and every element is a fan of tetrahedra around its lowest node: 2 in a pyramid,
    3 in a wedge, 6 in a hexahedron (Dompierre, Labbé, Vallet and Camarero, 8th International
    Meshing Roundtable, 1999).
    """
    if shape == "quad":
        return _halved(cells)
    if shape not in ("pyramid", "wedge", "hexahedron"):
        return cells
    lowest = np.argmin(cells, axis=1)
    return np.concatenate(
        [_fan(shape, cells[lowest == apex], apex) for apex in range(CORNERS[shape])]
    )


def split_blocks(blocks: Blocks) -> Indices:
    """Return the elements of all blocks, each split by :func:`simplices`."""
    return np.concatenate([simplices(shape, cells) for shape, cells in blocks])


def nodes_of(blocks: Blocks) -> Indices:
    """Return the nodes of the elements of all blocks, sorted, each once."""
    return np.unique(np.concatenate([cells.ravel() for _, cells in blocks]))


def _halved(quads: Indices) -> Indices:
    """Return two triangles of each quadrilateral, split by the diagonal from its lowest node."""
    cyclic = (np.argmin(quads, axis=1)[:, None] + np.arange(4)) % 4
    quads = np.take_along_axis(quads, cyclic, axis=1)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _fan(shape: str, cells: Indices, apex: int) -> Indices:
    """Return the tetrahedra from the corner ``apex`` to all faces that do not touch it."""
    fan = []
    for face in FACES[shape]:
        if apex not in face:
            triangles = simplices(FACE_SHAPES[len(face)], cells[:, face])
            tip = np.tile(cells[:, apex], len(triangles) // max(len(cells), 1))
            fan.append(np.column_stack([tip, triangles]))
    return np.concatenate(fan)


def pieces(blocks: Blocks) -> list[Indices]:
    """Return the number of the piece that each element belongs to, ``(m,)`` per block.

    Elements that share a node are in one piece; pieces are numbered in the order of their first
    elements.
    """
    # The import takes a fifth of a second, so it is done only where it is needed.
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    count = 1 + max(int(cells.max()) for _, cells in blocks)
    # Link every corner of an element with its first one.
    links = np.concatenate([cells[:, [0, k]] for _, cells in blocks for k in range(cells.shape[1])])
    graph = sp.coo_matrix((np.ones(len(links)), links.T), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    labels = np.concatenate([label[cells[:, 0]] for _, cells in blocks])
    _, first, piece = np.unique(labels, return_index=True, return_inverse=True)
    ordered = np.argsort(np.argsort(first))[piece]
    return np.split(ordered, np.cumsum([len(cells) for _, cells in blocks])[:-1])


def piece_blocks(blocks: Blocks) -> list[Blocks]:
    """Return the elements of each piece, as numbered by :func:`pieces`."""
    labels = pieces(blocks)
    return [
        [
            (shape, cells[label == piece])
            for (shape, cells), label in zip(blocks, labels, strict=True)
            if np.any(label == piece)
        ]
        for piece in range(1 + max(int(label.max()) for label in labels))
    ]
