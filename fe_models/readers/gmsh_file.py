"""Meshes of gmsh, from a ``.msh`` file or just generated, with entity groups as named groups."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.grouped import (
    CORNERS,
    Blocks,
    GroupedMesh,
    midsides_of,
    nodes_of,
    split_blocks,
)
from fe_models.readers.text_files import unmarked
from sa_solver.types import Array, Indices

# Shape of an element by the first word of its name in gmsh; corner nodes come first in all.
SHAPES = {
    "Point": "vertex", "Line": "line", "Triangle": "triangle", "Quadrilateral": "quad",
    "Tetrahedron": "tetra", "Pyramid": "pyramid", "Prism": "wedge", "Hexahedron": "hexahedron",
}  # fmt: skip


@dataclass(frozen=True)
class EntityGroup:
    """Named group of entities of one dimension."""

    name: str
    dimension: int
    entities: list[int]


def read_msh(path: Path) -> GroupedMesh:
    """Read a gmsh file (2.2 or 4.1, text or binary).

    Physical volumes are bodies, physical surfaces their boundaries, and physical curves and points
    node sets; in a plane mesh surfaces are bodies and curves boundaries. A group without a name is
    named by its number, and in a file without physical groups every entity is a group named by its
    number. Raises :class:`MeshError`.
    """
    with unmarked(path) as plain, gmsh_model(path.stem) as gmsh:
        with plain.open("rb") as file:
            # gmsh would run any other file as a script in its own language.
            if file.read(1) != b"$":
                raise MeshError(
                    f"{path}: is not a gmsh mesh; allowed: .msh files of format 2.2 or 4.1"
                )
        try:
            gmsh.merge(str(plain))
        except Exception as error:  # gmsh raises no more specific exception.
            raise MeshError(f"{path}: gmsh cannot read it: {first_line(error)}") from None
        try:
            return grouped_entities(gmsh, _groups(gmsh.model))
        except MeshError as error:
            raise MeshError(f"{path}: {error}") from None


def grouped_entities(gmsh: Any, groups: list[EntityGroup]) -> GroupedMesh:
    """Return the mesh of the open gmsh model.

    ``groups`` of its highest dimension are the bodies.
    """
    model = gmsh.model
    tags, coordinates, _ = model.mesh.getNodes()
    numbers = np.asarray(tags, dtype=np.int64)
    order = np.argsort(numbers)
    top = max(
        (dim for dim, _ in model.getEntities() if len(model.mesh.getElements(dim)[0])), default=0
    )
    _refuse_ungrouped(model, top, groups)
    named: list[dict[str, Blocks]] = [{}, {}, {}, {}]
    points, second = np.asarray(coordinates).reshape(-1, 3)[order], []
    node_sets: dict[str, Indices] = {}
    for group in groups:
        if group.name in named[group.dimension]:
            raise MeshError(
                f"two groups of dimension {group.dimension} are named {group.name}: rename one"
            )
        blocks = _blocks(model, group, numbers[order])
        if blocks:
            named[group.dimension][group.name] = [
                (shape, cells[:, : CORNERS[shape]]) for shape, cells in blocks
            ]
        if group.dimension == top:
            second += blocks
        if blocks and group.dimension < top - 1:
            node_sets[group.name] = nodes_of(blocks)
    return GroupedMesh(
        points=points,
        numbers=numbers[order],
        bodies=named[top],
        surfaces=named[top - 1] if top > 0 else {},
        node_sets=node_sets,
        midsides=midsides_of(points, second),
    )


def generated_body(
    gmsh: Any, body: EntityGroup, boundaries: list[EntityGroup]
) -> tuple[Array, Indices, dict[str, Indices]]:
    """Return a body that was just meshed in the open gmsh model.

    The result is its points ``(n, 3)``, simplices, and boundaries by name. Nodes are numbered from
    zero in gmsh's order; unused nodes are left out.
    """
    grouped = grouped_entities(gmsh, [body, *boundaries])
    cells = split_blocks(grouped.bodies[body.name])
    used = np.unique(cells)
    named = {
        name: np.searchsorted(used, split_blocks(blocks))
        for name, blocks in grouped.surfaces.items()
    }
    return grouped.points[used], np.searchsorted(used, cells), named


def _groups(model: Any) -> list[EntityGroup]:
    """Return the physical groups, or every entity named by its number if there are none."""
    physical = [
        EntityGroup(
            model.getPhysicalName(dim, tag) or str(tag),
            dim,
            list(model.getEntitiesForPhysicalGroup(dim, tag)),
        )
        for dim, tag in model.getPhysicalGroups()
    ]
    return physical or [
        EntityGroup(str(tag), dim, [tag]) for dim, tag in model.getEntities() if dim > 0
    ]


def _refuse_ungrouped(model: Any, top: int, groups: list[EntityGroup]) -> None:
    """Raise :class:`MeshError` if an element of the highest dimension is in no group."""
    grouped = {tag for group in groups if group.dimension == top for tag in group.entities}
    for dim, tag in model.getEntities(top):
        if tag not in grouped and len(model.mesh.getElements(dim, tag)[0]):
            raise MeshError(
                f"the elements of {'volume' if top == 3 else 'surface'} {tag} are in no physical "
                f"group: put them into one"
            )


def _blocks(model: Any, group: EntityGroup, numbers: Indices) -> Blocks:
    """Return the elements of a group with all their nodes, as rows of the sorted ``numbers``."""
    blocks = []
    for entity in group.entities:
        types, _, nodes = model.mesh.getElements(group.dimension, entity)
        for kind, tags in zip(types, nodes, strict=True):
            name, _, _, count, _, _ = model.mesh.getElementProperties(kind)
            shape = SHAPES.get(name.split()[0])
            if shape is None:
                raise MeshError(
                    f"group {group.name} has elements {name}; allowed: {', '.join(SHAPES)}"
                )
            cells = np.asarray(tags, dtype=np.int64).reshape(-1, count)
            blocks.append((shape, np.searchsorted(numbers, cells)))
    return blocks


def first_line(error: Exception) -> str:
    """Return the first line of an error's message."""
    return (str(error).splitlines() or [type(error).__name__])[0]
