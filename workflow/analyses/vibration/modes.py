"""Modes of a vibration case: frequency and damping over the amplitude."""

from __future__ import annotations

from typing import Any

import numpy as np

from fe_models.dynamics.curves.nonlinear_mode import LinearMode, ModeMotion, along_nonlinear_mode
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError
from wear.joints.periodic.march import SLIP
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.following import VibrationRun
from workflow.analyses.vibration.output.outcome import Curves
from workflow.errors import MethodFailed, UserError
from workflow.layout.declared import Arrays
from workflow.messages.warning_kinds import WarningKind
from workflow.models.vibration.motions import amplitudes_of
from workflow.models.vibration.results import LARGEST_ERROR
from workflow.models.vibration.structure import VibratingStructure

# Share of the largest motion of a mode, below which the observed point does not take part.
STILL = 1e-6
# Damping ratio below which the relative error of a damping ratio no longer counts: modes with
# almost no damping would otherwise show large errors that do not matter.
LEAST_DAMPING = 1e-4


def refuse_missing_modes(case: VibrationCase, model: VibratingStructure) -> None:
    """Refuse a mode number that the structure does not have, before any curve is followed."""
    for number in () if case.modes is None else case.modes.numbers:
        try:
            LinearMode.of(model.problem, number)
        except HarmonicBalanceError as error:
            raise UserError(f"modes.numbers: {error}; allowed: one of these") from error


def mode_of(run: VibrationRun, number: int, problem: HarmonicBalance) -> Curves:
    """Return a mode over the amplitudes of the case, with the harmonics of the ``problem``.

    Raises MethodFailed for a mode in which the observed point does not move, or that is not found
    at the least amplitude. A curve that ends before the largest amplitude gives a warning.
    """
    assert run.case.modes is not None
    linear, model = LinearMode.of(problem, number), run.structure
    moved = abs(float(model.rig.seen[-1] @ linear.shape))
    if moved <= STILL * np.abs(linear.shape).max():
        raise MethodFailed(
            f"modes: mode {number}, at {linear.frequency:.4g} Hz, does not move "
            f"{model.rig.labels[-1]}, by which amplitudes are measured: report another point, or "
            "leave the mode out"
        )
    # Convert observed amplitudes to modal ones, by the shape of the linear mode.
    least, largest = (amplitude / moved for amplitude in run.case.modes.amplitudes)
    control = run.control((least, largest), "t^0.5 mm")
    branch = along_nonlinear_mode(problem, linear, (least, largest), control, run.steps)
    if not branch.motions:
        raise MethodFailed(f"modes: mode {number}: {branch.message}")
    if branch.message:
        run.reporter.warn(WarningKind.CURVE_ENDS, f"mode {number}: {branch.message}")
    error = max(map(_error, branch.motions))
    if error > LARGEST_ERROR:
        run.reporter.warn(
            WarningKind.INACCURATE_MOTION,
            f"mode {number} has an error of {error:.1e}: give a resolution.tolerance, or more "
            "resolution.harmonics and resolution.samples",
        )
    first, last = branch.motions[0], branch.motions[-1]
    numbers: dict[str, Any] = {
        "mode": number,
        "linear_frequency": linear.frequency,
        "linear_damping": linear.damping_ratio,
        "frequency": [first.solution.frequency, last.solution.frequency],
        "damping": [first.damping_ratio, last.damping_ratio],
        "most_damped": float(branch.damping_ratios.max()),
        "points": len(branch.motions),
        "error": error,
        "message": branch.message,
    }
    return Curves(_columns(model, branch.motions), numbers)


def _error(motion: ModeMotion) -> float:
    """Return the largest relative error of vibration, frequency and damping."""
    damping = motion.damping_error / max(abs(motion.damping_ratio), LEAST_DAMPING)
    return max(motion.vibration_error, motion.frequency_error, damping)


def _columns(model: VibratingStructure, motions: tuple[ModeMotion, ...]) -> Arrays:
    solutions = [motion.solution for motion in motions]
    columns: dict[str, list[float]] = {
        "amplitude": [float(amplitudes_of(model, s)[-1]) for s in solutions],
        "modal_amplitude": [motion.amplitude for motion in motions],
        "frequency": [s.frequency for s in solutions],
        "damping": [motion.damping_ratio for motion in motions],
        "energy_per_cycle": [float(s.cycle.dissipated.sum()) for s in solutions],
        "slip": [model.time_share(s, SLIP) for s in solutions],
        "frequency_error": [motion.frequency_error for motion in motions],
        "damping_error": [motion.damping_error for motion in motions],
    }
    return {name: np.array(values) for name, values in columns.items()}
