"""Memory that a case of specimens needs."""

from __future__ import annotations

from math import prod

from workflow.analyses.specimens.case import SpecimensCase
from workflow.shell.memory import Memory, factor_bytes

# Dense matrices of the pads at once; spectra and iterates of the half-space per cell.
DENSE_MATRICES, SPECTRA = 6, 300


def memory(case: SpecimensCase, nodes: int = 0) -> Memory:
    """Return the memory for both specimens, each with a number of ``nodes`` once it is known."""
    pad = 3 * (case.mesh.pad_elements + 1) ** 2
    fields = prod(case.contact.grid) * SPECTRA + DENSE_MATRICES * pad**2
    return Memory(
        fields + 2 * pad * nodes,
        "lower mesh.pad_elements, mesh.order or contact.grid, or raise mesh.size",
        factor_bytes(nodes),
    )
