"""A kind of structure that loads contacts, as the wear analysis knows it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.run_time import Extent
from workflow.shell.analysis import as_written
from workflow.shell.memory import Memory, factor_bytes

if TYPE_CHECKING:
    from wear.contact.interface import InterfaceState
    from wear.contact.tractions import CycleTractions
    from workflow.models.contact import FaceContact
    from workflow.models.loads import LoadSource
    from workflow.models.structure import StructureModel

AnyWearCase = TypeVar("AnyWearCase", bound=WearCase)

# Spectra and iterates alive during a contact solve, per cell.
SPECTRA = 300
# Dense interface matrices alive at once while a joint is condensed.
DENSE_MATRICES = 6

# What makes each part of the error of a run smaller; that of steps, and of loads that follow late,
# depends on what they are (workflow.analyses.wear.run_errors).
SETTINGS = {
    "link": "the mesh of the contact faces",
    "mesh": "the mesh of the structure",
    "increments": "load_path.increments",
    "grid": "contact.grid",
    "solver": "contact.tolerance",
}


def memory(
    case: WearCase,
    nodes: int = 0,
    interface_nodes: int = 0,
    kept: int = SPECTRA,
    remedy: str = "lower contact.grid",
    matrices: int = DENSE_MATRICES,
) -> Memory:
    """Of the contacts, and of a structure condensed onto its interfaces.

    The structure has so many nodes, and its interfaces so many, once they are known; numbers
    ``kept`` per cell of the grid are those of one contact at a time unless given; so many dense
    ``matrices`` of the interfaces are alive at once.
    """
    dense = matrices * (3 * interface_nodes) ** 2
    cells = max(prod(terms.grid) for terms in case.every_terms)
    return Memory(dense + cells * kept, remedy, factor_bytes(nodes))


@dataclass(frozen=True)
class Finer(Generic[AnyWearCase]):
    """A finer mesh, to tell what that of a case leaves: so large a ``share`` of the difference.

    ``mesh`` are its entries, in the case or in a ``section`` in the plane that stands for it.
    """

    mesh: Mapping[str, Any]
    share: float = 1.0
    section: AnyWearCase | None = None


def no_cycles(case: WearCase, state: InterfaceState) -> None:
    """Nobody knows the loads between two increments, or slips that friction would find."""


@dataclass(frozen=True)
class WearStructure(Generic[AnyWearCase]):
    """What a wear run needs to know of a kind of structure.

    ``case`` is the kind of case that has it, ``model`` gives the structure that it describes, or
    another source of loads, ``extent``
    how many they are, by which the time of a run is told, and ``memory`` what a run needs, given
    the nodes of both bodies and of all interfaces (0: unknown). ``choose`` gives the case with the
    settings that it leaves open, and a record of why; ``warnings`` are about the unworn contact of
    a stage under a peak load [N]. ``finer`` gives a finer mesh, if there is one that is cheap.
    ``finer_cycles`` gives the unworn cycle and that on the surfaces of a state in twice as many
    increments, where it is known what loads are in between and the half-space finds the slips.
    ``settings`` of a case say what makes parts of the error smaller, if not :data:`SETTINGS`.
    """

    name: str
    case: type[AnyWearCase]
    model: Callable[[AnyWearCase], StructureModel | LoadSource]
    extent: Callable[[AnyWearCase], Extent]
    memory: Callable[[AnyWearCase, int, int], Memory] = memory
    choose: Callable[[AnyWearCase], tuple[AnyWearCase, dict[str, Any] | None]] = as_written
    warnings: Callable[[AnyWearCase, FaceContact, float], Iterable[str]] = lambda *_: ()
    finer: Callable[[AnyWearCase], Finer[AnyWearCase] | None] = lambda _: None
    finer_cycles: Callable[[AnyWearCase, InterfaceState], list[CycleTractions] | None] = no_cycles
    settings: Callable[[AnyWearCase], Mapping[str, str]] = lambda _: {}

    def source(self, case: AnyWearCase) -> LoadSource:
        """Return the loads of the contacts of a case."""
        model = self.model(case)
        if not hasattr(model, "meshed"):
            return model
        # Finite elements take a second to load: where they are used.
        from workflow.analyses.wear.translation import structure_loads

        return structure_loads(case, lambda _: cast("StructureModel", model))
