"""A body that is one of the like sectors of a ring, as a case gives it."""

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
    """Points of a sector that are points of the next one."""

    points: Title = entry("of the face on which the sector ends, such as right", "right")
    next_points: Title = entry("of the next sector, as many, which they are", "left")


class RingOfSectors(Section):
    """Like sectors in a ring, of which the body is one; a wave travels round them."""

    sectors: Annotated[int, Whole(2, 1000)] = entry(
        "of the ring; the next one meets the force of the engine order later", 24
    )
    axis: Literal["x", "y", "z", "-x", "-y", "-z", "turning"] = entry(
        "about which the next sector is turned, by the right hand, by 360 deg over their number: "
        "x, y, z, -x, -y or -z; or turning: the axes of points turn with their sector, as radial "
        "and tangential ones",
        "turning",
    )
    faces: tuple[CutFace, ...] = entry("on which sectors are cut from each other", default=())

    @property
    def text(self) -> str:
        """The ring in a few words."""
        turned = "" if self._about is None else f", turned about {self._about}"
        return f"one of {self.sectors} sectors{turned}"

    @property
    def _about(self) -> str | None:
        """The axis about which sectors are turned, none of points whose axes turn with them."""
        return None if self.axis == "turning" else self.axis

    def diameters(self, engine_order: int, harmonics: Sequence[int]) -> list[int]:
        """Nodal diameters of harmonics, below zero where the wave travels from the next sector."""
        from fe_models.dynamics.rings.sector import Ring

        return list(map(Ring(self.sectors, engine_order).diameters, harmonics))

    def of_order(self, engine_order: int, names: PlaceNames) -> Ring:
        """The ring under an engine order, of a sector with these places.

        Raises EntryError for faces that do not fit each other.
        """
        from fe_models.dynamics.rings.sector import Ring

        ties: dict[str, str] = {}
        for number, face in enumerate(self.faces):
            key = f"ring.faces.{number}"
            here = names.of(face.points, f"{key}.points")
            there = names.of(face.next_points, f"{key}.next_points")
            if len(here) != len(there):
                raise EntryError(
                    f"{key}.next_points", f"{len(there)} points for {len(here)}; allowed: as many"
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
    """Names of a sector's displacements, and of those of the next that are not its own."""
    return (*names, *(f"{NEXT}{name}" for name in names if name not in ring.ties))
