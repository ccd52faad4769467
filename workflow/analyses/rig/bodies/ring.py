"""A body that is one of the equal sectors of a ring, as a case gives it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

from workflow.analyses.rig.places import NEXT
from workflow.case.fields import Whole
from workflow.case.sections import Section, Title, entry
from workflow.errors import EntryError

if TYPE_CHECKING:
    from fe_models.dynamics.rings.sector import Ring
    from workflow.analyses.rig.place_names import PlaceNames


class CutFace(Section):
    """Points of a sector that coincide with points of the next one."""

    points: Title = entry("points of the face on which the sector ends, such as right", "right")
    next_points: Title = entry(
        "as many points of the next sector, with which they coincide", "left"
    )


class RingOfSectors(Section):
    """Equal sectors in a ring, of which the body is one; a wave travels round them."""

    sectors: Annotated[int, Whole(2, 1000)] = entry(
        "number of sectors of the ring; each meets the force of the engine order later than "
        "the one before",
        24,
    )
    axis: Literal["x", "y", "z", "-x", "-y", "-z", "turning"] = entry(
        "axis about which the next sector is turned, right-handed, by 360 deg over their number: "
        "x, y, z, -x, -y or -z; or turning: the axes of points turn with their sector (radial "
        "and tangential)",
        "turning",
    )
    faces: tuple[CutFace, ...] = entry("faces between which sectors are cut", default=())

    @property
    def text(self) -> str:
        """Short description of the ring."""
        turned = "" if self._about is None else f", turned about {self._about}"
        return f"one of {self.sectors} sectors{turned}"

    @property
    def _about(self) -> str | None:
        """Axis about which sectors are turned, None if the points' axes turn with their sector."""
        return None if self.axis == "turning" else self.axis

    def diameters(self, engine_order: int, harmonics: Sequence[int]) -> list[int]:
        """Return nodal diameters of harmonics, negative if the wave comes from the next sector."""
        from fe_models.dynamics.rings.sector import Ring

        return list(map(Ring(self.sectors, engine_order).diameters, harmonics))

    def of_order(self, engine_order: int, names: PlaceNames) -> Ring:
        """Return the ring under an engine order, for a sector with these places.

        Raises EntryError for faces that do not match.
        """
        from fe_models.dynamics.rings.sector import Ring

        ties: dict[str, str] = {}
        for number, face in enumerate(self.faces):
            key = f"ring.faces.{number}"
            here = names.of(face.points, f"{key}.points")
            there = names.of(face.next_points, f"{key}.next_points")
            if len(here) != len(there):
                raise EntryError(
                    f"{key}.next_points",
                    f"{len(there)} points for {len(here)}; allowed: as many of both",
                )
            for point, other in zip(here, there, strict=True):
                moving = {name.rpartition(" ")[2] for name in names.names_of(point)}
                if moving != {name.rpartition(" ")[2] for name in names.names_of(other)}:
                    raise EntryError(
                        f"{key}.points",
                        f"{point} does not move as {other} does; allowed: points that move in the "
                        "same directions",
                    )
                ties |= {f"{point} {axis}": f"{other} {axis}" for axis in moving}
        return Ring(self.sectors, engine_order, ties, self._about)


def with_next(names: tuple[str, ...], ring: Ring) -> tuple[str, ...]:
    """Return names of a sector's displacements, and of the next sector's that it does not share."""
    return (*names, *(f"{NEXT}{name}" for name in names if name not in ring.ties))
