"""Memory estimate of a run, compared with the free memory before anything large is allocated."""

from __future__ import annotations

from dataclasses import dataclass

from fe_models.solvers.memory import available_bytes as _available_bytes
from workflow.errors import OutOfMemory

BYTES = 8
"""Size of a number in bytes."""

# Bytes for meshes, plots and the interpreter with its libraries.
REST = 1.2e9
# Measured bytes of the sparse factors of a structure with FACTOR_NODES nodes, and their growth
# exponent.
FACTOR_BYTES, FACTOR_NODES, FACTOR_POWER = 3.5e9, 1e5, 1.4


@dataclass(frozen=True)
class Memory:
    """Upper estimate of the ``numbers`` that a run stores, and of other ``bytes``.

    ``remedy`` says how such a case can be made smaller.
    """

    numbers: float
    remedy: str
    bytes: float = 0.0

    @property
    def required(self) -> float:
        """Total memory [bytes]."""
        return BYTES * self.numbers + self.bytes + REST

    @property
    def fits(self) -> bool:
        """True if the machine has as much free memory."""
        return self.required <= _available_bytes()

    def check(self) -> None:
        """Raise :class:`OutOfMemory` if the machine has less free memory."""
        required, available = self.required, _available_bytes()
        if required > available:
            raise OutOfMemory(
                f"this case needs about {required / 1e9:.1f} GB of memory, {available / 1e9:.1f} "
                f"GB are free: {self.remedy}"
            )


def factor_bytes(nodes: int) -> float:
    """Return the memory of the sparse factors of a structure with this number of nodes [bytes]."""
    return float(FACTOR_BYTES * (nodes / FACTOR_NODES) ** FACTOR_POWER)
