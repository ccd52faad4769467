"""Memory a run needs, held against what there is before anything large is allocated."""

from __future__ import annotations

from dataclasses import dataclass

from fe_models.solvers.memory import available_bytes as _available_bytes
from workflow.errors import OutOfMemory

BYTES = 8
"""Of a number."""

# Meshes, plots and the interpreter with its libraries.
REST = 1.2e9
# Sparse factors of a structure with this many nodes took this much; they grow with this power.
FACTOR_BYTES, FACTOR_NODES, FACTOR_POWER = 3.5e9, 1e5, 1.4


@dataclass(frozen=True)
class Memory:
    """Upper estimate of the ``numbers`` that a run keeps, and of other ``bytes``.

    ``remedy`` is what makes such a case smaller.
    """

    numbers: float
    remedy: str
    bytes: float = 0.0

    @property
    def required(self) -> float:
        """Bytes of all."""
        return BYTES * self.numbers + self.bytes + REST

    def check(self) -> None:
        """Raise :class:`OutOfMemory` if the machine has less."""
        required, available = self.required, _available_bytes()
        if required > available:
            raise OutOfMemory(
                f"this case needs about {required / 1e9:.1f} GB of memory, {available / 1e9:.1f} "
                f"GB are free: {self.remedy}"
            )


def factor_bytes(nodes: int) -> float:
    """Of the sparse factors of a structure with so many nodes."""
    return float(FACTOR_BYTES * (nodes / FACTOR_NODES) ** FACTOR_POWER)
