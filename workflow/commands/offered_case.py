"""Draft of a case of ``kind: mesh`` from the contents of a file, with gaps to be filled in."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.geometry.imported import GIVEN, ImportedMesh, Patch, patch
from fe_models.meshes.structure_mesh import Body
from fe_models.readers.scene import FileContact, FileLoad, FileSupport, Vector
from sa_solver.types import Array

TO_FILL = "fill in"
# Default number of increments of a leg.
INCREMENTS = 4
# Largest cosine between normals of opposite faces, and largest distance as a share of their size.
OPPOSITE, NEAR = -0.95, 0.02
# Larger Young's moduli are in another unit than MPa.
STIFFEST = 2e6
AXES = "xyz"


@dataclass(frozen=True)
class Offer:
    """Text of a case, and lines on contents of the file that are not in it."""

    text: str
    ignored: list[str]


def offered_case(imported: ImportedMesh, file: str, size: str | None) -> Offer:
    """Return a case from a mesh file, whose name relative to the case is ``file``."""
    return _Offered(imported, file, size).offer()


class _Offered:
    def __init__(self, imported: ImportedMesh, file: str, size: str | None) -> None:
        self.imported, self.file, self.size = imported, file, size
        self.scene = imported.scene
        # A unit that the file states itself is not repeated in the case.
        self.given = imported.unit.source == GIVEN
        self.ignored = list(self.scene.ignored)
        self.plane = len(imported.axes) == 2
        self.loads = [load for load in map(self._placed, self.scene.loads) if load is not None]
        self.supports = list(self._supports())
        held = {self._owner(support.group) for support in self.supports}
        # Supported bodies come first, so that body 1 is supported.
        self.order = sorted(imported.bodies, key=lambda name: name not in held)
        printed = [pair for pair in self.scene.contacts if self._is_known(pair)]
        self.contacts = [self._ordered(pair) for pair in printed or self._facing()]
        meeting = {self._owner(face) for pair in self.contacts for face in pair.faces}
        self.bodies = [name for name in self.order if name in meeting] or self.order
        for name in self.order:
            if name not in self.bodies:
                self.ignored.append(f"body {name}: in no contact")

    def offer(self) -> Offer:
        lines = [
            f"# What {Path(self.file).name} contains, by `fretscale describe`: check every entry,",
            f"# and replace {TO_FILL!r}. `fretscale check` lists what is wrong or missing.",
            f"# Lengths of the file are {self.imported.unit}, {self._forces}",
            f"title: {_text('Bodies of ' + Path(self.file).name)}",
            "analysis: wear",
            "structure:",
            "  kind: mesh",
            f"  file: {_text(self.file)}",
            *([f"  length_unit: {self.imported.unit.name}"] if self.given else []),
            *self._bodies(),
            "  contacts:",
            *self._contacts(),
            "  supports:",
            *self._held(),
            "  loads:",
            *self._loaded(),
            "materials:",
            *(line for number in (1, 2) for line in self._material(f"body_{number}", number - 1)),
            *self._friction(),
            *self._legs(),
            *(["mesh:", f"  size: {_text(self.size)}"] if self.size else []),
            "contact: {grid: [64, 64]}",
            "wear:",
            "  law: energy  # or archard, energy_amplitude",
            f"  body_1: {{coefficient: {TO_FILL}}}  # such as 1e4 um^3/J",
            f"  body_2: {{coefficient: {TO_FILL}}}",
            f"  cycles: {TO_FILL}  # of the whole run, such as 1e5",
            "  step: {kind: implicit}",
            "stress: {section: none, life: {parameter: none}}",
        ]
        return Offer("\n".join([*lines, ""]), self.ignored)

    # --- names and places -----------------------------------------------------------------------

    def _owners(self, group: str) -> list[str]:
        return [
            name
            for name, body in self.imported.bodies.items()
            if group in (body.mesh.boundaries or {}) or group in self.imported.points[name]
        ]

    def _owner(self, group: str) -> str:
        return next(iter(self._owners(group)), "")

    def _patch(self, group: str) -> Patch | None:
        """Return size and place of a group; None if it is not a face."""
        name = self._owner(group)
        body = self.imported.bodies[name]
        if group in (body.mesh.boundaries or {}):
            return patch(body, group)
        if group in self.imported.set_faces[name]:
            facets = self.imported.set_faces[name][group]
            return patch(Body(name, body.mesh.with_boundaries({group: facets})), group)
        return None

    def _is_known(self, pair: FileContact) -> bool:
        """Return whether the faces are on two bodies; if not, note why the contact is ignored."""
        for face in pair.faces:
            if len(self._owners(face)) != 1 or self._patch(face) is None:
                self.ignored.append(f"{pair.line}: contact face {face} is no face of one body")
                return False
        one, two = (self._owner(face) for face in pair.faces)
        if one == two:
            self.ignored.append(f"{pair.line}: body {one} touches itself")
        return one != two

    def _axes(self, axes: str) -> str:
        """Return axes of the file by their names in a case, which are x and z in the plane."""
        if not self.plane:
            return "".join(sorted(set(axes)))
        names = {AXES[axis]: name for axis, name in zip(self.imported.axes, "xz", strict=True)}
        return "".join(sorted({names[axis] for axis in axes if axis in names}))

    def _vector(self, vector: Vector) -> Array:
        """Return a vector of the file along the axes of a case."""
        if not self.plane:
            return np.array(vector)
        one, two = self.imported.axes
        return np.array([vector[one], 0.0, vector[two]])

    # --- supports and loads ---------------------------------------------------------------------

    def _supports(self) -> Iterator[FileSupport]:
        """Yield the supports, one per group, without the axes along which the group is moved."""
        moved = {
            (load.group, AXES[int(np.argmax(np.abs(load.value)))])
            for load in self.loads
            if load.kind == "displacement"
        }
        together: dict[str, FileSupport] = {}
        for support in self.scene.supports:
            if not self._owners(support.group):
                self.ignored.append(f"{support.line}: {support.group} is on no body")
                continue
            before = together.setdefault(support.group, replace(support, axes=""))
            axes = {*before.axes, *self._axes(support.axes)}
            axes -= {axis for group, axis in moved if group == support.group}
            together[support.group] = replace(before, axes="".join(sorted(axes)))
        return (support for support in together.values() if support.axes)

    def _placed(self, load: FileLoad) -> FileLoad | None:
        """Return a load in the form of a case, a traction as a force; None if it has none."""
        if load.group and len(self._owners(load.group)) != 1:
            self.ignored.append(f"{load.line}: {load.group} is not on one body")
            return None
        if isinstance(load.value, float):
            return load
        x, y, z = self._vector(load.value).tolist()
        if load.kind == "rotation" and self.plane:
            self.ignored.append(f"{load.line}: a rotation of a plane mesh: see rotation loads")
            return None
        if not any((x, y, z)):
            self.ignored.append(f"{load.line}: across the plane of the mesh")
            return None
        if load.kind == "traction":
            face = self._patch(load.group)
            if face is None:
                self.ignored.append(f"{load.line}: {load.group} is no face")
                return None
            x, y, z = face.area * x, face.area * y, face.area * z
            return replace(load, kind="force", value=(x, y, z))
        group = self._patch(load.group) if load.kind == "displacement" else None
        if load.kind == "displacement" and group is None:
            self.ignored.append(f"{load.line}: a displacement is for faces; {load.group} is none")
            return None
        return replace(load, value=(x, y, z))

    # --- contacts -------------------------------------------------------------------------------

    def _ordered(self, pair: FileContact) -> FileContact:
        """Return the contact with its faces in the order of their bodies."""
        one, two = sorted(pair.faces, key=lambda face: self.order.index(self._owner(face)))
        return replace(pair, faces=(one, two))

    def _facing(self) -> Iterator[FileContact]:
        """Yield pairs of boundaries of two bodies that touch, for a file that names no contacts."""
        places = {
            (name, boundary): patch(body, boundary)
            for name, body in self.imported.bodies.items()
            for boundary in body.mesh.boundaries or {}
        }
        for (one, face_1), (two, face_2) in combinations(places, 2):
            a, b = places[one, face_1], places[two, face_2]
            size = min(a.area, b.area) if self.plane else np.sqrt(min(a.area, b.area))
            apart = b.centroid - a.centroid
            reach = max(a.area, b.area) if self.plane else np.sqrt(max(a.area, b.area))
            if (
                one != two
                and a.normal @ b.normal < OPPOSITE
                and abs(apart @ a.normal) < NEAR * size
                and np.linalg.norm(apart) < reach
            ):
                yield FileContact((face_1, face_2), None, "by their places")

    def _sliding(self, normal: Array) -> list[float]:
        """Return the sliding direction of body 2: along a load or motion, else along an axis."""
        pushed = [
            np.array(load.value) / np.linalg.norm(load.value)
            for load in self.loads
            if load.kind in ("force", "displacement")
        ]
        for direction in [*pushed, *np.eye(3)[[0, 2] if self.plane else slice(None)]]:
            along = direction - (direction @ normal) * normal
            if np.linalg.norm(along) > 0.5:
                unit = along / np.linalg.norm(along)
                return [float(f"{c:.6g}") + 0.0 for c in unit]
        return [1.0, 0.0, 0.0]

    # --- lines ----------------------------------------------------------------------------------

    def _bodies(self) -> Iterator[str]:
        names = [*self.bodies, TO_FILL, TO_FILL][: max(2, len(self.bodies))]
        yield f"  body_1: {_text(names[0])}"
        yield f"  body_2: {_text(names[1])}"
        if len(names) > 2:
            yield "  other_bodies:"
        for number, name in enumerate(names[2:], start=2):
            yield f"    - name: {_text(name)}"
            yield from (f"      {line.strip()}" for line in self._material("material", number))

    def _contacts(self) -> Iterator[str]:
        if not self.contacts:
            yield f"    - {{name: contact, face_1: {TO_FILL}, face_2: {TO_FILL}, x: [1, 0, 0]}}"
        for number, pair in enumerate(self.contacts, start=1):
            face = self._patch(pair.faces[0])
            assert face is not None
            owners = [self._owner(name) for name in pair.faces]
            yield f"    - name: contact_{number}  # {pair.line}"
            yield f"      face_1: {_text(pair.faces[0])}"
            yield f"      face_2: {_text(pair.faces[1])}"
            yield f"      x: {_numbers(self._sliding(face.normal))}  # where body 2 would slide"
            if owners != self.bodies[:2]:
                yield f"      bodies: [{', '.join(map(_text, owners))}]"
            if pair.friction != self._coefficient:
                own = TO_FILL if pair.friction is None else _number(pair.friction)
                yield f"      friction: {{coefficient: {own}}}"

    def _held(self) -> Iterator[str]:
        if not self.supports:
            yield f"    - {{group: {TO_FILL}, hold: all}}"
        whole = "xz" if self.plane else "xyz"
        for support in self.supports:
            hold = "all" if support.axes == whole else support.axes
            yield f"    - {{group: {_text(support.group)}, hold: {hold}}}  # {support.line}"

    def _loaded(self) -> Iterator[str]:
        if not self.loads:
            path = _numbers([1.0] * self._steps + [0.0])
            yield f"    - {{kind: pressure, group: {TO_FILL}, pressure: {TO_FILL}, path: {path}}}"
        for load in self.loads:
            path = _numbers([*load.path, 0.0])
            group = f"group: {_text(load.group)}, " * bool(load.group)
            yield f"    - {{kind: {load.kind}, {group}{_value(load)}, path: {path}}}  # {load.line}"

    def _material(self, entry: str, number: int) -> Iterator[str]:
        name = self.bodies[number] if number < len(self.bodies) else ""
        known = self.scene.materials.get(name, {})
        if known.get("young", 0.0) > STIFFEST:
            self.ignored.append(
                f"material of {name}: Young's modulus of {known['young']:g} MPa: is the file in "
                f"other units? lengths are {self.imported.unit}; describe takes another --unit"
            )
        values = {"young": TO_FILL, "poisson": TO_FILL}
        values |= {key: _number(value) for key, value in known.items()}
        reported = ", ".join(f"{key}: {value}" for key, value in values.items())
        yield f"  {entry}: {{{reported}}}"

    @property
    def _forces(self) -> str:
        """Units in which forces and stresses of the file are read."""
        unit = self.imported.unit
        force = "N" if unit.force == 1.0 else "pounds"
        return f"forces in {force}, stresses in {force} on a square {unit.name}."

    @property
    def _coefficient(self) -> float | None:
        """Friction of most contacts: that of the first that has any."""
        return next((p.friction for p in self.contacts if p.friction is not None), None)

    def _friction(self) -> Iterator[str]:
        known = self._coefficient
        yield f"friction: {{coefficient: {TO_FILL if known is None else _number(known)}}}"

    @property
    def _steps(self) -> int:
        """Number of legs of the load path before the one back."""
        return max(self.scene.steps, 1)

    def _legs(self) -> Iterator[str]:
        yield "load_path:  # a leg for every step of the file, and one back: make it your cycle"
        yield f"  increments: {_numbers([INCREMENTS] * (self._steps + 1))}"
        yield f"  peak_leg: {self._steps}"


def _value(load: FileLoad) -> str:
    if isinstance(load.value, float):
        return f"pressure: {_number(load.value)}"
    if load.kind == "rotation":
        speed = float(np.linalg.norm(load.value))
        axis = _numbers([c / speed for c in load.value])
        return f"axis: {axis}, through: {_numbers(load.through)}, speed: {_number(speed)}"
    return f"{load.kind}: {_numbers(load.value)}"


def _numbers(values: Sequence[Any]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _number(value: float) -> str:
    """Return a number with all digits that a file has; adding zero turns -0 into 0."""
    return f"{value + 0.0:.12g}"


def _text(text: str) -> str:
    """Return a name for YAML: in quotes unless it consists of plain words."""
    return text if re.fullmatch(r"[A-Za-z][\w.\-]*( [\w.\-]+)*", text) else json.dumps(text)
