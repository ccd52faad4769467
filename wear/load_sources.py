"""Sources of the loads and slips of all contacts over a closed cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sa_solver.ties import first_largest
from sa_solver.types import Array
from wear.contact.face_loads import FaceLoads


class CycleSource(Protocol):
    """Protocol of a source of loads and slips of every contact over one closed cycle.

    Worn depths are nodal, ``(n,)`` per contact, of both bodies together [mm]. Coefficients of
    friction are one per contact; None stands for the coefficients before any wear.
    """

    def worn(
        self, depths: list[Array], friction: Sequence[float] | None = None
    ) -> Sequence[FaceLoads]:
        """Solve the closed cycle with worn faces."""
        ...

    def probe(self, depths: list[Array], friction: Sequence[float] | None = None) -> Array:
        """Return cheap resultants ``(contacts, 6)`` that change with wear as those of the cycle do.

        A source without anything better returns the resultants at peak load.
        """
        ...


@dataclass(frozen=True)
class ConstantLoads:
    """A source of loads that wear does not change, given as one of ``histories`` per contact.

    Examples
    --------
    The source returns the same cycle whatever has been worn:

    >>> import numpy as np
    >>> from sa_solver import LoadHistory
    >>> from wear import ConstantLoads, CycleLoads
    >>> P, zero = np.array([50.0, 100.0]), np.zeros(2)
    >>> cycle = CycleLoads(LoadHistory(P, *[zero] * 7, sliding=zero == 0.0), np.zeros((2, 2, 1)))
    >>> source = ConstantLoads([cycle])
    >>> print(source.worn([np.full(1, 0.01)])[0] is cycle, source.probe([])[0, 0])
    True 100.0
    """

    histories: Sequence[FaceLoads]

    def worn(
        self, depths: list[Array], friction: Sequence[float] | None = None
    ) -> Sequence[FaceLoads]:
        return self.histories

    def probe(self, depths: list[Array], friction: Sequence[float] | None = None) -> Array:
        """Return the resultants of each contact at its largest load."""
        return np.array([h.loads.resultants[first_largest(h.loads.P)] for h in self.histories])
