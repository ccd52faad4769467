"""Run time of a contact case."""

from __future__ import annotations

from math import prod

from workflow.analyses.contact.case import BodiesCase
from workflow.shell.run_time import FRICTIONAL, RunTime, solves

# Solves per increment that matters: in one part and in two. Between similar bodies only the ends of
# legs matter, in one part and in four.
IN_TWO, IN_FOUR = 3, 5


def run_time(case: BodiesCase) -> RunTime:
    """Return the time of all increments that matter, split once."""
    cells, materials, path = prod(case.contact.centred().shape), case.materials, case.load_path
    count = IN_TWO * len(path.table())
    if materials.body_1 == materials.body_2 and path.legs and case.contact.history != "full":
        count = min(count, IN_FOUR * len(path.legs))
    return RunTime(course=solves(count, cells, FRICTIONAL))
