"""Choice of the increments of a cycle of two bodies with friction, by the error due to them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from sa_solver.cycles.history import MOST_INCREMENTS
from wear.contact.interface import InterfaceContact
from wear.steps.stepping import ContactFailure
from workflow.analyses.contact.load_path import Leg, LineLeg
from workflow.analyses.wear.choice import Decision, record_of
from workflow.analyses.wear.structures.bodies.case import Stroke, TwoBodiesWearCase
from workflow.analyses.wear.structures.bodies.model import source_of
from workflow.analyses.wear.translation import face_contact
from workflow.case.changing import changed
from workflow.case.text.readable import percent
from workflow.models.uncoupled.increments import CycleWork

AnyCase = TypeVar("AnyCase", bound=TwoBodiesWearCase)


def choose_parts(case: AnyCase) -> tuple[AnyCase, dict[str, Any] | None]:
    """Return the case with increments that meet ``contact.accuracy``, and a record of why.

    Each increment is split into the same number of parts. There is no record if the case's
    increments suffice or no cycle can be solved.
    """
    begin, accuracy = time.perf_counter(), case.contact.accuracy
    rows, parts, tried = len(case.load_path.table()), 1, {}
    coarse, error = _cycle(case, 1), np.inf
    while True:
        fine = _cycle(case, 2 * parts)
        change = _change(coarse, fine)
        tried[parts] = 2.0 * change
        if 2.0 * change <= accuracy:
            error = 2.0 * change
            break
        coarse, parts, error = fine, 2 * parts, change
        if error <= accuracy or 2 * parts * rows > MOST_INCREMENTS:
            break
    if not np.isfinite(error) or (parts == 1 and error <= accuracy):
        return case, None
    why = (
        f"{parts * rows} in a cycle cause an error of {percent(error)} of depth and energy of the "
        f"unworn cycle, of {percent(accuracy)} allowed (contact.accuracy); the {rows} of the case "
        f"cause {percent(tried[1])}"
    )
    probe = {
        "parts": list(tried),
        "errors": [e if np.isfinite(e) else None for e in tried.values()],
    }
    decision = Decision(_divided(case, parts), why, accuracy, error, probe)
    return changed(case, decision.chosen), record_of([decision.timed(begin)], accuracy, begin)


def _contact(case: TwoBodiesWearCase, parts: int) -> tuple[InterfaceContact, Any]:
    source = source_of(case, parts)
    (face,), (loads,) = source.faces, source.unworn()
    return face_contact(case, face).contact, loads


def _cycle(case: TwoBodiesWearCase, parts: int) -> CycleWork | None:
    """Return the friction work of a cycle with its increments in ``parts``, or None if unsolved."""
    contact, loads = _contact(case, parts)
    try:
        _, first = contact.begin(loads, case.wear.cycles)
    except ContactFailure:
        return None
    return CycleWork.of(contact, loads, first)


def _change(coarse: CycleWork | None, fine: CycleWork | None) -> float:
    """Return the larger relative change of depth and energy; inf if a cycle is unknown."""
    return np.inf if coarse is None or fine is None else coarse.change(fine)


def _divided(case: TwoBodiesWearCase, parts: int) -> dict[str, Any]:
    """Return the case entries that split each increment into ``parts``."""
    path = case.load_path
    if isinstance(path, Stroke):
        return {"load_path.increments": parts * path.model_dump()["increments"]}
    legs: Sequence[Leg | LineLeg] = path.legs
    return {f"load_path.legs.{n}.increments": parts * leg.increments for n, leg in enumerate(legs)}
