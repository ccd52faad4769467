"""The cheapest model that meets the accuracy that a case asks for (``fidelity: auto``).

Every axis along which a model can be cheaper is a function that looks at the case, probes if it
must, and returns a decision. Axes are decided one after the other, each on the case that the
earlier ones left, each with its share of the accuracy: what two dimensions make of it goes first,
the rest is shared out (:data:`AXES`), and the shares add up to it.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict, replace
from operator import attrgetter
from typing import Any

from fe_models.mesh import MeshError
from sa_solver.normal import NormalContactError
from wear.stepping import ContactFailure
from workflow.analyses.wear.fidelity.axes import AXES
from workflow.analyses.wear.fidelity.decision import Axis, Decision
from workflow.analyses.wear.fidelity.dimension import choose_dimension
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.case.changing import changed
from workflow.errors import MethodFailed
from workflow.shell.reporter import Reporter


def choose(case: DovetailCase) -> tuple[DovetailCase, dict[str, Any]]:
    """The case to run, and a record of what was chosen and why."""
    begin = time.perf_counter()
    first = choose_dimension(case)
    decisions = [replace(first, seconds=_since(begin))]
    case = changed(case, first.chosen)
    left = case.accuracy - (first.error or 0.0)
    for axis in AXES:
        decisions.append(_decide(axis, case, axis.share * left))
        case = changed(case, decisions[-1].chosen)
    return case, {
        "accuracy": case.accuracy,
        "budget": {decision.entry: decision.allowed for decision in decisions},
        "estimated_error": sum(decision.error or 0.0 for decision in decisions),
        "met": all(decision.met for decision in decisions),
        "chosen": {
            name: value for decision in decisions for name, value in decision.chosen.items()
        },
        "decisions": [asdict(decision) for decision in decisions],
        "seconds": _since(begin),
    }


def _decide(axis: Axis, case: DovetailCase, allowed: float) -> Decision:
    """What an axis decides; the setting of the case where its probe fails."""
    begin = time.perf_counter()
    try:
        decision = axis.decide(case, allowed)
    except (MeshError, MethodFailed, ContactFailure, NormalContactError) as error:
        why = f"as the case has it: the probe failed: {error}"
        written = attrgetter(axis.entry)(case)
        decision = Decision(axis.entry, written, why, allowed=allowed, met=False)
    return replace(decision, seconds=_since(begin))


def _since(begin: float) -> float:
    return round(time.perf_counter() - begin, 2)


def report_choice(record: Mapping[str, Any] | None, reporter: Reporter) -> None:
    """What was chosen and why, a line for each axis, and whether all of it is accurate enough."""
    if record is None:
        return
    for decision in record["decisions"]:
        reporter.say(f"fidelity: {decision['entry']}: {decision['value']}: {decision['why']}")
    estimated, seconds = record["estimated_error"], record["seconds"]
    reporter.say(
        f"fidelity: estimated error {estimated:.2%} of {record['accuracy']:.2%} required, "
        f"{'within' if record['met'] else 'not within'} every share; probes took {seconds:.1f} s"
    )
