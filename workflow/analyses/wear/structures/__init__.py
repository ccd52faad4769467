"""Structures that may load contacts. A new one is a folder here and a name below."""

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


def structure_of(case: WearCase) -> WearStructure[Any]:
    """Return the kind of structure of a case."""
    return next(structure for structure in STRUCTURES if structure.case is type(case))
