"""Branches of motions under a force that are not reached from an end of the frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from fe_models.dynamics.curves.followed_curve import curve_by_frequency
from fe_models.dynamics.curves.forced_response import ResponseBranch
from fe_models.dynamics.curves.further_branches import (
    FurtherBranch,
    further_branches,
    vibrating_starts,
)
from sa_solver.steps import Steps
from workflow.analyses.vibration.case.sections import FurtherStart
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.model import accuracy_of, step_control
from workflow.analyses.vibration.output.outcome import Curves
from workflow.analyses.vibration.response import curves_of, progress_along
from workflow.analyses.vibration.stability import stability_along
from workflow.models.vibration.motions import amplitude_of
from workflow.models.vibration.structure import VibratingStructure
from workflow.shell.terminal.reporter import Reporter


def further_from(
    case: VibrationCase,
    model: VibratingStructure,
    start: FurtherStart,
    known: Sequence[ResponseBranch | FurtherBranch],
    reporter: Reporter,
    steps: Steps,
) -> list[tuple[FurtherBranch, Curves]]:
    """Return branches that a start leads to, other than those ``known`` under its force.

    A start that leads to no other branch gives a warning.
    """
    name = f"{case.amount.as_text(start.force)}, from {start.frequency:g} Hz"
    problem = max((branch.problem for branch in known), key=lambda of: of.resolution.samples)
    control = step_control(case, progress_along(case.frequencies, True, "Hz", reporter))
    starts = vibrating_starts(problem, start.frequency, start.amplitude, model.rig.seen[-1])
    found = further_branches(
        problem,
        start.force,
        case.frequencies,
        list(starts),
        start.frequency,
        [branch.solutions for branch in known],
        control=control,
        accuracy=accuracy_of(case),
        steps=steps,
    )
    if not found:
        reporter.warn(
            f"{name}: no further branch found: the search ended on known ones, or nowhere"
        )
    return [(branch, _curves(case, model, branch, name, reporter, steps)) for branch in found]


def _curves(
    case: VibrationCase,
    model: VibratingStructure,
    branch: FurtherBranch,
    name: str,
    reporter: Reporter,
    steps: Steps,
) -> Curves:
    """Return the curves of a branch, with its stability."""
    if branch.message:
        reporter.warn(f"{name}: {branch.message}")
    force = float(branch.forces[0])
    stability = stability_along(
        case,
        model,
        name,
        curve_by_frequency(branch.problem, force),
        branch.solutions,
        partial(amplitude_of, model),
        reporter,
        steps,
    )
    curves = curves_of(case, model, branch)
    sizes = curves["amplitude"][:, -1]
    numbers: dict[str, Any] = {
        case.amount.name: force,
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
