"""Stability of the motions of a curve, and the points where it changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fe_models.dynamics.curves.bifurcations import Bifurcation, find_bifurcations
from fe_models.dynamics.curves.followed_curve import FollowedCurve
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.joints import DeviatingJoints
from fe_models.dynamics.stability.floquet import Floquet, Stability
from sa_solver.types import Array
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.following import VibrationRun
from workflow.analyses.vibration.output.layout import bifurcation_columns
from workflow.layout.declared import Arrays
from workflow.messages.warning_kinds import WarningKind
from workflow.models.vibration.amount import ExcitationSize
from workflow.models.vibration.motions import amplitude_of
from workflow.models.vibration.structure import VibratingStructure
from workflow.shell.terminal.reporter import Reporter

# Values of the column of stability.
CODES = {"stable": 1, "unknown": 0, "unstable": -1}
# Motions whose stability is computed in one step of a run.
TOGETHER = 20
# At a true fold of the motion, a multiplier passes through 1. If all are at least this far from 1,
# and their number beyond 1 does not change, the fold is due to missing harmonics.
AWAY = 0.1


@dataclass(frozen=True)
class CurveStability:
    """Stability of a curve: ``columns`` ``(n,)`` each along it, and its ``bifurcations``.

    ``numbers`` are for the summary. All are empty where stability is not computed.
    """

    columns: Arrays
    numbers: dict[str, Any]
    bifurcations: tuple[dict[str, Any], ...]


NOT_LOOKED_FOR = CurveStability({}, {}, ())


def looked_for(case: VibrationCase, model: VibratingStructure) -> bool:
    """Return whether stability is computed: as the case says, or else where it is cheap.

    Contacts of the half-space cannot be linearised about a motion.
    """
    if case.stability == "auto":
        problem = model.problem
        return isinstance(problem.joints, DeviatingJoints) and Floquet(problem).is_fast
    return case.stability == "every"


def stability_along(
    run: VibrationRun, name: str, curve: FollowedCurve[Any], motions: Sequence[HarmonicSolution]
) -> CurveStability:
    """Return the stability of motions along a curve of this ``name``, and its bifurcations."""
    if not looked_for(run.case, run.structure):
        return NOT_LOOKED_FOR
    reporter, steps = run.reporter, run.steps
    reporter.doing(f"{name}: stability")
    floquet = Floquet(curve.problem)
    known: list[Stability] = []
    for first in range(0, len(motions), TOGETHER):
        some = motions[first : first + TOGETHER]
        known.extend(steps("stability", partial(_stability_of, floquet, tuple(some))))

    def find() -> tuple[dict[str, Any], ...]:
        found = find_bifurcations(curve, motions, known)
        return tuple(_described(run, each) for each in found)

    bifurcations = steps("bifurcations", find)
    _warn_of_folds(name, bifurcations, reporter)
    unknown = [at for at in known if at.verdict == "unknown"]
    if len(unknown) == len(known) and known:
        reporter.warn(
            WarningKind.UNKNOWN_STABILITY, f"{name}: stability is not known: {unknown[0].message}"
        )
    numbers: dict[str, Any] = {
        "unstable_points": sum(at.verdict == "unstable" for at in known),
        "unknown_points": len(unknown),
    }
    if sizes := [at.largest for at in known if at.resolved]:
        numbers["largest_multiplier"] = max(sizes)
    return CurveStability(_columns(known), numbers, bifurcations)


def _warn_of_folds(
    name: str, bifurcations: Sequence[Mapping[str, Any]], reporter: Reporter
) -> None:
    """Warn of folds that would vanish with more harmonics.

    Only folds with known stability on both sides are checked.
    """
    for each in bifurcations:
        before, after = each["unstable_before"], each["unstable_after"]
        if each["kind"] != "fold" or before is None or before != after:
            continue
        multiplier = each["multiplier"] * np.exp(1j * each["multiplier_angle"])
        if abs(multiplier - 1.0) > AWAY:
            reporter.warn(
                WarningKind.FALSE_FOLD,
                f"{name}: the fold at {each['frequency']:.4g} Hz is not one of the motion itself, "
                f"as no multiplier is near 1 there ({multiplier:.2g}): give more "
                "resolution.harmonics and resolution.samples",
            )


def _stability_of(floquet: Floquet, motions: tuple[HarmonicSolution, ...]) -> tuple[Stability, ...]:
    return tuple(floquet.stability(motion) for motion in motions)


def _columns(known: Sequence[Stability]) -> Arrays:
    """Return columns of motions; multipliers are left out where none is known."""
    columns = {"stability": np.array([CODES[at.verdict] for at in known])}
    resolved = np.array([at.resolved for at in known], bool)
    if not resolved.any():
        return columns
    largest, error = np.array([(at.largest, at.error) for at in known]).T
    return columns | {
        "multiplier": np.where(resolved, largest, np.nan),
        "multiplier_error": np.where(resolved, error, np.nan),
        "unstable_multipliers": np.array([at.unstable for at in known]),
    }


def _described(run: VibrationRun, bifurcation: Bifurcation) -> dict[str, Any]:
    """Return a bifurcation with the amplitude of its motion [mm], for summary and tables."""
    motion, multiplier = bifurcation.motion, bifurcation.multiplier
    return {
        "kind": bifurcation.kind,
        "frequency": motion.frequency,
        run.case.amount.name: motion.force,
        "amplitude": amplitude_of(run.structure, motion),
        "multiplier": abs(multiplier),
        "multiplier_angle": float(abs(np.angle(multiplier))),
        "unstable_before": bifurcation.unstable[0],
        "unstable_after": bifurcation.unstable[1],
    }


def bifurcation_arrays(bifurcations: Sequence[Mapping[str, Any]], amount: ExcitationSize) -> Arrays:
    """Return columns ``(n,)`` of bifurcations, without their kinds."""
    return {
        name: _numbers([found[name] for found in bifurcations])
        for name in bifurcation_columns(amount)
    }


def _numbers(values: Sequence[float | None]) -> Array:
    """Return numbers ``(n,)``, NaN for unknown ones."""
    if None not in values:
        return np.array(values)
    return np.array([np.nan if value is None else value for value in values])
