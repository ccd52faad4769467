"""Two bodies of a mesh or CAD file of the user's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from workflow.analyses.wear.run_time import DISSIPATING, Extent
from workflow.analyses.wear.structure import SETTINGS, WearStructure
from workflow.analyses.wear.structures.mesh.case import MeshCase

if TYPE_CHECKING:
    from workflow.analyses.wear.budget.companions import Companions
    from workflow.analyses.wear.load_source import LoadSource


def _source(case: MeshCase) -> LoadSource:
    # Finite elements take a second to load: where they are used.
    from workflow.analyses.wear.structure_stage import StructureStage
    from workflow.analyses.wear.structures.mesh.model import MeshModel

    return StructureStage(MeshModel(case))


def _extent(case: MeshCase) -> Extent:
    """As the file has it, which a check reads anyway."""
    mesh, path = case.structure.mesh(), case.load_path
    cycles = max(1, len(path.mix))
    return Extent(
        cycles * sum(path.increments[path.cycle_from - 1 :]),
        len(mesh.interfaces),
        mesh.body_1.mesh.nvertices + mesh.body_2.mesh.nvertices,
        sum(len(interface) for interface in mesh.interfaces),
        dissipating=DISSIPATING,
    )


def _companions(case: MeshCase) -> Companions[MeshCase]:
    from workflow.analyses.wear.structures.mesh.companions import companions

    return companions(case)


STRUCTURE = WearStructure(
    name="mesh",
    case=MeshCase,
    source=_source,
    extent=_extent,
    companions=_companions,
    settings=SETTINGS | {"mesh": "structure.order or a finer mesh"},
)
