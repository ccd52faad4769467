"""Forced response of a structure with joints: its periodic motions along frequency or force."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from fe_models.dynamics.curves.continuation import Refinement, SolutionCurve, follow
from fe_models.dynamics.curves.curve_steps import ContinuationControl, CurvePoint, first_point
from fe_models.dynamics.curves.newton import Equations, solve
from fe_models.dynamics.periodic.harmonic_balance import (
    SAMPLES_PER_PERIOD,
    Balance,
    HarmonicBalance,
)
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution, ResolutionError
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError, Resolution
from fe_models.dynamics.periodic.resolution_error import extended_problem, resolution_error
from sa_solver import checks
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

# Shares of the tolerance that neglected harmonics and samples may contribute to the error.
HARMONICS_SHARE, SAMPLES_SHARE = 0.3, 0.5


@dataclass(frozen=True)
class Accuracy:
    """Accuracy of periodic motions, to which their resolution adapts.

    Parameters
    ----------
    tolerance
        Tolerance of the errors of vibration and energy.
    highest
        Highest harmonic that may be added.
    most_samples
        Largest number of samples of a period. If harmonics and samples do not suffice, the
        remaining error is in the solutions.

    Examples
    --------
    The force of a slider has a third harmonic. It is added for an accuracy of 0.1 %.

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.02)
    >>> load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
    >>> problem = HarmonicBalance(rig, PeriodicMarch(law), load, Resolution((1,), 64))
    >>> branch = along_frequency(problem, 10.0, (180.0, 190.0), accuracy=Accuracy(1e-3))
    >>> print(3 in branch.problem.resolution.harmonics, branch.solutions[-1].error.largest < 1e-3)
    True True
    """

    tolerance: float
    highest: int = 63
    most_samples: int = 4096

    def __post_init__(self) -> None:
        checks.numbers(self, "tolerance", above=0.0, error=HarmonicBalanceError)
        for name in ("highest", "most_samples"):
            if checks.whole(name, getattr(self, name), HarmonicBalanceError) < 1:
                raise HarmonicBalanceError(f"{name} = {getattr(self, name)}: give 1 or more")


@dataclass(frozen=True)
class Motions:
    """Periodic motions ``(s,)`` in the order of a curve."""

    solutions: tuple[HarmonicSolution, ...]

    @property
    def frequencies(self) -> Array:
        return np.array([solution.frequency for solution in self.solutions])

    @property
    def forces(self) -> Array:
        return np.array([solution.force for solution in self.solutions])

    def first_amplitudes(self, place: int) -> Array:
        """Return the magnitude ``(s,)`` [mm] of harmonic 1 of a degree of freedom."""
        return np.array([abs(solution.amplitude(place)) for solution in self.solutions])


@dataclass(frozen=True)
class ResponseBranch(Motions):
    """Branch of forced responses in the order in which they were found, the first one included.

    Parameters
    ----------
    solutions
        The motions.
    curve
        The points of the curve.
    problem
        The problem at its last resolution, with which the branch can be continued.
    """

    curve: SolutionCurve
    problem: HarmonicBalance

    @property
    def message(self) -> str:
        """Empty if the branch reached the far end of its span, else the reason why not."""
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
    steps: Steps = COMPUTED,
) -> ResponseBranch:
    """Follow the periodic motions under a force over a span of frequencies, past folds.

    A branch that does not reach the other end says why in its ``message``.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    force
        Force factor of the load.
    span
        Lowest and highest frequency [Hz].
    start
        A motion as initial guess, or a branch, which is continued from its last point to either
        end.
    upward
        Whether the branch starts at the lower end of the span, or at the upper one.
    control
        Control of the steps.
    accuracy
        Accuracy of the motions; if None, the resolution is that of the problem.
    steps
        Runner of the steps, each of which finds one motion; see :class:`sa_solver.steps.Steps`.

    Examples
    --------
    Without friction the amplitude at resonance is that of mass and spring alone, F / (2 ζ k):

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.02)
    >>> load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    >>> free = PeriodicMarch(Jenkins(stiffness=1e3, friction=0.0, normal_load=10.0))
    >>> problem = HarmonicBalance(rig, free, load, Resolution((1,), 64))
    >>> branch = along_frequency(problem, 1.0, (140.0, 180.0))
    >>> print(f"{branch.first_amplitudes(0).max():.3f} mm of {1.0 / (2.0 * 0.02 * 1e3):.3f}")
    0.025 mm of 0.025
    """
    along = Along("frequency", force)
    return _branch(problem, along, span, start, upward, control, accuracy, steps)


def along_force(
    problem: HarmonicBalance,
    frequency: float,
    span: tuple[float, float],
    start: HarmonicSolution | ResponseBranch | None = None,
    *,
    upward: bool = True,
    control: ContinuationControl | None = None,
    accuracy: Accuracy | None = None,
    steps: Steps = COMPUTED,
) -> ResponseBranch:
    """Follow the periodic motions at a frequency over a span of forces, past folds.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    frequency
        Frequency [Hz].
    span
        Lowest and highest force factor.
    start, upward, control, accuracy, steps
        As in :func:`along_frequency`.

    Examples
    --------
    Far above resonance the amplitude of a mass is F / (m ω²), whatever the joint does:

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.02)
    >>> load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
    >>> problem = HarmonicBalance(rig, PeriodicMarch(law), load, Resolution((1,), 64))
    >>> branch = along_force(problem, 5000.0, (100.0, 1000.0))
    >>> share = branch.first_amplitudes(0) * 1e-3 * (2.0 * np.pi * 5000.0) ** 2 / branch.forces
    >>> print(share.round(2))
    [1. 1. 1. 1. 1. 1. 1. 1. 1. 1. 1. 1. 1. 1. 1. 1.]
    """
    along = Along("force", frequency)
    return _branch(problem, along, span, start, upward, control, accuracy, steps)


@dataclass(frozen=True)
class Along:
    """Quantity that varies along a branch, and the fixed value of the ``other`` one."""

    varies: Literal["frequency", "force"]
    other: float

    def equations(self, problem: HarmonicBalance) -> Equations[Balance]:
        if self.varies == "frequency":
            return problem.by_frequency(self.other)
        return problem.by_force(self.other)

    def frequency_and_force(self, parameter: float) -> tuple[float, float]:
        return (parameter, self.other) if self.varies == "frequency" else (self.other, parameter)


class BranchRecorder:
    """Recorder of the motions of a branch, which requests refined equations where needed."""

    def __init__(self, problem: HarmonicBalance, along: Along, accuracy: Accuracy | None) -> None:
        self.problem, self._along, self._accuracy = problem, along, accuracy
        self.solutions: list[HarmonicSolution] = []

    def describe(self, point: CurvePoint, at: Balance) -> HarmonicSolution:
        """Return the motion at a point, with its error if an accuracy is given."""
        frequency, force = self._along.frequency_and_force(point.parameter)
        solution = self.problem.describe(point.unknowns, at, frequency, force, point.iterations)
        if self._accuracy is None:
            return solution
        return replace(solution, error=resolution_error(self.problem, solution))

    def take(self, description: HarmonicSolution) -> Refinement[Balance] | None:
        """Store a motion, or request refined equations if it is not accurate."""
        finer = finer_for(self.problem, description, self._accuracy)
        if finer is not None:
            return self._refine(finer)
        if description.resolution is not self.problem.resolution:
            # A stored motion has a resolution object of its own: let all motions share one.
            description = replace(description, resolution=self.problem.resolution)
        self.solutions.append(description)
        return None

    def _refine(self, finer: Resolution) -> Refinement[Balance]:
        coarse, self.problem = self.problem.resolution, self.problem.with_resolution(finer)
        size = coarse.size, self.problem.joints.directions

        def lift(unknowns: Array) -> Array:
            return finer.adopt(unknowns.reshape(-1, *size), coarse).ravel()

        return Refinement(self._along.equations(self.problem), lift)


def finer_for(
    problem: HarmonicBalance, motion: HarmonicSolution, accuracy: Accuracy | None
) -> Resolution | None:
    """Return the resolution that a motion needs, or None if that of the problem suffices."""
    if accuracy is None or motion.error is None:
        return None
    # When the error was estimated in an earlier run, the richer problem grew; it must grow here
    # too.
    extended_problem(problem, motion)
    return finer_resolution(problem.resolution, motion.error, accuracy)


def finer_resolution(
    present: Resolution, error: ResolutionError, accuracy: Accuracy
) -> Resolution | None:
    """Return the resolution that an error demands, or None if the present one is kept.

    The harmonics that cause most of the error are added. The present resolution is kept if it
    suffices or is the finest allowed.

    Parameters
    ----------
    present
        Present resolution.
    error
        Error of a motion.
    accuracy
        Accuracy demanded.
    """
    tolerance, harmonics, samples = accuracy.tolerance, present.harmonics, present.samples
    if error.largest > tolerance:
        parts = error.harmonics[: accuracy.highest + 1]
        order = np.argsort(parts)
        # Error that remains if the harmonics up to this one, in ascending order of contribution,
        # are neglected.
        remaining = np.sqrt(np.cumsum(parts[order] ** 2))
        added = order[remaining > HARMONICS_SHARE * tolerance]
        harmonics = tuple(sorted({*harmonics, *added.tolist()}))
        if error.sampling > SAMPLES_SHARE * tolerance:
            samples *= 2
    while samples < SAMPLES_PER_PERIOD * harmonics[-1]:
        samples *= 2
    finer = Resolution(harmonics, min(samples, max(accuracy.most_samples, present.samples)))
    return None if finer == present else finer


def _branch(
    problem: HarmonicBalance,
    along: Along,
    span: tuple[float, float],
    start: HarmonicSolution | ResponseBranch | None,
    upward: bool,
    control: ContinuationControl | None,
    accuracy: Accuracy | None,
    steps: Steps,
) -> ResponseBranch:
    """Return the branch along frequency or force; see :func:`along_frequency`."""
    checks.number("force or frequency", along.other, error=HarmonicBalanceError)
    checks.array("ends of the span", span, (2,), error=HarmonicBalanceError, finite=False)
    lower_bound = 0.0 if along.varies == "frequency" else -np.inf
    if not lower_bound < span[0] < span[1] < np.inf:
        raise HarmonicBalanceError(
            f"the span from {span[0]:g} to {span[1]:g} is not possible: give its lower end first, "
            "and finite ends, above 0 if they are frequencies"
        )
    control = control or ContinuationControl()
    end: float | None = span[1] if upward else span[0]
    if isinstance(start, ResponseBranch):
        record, point = BranchRecorder(start.problem, along, accuracy), start.curve.points[-1]
        # The last point knows in which direction the branch continues.
        end = None
    else:
        record = BranchRecorder(problem, along, accuracy)
        first = _first(record, along, span[0 if upward else 1], start, upward, control, steps)
        if isinstance(first, str):
            return ResponseBranch((), SolutionCurve((), first), problem)
        point = first
    # Steps are relative to the vibration, since the displacement under the constant load may be far
    # larger.
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
        steps=steps,
    )
    return ResponseBranch(tuple(record.solutions), curve, record.problem)


def _first(
    record: BranchRecorder,
    along: Along,
    parameter: float,
    start: HarmonicSolution | None,
    upward: bool,
    control: ContinuationControl,
    steps: Steps,
) -> CurvePoint | str:
    """Return the first point of a branch, which is recorded, or the reason why there is none."""
    frequency, force = along.frequency_and_force(parameter)

    def found(unknowns: Array) -> tuple[CurvePoint, HarmonicSolution] | str:
        solution = record.problem.find(frequency, force, unknowns, control)
        if not solution.converged:
            return solution.message
        if along.varies == "force":
            solution = solve(along.equations(record.problem), solution.unknowns, parameter)
        point = first_point(solution, parameter, upward, control.first)
        return point, record.describe(point, solution.at)

    unknowns = record.problem.guess(start)
    while True:
        first = steps("first point of a curve", partial(found, unknowns))
        if isinstance(first, str):
            return first
        point, motion = first
        finer = record.take(motion)
        if finer is None:
            return point
        unknowns = finer.lift(point.unknowns)
