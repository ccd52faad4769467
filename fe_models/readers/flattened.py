"""Bodies, surfaces and node sets of a file that defines its mesh by numbers and names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any, TypeVar

import numpy as np

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import Card, SourceLine
from fe_models.readers.grouped import (
    DIMENSION,
    FACE_SHAPES,
    FACES,
    Blocks,
    GroupedMesh,
    edges_of_shape,
    midsides_of,
    nodes_of,
    piece_blocks,
    pieces,
)
from fe_models.readers.scope import Element, Members, Names, Scope, existing, extend, resolve
from sa_solver.types import Indices

_Value = TypeVar("_Value")


def dimension_of(scope: Scope) -> int:
    """Return the dimension of the bodies of a scope.

    Raises :class:`MeshError` if it has only facets and edges.
    """
    standing = [e for e in scope.elements.values() if e.stands_alone]
    if not standing:
        first = next(iter(scope.elements.values()))
        raise MeshError(
            f"{first.place}: element type {first.kind} is {first.advice}; allowed: solid or "
            "plane elements, and such facets on them"
        )
    return max(DIMENSION[element.shape] for element in standing)


class Flattened:
    """Nodes of all ``scopes`` in one list.

    ``common`` is the scope whose names need no prefix: the assembly, or the flat file itself.
    """

    def __init__(self, scopes: list[Scope], common: Scope) -> None:
        self.scopes, self.common = scopes, common
        self.instances: Names[Scope] = Names()
        # Row of each node, by scope and number.
        self.row: dict[str, dict[int, int]] = {}
        offset = 0
        for scope in scopes:
            if scope is not common:
                self.instances.add(scope.name, scope)
            self.row[scope.name] = {node: offset + row for row, node in enumerate(scope.nodes)}
            offset += len(scope.nodes)

    def mesh(self) -> GroupedMesh:
        points = [
            scope.placing(np.array(list(scope.nodes.values())).reshape(-1, 3))
            for scope in self.scopes
        ]
        together = np.concatenate(points)
        return GroupedMesh(
            points=together,
            numbers=np.concatenate(
                [np.array(list(scope.nodes), dtype=np.int64) for scope in self.scopes]
            ),
            bodies=self.bodies(),
            surfaces=self.surfaces(),
            node_sets=self.node_sets(),
            midsides=midsides_of(together, self._second_order()),
        )

    def _second_order(self) -> Iterator[tuple[str, Indices]]:
        """Yield the elements with midside nodes, these included."""
        for scope in self.scopes:
            numbers = [n for n, element in scope.elements.items() if element.midsides]
            yield from self.blocks(scope, numbers, midsides=True)

    def bodies(self) -> dict[str, Blocks]:
        return {scope.name: self.blocks(scope, scope.elements) for scope in self.scopes}

    def surfaces(self) -> dict[str, Blocks]:
        """Return the facets of the element surfaces."""
        return {
            name: self._faces(scope, card)
            for name, scope, _, card in self._named("surfaces")
            if not _is_node_surface(card)
        }

    def node_sets(self) -> dict[str, Indices]:
        """Return the rows of the nodes of node sets and node surfaces."""
        sets = {
            name: self._rows(name, scope, members)
            for name, scope, _, members in self._named("node_sets")
        }
        for name, scope, _, card in self._named("surfaces"):
            if _is_node_surface(card):
                if name in sets:
                    raise MeshError(f"{card.place}: a node set is named {name}, too; rename one")
                nodes: Members = {}
                for place, fields in card.rows:
                    extend(nodes, resolve(place, fields[0], "node_sets", scope, self.instances))
                sets[name] = self._rows(name, scope, nodes)
        return sets

    def blocks(self, scope: Scope, numbers: Iterable[int], midsides: bool = False) -> Blocks:
        """Return elements of a scope by shape: their corners, and their ``midsides`` on request."""
        by_shape: dict[str, list[list[int]]] = {}
        for number in numbers:
            element = scope.elements[number]
            nodes = element.nodes + element.midsides * midsides
            rows = self._node_rows(scope, nodes, element.place)
            by_shape.setdefault(element.shape, []).append(rows)
        return [(shape, np.array(cells)) for shape, cells in by_shape.items()]

    def _node_rows(self, scope: Scope, nodes: Iterable[int], place: SourceLine) -> list[int]:
        known = self.row[scope.name]
        try:
            return [known[node] for node in nodes]
        except KeyError as error:
            raise MeshError(f"{place}: node {error.args[0]} is not defined") from None

    def _named(self, kind: str) -> Iterator[tuple[str, Scope, str, Any]]:
        """Yield the named entries of all scopes with their final names.

        A name that is not unique gets its instance as a prefix.
        """
        scopes = [self.common, *(scope for _, scope in self.instances.items())]
        count = Counter(
            name.upper() for scope in scopes for name, _ in getattr(scope, kind).items()
        )
        for scope in scopes:
            prefix = f"{scope.name}." if scope.name else ""
            for name, value in getattr(scope, kind).items():
                yield (prefix + name if count[name.upper()] > 1 else name), scope, name, value

    def names_of_groups(self) -> dict[tuple[str, str], str]:
        """Return the final names of sets and surfaces by instance and own name, in upper case."""
        return {
            (scope.name.upper(), own.upper()): name
            for kind in ("node_sets", "surfaces")
            for name, scope, own, _ in self._named(kind)
        }

    def _rows(self, name: str, scope: Scope, members: Members) -> Indices:
        """Return the rows of the nodes of a set, without the assembly's own reference points."""
        rows: list[int] = []
        for instance, numbers in members.items():
            known = self.row.get(instance or scope.name)
            if known is not None:
                what = f"{scope.place}: node set {name}"
                rows += [known[number] for number in existing(numbers, known, what)]
        return np.unique(np.array(rows, dtype=np.int64))

    def _faces(self, scope: Scope, card: Card) -> Blocks:
        """Return the facets of an element surface."""
        by_shape: dict[str, list[list[int]]] = {}
        for place, fields in card.rows:
            named = resolve(place, fields[0], "element_sets", scope, self.instances)
            side = fields[1].upper() if len(fields) > 1 else ""
            for instance, members in named.items():
                owner = self.instances[instance] if instance else scope
                for number in existing(members, owner.elements, f"{place}: the surface"):
                    element = owner.elements[number]
                    nodes = _face(element, number, side, place)
                    rows = self._node_rows(owner, nodes, element.place)
                    by_shape.setdefault(FACE_SHAPES[len(rows)], []).append(rows)
        if not by_shape:
            raise MeshError(f"{card.place}: surface {card.name('NAME')} has no elements")
        return [(shape, np.array(faces)) for shape, faces in by_shape.items()]


