"""A kind of structure that loads contacts, with the functions that the wear analysis needs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.run_time import Extent
from workflow.messages.warning_kinds import Notice
from workflow.shell.analysis import as_written
from workflow.shell.memory import Memory, factor_bytes

if TYPE_CHECKING:
    from workflow.models.contact import FaceContact
    from workflow.models.wear import Structure

AnyWearCase = TypeVar("AnyWearCase", bound=WearCase)

# Numbers per cell that are held during a contact solve, for spectra and iterates.
SPECTRA = 300
# Number of dense interface matrices that are held while a joint is condensed.
DENSE_MATRICES = 6


def memory(
    case: WearCase,
    nodes: int = 0,
    interface_nodes: int = 0,
    kept: int = SPECTRA,
    remedy: str = "lower contact.grid",
    matrices: int = DENSE_MATRICES,
) -> Memory:
    """Return the memory of the contacts and of a structure condensed onto its interfaces.

    ``nodes`` and ``interface_nodes`` are 0 while they are unknown. ``kept`` is the count of numbers
    per cell of the grid, by default that of one contact at a time; ``matrices`` is the number of
    dense interface matrices held at once.
    """
    dense = matrices * (3 * interface_nodes) ** 2
    cells = max(prod(terms.grid) for terms in case.every_terms)
    return Memory(dense + cells * kept, remedy, factor_bytes(nodes))


@dataclass(frozen=True)
class WearStructure(Generic[AnyWearCase]):
    """A kind of structure: functions of a case that a wear run calls.

    ``case`` is the class of its cases. ``model`` returns the structure of a case, or another source
    of loads. ``extent`` returns the size of its loads, for the time estimate, and ``memory`` the
    memory of a run, given the nodes of both bodies and of all interfaces (0: unknown). ``choose``
    returns the case with its open settings decided, and a record of why. ``warnings`` are about the
    unworn contact of a stage under a peak load [N]. ``settings`` returns the settings that reduce
    parts of the error, where they differ from those of all cases.
    """

    name: str
    case: type[AnyWearCase]
    model: Callable[[AnyWearCase], Structure]
    extent: Callable[[AnyWearCase], Extent]
    memory: Callable[[AnyWearCase, int, int], Memory] = memory
    choose: Callable[[AnyWearCase], tuple[AnyWearCase, dict[str, Any] | None]] = as_written
    warnings: Callable[[AnyWearCase, FaceContact, float], Iterable[Notice]] = lambda *_: ()
    settings: Callable[[AnyWearCase], Mapping[str, str]] = lambda _: {}
