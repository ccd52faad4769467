"""Meshes in I-DEAS universal files (``.unv``), as Salome, gmsh, NX and others write them.

Dataset numbers are: 2411 (781) nodes, 2412 elements, 2435, 2452, 2467 and 2477 groups (Structural
Dynamics Research Laboratory, University of Cincinnati, Universal File Formats).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import SourceLine, integer, real
from fe_models.readers.flattened import FlatFile
from fe_models.readers.grouped import CORNERS, DIMENSION, GroupedMesh
from fe_models.readers.length_unit import SIZES, LengthUnit
from fe_models.readers.scene import Scene
from fe_models.readers.scope import Element, Scope, extend
from fe_models.readers.text_files import open_text

DELIMITER = "-1"
NODES, ELEMENTS, GROUPS = ("781", "2411"), ("2412",), ("2435", "2452", "2467", "2477")
HEADER, UNITS, SYSTEMS = "151", "164", "2420"
OLD = {"15": NODES[1], "780": ELEMENTS[0]}
# Content of datasets that a case would have to describe.
DESCRIBED_IN_CASES = {
    "757": "boundary conditions",
    "790": "loads",
    "791": "supports",
    "1710": "materials",
}
# Unit of length by the code of the system of units; for other codes the factor determines it.
LENGTHS = {
    "1": "m", "2": "ft", "3": "m", "4": "ft", "5": "mm", "6": "cm", "7": "in", "8": "mm",
    "10": "mm",
}  # fmt: skip
# Relative difference up to which a rounded factor is that of a unit.
ROUNDED = 1e-3
# Shape of finite elements by their type number, and positions of the corners among their nodes. In
# those of second order the nodes go around the faces, with midside nodes between corners.
TET, WEDGE, HEX = (0, 2, 4, 9), (0, 2, 4, 9, 11, 13), (0, 2, 4, 6, 12, 14, 16, 18)
SHAPES: dict[int, tuple[str, tuple[int, ...]]] = {
    11: ("line", (0, 1)), 21: ("line", (0, 1)), 22: ("line", (0, 1)), 24: ("line", (0, 2)),
    **dict.fromkeys((41, 51, 61, 91), ("triangle", (0, 1, 2))),
    **dict.fromkeys((42, 52, 62, 92), ("triangle", (0, 2, 4))),
    **dict.fromkeys((44, 54, 64, 94), ("quad", (0, 1, 2, 3))),
    **dict.fromkeys((45, 55, 65, 95), ("quad", (0, 2, 4, 6))),
    111: ("tetra", (0, 1, 2, 3)), 118: ("tetra", TET),
    112: ("wedge", (0, 1, 2, 3, 4, 5)), 113: ("wedge", WEDGE),
    115: ("hexahedron", (0, 1, 2, 3, 4, 5, 6, 7)), 116: ("hexahedron", HEX),
}  # fmt: skip
BEAMS = (11, 21, 22, 23, 24)
PLANE_STRAIN = (51, 52, 54, 55)
KINDS = (
    (BEAMS, "a beam: mesh its volume with solid elements, or leave it out"),
    (range(41, 46), "of plane stress"),
    (range(61, 77), "a membrane: mesh its volume with solid elements"),
    (range(81, 86), "axisymmetric, which is not computed: take a sector in space"),
    (range(91, 96), "a shell: mesh its volume with solid elements"),
    ((121, 122), "rigid, and a tie that is not carried over: make one body of what is bonded"),
    (range(136, 153), "a spring, a damper or a gap: leave it out and put its force on the body"),
    (range(161, 172), "a point mass: leave it out and put its force on the body as a load"),
)
# Kinds of members of a group.
NODE, ELEMENT = "7", "8"


@dataclass(frozen=True)
class UnvDataset:
    """Dataset of a universal file: its number, the place where it begins, and its lines."""

    number: str
    place: SourceLine
    lines: list[tuple[SourceLine, str]]


def read_unv(path: Path) -> GroupedMesh:
    """Read the mesh of a universal file.

    Each connected piece of solids, or of plane elements, is a body with the name of the group that
    is exactly its elements, or else ``body_1``, .... Groups of facets on solids are boundaries,
    those of edges and of nodes are node sets. Raises :class:`MeshError` with file and line.
    """
    scope, left = Scope("", SourceLine(path, 1)), []
    groups, unit = [], LengthUnit()
    for dataset in _datasets(path):
        if dataset.number in NODES:
            _nodes(scope, dataset)
        elif dataset.number in ELEMENTS:
            _elements(scope, dataset)
        elif dataset.number in GROUPS:
            groups.append(dataset)
        elif dataset.number == SYSTEMS:
            _refuse_other_systems(dataset)
        elif dataset.number == UNITS:
            unit = _unit(dataset)
        elif line := _unread(dataset):
            left.append(line)
    if not scope.elements:
        raise MeshError(f"{path}: has no elements; allowed: dataset {ELEMENTS[0]}")
    for dataset in groups:
        _groups(scope, dataset)
    notes = (*left, *_plane_kinds(scope))
    return replace(FlatFile(scope).mesh(), unused=notes, scene=Scene(ignored=notes), unit=unit)


def _datasets(path: Path) -> Iterator[UnvDataset]:
    """Yield the datasets, which stand between lines of -1."""
    inside: list[tuple[SourceLine, str]] | None = None
    with open_text(path) as file:
        for number, line in enumerate(file, start=1):
            place, text = SourceLine(path, number), line.rstrip()
            if text.strip() == DELIMITER:
                if inside:
                    yield UnvDataset(inside[0][1].strip(), inside[0][0], inside[1:])
                inside = [] if inside is None else None
            elif inside is not None:
                inside.append((place, text))
            elif text:
                raise MeshError(
                    f"{place}: is not a universal file; allowed: datasets between lines of -1"
                )
    if inside:
        raise MeshError(
            f"{inside[0][0]}: dataset {inside[0][1].strip()} has no end: it may be damaged"
        )


def _nodes(scope: Scope, dataset: UnvDataset) -> None:
    for (place, head), (below, coordinates) in _in_groups(dataset, 2):
        number = integer(place, _fields(place, head)[0])
        if number in scope.nodes:
            raise MeshError(f"{place}: node {number} is defined twice")
        values = [real(below, text) for text in coordinates.split()]
        if len(values) != 3:
            raise MeshError(f"{below}: {len(values)} coordinates; allowed: 3")
        scope.nodes[number] = (values[0], values[1], values[2])


def _fields(place: SourceLine, text: str) -> list[str]:
    """Return the fields of a line. Raises :class:`MeshError` if the line is blank."""
    fields = text.split()
    if not fields:
        raise MeshError(f"{place}: a blank line in a dataset: it may be damaged")
    return fields


def _in_groups(
    dataset: UnvDataset, count: int
) -> Iterator[tuple[tuple[SourceLine, str], tuple[SourceLine, str]]]:
    if len(dataset.lines) % count:
        raise MeshError(f"{dataset.lines[-1][0]}: the dataset ends early: it may be damaged")
    return zip(dataset.lines[0::count], dataset.lines[1::count], strict=True)


def _elements(scope: Scope, dataset: UnvDataset) -> None:
    rows = iter(dataset.lines)
    for place, text in rows:
        head = [integer(place, field) for field in text.split()]
        if len(head) != 6:
            raise MeshError(f"{place}: {len(head)} numbers; allowed: the 6 of an element")
        number, kind, count = head[0], head[1], head[5]
        if kind in BEAMS:
            next(rows, None)  # Skip the line with its orientation and sections.
        nodes: list[int] = []
        while len(nodes) < count:
            below, line = next(rows, (place, ""))
            if not line:
                raise MeshError(
                    f"{place}: element {number} has fewer than its {count} nodes: it may be damaged"
                )
            nodes += [integer(below, field) for field in line.split()]
        if number in scope.elements:
            raise MeshError(f"{place}: element {number} is defined twice")
        scope.elements[number] = _element(place, kind, nodes)


def _element(place: SourceLine, kind: int, nodes: list[int]) -> Element:
    advice = _advice(kind)
    if kind not in SHAPES:
        why = f"is {advice}" if advice else f"is not read; allowed: {', '.join(map(str, SHAPES))}"
        raise MeshError(f"{place}: element type {kind} {why}")
    shape, corners = SHAPES[kind]
    if len(nodes) <= max(corners):
        raise MeshError(
            f"{place}: {len(nodes)} nodes are too few for a {shape} of type {kind}; allowed: "
            f"more than {max(corners)}"
        )
    midsides = [node for k, node in enumerate(nodes) if k not in corners]
    return Element(
        shape=shape,
        nodes=tuple(nodes[k] for k in corners),
        midsides=tuple(midsides),
        place=place,
        kind=f"element type {kind}",
        stands_alone=kind not in BEAMS,
        advice=advice,
    )


def _advice(kind: int) -> str:
    return next((advice for kinds, advice in KINDS if kind in kinds), "")


def _groups(scope: Scope, dataset: UnvDataset) -> None:
    """Read groups with their members, two to a line; a name may occur only once.

    Salome writes a blank line for the members of an empty group.
    """
    rows = iter(dataset.lines)
    for place, text in rows:
        if not (fields := text.split()):
            continue
        count = integer(place, fields[-1])
        _, name = next(rows, (place, ""))
        name = name.strip() or f"group_{fields[0]}"
        members: list[str] = []
        while len(members) < 4 * count:
            below, line = next(rows, (place, ""))
            if not line:
                raise MeshError(
                    f"{place}: group {name} has fewer than its {count} members: it may be damaged"
                )
            members += line.split()
        for sets, kind, known in (
            (scope.node_sets, NODE, scope.nodes),
            (scope.element_sets, ELEMENT, scope.elements),
        ):
            numbers: list[int | range] = [
                integer(below, members[k + 1]) for k in range(0, 4 * count, 4) if members[k] == kind
            ]
            missing = [number for number in numbers if number not in known]
            if missing:
                raise MeshError(f"{place}: group {name} names {missing[0]}, which is not defined")
            if numbers:
                extend(sets.add(name, {}), {"": numbers})


def _refuse_other_systems(dataset: UnvDataset) -> None:
    """Raise :class:`MeshError` unless all coordinate systems are the global one.

    That is one of type 0 with a unit matrix.
    """
    rows = dataset.lines[2:]
    for first in range(0, len(rows) - 5, 6):
        place, text = rows[first]
        matrix = np.array(
            [
                [real(at, field) for field in line.split()]
                for at, line in rows[first + 2 : first + 6]
            ]
        )
        if text.split()[1:2] != ["0"] or not np.array_equal(matrix, np.eye(4, 3)):
            raise MeshError(
                f"{place}: a coordinate system that is not the global one; allowed: nodes in "
                "global coordinates"
            )


def _unit(dataset: UnvDataset) -> LengthUnit:
    """Return the unit of length, from the factor on the dataset's second line.

    A length divided by the factor is in metres. Without a factor, the code of the system of units
    determines the unit.
    """
    # The code has ten columns, and its name follows immediately.
    match = re.match(r"\s*(\d+)", dataset.lines[0][1]) if dataset.lines else None
    code, factor = match[1] if match else "", 0.0
    if len(dataset.lines) > 1 and (factors := dataset.lines[1][1].split()):
        factor = real(dataset.lines[1][0], factors[0])
    source = f"as {dataset.place.short} says"
    if not factor > 0.0:
        name = LENGTHS.get(code, "mm")
        return LengthUnit(name, SIZES[name], source if code in LENGTHS else "")
    size = SIZES["m"] / factor
    near = [name for name, known in SIZES.items() if abs(size / known - 1.0) < ROUNDED]
    return LengthUnit(*((near[0], SIZES[near[0]]) if near else (f"{size:g} mm", size)), source)


def _unread(dataset: UnvDataset) -> str:
    """Describe in one line a dataset that is not read; empty if there is nothing to describe.

    Raises :class:`MeshError` for a dataset of an old form that contains the mesh.
    """
    place = dataset.place.short
    if dataset.number in OLD:
        raise MeshError(
            f"{dataset.place}: dataset {dataset.number} is of an old form; export it as "
            f"{OLD[dataset.number]}"
        )
    if dataset.number == HEADER:
        return ""
    return (
        f"{place}: dataset {dataset.number}, {DESCRIBED_IN_CASES.get(dataset.number, 'not read')}"
    )


def _plane_kinds(scope: Scope) -> Iterator[str]:
    """Yield a line if the bodies are plane elements of another kind than plane strain."""
    if any(DIMENSION[element.shape] == 3 for element in scope.elements.values()):
        return
    strain = {f"element type {kind}" for kind in PLANE_STRAIN}
    for element in scope.elements.values():
        if len(element.nodes) == CORNERS[element.shape] > 2 and element.kind not in strain:
            yield f"{element.place.short}: {element.kind}: bodies in the plane are in plane strain"
            return