def _is_node_surface(card: Card) -> bool:
    return card.parameters.get("TYPE", "").upper() == "NODE"


def _face(element: Element, number: int, side: str, place: SourceLine) -> list[int]:
    """Return the nodes of the face S1, S2, ... of an element."""
    faces = FACES.get(element.shape, ())
    sides = [f"S{face}" for face in range(1, len(faces) + 1)]
    if side not in sides:
        raise MeshError(
            f"{place}: face {side or '(none)'} of element {number}, a {element.shape}; allowed: "
            f"{', '.join(sides) or 'faces of solid or plane elements'}"
        )
    return [element.nodes[corner] for corner in faces[sides.index(side)]]


def _loose(element: Element, where: str) -> MeshError:
    """Return the error for a facet or an edge that is on no body."""
    remedy = f" is {element.advice}" if element.advice else "; allowed: bodies of one kind"
    return MeshError(f"{element.place}: {element.kind} {where}{remedy}")


class FlatFile(Flattened):
    """File without parts.

    With ``joins``, sets that divide a body between them name it together, as in formats that have
    no set of all its elements. ``notes`` are lines about such bodies.
    """

    def __init__(self, scope: Scope, joins: bool = False) -> None:
        super().__init__([scope], scope)
        self.top, self.joins = dimension_of(scope), joins
        self.notes: list[str] = []

    def bodies(self) -> dict[str, Blocks]:
        """Return the connected pieces, each by the name of its element set."""
        numbers = sorted(
            (n for n, element in self.common.elements.items() if self._level(element) == 0),
            key=lambda number: self.common.elements[number].shape,
        )
        self._check_facets(numbers)
        blocks = self.blocks(self.common, numbers)
        labels = np.concatenate(pieces(blocks)).tolist()
        names = self._piece_names(dict(zip(numbers, labels, strict=True)))
        return {
            names.get(piece, f"body_{piece + 1}"): part
            for piece, part in enumerate(piece_blocks(blocks))
        }

    def surfaces(self) -> dict[str, Blocks]:
        return _united(super().surfaces(), self._sets_of_level(1))

    def node_sets(self) -> dict[str, Indices]:
        edges = {name: nodes_of(blocks) for name, blocks in self._sets_of_level(2).items()}
        return _united(super().node_sets(), edges)

    def _check_facets(self, numbers: list[int]) -> None:
        """Raise unless all facets and edges are on bodies; others would be bodies themselves."""
        elements = self.common.elements
        used = {node for number in numbers for node in elements[number].nodes}
        for element in elements.values():
            if self._level(element) and not used.issuperset(element.nodes):
                bodies = "solid" if self.top == 3 else "plane element"
                raise _loose(element, f"with nodes on no {bodies}")
        lines = [element for element in elements.values() if self._level(element) == 2]
        if not lines:
            return
        edges = {
            tuple(sorted((element.nodes[a], element.nodes[b])))
            for element in (elements[number] for number in numbers)
            for a, b in edges_of_shape(element.shape).tolist()
        }
        for element in lines:
            if tuple(sorted(element.nodes)) not in edges:
                raise _loose(element, "on no edge of a solid")

    def _level(self, element: Element) -> int:
        """Return 0 for an element of a body, 1 for a facet, and 2 for an edge on solids."""
        return self.top - DIMENSION[element.shape]

    def _members(self, name: str) -> list[int]:
        members = self.common.element_sets[name].get("", [])
        what = f"{self.common.place.path}: element set {name}"
        return existing(members, self.common.elements, what)

    def _sets_of_level(self, level: int) -> dict[str, Blocks]:
        """Return the element sets whose elements are all of one level."""
        sets = {}
        for name, _ in self.common.element_sets.items():
            numbers = self._members(name)
            if {self._level(self.common.elements[number]) for number in numbers} == {level}:
                sets[name] = self.blocks(self.common, numbers)
        return sets

    def _piece_names(self, piece_of: dict[int, int]) -> dict[int, str]:
        """Return the name of the element set that is exactly one piece, by number of the piece.

        Sets that divide a piece between them are refused or joined. Sets that the user has named
        take precedence over those of ``*Element`` lines.
        """
        size = Counter(piece_of.values())
        names: dict[int, str] = {}
        parts: dict[int, dict[str, set[int]]] = {}
        sets = [name for name, _ in self.common.element_sets.items()]
        for name in sorted(sets, key=lambda name: name.upper() in self.common.blocks):
            members = set(self._members(name))
            inside = {piece_of.get(number, -1) for number in members}
            if len(inside) != 1 or -1 in inside:
                continue
            (piece,) = inside
            if len(members) == size[piece]:
                names.setdefault(piece, name)
            else:
                parts.setdefault(piece, {})[name] = members
        for piece, divided in parts.items():
            if piece not in names and len(set().union(*divided.values())) == size[piece]:
                if self.joins:
                    names[piece] = "+".join(divided)
                    self.notes.append(
                        f"{self.common.place.path.name}: {', '.join(divided)} share nodes: one "
                        f"body {names[piece]}, of one material"
                    )
                    continue
                raise MeshError(
                    f"{self.common.place.path}: the element sets {', '.join(divided)} share nodes: "
                    "they are bonded, not in contact; name them by one set if they are one body, "
                    "or give each its own nodes"
                )
        return names


def _united(first: dict[str, _Value], second: dict[str, _Value]) -> dict[str, _Value]:
    for name in first:
        if name in second:
            raise MeshError(f"two groups are named {name}: rename one")
    return first | second
