"""Two bodies of a mesh or CAD file of the user's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from workflow.analyses.wear.structure import WearStructure
from workflow.analyses.wear.structures.mesh.case import MeshCase

if TYPE_CHECKING:
    from workflow.analyses.wear.load_source import LoadSource


def _source(case: MeshCase) -> LoadSource:
    # Finite elements take a second to load: where they are used.
    from workflow.analyses.wear.structure_stage import StructureStage
    from workflow.analyses.wear.structures.mesh.model import MeshModel

    return StructureStage(MeshModel(case))


STRUCTURE = WearStructure(name="mesh", case=MeshCase, source=_source)
