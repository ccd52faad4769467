"""Two bodies without a structure, under a cycle of forces and motions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from workflow.analyses.wear.run_time import Extent
from workflow.analyses.wear.structure import WearStructure
from workflow.analyses.wear.structures.bodies.case import (
    SHIFTS,
    BodiesWearCase,
    LineBodiesWearCase,
)

if TYPE_CHECKING:
    from workflow.analyses.wear.load_source import LoadSource

# Path of slip in a cycle of a contact that forces shear, to tell about how long it takes [mm].
PARTIAL_SLIP = 5e-3


def _source(case: BodiesWearCase | LineBodiesWearCase) -> LoadSource:
    from workflow.analyses.wear.structures.bodies.source import BodiesSource

    return BodiesSource(case)


def _extent(case: BodiesWearCase | LineBodiesWearCase) -> Extent:
    """Every increment of the cycle may dissipate."""
    table = case.load_path.table()
    steps = [table[name] - np.roll(table[name], 1) for name in SHIFTS]
    path = float(np.hypot(*steps).sum())
    return Extent(len(table), path=path or PARTIAL_SLIP)


STRUCTURE = WearStructure(name="bodies_wear", case=BodiesWearCase, source=_source, extent=_extent)
LINE_STRUCTURE = WearStructure(
    name="line_wear", case=LineBodiesWearCase, source=_source, extent=_extent
)
