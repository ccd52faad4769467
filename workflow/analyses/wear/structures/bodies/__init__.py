"""Two bodies without a structure, under a cycle of forces and motions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from workflow.analyses.wear.run_time import Extent
from workflow.analyses.wear.structure import WearStructure
from workflow.analyses.wear.structures.bodies.case import (
    BodiesWearCase,
    LineBodiesWearCase,
    TwoBodiesWearCase,
)
from workflow.models.uncoupled.load_table import SHIFTS

if TYPE_CHECKING:
    from workflow.models.uncoupled.body_pair import BodyPair

# Slip path in a cycle of a contact under shear forces, for the estimate of run times [mm].
PARTIAL_SLIP = 5e-3
# Typical number of increments after splitting: two legs of one, to 2 %, took 8 to 64.
SPLIT_INTO = 32


def _model(case: TwoBodiesWearCase) -> BodyPair:
    from workflow.analyses.wear.structures.bodies.model import body_pair

    return body_pair(case)


def _extent(case: TwoBodiesWearCase) -> Extent:
    """Return the extent of the cycle: all increments may dissipate, and forces split them."""
    table = case.load_path.table()
    steps = [table[name] - np.roll(table[name], 1) for name in SHIFTS]
    path = float(np.hypot(*steps).sum())
    increments = len(table)
    if case.splits and not path:
        increments = max(increments, SPLIT_INTO)
    return Extent(increments, path=path or PARTIAL_SLIP)


def _choose(
    case: TwoBodiesWearCase,
) -> tuple[TwoBodiesWearCase, dict[str, Any] | None]:
    if not case.splits:
        return case, None
    from workflow.analyses.wear.structures.bodies.increments import choose_parts

    return choose_parts(case)


STRUCTURE, LINE_STRUCTURE = (
    WearStructure(
        name=name,
        case=case,
        model=_model,
        extent=_extent,
        choose=_choose,
        settings=lambda _: {"increments": "contact.accuracy, or the increments of load_path"},
    )
    for name, case in (("bodies_wear", BodiesWearCase), ("line_wear", LineBodiesWearCase))
)
