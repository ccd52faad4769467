"""Resultants of an interface over the increments of a closed cycle, or of a mix of cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Indices, Mask


@dataclass(frozen=True)
class LoadHistory:
    """Resultants of one interface over the increments of a closed cycle, each ``(n,)``.

    A mix of missions holds several closed cycles one after the other.

    Parameters
    ----------
    P, Qx, Qy
        Forces at the end of each increment [N].
    Mx, My, Mz
        Moments at the end of each increment [N mm].
    Edx, Edy
        Energy dissipated in the increment by slip along x and along y [N mm].
    sliding
        Whether the whole contact slides in the increment (gross slip).
    share
        How often each increment occurs per mean cycle; 1 by default.
    block
        Number of the closed cycle that each increment belongs to, from 0.

    Examples
    --------
    A pad under 100 N that slides back and forth by 0.1 mm with µ = 0.5:

    >>> import numpy as np
    >>> from sa_solver import LoadHistory
    >>> P, zero = np.array([100.0, 100.0]), np.zeros(2)
    >>> energy, sliding = 0.5 * P * 0.1, np.array([True, True])
    >>> cycle = LoadHistory(P, 0.5 * P * [1, -1], zero, zero, zero, zero, energy, zero, sliding)
    >>> print(f"{cycle.mean_energy:g} N mm a cycle of {len(cycle)} increments")
    10 N mm a cycle of 2 increments
    >>> mix = LoadHistory.mix([cycle, cycle], shares=[0.9, 0.1])
    >>> print(mix.missions)
    [slice(0, 2, None), slice(2, 4, None)]
    """

    P: Array
    Qx: Array
    Qy: Array
    Mx: Array
    My: Array
    Mz: Array
    Edx: Array
    Edy: Array
    sliding: Mask
    share: Array = field(default_factory=lambda: np.empty(0))
    block: Indices = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def __post_init__(self) -> None:
        if not self.block.size and not self.share.size:
            count = len(checks.array("values of P", self.P, (None,), finite=False))
            checks.settle(self, share=np.ones(count), block=np.zeros(count, dtype=np.int64))
        forces = [f.name for f in fields(self) if f.name not in ("sliding", "share", "block")]
        for name in (*forces, "share"):
            column = checks.array(f"values of {name}", getattr(self, name), (None,), finite=False)
            checks.settle(self, **{name: column})
        sliding: Any = np.asarray(self.sliding)
        if sliding.ndim != 1 or sliding.dtype.kind not in "biuf":
            raise InputError(
                f"LoadHistory.sliding is {checks.shown(self.sliding)}: give True or False for each "
                "increment"
            )
        checks.settle(self, sliding=sliding.astype(bool))
        lengths = {len(getattr(self, f.name)) for f in fields(self)}
        if len(lengths) != 1:
            raise InputError(f"columns of a load history differ in length: {sorted(lengths)}")

    def __len__(self) -> int:
        return len(self.P)

    @classmethod
    def mix(cls, cycles: Sequence[LoadHistory], shares: Sequence[float]) -> LoadHistory:
        """Return a mix of closed ``cycles``, one per mission.

        ``shares`` are the relative frequencies of the cycles, which add up to 1.
        """
        each = checks.array("shares", shares, (len(cycles),))
        if (each < 0.0).any() or not np.isclose(each.sum(), 1.0):
            raise InputError(f"shares {each.tolist()}: give 0 or more, which add up to 1")
        lengths = [len(cycle) for cycle in cycles]
        columns = {
            column.name: np.concatenate([getattr(cycle, column.name) for cycle in cycles])
            for column in fields(cls)
        }
        columns["share"] = np.repeat(each, lengths)
        columns["block"] = np.repeat(np.arange(len(cycles)), lengths)
        return cls(**columns)

    @property
    def resultants(self) -> Array:
        """Resultants P, Qx, Qy, Mx, My and Mz of all increments ``(n, 6)``."""
        return np.stack([self.P, self.Qx, self.Qy, self.Mx, self.My, self.Mz], axis=1)

    @property
    def missions(self) -> list[slice]:
        """Increments of each mission as a slice; a mission is one closed cycle."""
        begins = np.flatnonzero(np.diff(self.block, prepend=-1)).tolist()
        return [slice(*ends) for ends in pairwise([*begins, len(self)])]

    @property
    def mixed(self) -> bool:
        """True if the history has more than one cycle, or shares other than 1."""
        return bool(self.block.any() or np.any(self.share != 1.0))

    @property
    def mean_energy(self) -> float:
        """Energy dissipated per mean cycle [N mm]."""
        return float(self.share @ (self.Edx + self.Edy))
