"""Meshes in the formats that meshio reads."""

from __future__ import annotations

import io
import re
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.grouped import (
    CORNERS,
    DIMENSION,
    Blocks,
    GroupedMesh,
    midsides_of,
    piece_blocks,
)
from fe_models.readers.text_files import unmarked
from sa_solver.types import Indices

# Cell data that number groups in different formats, used before any other integer data.
TAG_FIELDS = ("gmsh:physical", "medit:ref", "cell_tags", "nastran:ref", "tetgen:ref", "su2:tag")
# Cell data in which the number 0 means no group.
ZERO_IS_NO_GROUP = ("gmsh:physical", "cell_tags")

# Names of the groups that each element of a block is in, and its rows.
CellGroups = dict[str, Indices]


def read_meshio(path: Path) -> GroupedMesh:
    """Read a mesh through meshio.

    Groups are the file's cell sets, or the values of one integer field on its cells, by their names
    or else as ``1``, ``2``, .... Without either, the connected pieces are bodies ``body_1``, ...
    without boundaries. Nodes are numbered from zero in the order of the file. Raises
    :class:`MeshError`.
    """
    mesh, remarks = _read(path)
    shapes = [_shape(path, block.type) for block in mesh.cells]
    full = [np.asarray(block.data, dtype=np.int64) for block in mesh.cells]
    cells = [nodes[:, : CORNERS[shape]] for nodes, shape in zip(full, shapes, strict=True)]
    _refuse_missing(path, len(mesh.points), [*full, *map(np.asarray, mesh.point_sets.values())])
    members = _members(path, mesh, [DIMENSION[shape] for shape in shapes])
    top = max((DIMENSION[shape] for shape in shapes), default=0)
    named: list[dict[str, Blocks]] = [{}, {}, {}, {}]
    for shape, block, groups in zip(shapes, cells, members, strict=True):
        if DIMENSION[shape] == top and any(groups):
            _refuse_ungrouped(path, len(block), groups)
        for name, rows in groups.items():
            named[DIMENSION[shape]].setdefault(name, []).append((shape, block[rows]))
    if not named[top] and top > 0:
        whole = [
            (shape, block)
            for shape, block in zip(shapes, cells, strict=True)
            if DIMENSION[shape] == top
        ]
        parts = piece_blocks(whole)
        named[top] = {f"body_{number}": part for number, part in enumerate(parts, start=1)}
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    return GroupedMesh(
        points=points,
        numbers=np.arange(len(points)),
        bodies=named[top],
        surfaces=named[top - 1] if top > 0 else {},
        node_sets=_node_sets(mesh, named[: max(top - 1, 0)]),
        midsides=midsides_of(points, zip(shapes, full, strict=True)),
        remarks=remarks,
    )


def _read(path: Path) -> tuple[Any, tuple[str, ...]]:
    """Return meshio's mesh of the file and its output, which becomes the error if it fails."""
    import meshio

    for kind in ("wedge15", "pyramid13"):  # meshio reads these but lacks their dimension.
        meshio._mesh.topological_dimension.setdefault(kind, 3)
    output = io.StringIO()
    try:
        with redirect_stdout(output), redirect_stderr(output), unmarked(path) as plain:
            mesh = meshio.read(plain)
    # Its readers raise any exception, and its dispatch exits.
    except (Exception, SystemExit) as error:
        reason = output.getvalue() if isinstance(error, SystemExit) else str(error)
        reason = " ".join(reason.split()) or type(error).__name__
        raise MeshError(f"{path}: meshio cannot read it: {reason}") from None
    printed = " ".join(output.getvalue().split())
    return mesh, (f"meshio: {printed}",) if printed else ()


def _shape(path: Path, kind: str) -> str:
    """Return the shape of meshio's element type; corners come first in all types."""
    match = re.fullmatch(r"([a-z]+)\d*", kind)
    if match is None or match[1] not in CORNERS:
        raise MeshError(f"{path}: has elements {kind}; allowed: {', '.join(CORNERS)}")
    return match[1]


def _members(path: Path, mesh: Any, dimensions: list[int]) -> list[CellGroups]:
    """Return the groups of every block of cells."""
    sets = {name: rows for name, rows in mesh.cell_sets.items() if not name.startswith("gmsh:")}
    if sets:
        return [
            {
                name: np.asarray(rows[block], dtype=np.int64)
                for name, rows in sets.items()
                if rows[block] is not None and len(rows[block])
            }
            for block in range(len(dimensions))
        ]
    field = _tag_field(path, mesh)
    if field is None:
        return [{} for _ in dimensions]
    members = []
    for tags, dimension in zip(mesh.cell_data[field], dimensions, strict=True):
        groups: CellGroups = {}
        values, first = np.unique(tags, return_index=True)
        for tag in values[np.argsort(first)]:
            if tag == 0 and field in ZERO_IS_NO_GROUP:
                continue
            for name in _names(mesh, int(tag), dimension):
                rows = np.flatnonzero(tags == tag)
                groups[name] = np.concatenate([groups.get(name, rows[:0]), rows])
        members.append(groups)
    return members


def _tag_field(path: Path, mesh: Any) -> str | None:
    """Return the name of the cell data that number the groups."""
    integers = [
        name
        for name, data in mesh.cell_data.items()
        if all(values.ndim == 1 and values.dtype.kind in "iu" for values in data)
    ]
    known = [name for name in TAG_FIELDS if name in integers]
    if len(integers) > 1 and not known:
        raise MeshError(
            f"{path}: has several fields of integers on its cells, {', '.join(integers)}; allowed: "
            "one, which numbers bodies and boundaries"
        )
    return (known or integers or [None])[0]


def _names(mesh: Any, tag: int, dimension: int) -> list[str]:
    """Return the names of a group: a MED family has several, other formats one or a number."""
    families = getattr(mesh, "cell_tags", {})
    if tag in families:
        return list(families[tag])
    names = [name for name, pair in mesh.field_data.items() if tuple(pair) == (tag, dimension)]
    return names or [str(tag)]


def _refuse_ungrouped(path: Path, count: int, groups: CellGroups) -> None:
    """Raise :class:`MeshError` if an element in a block of a body is in no group."""
    left = count - len(np.unique(np.concatenate(list(groups.values()))))
    if left:
        raise MeshError(f"{path}: {left} elements are in no group; put them into one")


def _refuse_missing(path: Path, count: int, nodes: list[Indices]) -> None:
    """Raise :class:`MeshError` if a node that is used is not among the file's ``count`` nodes."""
    if any(some.size and not 0 <= some.min() <= some.max() < count for some in nodes):
        raise MeshError(
            f"{path}: has elements or sets of nodes that are not in it; it may be damaged, export "
            "it again"
        )


def _node_sets(mesh: Any, lower: list[dict[str, Blocks]]) -> dict[str, Indices]:
    """Return the file's point sets and the nodes of groups below the boundaries."""
    sets: dict[str, list[Indices]] = {}
    for groups in lower:
        for name, blocks in groups.items():
            sets.setdefault(name, []).extend(cells.ravel() for _, cells in blocks)
    for name, rows in mesh.point_sets.items():
        sets.setdefault(name, []).append(np.asarray(rows, dtype=np.int64))
    tags = mesh.point_data.get("point_tags")
    for tag, names in getattr(mesh, "point_tags", {}).items():
        for name in names:
            sets.setdefault(name, []).append(np.flatnonzero(tags == tag))
    return {name: np.unique(np.concatenate(rows)) for name, rows in sets.items()}
