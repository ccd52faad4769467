"""Two bodies without a structure, one sliding to and fro on the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from workflow.analyses.wear.structure import WearStructure
from workflow.analyses.wear.structures.bodies.case import BodiesWearCase, LineBodiesWearCase

if TYPE_CHECKING:
    from workflow.analyses.wear.load_source import LoadSource


def _source(case: BodiesWearCase | LineBodiesWearCase) -> LoadSource:
    from workflow.analyses.wear.structures.bodies.source import BodiesSource

    return BodiesSource(case)


STRUCTURE = WearStructure(name="bodies_wear", case=BodiesWearCase, source=_source)
LINE_STRUCTURE = WearStructure(name="line_wear", case=LineBodiesWearCase, source=_source)
