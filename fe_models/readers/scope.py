"""Definitions in a mesh file, by numbers and names: nodes, elements, sets and surfaces."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import Card, SourceLine
from fe_models.readers.grouped import FACE_SHAPES
from sa_solver.types import Array

# Numbers of nodes or elements, by the instance that they belong to; those of the scope itself are
# under "". A range stands for those of its numbers that exist.
Members = dict[str, list[int | range]]
_Value = TypeVar("_Value")


class Names(Generic[_Value]):
    """Values by name, where upper and lower case are the same, as in Abaqus.

    The first spelling is kept.
    """

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
        """Store the value unless the name has one, and return the stored value."""
        return self._entries.setdefault(name.upper(), (name, value))[1]

    def items(self) -> Iterator[tuple[str, _Value]]:
        return iter(self._entries.values())


@dataclass(frozen=True)
class Element:
    """Element of a mesh file.

    Attributes
    ----------
    shape
        Name of its shape.
    nodes
        Corner nodes.
    midsides
        Midside nodes of elements of second order.
    place
        Line that defines it.
    kind
        Type in the file.
    stands_alone
        Whether it is an element of a body, and not a facet or an edge of one.
    advice
        What it is and what to do if it is neither of a body nor on one.
    """

    shape: str
    nodes: tuple[int, ...]
    midsides: tuple[int, ...]
    place: SourceLine
    kind: str = ""
    stands_alone: bool = True
    advice: str = ""


@dataclass
class Scope:
    """Part, instance, assembly or flat file, with its nodes, elements, sets and surfaces.

    ``blocks`` are the element sets that are named only on ``*Element`` lines, as programs name
    them. ``facets`` counts the facets that are no elements of the file. ``placing`` maps points
    ``(n, 3)`` to their positions in an instance.
    """

    name: str
    place: SourceLine
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[int, Element] = field(default_factory=dict)
    node_sets: Names[Members] = field(default_factory=Names)
    element_sets: Names[Members] = field(default_factory=Names)
    surfaces: Names[Card] = field(default_factory=Names)
    blocks: set[str] = field(default_factory=set)
    facets: int = 0
    placing: Callable[[Array], Array] = lambda points: points

    def instance(self, name: str, place: SourceLine, placing: Callable[[Array], Array]) -> Scope:
        """Return an instance of this part."""
        return Scope(
            name=name,
            place=place,
            nodes=dict(self.nodes),
            elements=dict(self.elements),
            node_sets=deepcopy(self.node_sets),
            element_sets=deepcopy(self.element_sets),
            surfaces=deepcopy(self.surfaces),
            placing=placing,
        )

    def add_facet(
        self, members: Members, nodes: tuple[int, ...], place: SourceLine, kind: str
    ) -> None:
        """Add a facet that is no element of the file, and has a negative number, to ``members``."""
        self.facets += 1
        shape = FACE_SHAPES[len(nodes)]
        facet = Element(shape, nodes, (), place, kind, stands_alone=False)
        self.elements[-self.facets] = facet
        extend(members, {"": [-self.facets]})

    def is_empty(self) -> bool:
        """Return whether nothing is defined in it."""
        return not (
            self.nodes or self.elements or self.node_sets or self.element_sets or self.surfaces
        )


def resolve(
    place: SourceLine, text: str, kind: str, scope: Scope, instances: Names[Scope]
) -> Members:
    """Return the members that a data line names by number, set name, or ``Instance.`` and either.

    ``kind`` is ``node_sets`` or ``element_sets``.
    """
    text = text.strip('"')
    if re.fullmatch(r"\d+", text):
        return {"": [int(text)]}
    sets: Names[Members] = getattr(scope, kind)
    if text in sets:
        return sets[text]
    # Names may themselves contain dots.
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
    """Return all numbers of ``members``, and of ranges those in ``known``.

    Raises :class:`MeshError` if a single number is not in ``known``.
    """
    numbers: list[int] = []
    for member in members:
        if isinstance(member, range):
            numbers.extend(number for number in member if number in known)
        elif member in known:
            numbers.append(member)
        else:
            raise MeshError(f"{what} names number {member}, which is not defined")
    return numbers
