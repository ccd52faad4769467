"""Choice of the cheapest model that meets the accuracy of a case (``fidelity: auto``).

Settings are decided one after the other, each on the case with the earlier decisions applied and
each with its share of the accuracy. The error of two dimensions is subtracted first; the rest is
divided among the other approximations (:data:`SHARES`).
"""

from __future__ import annotations

import time
from typing import Any

from workflow.analyses.wear.approximations.approximation import Approximation, entry_at
from workflow.analyses.wear.approximations.registry import APPROXIMATIONS
from workflow.analyses.wear.choice import Decision, record_of
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.case.changing import changed
from workflow.models.budget.probe_runs import FAILURES
from workflow.models.dovetail import FEW_INCREMENTS

# Largest share of the accuracy that two dimensions may use: other approximations need the rest.
MOST_FOR_DIMENSION = 0.9
# Approximations in the order of their decisions, and their shares of the error, which add up to 1:
# the errors are assumed to have the same sign. Shares are large where accuracy is costly: the cost
# of increments and wear steps grows with the root of 1 / error, that of meshes in space with the
# fourth power of this root.
SHARES = {
    "increments": 0.18,
    "mesh": 0.38,
    "grid": 0.12,
    "tolerance": 0.02,
    "stepper": 0.18,
    "coupling": 0.12,
}


def choose(case: DovetailCase) -> tuple[DovetailCase, dict[str, Any]]:
    """Return the case to run, and a record of the choices and their reasons."""
    begin = time.perf_counter()
    if not any(case.legs):
        case = changed(case, case.divided(FEW_INCREMENTS))  # until the increments are decided
    by_name = {approximation.name: approximation for approximation in APPROXIMATIONS}
    decisions = [_decide(by_name["dimension"], case, MOST_FOR_DIMENSION * case.accuracy)]
    case = changed(case, decisions[0].chosen)
    left = case.accuracy - (decisions[0].error or 0.0)
    for name, share in SHARES.items():
        decisions.append(_decide(by_name[name], case, share * left))
        case = changed(case, decisions[-1].chosen)
    return case, record_of(decisions, case.accuracy, begin)


def _decide(approximation: Approximation, case: DovetailCase, allowed: float) -> Decision:
    """Return the decision on a setting, or the case's own setting if its probe fails."""
    begin, entry = time.perf_counter(), approximation.entries[0]
    assert approximation.decide is not None
    try:
        decision = approximation.decide(case, allowed)
    except FAILURES as error:
        why = f"as the case says, because the probe failed: {error}"
        decision = Decision({entry: entry_at(case, entry)}, why, allowed)
    return decision.timed(begin)
