"""Parts, instances and the assembly of an Abaqus input file, as its keywords define them."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from scipy.spatial.transform import Rotation

from fe_models.geometry.abaqus_cards import Card, DataLine, SourceLine, integer, real
from fe_models.geometry.grouped import CORNERS
from fe_models.mesh import MeshError
from sa_solver.types import Array

# Shape of the solid (C3D) and plane (CPE, CPS) elements by their number of nodes, of which the
# corners come first.
SOLIDS = {
    4: "tetra", 10: "tetra", 5: "pyramid", 6: "wedge", 15: "wedge", 8: "hexahedron",
    20: "hexahedron",
}  # fmt: skip
PLANES = {3: "triangle", 6: "triangle", 4: "quad", 8: "quad"}
# Letters after the number (reduced integration, hybrid, modified, ...) do not change the mesh.
SOLID_TYPE, PLANE_TYPE = re.compile(r"C3D(\d+)[HIMPRST]*"), re.compile(r"CP[ES](\d+)[HIMPRT]*")
# What gmsh and meshio write for edges and facets: neither is a body.
FACET_TYPES = {
    "T2D2": (2, "line"), "T2D3": (3, "line"), "T3D2": (2, "line"), "T3D3": (3, "line"),
    "R3D3": (3, "triangle"), "R3D4": (4, "quad"), "SFM3D3": (3, "triangle"), "SFM3D4": (4, "quad"),
}  # fmt: skip
ALLOWED_TYPES = (
    "C3D4, C3D5, C3D6, C3D8, C3D10, C3D15, C3D20, CPE3, CPE4, CPE6, CPE8, and CPS of these"
)

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
)  # fmt: skip

# Keywords that say what a case says: they are not taken over.
LEFT = frozenset(
    ["BOUNDARY", "CLOAD", "DLOAD", "DSLOAD", "TEMPERATURE", "CONTACTPAIR", "CONTACT", "CLEARANCE",
     "CONTACTINTERFERENCE", "FRICTION", "SURFACEBEHAVIOR", "ELASTIC", "DENSITY", "EXPANSION",
     "AMPLITUDE", "INITIALCONDITIONS", "SPRING", "MASS"]
)  # fmt: skip

# Numbers of nodes or elements, or ranges of which those that exist are meant, by the instance they
# belong to; those of the scope itself are under "".
Members = dict[str, list[int | range]]
_Value = TypeVar("_Value")


class Names(Generic[_Value]):
    """Values by name. Abaqus reads upper and lower case alike; the first spelling is kept."""

    def __init__(self) -> None:
        self._entries: dict[str, tuple[str, _Value]] = {}

    def __contains__(self, name: str) -> bool:
        return name.upper() in self._entries

    def __getitem__(self, name: str) -> _Value:
        return self._entries[name.upper()][1]

    def __len__(self) -> int:
        return len(self._entries)

    def __str__(self) -> str:
        return ", ".join(name for name, _ in self.items())

    def add(self, name: str, value: _Value) -> _Value:
        """Keep the value unless the name has one; return the one kept."""
        return self._entries.setdefault(name.upper(), (name, value))[1]

    def items(self) -> Iterator[tuple[str, _Value]]:
        return iter(self._entries.values())


@dataclass(frozen=True)
class Element:
    """Shape, corner nodes, nodes on its edges, of second order, and place of an element."""

    shape: str
    nodes: tuple[int, ...]
    midsides: tuple[int, ...]
    place: SourceLine


@dataclass
class Scope:
    """A part, an instance, the assembly, or a flat file: nodes, elements, sets and surfaces.

    ``blocks`` are the element sets named on an ``*Element`` line only, as programs name them;
    ``placing`` takes points ``(n, 3)`` to where an instance has them.
    """

    name: str
    place: SourceLine
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[int, Element] = field(default_factory=dict)
    node_sets: Names[Members] = field(default_factory=Names)
    element_sets: Names[Members] = field(default_factory=Names)
    surfaces: Names[Card] = field(default_factory=Names)
    blocks: set[str] = field(default_factory=set)
    placing: Callable[[Array], Array] = lambda points: points

    def instance(self, card: Card) -> Scope:
        """An instance of this part."""
        return Scope(
            name=card.name("NAME"),
            place=card.place,
            nodes=dict(self.nodes),
            elements=dict(self.elements),
            node_sets=deepcopy(self.node_sets),
            element_sets=deepcopy(self.element_sets),
            surfaces=deepcopy(self.surfaces),
            placing=_placing(card.rows),
        )

    def is_empty(self) -> bool:
        """Whether nothing is defined in it."""
        return not (
            self.nodes or self.elements or self.node_sets or self.element_sets or self.surfaces
        )


def resolve(
    place: SourceLine, text: str, kind: str, scope: Scope, instances: Names[Scope]
) -> Members:
    """What a data line means by a number, the name of a set, or ``Instance.`` and either.

    ``kind`` is ``node_sets`` or ``element_sets``.
    """
    text = text.strip('"')
    if re.fullmatch(r"\d+", text):
        return {"": [int(text)]}
    sets: Names[Members] = getattr(scope, kind)
    if text in sets:
        return sets[text]
    # Names may have dots in them, too.
    for dot in (match.start() for match in re.finditer(r"\.", text)):
        if text[:dot] in instances:
            inner = instances[text[:dot]]
            members = resolve(place, text[dot + 1 :], kind, inner, Names())
            return {inner.name: members.get("", [])}
    raise MeshError(
        f"{place}: no {kind[:-1].replace('_', ' ')} {text or '(no name)'}; allowed: "
        f"{sets or 'those defined above'}"
    )


def extend(members: Members, more: Members) -> None:
    """Add members to a set."""
    for instance, numbers in more.items():
        members.setdefault(instance, []).extend(numbers)


def existing(members: list[int | range], known: Collection[int], what: str) -> list[int]:
    """All numbers meant, of ranges those that exist; raises if any other does not."""
    numbers: list[int] = []
    for member in members:
        if isinstance(member, range):
            numbers.extend(number for number in member if number in known)
        elif member in known:
            numbers.append(member)
        else:
            raise MeshError(f"{what} names number {member}, which is not defined")
    return numbers


class Model:
    """What has been read so far: a flat file, or parts, their instances and the assembly."""

    def __init__(self, path: Path) -> None:
        self.flat = Scope("", SourceLine(path, 1))
        self.assembly = Scope("", SourceLine(path, 1))
        self.parts: Names[Scope] = Names()
        self.instances: Names[Scope] = Names()
        self.left: list[str] = []
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
        """Take in a keyword; raises :class:`MeshError` if it is not supported."""
        if card.keyword in REFUSED:
            raise MeshError(
                f"{card.place}: *{card.keyword} is not supported: {REFUSED[card.keyword]}"
            )
        if card.keyword in LEFT:
            self.left.append(_told(card))
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
        # What follows up to *End Instance belongs to it: CAE writes independent instances so.
        self._scope = self.instances.add(name, self.parts[part].instance(card))

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
        count, shape = _element_type(card)
        corners = CORNERS[shape]
        numbers: list[int | range] = []
        for place, (number, *nodes) in _element_rows(card, count):
            if number in scope.elements:
                raise MeshError(f"{place}: element {number} is defined twice")
            scope.elements[number] = Element(
                shape, tuple(nodes[:corners]), tuple(nodes[corners:]), place
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
                every = (known[n].nodes + known[n].midsides for n in numbers)
                extend(members, {instance: [node for nodes in every for node in nodes]})
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
        """What the data lines of a set name."""
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


def _told(card: Card) -> str:
    """A keyword in a line: where it stands, its parameters and its first data."""
    given = card.parameters.items()
    parameters = [f"{key.lower()}={value}" if value else key.lower() for key, value in given]
    data = [", ".join(row.fields) for row in card.rows[:1]] + ["..."] * (len(card.rows) > 1)
    head = ", ".join([f"*{card.keyword.lower()}", *parameters])
    return f"{card.place.path.name}:{card.place.line}: {head}{': ' * bool(data)}{' '.join(data)}"


def _range(place: SourceLine, fields: list[str]) -> range:
    """First and last number, and step."""
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


def _element_type(card: Card) -> tuple[int, str]:
    """Number of nodes and shape of a type of element."""
    kind = card.name("TYPE").upper()
    for pattern, shapes in ((SOLID_TYPE, SOLIDS), (PLANE_TYPE, PLANES)):
        if (match := pattern.fullmatch(kind)) and int(match[1]) in shapes:
            return int(match[1]), shapes[int(match[1])]
    if kind not in FACET_TYPES:
        raise MeshError(f"{card.place}: element type {kind}; allowed: {ALLOWED_TYPES}")
    return FACET_TYPES[kind]


def _element_rows(card: Card, count: int) -> Iterator[tuple[SourceLine, list[int]]]:
    """Number and nodes of each element, which may go over several lines."""
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
    """Where an instance has its points: translated, then turned about an axis by an angle [°].

    Two points on the axis are given.
    """
    if not rows:
        return lambda points: points
    values = [[real(row.place, text) for text in row.fields] for row in rows]
    if [len(line) for line in values] not in ([2], [3], [2, 7], [3, 7]):
        raise MeshError(
            f"{rows[0].place}: allowed: a line of 3 numbers that move the instance and one of 7 "
            "that turn it"
        )
    translation = np.array([*values[0], 0.0][:3])
    if len(values) == 1:
        return lambda points: points + translation
    start, end, angle = np.array(values[1][:3]), np.array(values[1][3:6]), values[1][6]
    length = np.linalg.norm(end - start)
    if length == 0.0:
        raise MeshError(f"{rows[1].place}: the axis of rotation has no length")
    turn = Rotation.from_rotvec(angle * (end - start) / length, degrees=True)
    return lambda points: turn.apply(points + translation - start) + start
