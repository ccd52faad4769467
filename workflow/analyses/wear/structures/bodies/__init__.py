"""Two bodies without a structure, one sliding to and fro on the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from workflow.analyses.wear.run_time import Extent
from workflow.analyses.wear.structure import WearStructure
from workflow.analyses.wear.structures.bodies.case import BodiesWearCase, LineBodiesWearCase

if TYPE_CHECKING:
    from workflow.analyses.wear.load_source import LoadSource


def _source(case: BodiesWearCase | LineBodiesWearCase) -> LoadSource:
    from workflow.analyses.wear.structures.bodies.source import BodiesSource

    return BodiesSource(case)


def _extent(case: BodiesWearCase | LineBodiesWearCase) -> Extent:
    """Every increment of the way there and back dissipates."""
    path = case.load_path
    return Extent(2 * path.increments, path=2.0 * path.stroke)


STRUCTURE = WearStructure(name="bodies_wear", case=BodiesWearCase, source=_source, extent=_extent)
LINE_STRUCTURE = WearStructure(
    name="line_wear", case=LineBodiesWearCase, source=_source, extent=_extent
)
