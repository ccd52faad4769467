"""Worn depth of a face as displacements of the user's nodes.

A node gets the mean of the depth around it, weighted by its shape function over the facets of its
face, so that Σ depth x nodal area is exactly the volume worn on the grid where the nodes cover it.
``NodalDepths.volume_share`` is the share of the volume that they carry.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fe_models.meshes.structure_mesh import Face
from fe_models.meshes.transfer import FaceTransfer
from sa_solver.types import Array, Frame, Grid, Indices
from workflow.analyses.wear.structures.resultants.faces import FaceError, facets_over
from workflow.case.fields import Quantity
from workflow.case.files.table_file import read_table_file
from workflow.shell.output.tables import write_table

NODE = "node"
AXES = ("X", "Y", "Z")
# Height of a face over its plane, relative to its extent, that indicates a wrong frame or a node
# set that is not the contact face. Crowned and rounded faces stay below a hundredth.
OFF_PLANE = 0.1


@dataclass(frozen=True)
class NodeTable:
    """Numbers ``(n,)`` of the user's nodes on one face and their ``points`` ``(n, 3)`` [mm]."""

    numbers: Indices
    points: Array

    def __len__(self) -> int:
        return len(self.numbers)


@dataclass(frozen=True)
class NodalDepths:
    """Worn ``depth`` at nodes ``(n,)`` [mm].

    ``volume_share`` is Σ depth x nodal area over the volume worn on the grid: 1 if the nodes cover
    the whole worn area, NaN if nothing is worn.
    """

    depth: Array
    volume_share: float

    @classmethod
    def of(cls, nodal: Array, areas: Array, grid: Grid, depth: Array) -> NodalDepths:
        """Return depths at nodes of ``areas`` ``(n,)`` with ``depth`` ``(nx, ny)`` on the grid."""
        worn = float(depth.sum()) * grid.cell_area
        return cls(nodal, float(nodal @ areas) / worn if worn else np.nan)


def read_nodes(file: str | Path) -> NodeTable:
    """Return the node table ``node, X, Y, Z`` in global axes; a plane model may omit Z.

    Raises InputFileError.
    """
    table, needed = read_table_file(file), (NODE, "X", "Y")
    table.check({NODE: "1", **dict.fromkeys(AXES, "mm")})
    table.require(needed, ", ".join(needed))
    numbers = table.once(NODE)
    columns = [
        table.column(axis, Quantity("mm")) if axis in table.names else np.zeros(len(table))
        for axis in AXES
    ]
    points = np.stack(columns, axis=1)
    return NodeTable(numbers, points)


def nodal_depths(points: Array, frame: Frame, grid: Grid, depth: Array) -> NodalDepths:
    """Return worn depths at nodes of a face from ``depth`` ``(nx, ny)`` [mm] on the grid.

    ``points`` ``(n, 3)`` [mm] are in global axes and the grid lies in ``frame``; beyond the grid
    nothing is worn. Raises FaceError unless the points are the nodes of a face in that frame.
    """
    coordinates = _in_plane(points, frame, grid.line)
    facets = facets_over(coordinates, grid.line)
    facets = facets[_meets(coordinates, facets, grid)]
    if len(facets) == 0:
        raise FaceError("no node is near the contact; allowed: those of its face, in its frame")
    nodes, numbered = np.unique(facets, return_inverse=True)
    face = Face("worn", frame, coordinates[nodes], numbered.reshape(facets.shape))
    shared = FaceTransfer.between(face, grid).shared
    nodal, areas = np.zeros((2, len(points)))
    areas[nodes] = face.nodal_areas
    nodal[nodes] = shared.T @ depth.ravel() / face.nodal_areas
    return NodalDepths.of(nodal, areas, grid, depth)


def worn_displacement(depth: Array, frame: Frame, body: Literal[1, 2]) -> Array:
    """Return displacements ``(n, 3)`` [mm] in global axes of nodes that lose ``depth`` ``(n,)``.

    Nodes move into the body: body 1 lies below the face and moves along -z of the frame, body 2
    along z.
    """
    inwards = {1: -1.0, 2: 1.0}[body] * frame.axes[2]
    return np.outer(depth, inwards)


def write_worn_nodes(path: Path, nodes: Indices, displacement: Array) -> None:
    """Write displacements ``(n, 3)`` [mm] by node number, in full precision."""
    along = {
        f"u{axis.lower()} [mm]": component
        for axis, component in zip(AXES, displacement.T, strict=True)
    }
    write_table(path, {NODE: nodes} | along)


def _in_plane(points: Array, frame: Frame, line: bool) -> Array:
    """Return the places ``(n, 2)`` of the nodes in the plane of the interface [mm]."""
    local = frame.coordinates(points)
    extent, off = float(np.ptp(local[:, :2], axis=0).max()), float(np.abs(local[:, 2]).max())
    if off > OFF_PLANE * extent:
        raise FaceError(
            f"nodes lie up to {off:.3g} mm off the plane of the interface; allowed: nodes of its "
            "contact face, in the axes of its frame"
        )
    if line:
        local[:, 1] = 0.0
    return local[:, :2]


def _meets(coordinates: Array, facets: Indices, grid: Grid) -> NDArray[np.bool_]:
    """Return the mask ``(m,)`` of facets whose box overlaps the grid; others have no wear."""
    corners = coordinates[facets]
    half = 0.5 * np.array(grid.size)
    inside = (corners.min(axis=1) < half) & (corners.max(axis=1) > -half)
    overlaps: NDArray[np.bool_] = inside.all(axis=1)
    return overlaps


def check_nodes(file: str, frame: Frame, size: tuple[float, float], line: bool) -> None:
    """Raise unless the file has the nodes of a face of ``size`` [mm] in that frame.

    Raises InputFileError for an invalid file and FaceError for unsuitable nodes.
    """
    grid = Grid.over(size, (1, 1), line)
    nodal_depths(read_nodes(file).points, frame, grid, np.zeros(grid.shape))
