"""Meshes in Nastran bulk data (``.bdf``, ``.nas``, ``.dat``): grid points, solids, faces and sets.

Entries are as in the Nastran Quick Reference Guide. Entries that tie bodies together are refused
with their line; entries that describe more than a mesh are listed and not imported.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import SourceLine
from fe_models.readers.flattened import FlatFile
from fe_models.readers.grouped import CORNERS, GroupedMesh
from fe_models.readers.nastran.cards import BulkData, BulkEntry, bulk_data, summary_line
from fe_models.readers.nastran.elements import BEAM, BEAMS, PLANES, SHELL, SHELLS, SOLIDS, refuse
from fe_models.readers.nastran.groups import Groups
from fe_models.readers.nastran.scene import scene_of
from fe_models.readers.scope import Element, Scope, extend
from sa_solver.types import Array

# Entries that describe what a case has to describe: they are not imported with the mesh.
LEFT = re.compile(
    r"SPC1?|SPCD|FORCE\d?|MOMENT\d?|PLOAD\d?|GRAV|ACCEL1?|RFORCE|TEMPD?|TEMPP\d|MAT\d+|MATS1|"
    r"LOAD|LSEQ|BCTABLE1?|BCTSET|BCTPARM|BCONP|BFRIC|BCBODY|BCTADD|BSURFS?|DEFORM"
)
# Names of properties, by number, in the comments that pre-processors write.
NAMED = (
    re.compile(r'\$HMNAME\s+PROP\s+(\d+)\s*"([^"]+)"'),
    re.compile(r"\$\s*FEMAP.*\bProperty\s+(\d+)\s*:\s*(.+?)\s*$", re.IGNORECASE),
    re.compile(r"\$ANSA_NAME_COMMENT;(\d+);P(?:SOLID|SHELL)\w*;([^;]+);"),
)


def read_nastran(path: Path) -> GroupedMesh:
    """Read the mesh of a Nastran bulk data file.

    Each connected piece of solids is a body. It has the name or number of the property that is
    exactly its elements, or of several properties joined by plus signs, or else ``body_1``, ....
    Shells that lie on solids are boundaries named by their property, and have no stiffness.
    ``PLOAD4``, ``BSURFS`` and ``BSURF`` name boundaries ``pload4_1``, ``bsurfs_1``, ...; ``SPC1``,
    ``SPC`` and ``FORCE`` name node sets ``spc_1_xyz``, ``force_1``, ....

    Raises :class:`MeshError` with file and line.
    """
    read = _Read(path, bulk_data(path))
    if not read.scope.elements:
        raise MeshError(f"{path}: has no elements that are read: {', '.join(SOLIDS)}")
    flat = FlatFile(read.scope, joins=True)
    mesh = flat.mesh()
    scene, caveats = scene_of(read.entries, mesh, read.unused), (*read.caveats, *flat.notes)
    return replace(
        mesh,
        unused=(*map(summary_line, read.unused), *caveats),
        scene=replace(scene, ignored=(*scene.ignored, *caveats)),
    )


class _Read:
    """Scope of a file's mesh, and the entries that describe more than a mesh."""

    def __init__(self, path: Path, data: BulkData) -> None:
        self.scope = Scope("", SourceLine(path, 1))
        self.entries, self.unused = (
            data.entries,
            [e for e in data.entries if LEFT.fullmatch(e.name)],
        )
        # Notes on properties that bodies do not have: stiffness of shells, and plane stress.
        self.caveats: list[str] = []
        self._names = _property_names(data.comments)
        self._shells: dict[str, Element] = {}
        self._systems = {e.whole(0): e for e in data.entries if re.fullmatch("CORD2[RCS]", e.name)}
        solids = [entry for entry in data.entries if entry.name in SOLIDS]
        self._solid_properties = {entry.text(1) for entry in solids}
        self._shell_properties = {e.text(1) for e in data.entries if e.name in SHELLS | PLANES}
        # Check the first entry of each name.
        for entry in {entry.name: entry for entry in reversed(data.entries)}.values():
            refuse(entry)
        for entry in data.entries:
            if entry.name == "GRID":
                self._grid(entry)
            elif entry.name in SOLIDS:
                self._solid(entry)
            elif entry.name in SHELLS | PLANES:
                self._plane(entry)
            elif entry.name in BEAMS:
                self._beam(entry)
        groups = Groups(self.scope)
        for entry in data.entries:
            groups.read(entry)
        self._note_shells(plane=not solids)

    def _grid(self, entry: BulkEntry) -> None:
        number = entry.whole(0)
        if number in self.scope.nodes:
            raise entry.wrong(f"node {number} is defined twice")
        place = np.array([entry.real(k) for k in (2, 3, 4)])
        system = entry.whole(1) if entry.text(1) else 0
        x, y, z = self._placed(entry, system, place).tolist()
        self.scope.nodes[number] = (x, y, z)

    def _placed(self, entry: BulkEntry, system: int, place: Array) -> Array:
        """Return the coordinates in the basic system of a point given in a system."""
        if system == 0:
            return place
        if system not in self._systems:
            raise entry.wrong(f"no coordinate system {system}; allowed: CORD2R, CORD2C, CORD2S")
        card = self._systems[system]
        if card.text(1) not in ("", "0"):
            raise card.wrong("is defined in another system; define it in the basic system")
        origin, on_z, on_xz = (
            np.array([card.real(2 + 3 * point + k) for k in range(3)]) for point in range(3)
        )
        z = on_z - origin
        y = np.cross(z, on_xz - origin)
        if not np.linalg.norm(y) > 0.0:
            raise card.wrong("its three points are on a line; give points that span a plane")
        axes = np.array([np.cross(y, z), y, z])
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        return np.asarray(origin + _cartesian(card.name[-1], place) @ axes)

    def _solid(self, entry: BulkEntry) -> None:
        shape, counts = SOLIDS[entry.name]
        nodes = [text for text in entry.fields[2:] if text]
        if len(nodes) not in counts:
            raise entry.wrong(
                f"{len(nodes)} nodes; allowed: {counts[0]}, or {counts[1]} with all midsides"
            )
        self._add(
            entry, shape, [entry.whole(2 + k) for k in range(len(nodes))], "", self._set(entry)
        )

    def _plane(self, entry: BulkEntry) -> None:
        shape, count = (SHELLS | PLANES)[entry.name]
        # Angles and offsets follow the nodes and are not read.
        nodes = [
            entry.whole(2 + k) for k in range(count) if k < CORNERS[shape] or entry.text(2 + k)
        ]
        if len(nodes) not in (CORNERS[shape], count):
            raise entry.wrong(f"{len(nodes)} nodes; allowed: {count}, or {CORNERS[shape]}")
        name = self._set(entry)
        self._shells.setdefault(name, self._add(entry, shape, nodes, SHELL, name))

    def _beam(self, entry: BulkEntry) -> None:
        name = self._set(entry)
        ends = [entry.whole(2), entry.whole(3)]
        element = self._add(entry, "line", ends, BEAM, name, stands_alone=False)
        self._shells.setdefault(name, element)

    def _set(self, entry: BulkEntry) -> str:
        """Return the name of an element's property.

        It gets a suffix if elements of another dimension have the property, too.
        """
        number = entry.text(1) or entry.text(0)
        name = self._names.get(number, number)
        if entry.name in SOLIDS:
            return name
        among = self._solid_properties | (self._shell_properties if entry.name in BEAMS else set())
        return f"{name}_{'edges' if entry.name in BEAMS else 'faces'}" if number in among else name

    def _add(
        self,
        entry: BulkEntry,
        shape: str,
        nodes: list[int],
        advice: str,
        name: str,
        stands_alone: bool = True,
    ) -> Element:
        number, corners = entry.whole(0), CORNERS[shape]
        if number in self.scope.elements:
            raise entry.wrong(f"element {number} is defined twice")
        element = Element(
            shape=shape,
            nodes=tuple(nodes[:corners]),
            midsides=tuple(nodes[corners:]),
            place=entry.place,
            kind=entry.name,
            advice=advice,
            stands_alone=stands_alone,
        )
        self.scope.elements[number] = element
        extend(self.scope.element_sets.add(name, {}), {"": [number]})
        return element

    def _note_shells(self, plane: bool) -> None:
        """Note which faces are named by shells, and that plane bodies are in plane strain."""
        for name, element in self._shells.items():
            place = element.place.short
            if not plane:
                what = "edges" if element.kind in BEAMS else "faces"
                self.caveats.append(
                    f"{place}: stiffness of {element.kind}, which names {what} {name}"
                )
            elif not element.kind.startswith("CPLSTN"):
                self.caveats.append(
                    f"{place}: {element.kind}: bodies in the plane are in plane strain"
                )


def _cartesian(kind: str, place: Array) -> Array:
    """Return the Cartesian coordinates of a point in a system of a kind.

    The kind is R for rectangular, C for cylindrical and S for spherical coordinates, with angles in
    degrees.
    """
    if kind == "R":
        return place
    if kind == "C":
        radius, angle, height = place[0], np.radians(place[1]), place[2]
        return np.array([radius * np.cos(angle), radius * np.sin(angle), height])
    radius, polar, angle = place[0], np.radians(place[1]), np.radians(place[2])
    across = radius * np.sin(polar)
    return np.array([across * np.cos(angle), across * np.sin(angle), radius * np.cos(polar)])


def _property_names(comments: list[str]) -> dict[str, str]:
    """Return the names of properties by their numbers, if only one property has the name."""
    found = {
        match[1]: match[2].strip()
        for comment in comments
        for pattern in NAMED
        if (match := pattern.match(comment))
    }
    count = Counter(found.values())
    return {number: name for number, name in found.items() if count[name] == 1}
