"""Loads and slips of one contact face over a closed cycle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sa_solver import checks
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array


class FaceLoads(Protocol):
    """Protocol of the loads and slips of one face over a cycle, by its nodes.

    ``slip`` is ``(t, 2, n)`` [mm], ``force`` on body 2 ``(t, 3, n)`` [N], and ``displacement``
    ``(t, 3, n)`` [mm] that of body 2 relative to body 1 since both were unloaded. Force and
    displacement are None where they are unknown.
    """

    @property
    def loads(self) -> LoadHistory: ...
    @property
    def slip(self) -> Array: ...
    @property
    def force(self) -> Array | None: ...
    @property
    def displacement(self) -> Array | None: ...


@dataclass(frozen=True)
class CycleLoads:
    """Loads and slips of one contact face of ``n`` nodes over ``t`` increments of a closed cycle.

    Parameters
    ----------
    loads
        Resultants of the face.
    slip
        Slip of the nodes in each increment ``(t, 2, n)`` [mm].
    force
        Nodal forces on body 2 ``(t, 3, n)`` [N], if known.
    displacement
        Displacement of body 2 relative to body 1 since both were unloaded ``(t, 3, n)`` [mm], if
        known.

    Examples
    --------
    A cell under 100 N slides forward and backward by 0.05 mm:

    >>> import numpy as np
    >>> from sa_solver import LoadHistory
    >>> from wear import ConstantLoads, CycleLoads
    >>> P, zero, slip = np.full(2, 100.0), np.zeros(2), np.zeros((2, 2, 1))
    >>> slip[:, 0, 0] = 0.05, -0.05
    >>> loads = LoadHistory(P, *[zero] * 7, sliding=np.full(2, True))
    >>> cycle = CycleLoads(loads, slip)
    >>> print(np.abs(cycle.slip).sum(), ConstantLoads([cycle]).probe([])[0, 0])
    0.1 100.0
    """

    loads: LoadHistory
    slip: Array
    force: Array | None = None
    displacement: Array | None = None

    def __post_init__(self) -> None:
        increments, places = len(self.loads), np.shape(self.slip)[2:] or (None,)
        checks.settle(self, slip=checks.array("slips", self.slip, (increments, 2, *places)))
        for name in ("force", "displacement"):
            field = getattr(self, name)
            if field is not None:
                field = checks.array(f"{name}s", field, (increments, 3, *places))
                checks.settle(self, **{name: field})
