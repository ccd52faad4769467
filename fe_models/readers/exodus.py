"""Meshes in Exodus II files (``.e``, ``.exo``, ``.g``), as Cubit, Sierra, MOOSE and others write.

An Exodus file is a NetCDF file, either of HDF5 (netCDF-4) or of the classic format (netCDF-3): h5py
reads the former, scipy the latter. Variables and the numbers of sides are as in Schoof and
Yarberry, EXODUS II: A Finite Element Data Model, SAND92-2137, with the later ``coordx`` and names.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import SourceLine
from fe_models.readers.flattened import FlatFile
from fe_models.readers.grouped import CORNERS, DIMENSION, FACES, GroupedMesh
from fe_models.readers.scene import Scene
from fe_models.readers.scope import Element, Scope, extend
from sa_solver.types import Indices

CLASSIC, WIDE = b"CDF", b"CDF\x05"
# Shape of element types by their first letters, and first letters of types that are points.
SHAPES = {
    "SHELL3": "triangle", "TET": "tetra", "PYR": "pyramid", "WED": "wedge", "HEX": "hexahedron",
    "TRI": "triangle", "QUA": "quad", "SHE": "quad", "BAR": "line", "BEA": "line", "TRU": "line",
    "EDG": "line",
}  # fmt: skip
POINTS = ("SPH", "CIR", "NOD")
# Corners of the sides 1, 2, ... of a shape, counted from zero; shells in space have two faces.
SIDES: dict[str, tuple[tuple[int, ...], ...]] = {
    "tetra": ((0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1)),
    "pyramid": ((0, 1, 4), (1, 2, 4), (2, 3, 4), (0, 4, 3), (0, 3, 2, 1)),
    "wedge": ((0, 1, 4, 3), (1, 2, 5, 4), (0, 3, 5, 2), (0, 2, 1), (3, 4, 5)),
    "hexahedron": (
        (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7),
    ),
    "triangle": FACES["triangle"],
    "quad": FACES["quad"],
}  # fmt: skip
SHELL_SIDES = {"triangle": ((0, 1, 2),) * 2, "quad": ((0, 1, 2, 3),) * 2}
SHELL = "a shell: mesh its volume with solid elements, or lay it on faces of solids to name these"
BEAM = "a beam: mesh its volume with solid elements, or leave it out"


def read_exodus(path: Path) -> GroupedMesh:
    """Read the mesh of an Exodus file.

    Each connected piece of solids is a body with the name of its element block, or with those of
    its blocks joined by plus signs; side sets are boundaries. Names are those of the file, or else
    ``block_1``, ``side_set_1`` and ``node_set_1`` with their numbers. Blocks of shells and beams on
    solids name faces and edges, and have no stiffness. Raises :class:`MeshError`.
    """
    with path.open("rb") as file:
        head = file.read(len(WIDE))
    if head == WIDE:
        raise MeshError(
            f"{path}: NetCDF of 64-bit data (CDF-5) is not read; allowed: netCDF-4, classic"
        )
    if head.startswith(CLASSIC):
        # The import takes a tenth of a second, so it is done only where it is needed.
        from scipy.io import netcdf_file

        with netcdf_file(path, mmap=False) as classic:
            types = {n: getattr(v, "elem_type", b"") for n, v in classic.variables.items()}
            return _Read(path, {n: v.data for n, v in classic.variables.items()}, types).mesh()
    if not h5py.is_hdf5(path):
        raise MeshError(f"{path}: is not an Exodus file; allowed: NetCDF, of HDF5 or classic")
    with h5py.File(path, "r") as wide:
        types = {n: v.attrs.get("elem_type", b"") for n, v in wide.items()}
        return _Read(path, {n: v[()] for n, v in wide.items()}, types).mesh()


class _Read:
    """Mesh defined by the variables of a file, which count nodes and elements from one."""

    def __init__(self, path: Path, variables: Mapping[str, Any], types: dict[str, Any]) -> None:
        self.scope = Scope("", SourceLine(path, 0))
        self._path, self._variables = path, variables
        self._types = {name: _text(kind) for name, kind in types.items()}
        self._numbers = self._nodes()
        # Shape and message of each block that may name faces or edges and has no stiffness then.
        self._caveats: list[tuple[str, str]] = []
        self._blocks()
        self._sets()

    def mesh(self) -> GroupedMesh:
        flat = FlatFile(self.scope, joins=True)
        mesh = flat.mesh()
        lower = (text for shape, text in self._caveats if DIMENSION[shape] < flat.top)
        notes = (*flat.notes, *lower)
        return replace(mesh, unused=notes, scene=Scene(ignored=notes))

    def _wrong(self, what: str) -> MeshError:
        return MeshError(f"{self._path}: {what}")

    def _array(self, name: str) -> Any:
        if name not in self._variables:
            raise self._wrong(f"has no {name}: it is damaged or not an Exodus file")
        return np.asarray(self._variables[name])

    def _nodes(self) -> Indices:
        """Read the nodes and return the file's own number of each."""
        if "coord" in self._variables:
            rows = self._array("coord")
        else:
            axes = [f"coord{axis}" for axis in "xyz" if f"coord{axis}" in self._variables]
            rows = np.array([self._array(axis) for axis in axes])
        if rows.ndim != 2 or len(rows) not in (2, 3):
            raise self._wrong("has no coordinates in space or in a plane: it may be damaged")
        points = np.zeros((rows.shape[1], 3))
        points[:, : len(rows)] = rows.T
        numbers = np.arange(1, len(points) + 1)
        if "node_num_map" in self._variables:
            numbers = self._array("node_num_map").astype(np.int64)
        if numbers.shape != points.shape[:1] or len(np.unique(numbers)) < len(numbers):
            raise self._wrong("the nodes do not have one number each: it may be damaged")
        for number, (x, y, z) in zip(numbers.tolist(), points.tolist(), strict=True):
            self.scope.nodes[number] = (x, y, z)
        return numbers

    def _own(self, counted: Any, what: str) -> list[Any]:
        """Return the file's own numbers of nodes that are counted from one."""
        if counted.size and not 1 <= counted.min() <= counted.max() <= len(self._numbers):
            raise self._wrong(f"{what} has nodes that are not in the file: it may be damaged")
        return self._numbers[counted.astype(np.int64) - 1].tolist()

    def _blocks(self) -> None:
        for key, name in self._named("connect", "eb", "block"):
            cells, kind = self._array(key), self._types[key]
            shape = self._shape(name, kind)
            corners = CORNERS[shape]
            if cells.ndim != 2 or cells.shape[1] < corners:
                raise self._wrong(
                    f"block {name} does not have the nodes of a {shape}: it may be damaged"
                )
            first = len(self.scope.elements) + 1
            for number, nodes in enumerate(self._own(cells, f"block {name}"), start=first):
                self.scope.elements[number] = Element(
                    shape=shape,
                    nodes=tuple(nodes[:corners]),
                    midsides=tuple(nodes[corners:]),
                    place=self.scope.place,
                    kind=f"{kind} of block {name}",
                    stands_alone=shape != "line",
                    advice=BEAM if shape == "line" else SHELL * (shape in SHELL_SIDES),
                )
            numbers: list[int | range] = list(range(first, first + len(cells)))
            extend(self.scope.element_sets.add(name, {}), {"": numbers})
            note = f"{self._path.name}: stiffness of {kind}, which names faces or edges {name}"
            self._caveats.append((shape, note))
        if not self.scope.elements:
            raise self._wrong("has no elements")

    def _shape(self, block: str, kind: str) -> str:
        if kind.upper().startswith(POINTS):
            raise self._wrong(
                f"block {block} has points, {kind}: leave it out and put its force on the body as "
                "a load"
            )
        for start, shape in SHAPES.items():
            if kind.upper().startswith(start):
                return shape
        raise self._wrong(
            f"block {block} has elements {kind or 'of no type'}; allowed: TETRA, PYRAMID, WEDGE, "
            "HEX, and in the plane TRI, QUAD"
        )

    def _sets(self) -> None:
        for key, name in self._named("node_ns", "ns", "node_set"):
            nodes: list[int | range] = self._own(self._array(key), f"node set {name}")
            extend(self.scope.node_sets.add(name, {}), {"": nodes})
        space = "coordz" in self._variables or len(self._variables.get("coord", ())) == 3
        sides_of = SIDES | SHELL_SIDES if space else SIDES
        elements = len(self.scope.elements)
        for key, name in self._named("elem_ss", "ss", "side_set"):
            sides = self._array(key.replace("elem", "side")).tolist()
            taken = name in self.scope.element_sets
            into = self.scope.element_sets.add(f"{name}_faces" if taken else name, {})
            for number, side in zip(self._array(key).tolist(), sides, strict=True):
                if not 1 <= number <= elements:
                    raise self._wrong(f"side set {name} has elements that are not in the file")
                element = self.scope.elements[number]
                faces = sides_of.get(element.shape, ())
                if not 1 <= side <= len(faces):
                    raise self._wrong(
                        f"side set {name} has side {side} of a {element.shape}; allowed: 1 to "
                        f"{len(faces)}"
                    )
                nodes_of_face = tuple(element.nodes[corner] for corner in faces[side - 1])
                self.scope.add_facet(into, nodes_of_face, self.scope.place, f"side set {name}")

    def _named(self, variable: str, names: str, kind: str) -> Iterator[tuple[str, str]]:
        """Yield the variables of all blocks or sets of a kind that are not empty, and names."""
        given = [_text(row) for row in self._variables.get(f"{names}_names", ())]
        numbers = np.ravel(self._variables.get(f"{names}_prop1", ())).tolist()
        found = (re.fullmatch(rf"{variable}(\d+)", name) for name in self._variables)
        for place in sorted(int(match[1]) for match in found if match):
            given_name = given[place - 1] if place <= len(given) else ""
            number = numbers[place - 1] if place <= len(numbers) else place
            if np.size(self._variables[f"{variable}{place}"]):
                yield f"{variable}{place}", given_name or f"{kind}_{number}"


def _text(letters: Any) -> str:
    """Return text from characters or bytes, up to the first zero."""
    raw = letters if isinstance(letters, bytes) else np.asarray(letters).astype("S").tobytes()
    return raw.split(b"\0")[0].decode("utf-8", "replace").strip()
