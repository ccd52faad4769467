"""Loads of a contact as files: from another FE code in, and worn surfaces back to its nodes.

Columns, units, signs and how to get them out of Abaqus and Ansys: ``RECIPE.md`` beside this file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from workflow.analyses.wear.run_time import DISSIPATING, Extent
from workflow.analyses.wear.structure import WearStructure
from workflow.analyses.wear.structures.resultants.case import ResultantsCase

if TYPE_CHECKING:
    from workflow.models.loads import LoadSource


def _source(case: ResultantsCase) -> LoadSource:
    from workflow.analyses.wear.structures.resultants.source import ResultantsSource

    return ResultantsSource(case)


def _extent(case: ResultantsCase) -> Extent:
    loads = case.loads()
    increments = len(next(iter(loads.values())).loads)
    return Extent(increments, len(loads), dissipating=DISSIPATING)


STRUCTURE = WearStructure(
    name="resultants",
    case=ResultantsCase,
    model=_source,
    extent=_extent,
    settings=lambda _: {
        "link": "displacements of the nodes in structure.file",
        "mesh": "the mesh that structure.file comes from",
        "increments": "more increments in structure.file",
    },
)
