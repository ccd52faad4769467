"""Loads of a contact from files of another FE code, and worn surfaces back to its nodes.

``RECIPE.md`` in this folder explains columns, units and signs, and how to export them from Abaqus
and Ansys.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from workflow.analyses.wear.run_time import DISSIPATING, Extent
from workflow.analyses.wear.structure import WearStructure
from workflow.analyses.wear.structures.resultants.case import ResultantsCase

if TYPE_CHECKING:
    from workflow.models.uncoupled.given_loads import GivenLoads


def _model(case: ResultantsCase) -> GivenLoads:
    from workflow.analyses.wear.structures.resultants.model import given_loads

    return given_loads(case)


def _extent(case: ResultantsCase) -> Extent:
    loads = case.loads()
    increments = len(next(iter(loads.values())).loads)
    return Extent(increments, len(loads), dissipating=DISSIPATING)


STRUCTURE = WearStructure(
    name="resultants",
    case=ResultantsCase,
    model=_model,
    extent=_extent,
    settings=lambda _: {
        "link": "displacements of the nodes in structure.file",
        "mesh": "the mesh that structure.file comes from",
        "increments": "more increments in structure.file",
    },
)
