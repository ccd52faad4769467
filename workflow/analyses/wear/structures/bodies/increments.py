"""Increments of a cycle of two bodies with friction, and the error due to them.

The loads of such a cycle vary linearly from increment to increment, so that values in between are
known. A solution in twice as many increments measures their error, that of friction and that of
sums over increments together: backward Euler is of first order, and halving the increments removes
half of the error.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from sa_solver.cycles.history import MOST_INCREMENTS, NO_ENERGY
from sa_solver.cycles.increments import depth_and_energy
from sa_solver.rigid_modes import PLANAR
from sa_solver.types import Array
from wear.contact.interface import InterfaceContact
from wear.steps.stepping import ContactFailure
from workflow.analyses.contact.load_path import Leg, LineLeg
from workflow.analyses.wear.choice import Decision, record_of
from workflow.analyses.wear.structures.bodies.case import Stroke, TwoBodiesWearCase
from workflow.analyses.wear.structures.bodies.model import source_of
from workflow.analyses.wear.translation import face_contact
from workflow.case.changing import changed
from workflow.case.text.readable import percent

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


def _cycle(case: TwoBodiesWearCase, parts: int) -> tuple[Array, float] | None:
    """Return friction work per area and work of the shear loads of a cycle, or None if unsolved.

    The second value sums the absolute work of all increments [N mm], per area of a cell.
    """
    contact, loads = _contact(case, parts)
    try:
        _, first = contact.begin(loads, case.wear.cycles)
    except ContactFailure:
        return None
    work = contact.unworn_tractions(loads, first).work.sum(axis=0)
    planar = list(PLANAR)
    forces, motions = (
        np.array([getattr(state, name)[planar] for state in first.cycle])
        for name in ("resultants", "rigid")
    )
    moved = np.abs(np.sum(forces * (motions - np.roll(motions, 1, axis=0)), axis=1)).sum()
    return work, float(moved) / contact.grid.cell_area


def _change(coarse: tuple[Array, float] | None, fine: tuple[Array, float] | None) -> float:
    """Return the larger relative change of depth and energy; inf if a cycle is unknown."""
    if coarse is None or fine is None:
        return np.inf
    (before, _), (work, moved) = coarse, fine
    energy = float(work.sum())
    if energy <= 0.0:
        return 0.0 if before.sum() <= 0.0 else np.inf
    scale = max(1.0, NO_ENERGY * moved / energy)
    return float(np.max(depth_and_energy(work - before) / depth_and_energy(work)) / scale)


def _divided(case: TwoBodiesWearCase, parts: int) -> dict[str, Any]:
    """Return the case entries that split each increment into ``parts``."""
    path = case.load_path
    if isinstance(path, Stroke):
        return {"load_path.increments": parts * path.model_dump()["increments"]}
    legs: Sequence[Leg | LineLeg] = path.legs
    return {f"load_path.legs.{n}.increments": parts * leg.increments for n, leg in enumerate(legs)}
