"""Boundaries and node sets named by loads, supports and contacts of Nastran bulk data."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fe_models.readers.grouped import DIMENSION, FACES
from fe_models.readers.nastran.cards import BulkEntry
from fe_models.readers.scope import Element, Scope, extend


class Groups:
    """Adds the groups that entries name to a scope whose elements are known.

    Facets that are not elements of the file have negative numbers.
    """

    def __init__(self, scope: Scope) -> None:
        self.scope = scope
        self._handlers: dict[str, Callable[[BulkEntry], None]] = {
            "SPC1": self._held,
            "SPC": self._held_singly,
            "FORCE": self._forced,
            "MOMENT": self._forced,
            "BSURF": self._surface,
            "BSURFS": self._surface_of_solids,
            "PLOAD4": self._pressed,
        }

    def read(self, entry: BulkEntry) -> None:
        """Read an entry if it names a group."""
        if entry.name in self._handlers:
            self._handlers[entry.name](entry)

    def _held(self, entry: BulkEntry) -> None:
        self._nodes(held_name(entry.text(0), entry.text(1)), _listed(entry, 2))

    def _held_singly(self, entry: BulkEntry) -> None:
        for first in (1, 4):
            if entry.text(first):
                name = held_name(entry.text(0), entry.text(first + 1))
                self._nodes(name, [entry.whole(first)])

    def _forced(self, entry: BulkEntry) -> None:
        self._nodes(f"{entry.name.lower()}_{entry.text(0)}", [entry.whole(1)])

    def _surface(self, entry: BulkEntry) -> None:
        for element in self._elements(_listed(entry, 1)):
            self._facet(entry, element.nodes)

    def _surface_of_solids(self, entry: BulkEntry) -> None:
        for first in range(4, len(entry.fields), 4):
            if entry.text(first):
                corners = [entry.whole(first + k) for k in (1, 2, 3)]
                self._facet(entry, self._face(entry, entry.whole(first), corners))

    def _pressed(self, entry: BulkEntry) -> None:
        """Add the face of a solid, given by its corners, or shells themselves."""
        numbers: list[int | range] = [entry.whole(1)]
        corners = []
        if entry.text(6).upper() == "THRU":
            numbers = [range(entry.whole(1), entry.whole(7) + 1)]
        else:
            corners = [entry.whole(k) for k in (6, 7) if entry.text(k)]
        for element in self._elements(numbers):
            self._facet(entry, _loaded(entry, element, corners))

    def _nodes(self, name: str, members: list[int | range]) -> None:
        if not name.endswith("_"):  # Ignore rotations alone, which solids do not have.
            extend(self.scope.node_sets.add(name, {}), {"": members})

    def _elements(self, numbers: list[int | range]) -> Iterator[Element]:
        """Yield the elements among the numbers that are read."""
        for number in numbers:
            for one in [number] if isinstance(number, int) else number:
                if one in self.scope.elements:
                    yield self.scope.elements[one]

    def _face(self, entry: BulkEntry, number: int, corners: list[int]) -> tuple[int, ...]:
        """Return the face of an element that has the corners."""
        if number not in self.scope.elements:
            raise entry.wrong(f"element {number} is not defined")
        found = [f for f in _faces(self.scope.elements[number]) if set(corners) <= set(f)]
        if len(found) != 1:
            raise entry.wrong(f"nodes {corners} are on no face of element {number}")
        return found[0]

    def _facet(self, entry: BulkEntry, nodes: tuple[int, ...]) -> None:
        members = self.scope.element_sets.add(f"{entry.name.lower()}_{entry.text(0)}", {})
        self.scope.add_facet(members, nodes, entry.place, entry.name)


def held_name(number: str, components: str) -> str:
    """Return the name of the nodes that a set of constraints holds along some components."""
    return f"spc_{number}_{axes_of(components)}"


def axes_of(components: str) -> str:
    """Return the axes of the translations 1 to 3 among components."""
    return "".join(axis for axis, number in zip("xyz", "123", strict=True) if number in components)


def _loaded(entry: BulkEntry, element: Element, corners: list[int]) -> tuple[int, ...]:
    """Return the corners of the face of an element on which a pressure acts.

    For a tetrahedron the second given corner is off the face. A quadrilateral is given by two
    opposite corners, the triangle of a wedge by one.
    """
    if DIMENSION[element.shape] == 2:
        return element.nodes
    faces = _faces(element)
    if element.shape == "tetra" and len(corners) == 2:
        found = [face for face in faces if corners[0] in face and corners[1] not in face]
    elif len(corners) == 1:
        found = [face for face in faces if corners[0] in face and len(face) == 3]
    else:
        found = [face for face in faces if corners and set(corners) <= set(face)]
        found = [face for face in found if len(face) == 4] or found
    if len(found) != 1:
        raise entry.wrong(f"its grid points name no face of element {entry.text(1)}")
    return found[0]


def _faces(element: Element) -> list[tuple[int, ...]]:
    return [tuple(element.nodes[k] for k in face) for face in FACES[element.shape]]


def _listed(entry: BulkEntry, first: int) -> list[int | range]:
    """Return the numbers from a field on, or a range ``a THRU b``."""
    if entry.text(first + 1).upper() == "THRU":
        return [range(entry.whole(first), entry.whole(first + 2) + 1)]
    return [entry.whole(k) for k in range(first, len(entry.fields)) if entry.text(k)]
