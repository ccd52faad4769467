"""Forced response of a structure with joints: its periodic motions along frequency or force."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fe_models.dynamics.continuation import (
    ContinuationControl,
    CurvePoint,
    Refinement,
    SolutionCurve,
    first_point,
    follow,
)
from fe_models.dynamics.harmonic_balance import (
    SAMPLES_PER_PERIOD,
    Balance,
    HarmonicBalance,
)
from fe_models.dynamics.harmonic_solution import HarmonicSolution, ResolutionError
from fe_models.dynamics.harmonics import HarmonicBalanceError, Resolution
from fe_models.dynamics.newton import Equations, solve
from fe_models.dynamics.resolution_error import resolution_error
from sa_solver.types import Array

# Of the tolerance, what harmonics that stay left out may have of the error, and samples.
HARMONICS_LEAVE, SAMPLES_LEAVE = 0.3, 0.5


@dataclass(frozen=True)
class Accuracy:
    """How accurate motions are to be: ``tolerance`` of their ``error``, vibration and energy.

    Harmonics and samples grow as needed up to the ``highest`` harmonic and ``most_samples``; what
    then is left is in the solutions.
    """

    tolerance: float
    highest: int = 63
    most_samples: int = 4096


@dataclass(frozen=True)
class Motions:
    """Motions ``(s,)`` in the order of a curve."""

    solutions: tuple[HarmonicSolution, ...]

    @property
    def frequencies(self) -> Array:
        return np.array([solution.frequency for solution in self.solutions])

    @property
    def forces(self) -> Array:
        return np.array([solution.force for solution in self.solutions])

    def first_amplitudes(self, place: int) -> Array:
        """Size of harmonic 1 of a degree of freedom ``(s,)`` [mm]."""
        return np.array([abs(solution.amplitude(place)) for solution in self.solutions])


@dataclass(frozen=True)
class ResponseBranch(Motions):
    """Motions in the order in which they were found, the first one included.

    ``message`` is empty if the branch reached the far end of its span. ``points`` are those of the
    curve, and ``problem`` is what it ended with, to go on from its last point.
    """

    curve: SolutionCurve
    problem: HarmonicBalance

    @property
    def message(self) -> str:
        return self.curve.message


def along_frequency(
    problem: HarmonicBalance,
    force: float,
    span: tuple[float, float],
    start: HarmonicSolution | ResponseBranch | None = None,
    *,
    upward: bool = True,
    control: ContinuationControl | None = None,
    accuracy: Accuracy | None = None,
) -> ResponseBranch:
    """Motions under a force for the frequencies of ``span`` [Hz], folds included.

    From its lower end upward or from its upper end downward: a branch that does not get to the
    other end says why. From a ``start`` if there is one: a solution as a first guess; or a branch,
    to go on from its last point to either end. Without ``accuracy`` the
    resolution is that of the problem.
    """
    return _branch(problem, _Along("frequency", force), span, start, upward, control, accuracy)


def along_force(
    problem: HarmonicBalance,
    frequency: float,
    span: tuple[float, float],
    start: HarmonicSolution | ResponseBranch | None = None,
    *,
    upward: bool = True,
    control: ContinuationControl | None = None,
    accuracy: Accuracy | None = None,
) -> ResponseBranch:
    """Motions at a frequency [Hz] for the forces of ``span``; see :func:`along_frequency`."""
    return _branch(problem, _Along("force", frequency), span, start, upward, control, accuracy)


@dataclass(frozen=True)
class _Along:
    """What varies along a branch, and the value of the other."""

    varies: Literal["frequency", "force"]
    other: float

    def equations(self, problem: HarmonicBalance) -> Equations[Balance]:
        if self.varies == "frequency":
            return problem.by_frequency(self.other)
        return problem.by_force(self.other)

    def frequency_and_force(self, parameter: float) -> tuple[float, float]:
        return (parameter, self.other) if self.varies == "frequency" else (self.other, parameter)


class _Recorder:
    """Describes every new point of a branch, and asks for finer equations where needed."""

    def __init__(self, problem: HarmonicBalance, along: _Along, accuracy: Accuracy | None) -> None:
        self.problem, self._along, self._accuracy = problem, along, accuracy
        self.solutions: list[HarmonicSolution] = []

    def __call__(self, point: CurvePoint, at: Balance) -> Refinement[Balance] | None:
        solution = replace(
            self.problem.describe(
                point.unknowns, at, *self._along.frequency_and_force(point.parameter)
            ),
            iterations=point.iterations,
        )
        if self._accuracy is not None:
            error = resolution_error(self.problem, solution)
            finer = finer_resolution(self.problem.resolution, error, self._accuracy)
            if finer is not None:
                return self._refine(finer)
            solution = replace(solution, error=error)
        self.solutions.append(solution)
        return None

    def _refine(self, finer: Resolution) -> Refinement[Balance]:
        coarse, self.problem = self.problem.resolution, self.problem.refined(finer)
        size = coarse.size, self.problem.joints.directions

        def lift(unknowns: Array) -> Array:
            return finer.adopt(unknowns.reshape(-1, *size), coarse).ravel()

        return Refinement(self._along.equations(self.problem), lift)


def finer_resolution(
    present: Resolution, error: ResolutionError, accuracy: Accuracy
) -> Resolution | None:
    """The resolution that an error asks for, None if the present will do or is the finest allowed.

    The harmonics that cause most of the error are added.
    """
    tolerance, harmonics, samples = accuracy.tolerance, present.harmonics, present.samples
    if error.largest > tolerance:
        parts = error.harmonics[: accuracy.highest + 1]
        order = np.argsort(parts)
        # What is left out if the harmonics up to this one, in the order of their parts, are.
        left = np.sqrt(np.cumsum(parts[order] ** 2))
        added = order[left > HARMONICS_LEAVE * tolerance]
        harmonics = tuple(sorted({*harmonics, *added.tolist()}))
        if error.sampling > SAMPLES_LEAVE * tolerance:
            samples *= 2
    while samples < SAMPLES_PER_PERIOD * harmonics[-1]:
        samples *= 2
    finer = Resolution(harmonics, min(samples, max(accuracy.most_samples, present.samples)))
    return None if finer == present else finer


def _branch(
    problem: HarmonicBalance,
    along: _Along,
    span: tuple[float, float],
    start: HarmonicSolution | ResponseBranch | None,
    upward: bool,
    control: ContinuationControl | None,
    accuracy: Accuracy | None,
) -> ResponseBranch:
    above = 0.0 if along.varies == "frequency" else -np.inf
    if not above < span[0] < span[1] < np.inf:
        raise HarmonicBalanceError(
            f"a span from {span[0]:g} to {span[1]:g}: give its lower end first, and finite ends, "
            "above 0 if they are frequencies"
        )
    control = control or ContinuationControl()
    end: float | None = span[1] if upward else span[0]
    if isinstance(start, ResponseBranch):
        record, point = _Recorder(start.problem, along, accuracy), start.curve.points[-1]
        # Which way it leads is in its last point.
        end = None
    else:
        record = _Recorder(problem, along, accuracy)
        first = _first(record, along, span[0 if upward else 1], start, upward, control)
        if isinstance(first, str):
            return ResponseBranch((), SolutionCurve((), first), problem)
        point = first
    # Steps are shares of the vibration: the displacement under the constant load may be far larger.
    rest = record.problem.guess(None)
    curve = follow(
        along.equations(record.problem),
        point,
        span,
        control,
        record,
        rest,
        record.problem.rounding,
        end=end,
    )
    return ResponseBranch(tuple(record.solutions), curve, record.problem)


def _first(
    record: _Recorder,
    along: _Along,
    parameter: float,
    start: HarmonicSolution | None,
    upward: bool,
    control: ContinuationControl,
) -> CurvePoint | str:
    """The first point of a branch, recorded; or why there is none."""
    frequency, force = along.frequency_and_force(parameter)
    problem, unknowns = record.problem, record.problem.guess(start)
    while True:
        solution = problem.find(frequency, force, unknowns, control)
        if not solution.converged:
            return solution.message
        if along.varies == "force":
            solution = solve(along.equations(problem), solution.unknowns, parameter)
        point = first_point(solution, parameter, upward, control.first)
        finer = record(point, solution.at)
        if finer is None:
            return point
        problem, unknowns = record.problem, finer.lift(solution.unknowns)
