"""Checks that elements fill a body's volume once and that boundaries are on its surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import Body, MeshError, named_mesh
from fe_models.readers.grouped import pieces
from sa_solver.types import Array, Indices

# An element is flat when its volume is below this share of the cube of its extent (the square in
# the plane): slivers of meshers have 1e-4, rounding errors are 1e-16.
FLAT = 1e-10


def checked_body(name: str, points: Array, cells: Indices, boundaries: dict[str, Indices]) -> Body:
    """Return a body with boundaries given by the vertices of their facets.

    Raises :class:`MeshError` if elements are flat, folded, duplicate or in separate pieces, or if a
    boundary is not on the surface.
    """
    _check_cells(name, points, cells)
    body = Body(name, named_mesh(points, cells, boundaries))
    _check_filling(body)
    for boundary, index in (body.mesh.boundaries or {}).items():
        inner = int(np.sum(body.mesh.f2t[1, index] >= 0))
        if inner:
            raise MeshError(
                f"{inner} of the {len(index)} facets of boundary {boundary} are inside body {name}"
            )
    return body


def _check_cells(name: str, points: Array, cells: Indices) -> None:
    """Raise unless elements have distinct corners, occur once and are connected."""
    ordered = np.sort(cells, axis=1)
    repeating = np.any(np.diff(ordered, axis=1) == 0, axis=1)
    if np.any(repeating):
        raise MeshError(
            f"{np.sum(repeating)} elements of body {name} repeat a node, "
            f"{_near(points, cells, repeating)}; allowed: as many nodes as the shape has corners"
        )
    _, count = np.unique(ordered, axis=0, return_counts=True)
    if np.any(count > 1):
        raise MeshError(
            f"{np.sum(count > 1)} elements of body {name} occur more than once; keep one of each"
        )
    separate = 1 + int(pieces([("", cells)])[0].max())
    if separate > 1:
        raise MeshError(
            f"body {name} is in {separate} pieces that share no nodes: merge their nodes if they "
            "are one body, or name each"
        )


def _check_filling(body: Body) -> None:
    """Raise unless elements have volume and at most two, on opposite sides, share a facet."""
    mesh, points = body.mesh, body.mesh.p.T
    corners = points[mesh.t.T]
    size = np.ptp(corners, axis=1).max(axis=1)
    flat = np.abs(element_volumes(mesh)) < FLAT * size ** mesh.dim()
    if np.any(flat):
        raise MeshError(
            f"{np.sum(flat)} elements of body {body.name} are flat, {_near(points, mesh.t.T, flat)}"
        )
    crowded = np.bincount(mesh.t2f.ravel()) > 2
    if np.any(crowded):
        raise MeshError(
            f"{np.sum(crowded)} facets of body {body.name} belong to more than two elements, "
            f"{_near(points, mesh.facets.T, crowded)}"
        )
    shared = np.flatnonzero(mesh.f2t[1] >= 0)
    facets = points[mesh.facets[:, shared].T]
    sides = [
        np.linalg.det(
            np.concatenate([facets[:, 1:], points[_opposite(body, shared, side)][:, None]], axis=1)
            - facets[:, :1]
        )
        for side in (0, 1)
    ]
    folded = sides[0] * sides[1] > 0.0
    if np.any(folded):
        raise MeshError(
            f"body {body.name} folds over itself at {np.sum(folded)} facets, "
            f"{_near(points, mesh.facets[:, shared].T, folded)}: elements overlap or are too "
            "distorted to be split"
        )


def _opposite(body: Body, facets: Indices, side: int) -> Indices:
    """Return the vertex off the facet of the element on side 0 or 1 of each facet ``(n,)``."""
    mesh = body.mesh
    return mesh.t[:, mesh.f2t[side, facets]].sum(axis=0) - mesh.facets[:, facets].sum(axis=0)


def _near(points: Array, cells: Indices, chosen: NDArray[np.bool_]) -> str:
    """Return the position of the first chosen element or facet, for a message."""
    return f"the first near {vector(points[cells[np.argmax(chosen)]].mean(axis=0))} mm"


def vector(components: Array) -> str:
    """Return a vector, in mm or of length 1, as text for a message."""
    # Rounding is noise below the ninth decimal; adding zero turns -0 into 0.
    return "(" + ", ".join(f"{round(component, 9) + 0.0:.4g}" for component in components) + ")"
