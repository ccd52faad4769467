"""What one contact face carries over a closed cycle, whoever knows it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from sa_solver.types import Array, LoadHistory


class FaceLoads(Protocol):
    """What one face carries over a cycle: ``slip`` ``(t, 2, n)`` [mm] is that of its nodes.

    So are ``force`` ``(t, 3, n)`` on body 2 [N] and ``displacement`` ``(t, 3, n)`` [mm] of body 2
    relative to body 1 since both were unloaded, None where nobody knows them.
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
    """The same as plain data."""

    loads: LoadHistory
    slip: Array
    force: Array | None = None
    displacement: Array | None = None
