"""Gmsh's meshes, from a ``.msh`` file or just generated: groups of entities become named groups."""

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

# First word of gmsh's name of an element and the shape it is; corner nodes come first in all.
SHAPES = {
    "Point": "vertex", "Line": "line", "Triangle": "triangle", "Quadrilateral": "quad",
    "Tetrahedron": "tetra", "Pyramid": "pyramid", "Prism": "wedge", "Hexahedron": "hexahedron",
}  # fmt: skip


@dataclass(frozen=True)
class EntityGroup:
    """A named group of entities of one dimension."""

    name: str
    dimension: int
    entities: list[int]


def read_msh(path: Path) -> GroupedMesh:
    """Read a gmsh file (2.2 or 4.1, text or binary).

    Physical volumes are bodies, physical surfaces their boundaries, lower groups node sets; in a
    plane mesh surfaces and curves. A group without a name goes by its number, and in a file without
    physical groups every entity does. Raises :class:`MeshError`.
    """
    with unmarked(path) as plain, gmsh_model(path.stem) as gmsh:
        with plain.open("rb") as file:
            # Anything else would be run as a script in gmsh's own language.
            if file.read(1) != b"$":
                raise MeshError(
                    f"{path}: is no gmsh mesh; allowed: .msh files of format 2.2 or 4.1"
                )
        try:
            gmsh.merge(str(plain))
        except Exception as error:  # gmsh raises nothing more specific
            raise MeshError(f"{path}: gmsh cannot read it: {first_line(error)}") from None
        try:
            return grouped_entities(gmsh, _groups(gmsh.model))
        except MeshError as error:
            raise MeshError(f"{path}: {error}") from None


def grouped_entities(gmsh: Any, groups: list[EntityGroup]) -> GroupedMesh:
    """The mesh of the open gmsh model; ``groups`` of its highest dimension are the bodies."""
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
    every: dict[str, Indices] = {}
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
            every[group.name] = nodes_of(blocks)
    return GroupedMesh(
        points=points,
        numbers=numbers[order],
        bodies=named[top],
        surfaces=named[top - 1] if top > 0 else {},
        node_sets=every,
        midsides=midsides_of(points, second),
    )


def generated_body(
    gmsh: Any, body: EntityGroup, boundaries: list[EntityGroup]
) -> tuple[Array, Indices, dict[str, Indices]]:
    """A body just meshed in the open gmsh model: points ``(n, 3)``, simplices, boundaries by name.

    Its nodes are numbered from zero, in gmsh's order; others are left out.
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
    """The physical groups; without any, every entity by its number."""
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
    """No element of the highest dimension is left out."""
    grouped = {tag for group in groups if group.dimension == top for tag in group.entities}
    for dim, tag in model.getEntities(top):
        if tag not in grouped and len(model.mesh.getElements(dim, tag)[0]):
            raise MeshError(
                f"the elements of {'volume' if top == 3 else 'surface'} {tag} are in no physical "
                f"group: put them into one"
            )


def _blocks(model: Any, group: EntityGroup, numbers: Indices) -> Blocks:
    """Elements of a group with all their nodes, which are rows of the sorted ``numbers``."""
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
    """The first line of a message."""
    return (str(error).splitlines() or [type(error).__name__])[0]
