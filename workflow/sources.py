"""The load source that a wear case asks for."""

from __future__ import annotations

from workflow.bodies_source import BodiesSource
from workflow.case import (
    BodiesWearCase,
    DovetailCase,
    LineBodiesWearCase,
    MeshCase,
    ResultantsCase,
    WearCase,
)
from workflow.dovetail_model import DovetailModel
from workflow.load_source import LoadSource
from workflow.mesh_model import MeshModel
from workflow.resultants.source import ResultantsSource
from workflow.structure_stage import StructureStage


def load_source(case: WearCase) -> LoadSource:
    """Where the loads of the case's contacts come from."""
    if isinstance(case, DovetailCase):
        return StructureStage(DovetailModel(case))
    if isinstance(case, ResultantsCase):
        return ResultantsSource(case)
    if isinstance(case, BodiesWearCase | LineBodiesWearCase):
        return BodiesSource(case)
    assert isinstance(case, MeshCase)
    return StructureStage(MeshModel(case))
