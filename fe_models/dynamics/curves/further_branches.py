"""Further branches of motions under a force, which no branch from an end of the span leads to.

Such a branch is often closed, an isola: the motions on it are only met from nearby. It is looked
for from motions of a given size at a given frequency, vibrating in harmonic 1 as the structure
would with its joints free, or stuck, at several phases: Newton's method leads from each of them to
some motion, and from those that are not on a known branch the curve is followed both ways. Nothing
says that there are no others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fe_models.dynamics.curves.continuation import CurvePoint, Refinement, first_point, follow
from fe_models.dynamics.curves.control import ContinuationControl
from fe_models.dynamics.curves.followed_curve import Chord, curve_by_frequency
from fe_models.dynamics.curves.forced_response import Accuracy, Along, BranchRecorder, Motions
from fe_models.dynamics.curves.newton import NewtonControl, solve
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray, HarmonicBalanceError
from fe_models.dynamics.periodic.receptance import Receptance
from sa_solver.errors import FretscaleError
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

# Phases at which a motion of given size is tried.
PHASES = 12
# Share of the vibration by which two motions at one frequency differ that are the same: both are
# solved, in resolutions that may not be the same.
SAME = 1e-3
# A curve has come round where it passes its first point within this share of a step, ...
NEARBY = 0.1
# ... not before so many points.
AWAY = 3


@dataclass(frozen=True)
class FurtherBranch(Motions):
    """Motions under a force in the order of their curve, in whose middle the first found was.

    ``closed``, where the last follows the first again. ``message`` is empty where it is, or both
    its ends are those of the span. ``joins`` tells that an end is that of a known branch.
    ``problem`` is what it ended with.
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
    """Branches through the motions that Newton's method finds from ``starts`` at a frequency [Hz].

    ``starts`` are unknowns ``(n,)``, such as :func:`vibrating_starts` or another motion's;
    ``known`` the motions of branches under the same force, in the order of each.
    """
    if not 0.0 < span[0] <= frequency <= span[1]:
        raise HarmonicBalanceError(
            f"a start at {frequency:g} Hz: give one within the span, {span[0]:g} to {span[1]:g} Hz"
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
        if any(_passes(problem, motions, motion) for motions in curves):
            continue
        branch = _both_ways(problem, motion, span, control, accuracy, steps)
        ends = branch.solutions[0], branch.solutions[-1]
        joins = not branch.closed and any(
            _passes(branch.problem, motions, end) for motions in known for end in ends
        )
        found.append(replace(branch, joins=joins))
        curves.append(branch.solutions)
    return tuple(found)


def vibrating_starts(
    problem: HarmonicBalance, frequency: float, amplitude: float, output: Array
) -> Iterator[Array]:
    """Unknowns ``(n,)`` of motions in which the ``output`` ``(n,)`` of the structure vibrates by an
    ``amplitude`` [mm], with joints free and stuck, at all phases."""
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
    """Displacements of joints ``(j d,)`` in a motion of that size of the output, as the first
    harmonic of the load would cause."""
    if not problem.load.waves:
        raise HarmonicBalanceError("the load has no harmonics: give other starts")
    force = problem.load.waves[min(problem.load.waves)]
    motion = structure.at(angular).respond((force @ structure.at_points.conj())[None])[0]
    seen = abs(complex(output @ structure.at_points @ motion))
    if seen == 0.0:
        raise HarmonicBalanceError("what is looked at does not move: look at what does")
    return np.asarray(amplitude / seen * (structure.at_joints @ motion))


class _Returned(FretscaleError):
    """The curve has come round to its first point."""


class _UntilClosed(BranchRecorder):
    """Keeps the points of a branch until it has come round to its first."""

    def __init__(
        self,
        problem: HarmonicBalance,
        along: Along,
        accuracy: Accuracy | None,
        first: HarmonicSolution,
    ) -> None:
        super().__init__(problem, along, accuracy)
        self._first = first

    def take(self, description: HarmonicSolution) -> Refinement[Balance] | None:
        finer = super().take(description)
        away = finer is None and len(self.solutions) > AWAY
        if away and _passes(self.problem, self.solutions[-2:], self._first):
            raise _Returned
        return finer


def _both_ways(
    problem: HarmonicBalance,
    motion: HarmonicSolution,
    span: tuple[float, float],
    control: ContinuationControl,
    accuracy: Accuracy | None,
    steps: Steps,
) -> FurtherBranch:
    along = Along("frequency", motion.force)
    halves, messages = [], []
    for upward in (True, False):
        record = _UntilClosed(problem, along, accuracy, motion)
        solution = solve(
            problem.by_frequency(motion.force), problem.guess(motion), motion.frequency
        )
        point: CurvePoint = first_point(solution, motion.frequency, upward, control.first)
        try:
            curve = follow(
                along.equations(problem),
                point,
                span,
                control,
                record,
                problem.guess(None),
                problem.rounding,
                steps=steps,
            )
        except _Returned:
            motions = (motion, *record.solutions)
            return FurtherBranch(motions, True, False, "", record.problem)
        halves.append(record.solutions)
        messages.append(curve.message)
        problem = record.problem
    motions = (*reversed(halves[1]), motion, *halves[0])
    message = "; ".join(message for message in messages if message)
    return FurtherBranch(motions, False, False, message, problem)


def _passes(
    problem: HarmonicBalance, motions: Sequence[HarmonicSolution], motion: HarmonicSolution
) -> bool:
    """Whether a curve of motions passes a motion: the point of it that is nearest is the motion."""
    curve, control = curve_by_frequency(problem, motion.force), ContinuationControl()
    at = curve.coordinates_of(motion)
    places = [curve.coordinates_of(each) for each in motions]
    # Shares of the motion's unknowns and of its frequency count alike.
    scale = np.full(len(at), 1.0 / (problem.vibration(motion.coefficients) or 1.0))
    scale[-1] = 1.0 / motion.frequency
    for start, end in pairwise(places):
        chord, beyond = scale * (end - start), scale * (at - start)
        share = float(beyond @ chord) / (float(chord @ chord) or 1.0)
        away = np.linalg.norm(beyond - share * chord)
        if 0.0 <= share <= 1.0 and away <= NEARBY * np.linalg.norm(chord):
            place = Chord(curve, start, end, control).at(share)
            if place is None or _apart(problem, place.point.coordinates, at, motion) <= SAME:
                return True
    return any(_apart(problem, end, at, motion) <= SAME for end in (places[0], places[-1]))


def _apart(problem: HarmonicBalance, one: Array, other: Array, motion: HarmonicSolution) -> float:
    """How far two points are from each other, in shares of a motion."""
    size = problem.vibration(motion.coefficients) or 1.0
    unknowns = float(np.linalg.norm(one[:-1] - other[:-1])) / size
    return max(unknowns, abs(one[-1] / other[-1] - 1.0))
