"""Materials, contacts, supports and loads of an Abaqus input file, step by step.

Keywords are as in the Abaqus Keywords Reference Guide. Lines that are not understood are ignored,
with the line and the reason; none of them changes the mesh.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import Card, DataLine, real
from fe_models.readers.abaqus.model import Model, summary_line
from fe_models.readers.flattened import Flattened
from fe_models.readers.grouped import GroupedMesh
from fe_models.readers.scene import (
    FileContact,
    FileLoad,
    FileSupport,
    NotTakenError,
    Scene,
    Vector,
    times,
)
from fe_models.readers.scope import Scope, existing

AXES = "xyz"
UNITS: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
# Displacements of solids that a named boundary condition holds.
NAMED = {
    "ENCASTRE": "xyz", "PINNED": "xyz", "XSYMM": "x", "YSYMM": "y", "ZSYMM": "z", "XASYMM": "yz",
    "YASYMM": "xz", "ZASYMM": "xy",
}  # fmt: skip
# Kinds of loads that op=new ends, by keyword.
KINDS = {
    "CLOAD": ("force",), "DSLOAD": ("pressure", "traction"), "DLOAD": ("acceleration", "rotation"),
    "BOUNDARY": ("displacement",),
}  # fmt: skip
# Parameters that change the meaning of the data lines of supports and loads, with the reason for
# which they are ignored.
OTHERWISE = {
    "ORIENTATION": "along the axes of an orientation", "FIXED": "held where it has come to",
    "SUBMODEL": "as another model moves", "USER": "by a subroutine",
}  # fmt: skip

# Errors in reading a line, none of which prevents the mesh from being read.
WRONG = (NotTakenError, MeshError, IndexError, KeyError, ValueError)


def scene_of(model: Model, flattened: Flattened, mesh: GroupedMesh) -> Scene:
    """Return the scene of a file in the names of its bodies and groups."""
    return _Reader(model, flattened, mesh).scene()


class _Reader:
    """Reader that goes through the keywords in their order."""

    def __init__(self, model: Model, flattened: Flattened, mesh: GroupedMesh) -> None:
        self.model, self.flattened, self.mesh = model, flattened, mesh
        self.names = flattened.names_of_groups()
        self.sizes = {name: len(rows) for name, rows in mesh.node_sets.items()}
        self.step = 0
        self.properties: dict[str, dict[str, float]] = {}
        self.friction: dict[str, float] = {}
        self.sections: list[tuple[Scope, Card]] = []
        self.pairs: list[tuple[tuple[str, str], str, str]] = []
        self.supports: list[FileSupport] = []
        self.loads: dict[tuple[str, str, str], FileLoad] = {}
        self.factors: dict[tuple[str, str, str], dict[int, float]] = {}
        self.ended: set[tuple[int, str]] = set()
        self.ignored: list[str] = []
        self._material = self._interaction = ""
        self._handlers: dict[str, Callable[[Card], None]] = {
            "STEP": self._next_step,
            "MATERIAL": self._name_material,
            "ELASTIC": self._elastic,
            "DENSITY": lambda card: self._constant(card, "density"),
            "EXPANSION": lambda card: self._constant(card, "expansion"),
            "SURFACEINTERACTION": self._name_interaction,
            "FRICTION": self._slip,
            "CONTACTPAIR": self._pair,
            "BOUNDARY": self._rows(self._held),
            "CLOAD": self._rows(self._force),
            "DSLOAD": self._rows(self._surface_load),
            "DLOAD": self._rows(self._body_load),
        }

    def scene(self) -> Scene:
        for scope, card in self.model.case_cards:
            handler = self._handlers.get(card.keyword)
            try:
                if card.keyword == "SOLIDSECTION":
                    self._section(scope, card)
                    continue
                if handler is None:
                    raise NotTakenError("not part of a case")
                handler(card)
            except WRONG as error:
                self.ignored.append(_ignored(card, error))
        contacts = [
            FileContact(faces, self.friction.get(interaction.upper()), line)
            for faces, interaction, line in self.pairs
        ]
        return Scene(
            materials=self._materials(),
            contacts=tuple(contacts),
            supports=tuple(self.supports),
            loads=tuple(self._load_paths()),
            steps=self.step,
            ignored=tuple(self.ignored),
        )

    def _rows(self, take: Callable[[Card, DataLine, str], None]) -> Callable[[Card], None]:
        """Return a handler that reads each data line separately.

        Lines that cannot be used are ignored with the reason.
        """

        def handler(card: Card) -> None:
            if card.parameters.get("OP", "").upper() == "NEW" and self.step:
                self._end_loads(card)
            for parameter, why in OTHERWISE.items():
                if parameter in card.parameters:
                    raise NotTakenError(why)
            if amplitude := card.parameters.get("AMPLITUDE"):
                self.ignored.append(
                    _ignored(card, f"amplitude {amplitude}: loads grow evenly over a leg")
                )
            for row in card.rows:
                try:
                    take(card, row, row.place.short)
                except WRONG as error:
                    one = replace(card, place=row.place, rows=[row])
                    self.ignored.append(_ignored(one, error))

        return handler

    def _next_step(self, _: Card) -> None:
        self.step += 1

    # --- materials and contacts -----------------------------------------------------------------

    def _section(self, scope: Scope, card: Card) -> None:
        self.sections.append((scope, card))
        thickness = card.rows[0].fields[0] if card.rows else ""
        if thickness and real(card.rows[0].place, thickness) != 1.0:
            # Only plane bodies have a thickness.
            raise NotTakenError(f"thickness of {thickness}: forces in the plane are per length")

    def _name_material(self, card: Card) -> None:
        self._material = card.name("NAME").upper()
        self.properties[self._material] = {}

    def _elastic(self, card: Card) -> None:
        young, poisson = self._first(card, 2)
        self.properties[self._material] |= {"young": young, "poisson": poisson}

    def _constant(self, card: Card, name: str) -> None:
        (self.properties[self._material][name],) = self._first(card, 1)

    def _first(self, card: Card, count: int) -> list[float]:
        """Return the numbers of the first data line; more lines are for other temperatures."""
        if not card.parameters.get("TYPE", "ISO").upper().startswith("ISO"):
            raise NotTakenError("bodies are isotropic")
        if not card.rows or not self._material:
            raise NotTakenError("of no material, or without numbers")
        if len(card.rows) > 1:
            self.ignored.append(_ignored(card, "of its temperatures the first is taken"))
        row = card.rows[0]
        return [real(row.place, text) for text in row.fields[:count]]

    def _name_interaction(self, card: Card) -> None:
        self._interaction = card.name("NAME").upper()

    def _slip(self, card: Card) -> None:
        if self.step:
            raise NotTakenError("friction that changes in a step")
        if not card.rows:
            raise NotTakenError("without a coefficient")
        row = card.rows[0]
        self.friction[self._interaction] = real(row.place, row.fields[0])

    def _pair(self, card: Card) -> None:
        for row in card.rows:
            if len(row.fields) < 2 or not row.fields[1]:
                raise NotTakenError("a surface with itself")
            faces = self._group(row.fields[0]), self._group(row.fields[1])
            interaction = card.parameters.get("INTERACTION", "")
            self.pairs.append((faces, interaction, row.place.short))

    def _materials(self) -> dict[str, dict[str, float]]:
        """Return the constants of the bodies whose elements are all of one material."""
        found: dict[str, set[str]] = {}
        for scope, card in self.sections:
            material = card.parameters.get("MATERIAL", "").upper()
            for body in self._bodies_of(scope, card.parameters.get("ELSET", "")):
                found.setdefault(body, set()).add(material)
        materials = {}
        for body, named in found.items():
            constants = self.properties.get(next(iter(named)), {})
            if len(named) == 1 and "young" in constants:
                materials[body] = constants
            else:
                self.ignored.append(f"materials of body {body}: allowed: one, with *Elastic")
        return materials

    def _bodies_of(self, scope: Scope, elements: str) -> Iterator[str]:
        """Yield the names of the bodies with elements of a set of a part or of a flat file."""
        if scope is not self.model.flat:
            for name, instance in self.model.instances.items():
                mine = scope.name in (name, self.model.part_of.get(name))
                if mine and elements in instance.element_sets:
                    yield name
            return
        if elements not in scope.element_sets:
            return
        members = scope.element_sets[elements].get("", [])
        rows = [
            self.flattened.row[scope.name][scope.elements[number].nodes[0]]
            for number in existing(members, scope.elements, "")
        ]
        for name, blocks in self.mesh.bodies.items():
            if any(np.isin(rows, cells).any() for _, cells in blocks):
                yield name

    # --- supports and loads ---------------------------------------------------------------------

    def _group(self, text: str) -> str:
        """Return the name that a set or a surface has in a case."""
        text = text.strip('"')
        if re.fullmatch(r"(.*\.)?\d+", text):
            raise NotTakenError(f"on node {text}: name a set of it")
        owners = [("", text)]
        for dot in (match.start() for match in re.finditer(r"\.", text)):
            owners.append((text[:dot].upper(), text[dot + 1 :]))
        for owner, name in owners:
            if (owner, name.upper()) in self.names:
                return self.names[owner, name.upper()]
        raise NotTakenError(f"no set or surface {text}")

    def _held(self, card: Card, row: DataLine, line: str) -> None:
        kind = card.parameters.get("TYPE", "DISPLACEMENT").upper()
        if kind != "DISPLACEMENT":
            raise NotTakenError(f"of type {kind}: allowed: displacements")
        group = self._group(row.fields[0])
        axes, value = _moved(row)
        held = ""
        for axis in axes:
            # A displacement imposed in an earlier step returns to zero.
            if value or _key("displacement", group, UNITS[axis]) in self.loads:
                self._load("displacement", group, value, line, UNITS[axis])
            else:
                held += axis
        before = {axis for s in self.supports if s.group == group for axis in s.axes}
        if set(held) <= before:
            return
        if self.step > 1:
            self.ignored.append(f"{line}: {group} is held from the beginning, not from there")
        self.supports.append(FileSupport(group, held, line))

    def _force(self, card: Card, row: DataLine, line: str) -> None:
        group = self._group(row.fields[0])
        if group not in self.sizes:
            raise NotTakenError(f"{group} is no node set")
        axis = int(real(row.place, row.fields[1]))
        if not 1 <= axis <= 3:
            raise NotTakenError("a moment on nodes, which solids do not take: allowed: forces")
        total = real(row.place, row.fields[2]) * self.sizes[group]
        self._load("force", group, total, line, UNITS[AXES[axis - 1]])

    def _surface_load(self, card: Card, row: DataLine, line: str) -> None:
        group, kind = self._group(row.fields[0]), row.fields[1].upper()
        numbers = [real(row.place, text) for text in row.fields[2:]]
        if kind == "P":
            self._load("pressure", group, numbers[0], line)
        elif kind == "TRVEC" and len(numbers) == 4:
            self._load("traction", group, numbers[0], line, _direction(numbers[1:4]))
        else:
            raise NotTakenError(f"a load of type {kind}: allowed: P, TRVEC")

    def _body_load(self, card: Card, row: DataLine, line: str) -> None:
        kind = row.fields[1].upper() if len(row.fields) > 1 else ""
        numbers = [real(row.place, text) for text in row.fields[2:]]
        if kind == "GRAV" and len(numbers) == 4:
            # Inertia forces on bodies are opposite to the acceleration of their frame.
            self._load("acceleration", "", -numbers[0], line, _direction(numbers[1:4]))
        elif kind == "CENTRIF" and len(numbers) == 7:
            x, y, z = numbers[1:4]
            speed, axis = math.sqrt(numbers[0]), _direction(numbers[4:7])
            self._load("rotation", "", speed, line, axis, (x, y, z))
        else:
            raise NotTakenError(f"a load of type {kind}: allowed: GRAV, CENTRIF, or *Dsload")
        if row.fields[0]:
            self.ignored.append(f"{line}: acts on all bodies, not on {row.fields[0]} alone")

    def _load(
        self,
        kind: str,
        group: str,
        size: float,
        line: str,
        along: Vector | None = None,
        through: Vector = (0.0, 0.0, 0.0),
    ) -> None:
        """Store a load: a pressure, or a load along a direction.

        The same load in a later step continues from there, and ends where it is zero.
        """
        if not self.step:
            raise NotTakenError("before the first step")
        key = _key(kind, group, along)
        if not size and key not in self.loads:
            return
        value = size if along is None else times(size, along)
        first = self.loads.setdefault(key, FileLoad(kind, group, value, (), line, through))
        factor = _ratio(value, first.value)
        if factor is None:
            raise NotTakenError("along another direction than before")
        factors = self.factors.setdefault(key, {})
        if factors.get(self.step, 0.0) and kind in ("force", "pressure", "traction"):
            factor += factors[self.step]
        factors[self.step] = factor

    def _end_loads(self, card: Card) -> None:
        """End the loads of earlier steps, once per step although several cards may have op=new."""
        if (self.step, card.keyword) in self.ended:
            return
        self.ended.add((self.step, card.keyword))
        for (kind, _, _), factors in self.factors.items():
            if kind in KINDS[card.keyword]:
                factors[self.step] = 0.0
        if card.keyword == "BOUNDARY" and self.supports:
            self.ignored.append(_ignored(card, "what is held stays held, through all steps"))

    def _load_paths(self) -> Iterator[FileLoad]:
        """Yield the loads with their factors at the end of every step.

        A load stays until it changes.
        """
        for key, load in self.loads.items():
            path, factor = [], 0.0
            for step in range(1, self.step + 1):
                factor = self.factors[key].get(step, factor)
                path.append(factor)
            yield replace(load, path=tuple(path))


def _moved(row: DataLine) -> tuple[str, float]:
    """Return the axes that a line of *Boundary names, and the displacement along them.

    There are no axes if it names rotations, which solids do not have.
    """
    first = row.fields[1].upper()
    if first in NAMED:
        return NAMED[first], 0.0
    low = int(real(row.place, first))
    high = int(real(row.place, row.fields[2])) if len(row.fields) > 2 and row.fields[2] else low
    axes = "".join(AXES[k - 1] for k in range(low, high + 1) if 1 <= k <= 3)
    return axes, real(row.place, row.fields[3]) if len(row.fields) > 3 else 0.0


def _key(kind: str, group: str, along: Vector | None) -> tuple[str, str, str]:
    """Return the key that distinguishes a load from others, which includes the axes it is along."""
    return kind, group, "" if along is None else str([c != 0.0 for c in along])


def _direction(vector: list[float]) -> Vector:
    length = math.sqrt(sum(c * c for c in vector))
    if not length:
        raise NotTakenError("without a direction")
    x, y, z = (c / length for c in vector)
    return x, y, z


def _ratio(value: float | Vector, first: float | Vector) -> float | None:
    """Return the ratio of a load to the first one, or None if it is along another direction."""
    if isinstance(value, float) or isinstance(first, float):
        assert isinstance(value, float)
        assert isinstance(first, float)
        return value / first
    square = sum(c * c for c in first)
    ratio = sum(a * b for a, b in zip(value, first, strict=True)) / square
    off = sum((a - ratio * b) ** 2 for a, b in zip(value, first, strict=True))
    return ratio if off <= 1e-12 * square else None


def _ignored(card: Card, why: object) -> str:
    known = isinstance(why, NotTakenError | MeshError | str)
    return f"{summary_line(card)}: {why if known else 'not understood'}"
