"""The structures that may load contacts. A new one is a folder here and a name below."""

from collections.abc import Iterator, Mapping
from typing import Any

from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.structure import WearStructure
from workflow.analyses.wear.structures import bodies, dovetail, mesh, resultants

STRUCTURES: tuple[WearStructure[Any], ...] = (
    dovetail.STRUCTURE,
    mesh.STRUCTURE,
    resultants.STRUCTURE,
    bodies.STRUCTURE,
    bodies.LINE_STRUCTURE,
)


class CasesOfStructures(Mapping[str, type[WearCase]]):
    """Kinds of case by the names of their structures, those registered later included."""

    def __getitem__(self, name: str) -> type[WearCase]:
        return {structure.name: structure.case for structure in STRUCTURES}[name]

    def __iter__(self) -> Iterator[str]:
        return iter(structure.name for structure in STRUCTURES)

    def __len__(self) -> int:
        return len(STRUCTURES)


def structure_of(case: WearCase) -> WearStructure[Any]:
    """The structure of a case."""
    return next(structure for structure in STRUCTURES if structure.case is type(case))
