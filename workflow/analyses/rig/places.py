"""Places of a vibrating structure, as a case names them."""

from __future__ import annotations

from typing import Literal

from workflow.case.sections import Section, Title, entry

NAMED = "m1, m2, ... of a rig; of a reduced body one kept point, such as pad 17, or all of a kind"
# Prefix of points of the next sector of a ring, as in the library.
NEXT = "next "
Direction = Literal["x", "y", "z", "-x", "-y", "-z"]


class KeptPoints(Section):
    """Kept points of a reduced body."""

    points: Title = entry("one point, such as pad 17, or all of a kind, such as pad", "pad")


class Moved(KeptPoints):
    """Kept points of a reduced body, and a direction."""

    direction: Direction = entry("x, y, z, -x, -y or -z", "x")


class Against(Moved):
    """A connection of kept points with others or with the ground."""

    against: Title | None = entry(
        "other points, as many, or one for all; of a ring's sector also those of the next, as "
        "next tip; without it the ground",
        "ring 1",
        default=None,
    )
