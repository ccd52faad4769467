"""Choice of the cheapest model that meets the accuracy of a case (``fidelity: auto``).

Each axis along which a model can be cheaper is a function that examines the case, runs probes if
necessary, and returns a decision. Axes are decided one after the other, each on the case with the
earlier decisions applied and each with its share of the accuracy. The error of two dimensions is
subtracted first; the rest is divided among the axes (:data:`AXES`) by shares that add up to 1.
"""

from __future__ import annotations

import time
from dataclasses import replace
from operator import attrgetter
from typing import Any

from workflow.analyses.wear.budget.lives import FAILURES
from workflow.analyses.wear.choice import Decision, record_of, since
from workflow.analyses.wear.fidelity.axes import AXES, FidelityAxis
from workflow.analyses.wear.fidelity.dimension import choose_dimension
from workflow.analyses.wear.fidelity.probe import LEGS
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.case.changing import changed


def choose(case: DovetailCase) -> tuple[DovetailCase, dict[str, Any]]:
    """Return the case to run, and a record of the choices and their reasons."""
    begin = time.perf_counter()
    if not any(case.legs):
        case = changed(case, case.divided(LEGS))  # until the axis of increments is decided
    first = choose_dimension(case)
    decisions = [replace(first, seconds=since(begin))]
    case = changed(case, first.chosen)
    left = case.accuracy - (first.error or 0.0)
    for axis in AXES:
        decisions.append(_decide(axis, case, axis.share * left))
        case = changed(case, decisions[-1].chosen)
    return case, record_of(decisions, case.accuracy, since(begin))


def _decide(axis: FidelityAxis, case: DovetailCase, allowed: float) -> Decision:
    """Return the decision of an axis, or the case's own setting if its probe fails."""
    begin = time.perf_counter()
    try:
        decision = axis.decide(case, allowed)
    except FAILURES as error:
        why = f"as the case says, because the probe failed: {error}"
        written = attrgetter(axis.entry)(case)
        decision = Decision(axis.entry, written, why, allowed=allowed, met=False)
    return replace(decision, seconds=since(begin))
