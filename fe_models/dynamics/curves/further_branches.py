"""Further branches of motions under a force, which no branch from an end of the span reaches.

Such a branch is often closed, an isola: its motions are only found from nearby. The search starts
from motions of a given size at a given frequency that vibrate in harmonic 1 as the structure would
with its joints free, or stuck, at several phases. Newton's method leads from each of them to some
motion. If that motion is not on a known branch, its curve is followed in both directions. There is
no guarantee that all branches are found.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fe_models.dynamics.curves.continuation import Refinement
from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.followed_curve import Chord, curve_by_frequency
from fe_models.dynamics.curves.forced_response import Motions
from fe_models.dynamics.curves.motion_recorder import Accuracy, MotionRecorder
from fe_models.dynamics.curves.newton import NewtonControl, solve
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray, HarmonicBalanceError
from fe_models.dynamics.periodic.receptance import Receptance
from sa_solver.errors import FretscaleError
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

# Number of phases at which a motion of given size is tried.
PHASES = 12
# Relative difference up to which two motions at one frequency are the same one: both are solved
# for, perhaps in different resolutions.
SAME_MOTION = 1e-3
# A curve is closed if it passes its first point within this share of a step, ...
CLOSURE_SHARE = 0.1
# ... but not before this number of points.
MIN_POINTS = 3


@dataclass(frozen=True)
class FurtherBranch(Motions):
    """Motions under a force in the order of their curve, with the first one found in its middle.

    Parameters
    ----------
    solutions
        The motions.
    closed
        Whether the curve is closed, so that the first motion follows the last.
    joins
        Whether an end is that of a known branch.
    message
        Empty if the curve is closed or reaches both ends of the span, else the reason why not.
    problem
        The problem at its last resolution.
    """

    closed: bool
    joins: bool
    message: str
    problem: HarmonicBalance


def further_branches(
    problem: HarmonicBalance,
    force: float,
    span: tuple[float, float],
    starts: Sequence[Array],
    frequency: float,
    known: Sequence[Sequence[HarmonicSolution]],
    *,
    control: ContinuationControl | None = None,
    accuracy: Accuracy | None = None,
    steps: Steps = COMPUTED,
) -> tuple[FurtherBranch, ...]:
    """Return the branches through the motions that Newton's method finds from initial guesses.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    force
        Force factor of the load.
    span
        Lowest and highest frequency [Hz].
    starts
        Initial guesses of the unknowns ``(n,)``, for example from :func:`vibrating_starts`.
    frequency
        Frequency [Hz] of the initial guesses, within the span.
    known
        Motions of known branches under the same force, in the order of each.
    control
        Control of the steps.
    accuracy
        Accuracy of the motions; if None, the resolution is that of the problem.
    steps
        Runner of the steps, each of which finds one motion; see :class:`sa_solver.steps.Steps`.
    """
    if not 0.0 < span[0] <= frequency <= span[1]:
        raise HarmonicBalanceError(
            f"the start at {frequency:g} Hz is outside the span: give one within {span[0]:g} to "
            f"{span[1]:g} Hz"
        )
    control = control or ContinuationControl()
    curves, found = [*known], []
    for start in starts:
        solution = solve(
            problem.by_frequency(force), start, frequency, NewtonControl(control.tolerance)
        )
        if not solution.converged:
            continue
        motion = problem.describe(solution.unknowns, solution.at, frequency, force)
        if any(_contains(problem, motions, motion) for motions in curves):
            continue
        branch = _follow_both_ways(problem, motion, span, control, accuracy, steps)
        ends = branch.solutions[0], branch.solutions[-1]
        joins = not branch.closed and any(
            _contains(branch.problem, motions, end) for motions in known for end in ends
        )
        found.append(replace(branch, joins=joins))
        curves.append(branch.solutions)
    return tuple(found)


def vibrating_starts(
    problem: HarmonicBalance, frequency: float, amplitude: float, output: Array
) -> Iterator[Array]:
    """Yield unknowns ``(n,)`` of motions of a given size, with joints free and stuck.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    frequency
        Frequency [Hz].
    amplitude
        Amplitude [mm] of the output.
    output
        Combination ``(n,)`` of the structure's displacements that has this amplitude.
    """
    first = problem.resolution.harmonics.index(1)
    angular = np.array([2.0 * np.pi * frequency])
    rest = problem.guess(None).reshape(problem.transfer.joints, problem.resolution.size, -1)
    for structure in (problem.receptance, problem.stuck):
        shape = _shape(structure.of(1), problem, angular, amplitude, output)
        for phase in 2.0 * np.pi * np.arange(PHASES) / PHASES:
            amplitudes = problem.resolution.amplitudes(rest)
            amplitudes[first] = np.exp(1j * phase) * shape
            directions = problem.joints.directions
            yield problem.resolution.coefficients(amplitudes, directions).ravel()


def _shape(
    structure: Receptance,
    problem: HarmonicBalance,
    angular: Array,
    amplitude: float,
    output: Array,
) -> ComplexArray:
    """Return displacements of joints ``(j d,)`` in a motion with this amplitude of the output.

    The motion is the response to the lowest harmonic of the load, at the frequency ``angular``.
    """
    if not problem.load.waves:
        raise HarmonicBalanceError(
            "the load has no harmonics that could give starts: give other starts"
        )
    force = problem.load.waves[min(problem.load.waves)]
    motion = structure.at(angular).respond((force @ structure.at_points.conj())[None])[0]
    output_amplitude = abs(complex(output @ structure.at_points @ motion))
    if output_amplitude == 0.0:
        raise HarmonicBalanceError("the output does not move under the load: give one that does")
    return np.asarray(amplitude / output_amplitude * (structure.at_joints @ motion))


class _CurveClosed(FretscaleError):
    """Error raised when the curve has returned to its first point."""


class _ClosedCurveRecorder(MotionRecorder[Balance]):
    """Recorder of a branch that stops when the curve has returned to its first point."""

    def take(self, description: HarmonicSolution) -> Refinement[Balance] | None:
        finer = super().take(description)
        may_close = finer is None and len(self.solutions) > MIN_POINTS + 1
        if may_close and _contains(self.curve.problem, self.solutions[-2:], self.solutions[0]):
            raise _CurveClosed
        return finer


def _follow_both_ways(
    problem: HarmonicBalance,
    motion: HarmonicSolution,
    span: tuple[float, float],
    control: ContinuationControl,
    accuracy: Accuracy | None,
    steps: Steps,
) -> FurtherBranch:
    """Follow the curve through a motion in both directions."""
    curve = curve_by_frequency(problem, motion.force)
    halves, messages = [], []
    for upward in (True, False):
        recorder = _ClosedCurveRecorder(curve, accuracy)
        unknowns = curve.unknowns_of(motion)
        first = recorder.find_first(unknowns, motion.frequency, upward, control, steps)
        if isinstance(first, str):
            halves.append([motion])
            messages.append(first)
            continue
        try:
            messages.append(recorder.follow(first, span, control, steps).message)
        except _CurveClosed:
            motions = tuple(recorder.solutions)
            return FurtherBranch(motions, True, False, "", recorder.curve.problem)
        halves.append(recorder.solutions)
        curve = recorder.curve
    motions = (*reversed(halves[1]), *halves[0][1:])
    message = "; ".join(message for message in messages if message)
    return FurtherBranch(motions, False, False, message, curve.problem)


def _contains(
    problem: HarmonicBalance, motions: Sequence[HarmonicSolution], motion: HarmonicSolution
) -> bool:
    """Return whether a motion is on a curve of motions."""
    curve, control = curve_by_frequency(problem, motion.force), ContinuationControl()
    at = curve.coordinates_of(motion)
    points = [curve.coordinates_of(each) for each in motions]
    # Relative differences of the unknowns and of the frequency have equal weight.
    size = problem.vibration(at[:-1]) or 1.0
    scale = np.full(len(at), 1.0 / size)
    scale[-1] = 1.0 / motion.frequency
    for start, end in pairwise(points):
        chord, difference = scale * (end - start), scale * (at - start)
        share = float(difference @ chord) / (float(chord @ chord) or 1.0)
        offset = np.linalg.norm(difference - share * chord)
        if 0.0 <= share <= 1.0 and offset <= CLOSURE_SHARE * np.linalg.norm(chord):
            located = Chord(curve, start, end, control).at(share)
            if located is None or _distance(located.point.coordinates, at, size) <= SAME_MOTION:
                return True
    return any(_distance(end, at, size) <= SAME_MOTION for end in (points[0], points[-1]))


def _distance(first: Array, second: Array, size: float) -> float:
    """Return the distance between two points, relative to the ``size`` of a vibration."""
    unknowns = float(np.linalg.norm(first[:-1] - second[:-1])) / size
    return max(unknowns, abs(first[-1] / second[-1] - 1.0))
