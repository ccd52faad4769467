"""The places of a vibrating structure by name, and the actions there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fe_models.dynamics.rig import Link
from workflow.analyses.rig.bodies.point_kinds import known, matching
from workflow.analyses.rig.places import Against, Moved
from workflow.errors import EntryError

if TYPE_CHECKING:
    from workflow.models.rig.rig_model import RigModel


class PlaceNames:
    """Points such as ``pad 17`` of displacements ``names`` such as ``pad 17 x``.

    ``known_as`` maps names to those that the structure uses for the same displacement. The ``key``
    of each method is the entry of the case that names the point, for error messages.
    """

    def __init__(self, names: Sequence[str], known_as: Mapping[str, str] | None = None) -> None:
        self.names, self._known_as = tuple(names), known_as or {}
        # Each point once, in order.
        self._points = list(dict.fromkeys(name.rpartition(" ")[0] for name in self.names))

    def of(self, wanted: str, key: str) -> list[str]:
        """Return the point of that name, or all of that kind. Raises EntryError if none exists."""
        found = matching(self._points, wanted)
        if not found:
            raise EntryError(key, f"'{wanted}': no such point; allowed: {known(self._points)}")
        return found

    def names_of(self, point: str) -> list[str]:
        """Return the displacements of a point."""
        return [name for name in self.names if name.rpartition(" ")[0] == point]

    def pairs(self, connection: Against, key: str) -> list[tuple[str, str | None]]:
        """Return pairs of a point and the point against which it moves, None for the ground."""
        points = self.of(connection.points, f"{key}.points")
        if connection.against is None:
            return [(point, None) for point in points]
        opposites = self.of(connection.against, f"{key}.against")
        if len(opposites) == 1:
            opposites *= len(points)
        if len(opposites) != len(points):
            raise EntryError(
                f"{key}.against",
                f"{len(opposites)} points for {len(points)}; allowed: as many, or one",
            )
        for point, opposite in zip(points, opposites, strict=True):
            if point == opposite:
                raise EntryError(
                    f"{key}.against", f"{point} joined to itself; allowed: other points"
                )
        return list(zip(points, opposites, strict=True))

    def links(self, connection: Against, key: str) -> list[Link]:
        """Return the link between each point and the point, or ground, against which it moves."""
        pairs, axis = self.pairs(connection, key), connection.direction[-1]
        for point in (end for pair in pairs for end in pair if end is not None):
            self.moving(point, axis, f"{key}.direction")
        every = (link_along(*pair, connection.direction) for pair in pairs)
        return [Link(self._known(link.second), self._known(link.first)) for link in every]

    def shared(self, moved: Moved, key: str) -> list[tuple[str, float]]:
        """Return displacements along a direction, and the signed even share of each."""
        points, axis = self.of(moved.points, f"{key}.points"), moved.direction[-1]
        sign = -1.0 if moved.direction.startswith("-") else 1.0
        return [
            (self.moving(point, axis, f"{key}.direction"), sign / len(points)) for point in points
        ]

    def moving(self, point: str, axis: str, key: str) -> str:
        """Return the displacement of a point along an axis. Raises EntryError if it has none."""
        name = f"{point} {axis}"
        if name not in self.names:
            axes = [other for other in "xyz" if f"{point} {other}" in self.names]
            raise EntryError(key, f"{point} does not move along {axis}; allowed: {', '.join(axes)}")
        return self._known_as.get(name, name)

    def _known(self, name: str | None) -> str | None:
        return None if name is None else self._known_as.get(name, name)


def place_names_of(rig: RigModel) -> PlaceNames:
    """Return the places of a rig as a case names them: masses in a row move along x."""
    names = [rig.model.names[place] for place in rig.retained]
    return in_a_row(names) if rig.in_a_row else PlaceNames(names)


def in_a_row(masses: Sequence[str]) -> PlaceNames:
    """Return places of masses in a row; each has one displacement, along x, with its name."""
    along = {f"{name} x": name for name in masses}
    return PlaceNames(list(along), along)


def link_along(point: str, opposite: str | None, direction: str) -> Link:
    """Return the link that stretches when a point moves in a direction, away from its opposite.

    The opposite is another point, or the ground (None).
    """
    axis = direction[-1]
    ends = f"{point} {axis}", None if opposite is None else f"{opposite} {axis}"
    return Link(*reversed(ends)) if direction.startswith("-") else Link(*ends)
