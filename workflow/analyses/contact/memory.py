"""Memory that a contact case needs."""

from __future__ import annotations

from math import prod

from workflow.analyses.contact.case import BodiesCase
from workflow.shell.memory import Memory

# Numbers per cell: fields kept of a state, with tractions of longer increments to compare with; and
# spectra and iterates during a solve.
STATE_FIELDS, SPECTRA = 13, 300


def memory(case: BodiesCase) -> Memory:
    """Return the memory for the states of all increments."""
    cells = prod(case.contact.centred().shape)
    increments = len(case.load_path.table())
    return Memory(
        cells * (SPECTRA + STATE_FIELDS * increments),
        "lower contact.grid or the increments of load_path",
    )
