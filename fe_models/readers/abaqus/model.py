"""Parts, instances and the assembly of an Abaqus input file, as its keywords define them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import Card, DataLine, SourceLine, integer, real
from fe_models.readers.abaqus.elements import FACET_TYPES, advice, element_type
from fe_models.readers.grouped import CORNERS
from fe_models.readers.scope import Element, Members, Names, Scope, existing, extend, resolve
from sa_solver.types import Array

GENERATED = "it makes or moves nodes or elements; write all of them out"
TIED = "the tie or constraint is not carried over; make one body of what is bonded"
MODIFIED = "it changes the mesh in the course of the analysis or takes it from another one"
REFUSED = (
    dict.fromkeys(
        ["NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "PARAMETER",
         "SYMMETRICMODELGENERATION"], GENERATED)
    | dict.fromkeys(
        ["TIE", "EQUATION", "MPC", "COUPLING", "KINEMATICCOUPLING", "DISTRIBUTINGCOUPLING",
         "EMBEDDEDELEMENT", "RIGIDBODY", "SHELLTOSOLIDCOUPLING", "CYCLICSYMMETRYMODEL",
         "PRE-TENSIONSECTION", "FASTENER"], TIED)
    | dict.fromkeys(
        ["IMPERFECTION", "IMPORT", "MODELCHANGE", "SUBSTRUCTUREGENERATE", "SUBSTRUCTUREPATH",
         "USERELEMENT", "MATRIXINPUT"], MODIFIED)
    | {"DISPLAYBODY": "it is shown and no body that is computed; leave its instance out"}
)  # fmt: skip

# Keywords that are the context of others.
CONTEXT = frozenset(["MATERIAL", "SOLIDSECTION", "SURFACEINTERACTION", "STEP"])
# Keywords that describe what a case has to describe: they are not imported with the mesh.
LEFT = frozenset(
    ["BOUNDARY", "CLOAD", "DLOAD", "DSLOAD", "TEMPERATURE", "CONTACTPAIR", "CONTACT", "CLEARANCE",
     "CONTACTINTERFERENCE", "CONTACTINCLUSIONS", "CONTACTPROPERTYASSIGNMENT", "FRICTION",
     "CHANGEFRICTION", "SURFACEBEHAVIOR", "ELASTIC", "PLASTIC", "HYPERELASTIC", "CREEP",
     "VISCOELASTIC", "DENSITY", "EXPANSION", "AMPLITUDE", "INITIALCONDITIONS", "TRANSFORM",
     "INERTIARELIEF", "BASEMOTION", "SUBMODEL", "SPRING", "MASS"]
)  # fmt: skip


class Model:
    """Content of an input file read so far: a flat file, or parts, instances and the assembly."""

    def __init__(self, path: Path) -> None:
        self.flat = Scope("", SourceLine(path, 1))
        self.assembly = Scope("", SourceLine(path, 1))
        self.parts: Names[Scope] = Names()
        self.instances: Names[Scope] = Names()
        self.unused: list[str] = []
        # Keywords that a case has to describe, with their scope, and the part of each instance.
        self.case_cards: list[tuple[Scope, Card]] = []
        self.part_of: dict[str, str] = {}
        self._scope = self.flat
        self._handlers: dict[str, Callable[[Card], None]] = {
            "PART": self._part,
            "ENDPART": self._leave_to_file,
            "ASSEMBLY": self._leave_to_assembly,
            "ENDASSEMBLY": self._leave_to_file,
            "INSTANCE": self._instance,
            "ENDINSTANCE": self._leave_to_assembly,
            "NODE": self._nodes,
            "ELEMENT": self._elements,
            "NSET": self._node_set,
            "ELSET": self._element_set,
            "SURFACE": self._surface,
        }

    def read(self, card: Card) -> None:
        """Read a keyword; raises :class:`MeshError` if it is not supported."""
        if card.keyword in REFUSED:
            raise MeshError(
                f"{card.place}: *{card.keyword} is not supported: {REFUSED[card.keyword]}"
            )
        if card.keyword in LEFT:
            self.unused.append(summary_line(card))
        if card.keyword in LEFT | CONTEXT:
            self.case_cards.append((self._scope, card))
        if card.keyword in self._handlers:
            self._handlers[card.keyword](card)

    def _leave_to_file(self, _: Card) -> None:
        self._scope = self.flat

    def _leave_to_assembly(self, _: Card) -> None:
        self._scope = self.assembly

    def _part(self, card: Card) -> None:
        name = card.name("NAME")
        if name in self.parts:
            raise MeshError(f"{card.place}: part {name} is defined twice")
        self._scope = self.parts.add(name, Scope(name, card.place))

    def _instance(self, card: Card) -> None:
        name, part = card.name("NAME"), card.parameters.get("PART", "")
        if part not in self.parts:
            raise MeshError(
                f"{card.place}: instance {name} is of part {part or '(none)'}; allowed: "
                f"{self.parts or 'parts defined above'}"
            )
        if name in self.instances:
            raise MeshError(f"{card.place}: instance {name} is defined twice")
        self.part_of[name] = self.parts[part].name
        # Keywords up to *End Instance belong to it: CAE writes independent instances this way.
        self._scope = self.instances.add(
            name, self.parts[part].instance(name, card.place, _placing(card.rows))
        )

    def _nodes(self, card: Card) -> None:
        _refuse(card, "INPUT")
        if card.parameters.get("SYSTEM", "R").upper() != "R":
            _refuse(card, "SYSTEM")
        scope = self._scope
        numbers: list[int | range] = []
        for place, fields in card.rows:
            number = integer(place, fields[0])
            if number in scope.nodes:
                raise MeshError(f"{place}: node {number} is defined twice")
            x, y, z = [*(real(place, text) for text in fields[1:4]), 0.0, 0.0, 0.0][:3]
            scope.nodes[number] = (x, y, z)
            numbers.append(number)
        if name := card.parameters.get("NSET"):
            extend(scope.node_sets.add(name, {}), {"": numbers})

    def _elements(self, card: Card) -> None:
        _refuse(card, "INPUT")
        scope = self._scope
        count, shape = element_type(card)
        corners, kind = CORNERS[shape], card.name("TYPE").upper()
        remedy = advice(kind)
        numbers: list[int | range] = []
        for place, (number, *nodes) in _element_rows(card, count):
            if (shape, count) == ("line", 3):  # The middle node is listed between the ends.
                nodes = [nodes[0], nodes[2], nodes[1]]
            if number in scope.elements:
                raise MeshError(f"{place}: element {number} is defined twice")
            scope.elements[number] = Element(
                shape=shape,
                nodes=tuple(nodes[:corners]),
                midsides=tuple(nodes[corners:]),
                place=place,
                kind=kind,
                stands_alone=kind not in FACET_TYPES,
                advice=remedy,
            )
            numbers.append(number)
        if name := card.parameters.get("ELSET"):
            if name not in scope.element_sets:
                scope.blocks.add(name.upper())
            extend(scope.element_sets.add(name, {}), {"": numbers})

    def _node_set(self, card: Card) -> None:
        name = card.name("NSET")
        members = self._members(card, "node_sets")
        if source := card.parameters.get("ELSET"):
            elements = resolve(card.place, source, "element_sets", self._scope, self.instances)
            for instance, chosen in elements.items():
                known = (self.instances[instance] if instance else self._scope).elements
                numbers = existing(chosen, known, f"{card.place}: element set {source}")
                node_lists = (known[n].nodes + known[n].midsides for n in numbers)
                extend(members, {instance: [node for nodes in node_lists for node in nodes]})
        extend(self._scope.node_sets.add(name, {}), members)

    def _element_set(self, card: Card) -> None:
        name = card.name("ELSET")
        members = self._members(card, "element_sets")
        extend(self._scope.element_sets.add(name, {}), members)
        self._scope.blocks.discard(name.upper())

    def _surface(self, card: Card) -> None:
        _refuse(card, "COMBINE")
        _refuse(card, "CROP")
        name = card.name("NAME")
        kind = card.parameters.get("TYPE", "ELEMENT").upper()
        if kind not in ("ELEMENT", "NODE"):
            raise MeshError(f"{card.place}: surface of type {kind}; allowed: ELEMENT, NODE")
        if name in self._scope.surfaces:
            raise MeshError(f"{card.place}: surface {name} is defined twice")
        self._scope.surfaces.add(name, card)

    def _members(self, card: Card, kind: str) -> Members:
        """Return the members that the data lines of a set name."""
        members: Members = {}
        scope, owner = self._scope, ""
        if instance := card.parameters.get("INSTANCE", ""):
            if instance not in self.instances:
                raise MeshError(
                    f"{card.place}: no instance {instance}; allowed: "
                    f"{self.instances or 'instances defined above'}"
                )
            scope = self.instances[instance]
            owner = scope.name
        for place, fields in card.rows:
            if "GENERATE" in card.parameters:
                extend(members, {owner: [_range(place, fields)]})
                continue
            for text in filter(None, fields):
                named = resolve(place, text, kind, scope, self.instances)
                extend(members, {key or owner: numbers for key, numbers in named.items()})
        return members


def summary_line(card: Card) -> str:
    """Return a keyword in one line: its place, its parameters and its first data."""
    given = card.parameters.items()
    parameters = [f"{key.lower()}={value}" if value else key.lower() for key, value in given]
    data = [", ".join(row.fields) for row in card.rows[:1]] + ["..."] * (len(card.rows) > 1)
    head = ", ".join([f"*{card.keyword.lower()}", *parameters])
    return f"{card.place.short}: {head}{': ' * bool(data)}{' '.join(data)}"


def _range(place: SourceLine, fields: list[str]) -> range:
    """Return the range from the first and last number and the step."""
    numbers = [integer(place, text) for text in fields if text]
    if len(numbers) not in (2, 3) or numbers[2:] == [0]:
        raise MeshError(f"{place}: allowed: first number, last number, step")
    step = numbers[2] if len(numbers) == 3 else 1
    return range(numbers[0], numbers[1] + 1, step)


def _refuse(card: Card, parameter: str) -> None:
    if parameter in card.parameters:
        raise MeshError(
            f"{card.place}: *{card.keyword} with {parameter.lower()}= is not supported; allowed: "
            "data lines, in rectangular coordinates"
        )


def _element_rows(card: Card, count: int) -> Iterator[tuple[SourceLine, list[int]]]:
    """Yield the number and nodes of each element, which may extend over several lines."""
    values: list[int] = []
    for place, fields in card.rows:
        values += [integer(place, text) for text in fields]
        if len(values) > count + 1:
            break
        if len(values) == count + 1:
            yield place, values
            values = []
    if values:
        raise MeshError(
            f"{place}: {len(values) - 1} nodes of a {card.parameters['TYPE']}; allowed: {count}"
        )


def _placing(rows: list[DataLine]) -> Callable[[Array], Array]:
    """Return the function that moves points to their positions in an instance.

    Points are translated, then rotated about an axis, given by two points, by an angle [°].
    """
    if not rows:
        return lambda points: points
    values = [[real(row.place, text) for text in row.fields] for row in rows]
    if [len(line) for line in values] not in ([2], [3], [2, 7], [3, 7]):
        raise MeshError(
            f"{rows[0].place}: allowed: a line of 3 numbers that translate the instance and one of "
            "7 that rotate it"
        )
    translation = np.array([*values[0], 0.0][:3])
    if len(values) == 1:
        return lambda points: points + translation
    start, end, angle = np.array(values[1][:3]), np.array(values[1][3:6]), values[1][6]
    length = np.linalg.norm(end - start)
    if length == 0.0:
        raise MeshError(
            f"{rows[1].place}: the axis of rotation has no length; give two different points"
        )
    turn = Rotation.from_rotvec(angle * (end - start) / length, degrees=True)
    return lambda points: turn.apply(points + translation - start) + start
