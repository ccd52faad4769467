"""Materials, contacts, supports and loads of Nastran bulk data, all of them in one step.

Entries are as in the Nastran Quick Reference Guide. The selection of entries by subcases is not
read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.grouped import GroupedMesh
from fe_models.readers.nastran.cards import BulkEntry, summary_line
from fe_models.readers.nastran.elements import SOLIDS
from fe_models.readers.nastran.groups import axes_of, held_name
from fe_models.readers.scene import FileContact, FileLoad, FileSupport, NotTakenError, Scene

# Reason to ignore supports and forces along the axes of another coordinate system.
LOCAL = "along the axes of another coordinate system"


def scene_of(entries: Sequence[BulkEntry], mesh: GroupedMesh, left: Sequence[BulkEntry]) -> Scene:
    """Return the scene of the entries.

    ``left`` are the entries that describe more than the mesh. Each is either used or ignored with a
    reason.
    """
    return _Reader(entries, mesh).scene(left)


class _Reader:
    def __init__(self, entries: Sequence[BulkEntry], mesh: GroupedMesh) -> None:
        self.mesh = mesh
        self.of: dict[str, list[BulkEntry]] = {}
        for entry in entries:
            self.of.setdefault(entry.name, []).append(entry)
        # Grid points whose displacements are along the axes of another system.
        self.local = {e.whole(0) for e in self.of.get("GRID", []) if e.text(5) not in ("", "0")}
        self.contacts: list[FileContact] = []
        self.supports: list[FileSupport] = []
        self.loads: list[FileLoad] = []
        self.forces: dict[str, list[tuple[BulkEntry, np.ndarray]]] = {}
        self.pressures: dict[str, list[tuple[BulkEntry, float]]] = {}
        self.ignored: list[str] = []
        self._handlers: dict[str, Callable[[BulkEntry], None]] = {
            "SPC1": self._held,
            "SPC": self._held_singly,
            "FORCE": self._force,
            "PLOAD4": self._pressure,
            "GRAV": self._gravity,
            "RFORCE": self._rotation,
            "BCTSET": self._pairs,
            "MAT1": lambda _: None,
            "BSURF": lambda _: None,
            "BSURFS": lambda _: None,
        }

    def scene(self, left: Sequence[BulkEntry]) -> Scene:
        for entry in left:
            handler = self._handlers.get(entry.name)
            try:
                if handler is None:
                    raise NotTakenError("not part of a case")
                handler(entry)
            except (NotTakenError, MeshError) as error:
                self.ignored.append(f"{summary_line(entry)}: {error}")
        self.loads += [*self._total_forces(), *self._even_pressures()]
        sets = {load.group.rpartition("_")[2] for load in self.loads if load.group}
        if len(sets) > 1:
            self.ignored.append(f"load sets {', '.join(sorted(sets))}: all are taken, together")
        return Scene(
            materials=self._materials(),
            contacts=tuple(self.contacts),
            supports=tuple(self.supports),
            loads=tuple(self.loads),
            steps=1 if self.loads else 0,
            ignored=tuple(self.ignored),
        )

    # --- materials and contacts -----------------------------------------------------------------

    def _materials(self) -> dict[str, dict[str, float]]:
        """Return the constants of the bodies whose solids are all of one material."""
        constants = {}
        for entry in self.of.get("MAT1", []):
            try:
                constants[entry.text(0)] = _constants(entry)
            except MeshError as error:
                self.ignored.append(f"{summary_line(entry)}: {error}")
        found: dict[str, set[str]] = {}
        for section in self.of.get("PSOLID", []):
            for body in self._bodies_of(section.text(0)):
                found.setdefault(body, set()).add(section.text(1))
        materials = {}
        for body, named in found.items():
            known = constants.get(next(iter(named)), {})
            if len(named) == 1 and "young" in known:
                materials[body] = known
            else:
                self.ignored.append(f"materials of body {body}: allowed: one, of MAT1")
        return materials

    def _bodies_of(self, section: str) -> Iterator[str]:
        """Yield the names of the bodies that have solids of a property."""
        numbers = [
            entry.whole(2)
            for name in SOLIDS
            for entry in self.of.get(name, [])
            if (entry.text(1) or entry.text(0)) == section
        ]
        rows = np.flatnonzero(np.isin(self.mesh.numbers, numbers))
        for name, blocks in self.mesh.bodies.items():
            if any(np.isin(rows, cells).any() for _, cells in blocks):
                yield name

    def _pairs(self, entry: BulkEntry) -> None:
        for first in range(1, len(entry.fields), 8):
            if not entry.text(first):
                continue
            source, target = (self._surface(entry.text(first + k)) for k in (0, 1))
            friction = entry.real(first + 2) if entry.text(first + 2) else None
            self.contacts.append(FileContact((source, target), friction, entry.place.short))

    def _surface(self, number: str) -> str:
        for kind in ("bsurfs", "bsurf"):
            if f"{kind}_{number}" in self.mesh.surfaces:
                return f"{kind}_{number}"
        raise NotTakenError(f"no contact surface {number}: allowed: BSURFS, BSURF")

    # --- supports and loads ---------------------------------------------------------------------

    def _held(self, entry: BulkEntry) -> None:
        self._support(entry, entry.text(1))

    def _held_singly(self, entry: BulkEntry) -> None:
        for first in (1, 4):
            if entry.text(first):
                if entry.real(first + 2) != 0.0:
                    raise NotTakenError("an imposed displacement: name a face, and impose it there")
                self._support(entry, entry.text(first + 1))

    def _support(self, entry: BulkEntry, components: str) -> None:
        axes = axes_of(components)
        group = held_name(entry.text(0), components)
        if not axes or group not in self.mesh.node_sets:
            return  # These are rotations, which solids do not have.
        if self.local.intersection(self.mesh.numbers[self.mesh.node_sets[group]].tolist()):
            raise NotTakenError(LOCAL)
        if all(support.group != group for support in self.supports):
            self.supports.append(FileSupport(group, axes, entry.place.short))

    def _force(self, entry: BulkEntry) -> None:
        if entry.text(2) not in ("", "0"):
            raise NotTakenError(LOCAL)
        vector = entry.real(3) * np.array([entry.real(k) for k in (4, 5, 6)])
        self.forces.setdefault(f"force_{entry.text(0)}", []).append((entry, vector))

    def _total_forces(self) -> Iterator[FileLoad]:
        """Yield the sum of the forces of each set."""
        for group, forces in self.forces.items():
            vectors = np.array([vector for _, vector in forces])
            x, y, z = vectors.sum(axis=0).tolist()
            place = forces[0][0].place.short
            if np.ptp(vectors, axis=0).any():
                self.ignored.append(f"{place}: forces of {group} that differ: their sum is taken")
            yield FileLoad("force", group, (x, y, z), (1.0,), place)

    def _pressure(self, entry: BulkEntry) -> None:
        size = entry.real(2)
        other = [entry.real(k) for k in (3, 4, 5) if entry.text(k)]
        if any(value != size for value in other):
            raise NotTakenError("a pressure that is not the same at all corners")
        if any(entry.text(k) for k in (8, 9, 10, 11)):
            raise NotTakenError("a traction along a vector: give it as a force")
        self.pressures.setdefault(f"pload4_{entry.text(0)}", []).append((entry, size))

    def _even_pressures(self) -> Iterator[FileLoad]:
        """Yield the pressure of each set if it is the same everywhere."""
        for group, pressures in self.pressures.items():
            entry, size = pressures[0]
            if any(value != size for _, value in pressures):
                self.ignored.append(f"{summary_line(entry)}: the pressures of its set differ")
                continue
            yield FileLoad("pressure", group, size, (1.0,), entry.place.short)

    def _gravity(self, entry: BulkEntry) -> None:
        if entry.text(1) not in ("", "0"):
            raise NotTakenError(LOCAL)
        # Inertia forces on bodies are opposite to the acceleration of their frame.
        x, y, z = (-entry.real(2) * entry.real(k) for k in (3, 4, 5))
        self.loads.append(FileLoad("acceleration", "", (x, y, z), (1.0,), entry.place.short))

    def _rotation(self, entry: BulkEntry) -> None:
        if entry.text(2) not in ("", "0"):
            raise NotTakenError(LOCAL)
        point = self.mesh.points[self.mesh.numbers == (entry.whole(1) if entry.text(1) else 0)]
        through = point[0].tolist() if len(point) else [0.0, 0.0, 0.0]
        # The speed is given in revolutions per unit of time.
        axis = [2.0 * math.pi * entry.real(3) * entry.real(k) for k in (4, 5, 6)]
        x, y, z = axis
        a, b, c = through
        self.loads.append(FileLoad("rotation", "", (x, y, z), (1.0,), entry.place.short, (a, b, c)))


def _constants(entry: BulkEntry) -> dict[str, float]:
    """Return the constants of MAT1, which gives two of both moduli and Poisson's ratio."""
    young, shear, poisson = (entry.real(k) if entry.text(k) else None for k in (1, 2, 3))
    if poisson is None and young and shear:
        poisson = young / (2.0 * shear) - 1.0
    if young is None and shear and poisson is not None:
        young = 2.0 * shear * (1.0 + poisson)
    if young is None or poisson is None:
        return {}
    known = {"young": young, "poisson": poisson}
    for name, index in (("density", 4), ("expansion", 5)):
        if entry.real(index):
            known[name] = entry.real(index)
    return known
