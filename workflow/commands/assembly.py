"""Contents of a mesh or CAD file for display: surfaces, named faces and points of its bodies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fe_models.geometry.imported import ImportedMesh
from fe_models.meshes.structure_mesh import Body
from sa_solver.types import Array, Indices, Mask
from workflow.pictures.vtk import write_xml

if TYPE_CHECKING:
    import pyvista

# Boundary that contains all facets of a body's surface; no file can use this name.
SURFACE = "\0"
TRIANGLE, LINE = 5, 3  # cell types of VTK


@dataclass(frozen=True)
class DrawnBody:
    """Body as it is drawn: its surface, and what the file names on it.

    ``corners`` ``(m, dim, 3)`` [mm] are the corners of the facets of its surface, ``normals``
    ``(m, 3)`` their outward normals, and ``facets`` ``(m,)`` their numbers in the mesh. ``faces``
    has the facets of each named face, as rows of these arrays; ``points`` has the places ``(k, 3)``
    of the node sets that are not faces.
    """

    name: str
    body: Body
    corners: Array
    normals: Array
    facets: Indices
    faces: dict[str, Indices]
    points: dict[str, Array]

    @property
    def extent(self) -> Array:
        """Size along the axes ``(3,)`` [mm]."""
        return np.asarray(np.ptp(self.corners.reshape(-1, 3), axis=0))


def shown_bodies(imported: ImportedMesh) -> list[DrawnBody]:
    """Return all bodies of a file."""
    return [_shown(imported, name) for name in imported.bodies]


def _shown(imported: ImportedMesh, name: str) -> DrawnBody:
    body = imported.bodies[name]
    facets = np.asarray(body.mesh.boundary_facets())
    surface = Body(name, body.mesh.with_boundaries({SURFACE: facets}))
    row = np.full(body.mesh.facets.shape[1], -1)
    row[facets] = np.arange(len(facets))
    named = {**(body.mesh.boundaries or {}), **imported.set_faces[name]}
    return DrawnBody(
        name=name,
        body=body,
        corners=body.points[surface.facets(SURFACE)],
        normals=surface.outward(SURFACE),
        facets=facets,
        faces={key: row[np.asarray(index)] for key, index in named.items()},
        points={
            key: body.points[vertices]
            for key, vertices in imported.points[name].items()
            if key not in imported.set_faces[name]
        },
    )


def write_vtu(imported: ImportedMesh, path: Path) -> None:
    """Write the bodies for ParaView: facets and nodes, with the groups that they belong to."""
    write_xml(grid_of(imported), path)


def grid_of(imported: ImportedMesh) -> pyvista.UnstructuredGrid:
    """Return the facets of all surfaces as cells, each once; for plane meshes the elements too.

    ``body`` numbers the bodies from 1. ``face`` numbers the boundaries of each body as the picture
    does, 0 for none. An array for each name is 1 on that group. ``node`` has the node numbers of
    the file.
    """
    import pyvista

    bodies = shown_bodies(imported)
    offsets = np.cumsum([0, *(len(shown.body.points) for shown in bodies)])[:-1].tolist()
    parts = [_cells(shown, offset) for shown, offset in zip(bodies, offsets, strict=True)]
    cells, kinds, row = (np.concatenate(part) for part in zip(*parts, strict=True))
    points = np.concatenate([shown.body.points for shown in bodies])
    grid = pyvista.UnstructuredGrid(cells, kinds, points)
    owner = np.repeat(np.arange(1, len(bodies) + 1), [len(part[2]) for part in parts])
    face = np.zeros(len(row), dtype=np.int32)
    grid.cell_data["body"] = owner.astype(np.int32)
    for number, shown in enumerate(bodies, start=1):
        _mark(grid.cell_data, f"body {number} {shown.name}", owner == number)
        for order, (name, facets) in enumerate(shown.faces.items(), start=1):
            here = (owner == number) & np.isin(row, facets)
            face[here] = order
            _mark(grid.cell_data, f"boundary {name}", here)
    grid.cell_data["face"] = face
    grid.point_data["node"] = np.concatenate([imported.node_numbers[s.name] for s in bodies])
    for shown, offset in zip(bodies, offsets, strict=True):
        vertex = np.arange(len(points)) - offset
        for name, vertices in imported.points[shown.name].items():
            _mark(grid.point_data, f"node set {name}", np.isin(vertex, vertices))
    return grid


def _cells(shown: DrawnBody, offset: int) -> tuple[Indices, Indices, Indices]:
    """Return the cells of a body in VTK's format, their types, and their rows in its surface.

    Elements, which only plane bodies list, have the row -1.
    """
    mesh = shown.body.mesh
    plane = mesh.dim() == 2
    elements, facets = mesh.t.T if plane else mesh.t.T[:0], mesh.facets[:, shown.facets].T
    listed = [
        np.insert(block + offset, 0, block.shape[1], axis=1).ravel() for block in (elements, facets)
    ]
    kinds = np.repeat([TRIANGLE, LINE if plane else TRIANGLE], [len(elements), len(facets)])
    row = np.concatenate([np.full(len(elements), -1), np.arange(len(facets))])
    return np.concatenate(listed), kinds, row


def _mark(data: Any, name: str, here: Mask) -> None:
    """Set an array to 1 on these entries too: several bodies may share the name of a group."""
    before = data[name] if name in data else np.zeros(len(here), dtype=np.int8)
    data[name] = (before + here).clip(max=1).astype(np.int8)
