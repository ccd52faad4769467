"""The path of a contact case as a table: a row per increment, a column per entry that is given."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from sa_solver.types import Array

FORCES = ("P", "Qx", "Qy", "Mx", "My", "Mz")
# Rigid motions conjugate to them, in the same order.
MOTIONS = ("approach", "shift_x", "shift_y", "tilt_x", "tilt_y", "twist")
# Those of them that only press.
PRESSING = ("P", "Mx", "My", "approach", "tilt_x", "tilt_y")


@dataclass(frozen=True)
class LoadTable:
    """``columns`` ``(n,)`` by the names of ``FORCES``, ``MOTIONS`` and the two bulk stresses.

    In base units. What is not named is a force of 0, or no bulk stress.
    """

    columns: dict[str, Array]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def is_motion(self) -> tuple[bool, ...]:
        """Whether the motion is imposed instead of the force, by degree of freedom."""
        return tuple(motion in self.columns for motion in MOTIONS)

    @property
    def imposed(self) -> Array:
        """Force or motion imposed, ``(n, 6)`` in the order of ``FORCES``."""
        pairs = zip(FORCES, MOTIONS, strict=True)
        return np.stack([self[motion] + self[force] for force, motion in pairs], axis=1)

    def __getitem__(self, name: str) -> Array:
        """A column ``(n,)``, zeros if it is not named."""
        return self.columns.get(name, np.zeros(len(self)))


def ramps(
    targets: Mapping[str, Sequence[float | None]], increments: Sequence[int], closed: bool = False
) -> dict[str, Array]:
    """Columns that reach their ``targets`` linearly, each in its number of ``increments``.

    From 0, or from where the last of them leads if the path is ``closed``; where a target is None
    the value stays. Columns without any target are left out.
    """
    columns = {}
    for name, ends in targets.items():
        given = [end for end in ends if end is not None]
        if not given:
            continue
        start = given[-1] if closed else 0.0
        reached = accumulate(ends, lambda value, end: value if end is None else end, initial=start)
        steps = zip(pairwise(reached), increments, strict=True)
        columns[name] = np.concatenate([np.linspace(*leg, count + 1)[1:] for leg, count in steps])
    return columns


def conflict(named: Container[str]) -> tuple[str, str] | None:
    """The entry to look at and what is wrong with the columns ``named``, if anything is."""
    for force, motion in zip(FORCES, MOTIONS, strict=True):
        if force in named and motion in named:
            return motion, f"given beside {force}; allowed: one of them on the whole path"
    if "P" not in named and "approach" not in named:
        return "P", "neither P nor approach is given; allowed: one of them on the whole path"
    return None
