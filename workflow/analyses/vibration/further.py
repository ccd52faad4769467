"""Branches of motions under a force that are not reached from an end of the frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fe_models.dynamics.curves.followed_curve import curve_by_frequency
from fe_models.dynamics.curves.forced_response import ResponseBranch
from fe_models.dynamics.curves.further_branches import (
    FurtherBranch,
    further_branches,
    vibrating_starts,
)
from workflow.analyses.vibration.case.sections import FurtherStart
from workflow.analyses.vibration.following import VibrationRun
from workflow.analyses.vibration.output.outcome import Curves
from workflow.analyses.vibration.response import curves_of
from workflow.analyses.vibration.stability import stability_along
from workflow.messages.warning_kinds import WarningKind


def further_from(
    run: VibrationRun, start: FurtherStart, known: Sequence[ResponseBranch | FurtherBranch]
) -> list[tuple[FurtherBranch, Curves]]:
    """Return branches that a start leads to, other than those ``known`` under its force.

    A start that leads to no other branch gives a warning.
    """
    case = run.case
    name = f"{case.amount.as_text(start.force)}, from {start.frequency:g} Hz"
    problem = max((branch.problem for branch in known), key=lambda of: of.resolution.samples)
    seen = run.structure.rig.seen[-1]
    starts = vibrating_starts(problem, start.frequency, start.amplitude, seen)
    found = further_branches(
        problem,
        start.force,
        case.frequencies,
        list(starts),
        start.frequency,
        [branch.solutions for branch in known],
        control=run.control(case.frequencies, "Hz"),
        accuracy=run.accuracy,
        steps=run.steps,
    )
    if not found:
        run.reporter.warn(
            WarningKind.NO_FURTHER_BRANCH,
            f"{name}: no further branch found: the search ended on known ones, or nowhere",
        )
    return [(branch, _curves(run, branch, name)) for branch in found]


def _curves(run: VibrationRun, branch: FurtherBranch, name: str) -> Curves:
    """Return the curves of a branch, with its stability."""
    if branch.message:
        run.reporter.warn(WarningKind.CURVE_ENDS, f"{name}: {branch.message}")
    force = float(branch.forces[0])
    curve = curve_by_frequency(branch.problem, force)
    stability = stability_along(run, name, curve, branch.solutions)
    curves = curves_of(run, branch)
    sizes = curves["amplitude"][:, -1]
    numbers: dict[str, Any] = {
        run.case.amount.name: force,
        "points": len(branch.solutions),
        "lowest_frequency": float(branch.frequencies.min()),
        "highest_frequency": float(branch.frequencies.max()),
        "largest_amplitude": float(sizes.max()),
        "frequency_of_largest": float(branch.frequencies[int(np.argmax(sizes))]),
        "closed": branch.closed,
        "joins": branch.joins,
        "message": branch.message,
        **stability.numbers,
    }
    return Curves({**curves, **stability.columns}, numbers, stability.bifurcations)
