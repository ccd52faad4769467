"""Path of a contact case as a table: a row per increment, a column per given entry."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from sa_solver.types import Array

FORCES = ("P", "Qx", "Qy", "Mx", "My", "Mz")
# Rigid motions conjugate to the forces, in the same order.
MOTIONS = ("approach", "shift_x", "shift_y", "tilt_x", "tilt_y", "twist")
# Forces and motions that only press the bodies together.
PRESSING = ("P", "Mx", "My", "approach", "tilt_x", "tilt_y")


@dataclass(frozen=True)
class LoadTable:
    """Load table: ``columns`` ``(n,)`` by names of ``FORCES``, ``MOTIONS`` and bulk stresses.

    All are in base units. Quantities without a column are forces of 0, or no bulk stress.
    """

    columns: dict[str, Array]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def is_motion(self) -> tuple[bool, ...]:
        """True if the motion is imposed instead of the force, by degree of freedom."""
        return tuple(motion in self.columns for motion in MOTIONS)

    @property
    def imposed(self) -> Array:
        """Force or motion imposed, ``(n, 6)`` in the order of ``FORCES``."""
        pairs = zip(FORCES, MOTIONS, strict=True)
        return np.stack([self[motion] + self[force] for force, motion in pairs], axis=1)

    def __getitem__(self, name: str) -> Array:
        """Return a column ``(n,)``, zeros if there is none of this name."""
        return self.columns.get(name, np.zeros(len(self)))


def ramps(
    targets: Mapping[str, Sequence[float | None]], increments: Sequence[int], closed: bool = False
) -> dict[str, Array]:
    """Return columns that reach their ``targets`` linearly, each in its number of ``increments``.

    They start from 0, or from the last target if the path is ``closed``. Where a target is None the
    value stays. Columns without any target are left out.
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
    """Return entry and message of a conflict among the columns ``named``, None without one."""
    for force, motion in zip(FORCES, MOTIONS, strict=True):
        if force in named and motion in named:
            return motion, f"given together with {force}; allowed: one of them on the whole path"
    if "P" not in named and "approach" not in named:
        return "P", "neither P nor approach is given; allowed: one of them on the whole path"
    return None
