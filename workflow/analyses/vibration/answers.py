"""Motions under each force at the frequencies that a case asks for."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from fe_models.dynamics.curves.crossings import motions_at
from fe_models.dynamics.curves.forced_response import ResponseBranch
from fe_models.dynamics.curves.motion_recorder import Accuracy
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from workflow.analyses.vibration.following import VibrationRun
from workflow.analyses.vibration.model import step_control
from workflow.analyses.vibration.output.harmonics import harmonics_of
from workflow.analyses.vibration.output.outcome import Answers
from workflow.analyses.vibration.response import warn_of_error
from workflow.layout.declared import Arrays
from workflow.messages.warning_kinds import WarningKind
from workflow.models.vibration.motions import accurate, motion_columns
from workflow.models.vibration.structure import VibratingStructure

# Share of the vibration. A motion that changes more as harmonics are added is another one.
ANOTHER = 0.3
# Numbers that are reported for each motion, in addition to its error.
GROUND = ("absolute_amplitude",)
TOLD = "phase", "energy_per_cycle", "damping", "slip", "separated"


def answers_under(
    run: VibrationRun, branch: ResponseBranch
) -> tuple[Answers | None, dict[str, Arrays]]:
    """Return the motions of a branch at the frequencies of a case, and their harmonics by group.

    Returns None and no harmonics where the case asks for no frequencies. A frequency that the curve
    does not reach gives a warning, and so does a motion that is not found.
    """
    case, model = run.case, run.structure
    if not case.at:
        return None, {}
    reported = case.amount.as_text(branch.solutions[0].force)
    every: list[HarmonicSolution] = []
    numbers: list[dict[str, Any]] = []
    for frequency in case.at:
        run.reporter.doing(f"{reported}: motions at {frequency:g} Hz")
        found = motions_at(branch, frequency, step_control(case), run.steps)
        motions = [
            run.steps("accurate motion", partial(_accurate, branch, motion, run.accuracy))
            for motion in found
            if motion.converged
        ]
        message = _message(branch, frequency, found)
        if message:
            run.reporter.warn(
                WarningKind.MOTION_NOT_FOUND, f"{reported} at {frequency:g} Hz: {message}"
            )
        those = [_numbers(model, branch, motion) for motion in motions]
        for motion in those:
            warn_of_error(run, f"{reported}: the motion at {frequency:g} Hz", motion["error"])
        numbers.append({"frequency": frequency, "motions": those, "message": message})
        every += motions
    harmonics: dict[str, Arrays] = {
        f"at_{number:05d}": harmonics_of(model.rig, motion) for number, motion in enumerate(every)
    }
    return Answers(_table(model, branch, every), tuple(numbers)), harmonics


def _accurate(
    branch: ResponseBranch, motion: HarmonicSolution, accuracy: Accuracy | None
) -> HarmonicSolution:
    """Return the motion with its error, refined to the accuracy that the case asks for.

    The motion is not refined where added harmonics lead to another motion.
    """
    found = accurate(branch.problem, motion, accuracy)
    problem = branch.problem.with_resolution(found.resolution)
    before = problem.resolution.adopt(motion.coefficients, motion.resolution)
    size = problem.vibration(found.coefficients)
    if problem.vibration(found.coefficients - before) <= ANOTHER * size:
        return found
    return accurate(branch.problem, motion, None)


def _message(branch: ResponseBranch, frequency: float, found: tuple[HarmonicSolution, ...]) -> str:
    """Return why there is no motion, or not all of them; empty if none is missing."""
    lost = [motion.message for motion in found if not motion.converged]
    if lost:
        return f"a motion is not found: {lost[0]}"
    if found:
        return ""
    low, high = branch.frequencies.min(), branch.frequencies.max()
    return f"none: the curve from {low:.6g} to {high:.6g} Hz does not reach it"


def _numbers(
    model: VibratingStructure, branch: ResponseBranch, motion: HarmonicSolution
) -> dict[str, Any]:
    columns = motion_columns(model, branch.problem, [motion])
    assert motion.error is not None
    return {
        "amplitude": float(columns["amplitude"][0, -1]),
        **{name: float(columns[name][0]) for name in TOLD},
        **{name: float(columns[name][0, -1]) for name in GROUND if name in columns},
        "error": motion.error.largest,
        "residual": motion.residual,
        "harmonics": list(motion.resolution.harmonics),
        "samples": motion.resolution.samples,
    }


def _table(
    model: VibratingStructure, branch: ResponseBranch, motions: list[HarmonicSolution]
) -> Arrays:
    frequency = np.array([motion.frequency for motion in motions])
    columns = motion_columns(model, branch.problem, motions)
    errors = np.array([motion.error.largest for motion in motions if motion.error is not None])
    return {
        "frequency": frequency,
        "amplitude": columns["amplitude"].reshape(-1, len(model.rig.seen)),
        **{name: columns[name] for name in GROUND if name in columns},
        **{name: columns[name] for name in TOLD},
        "error": errors,
    }
