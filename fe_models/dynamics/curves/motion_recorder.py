"""Recorder of the motions along a curve, whose resolution adapts to an accuracy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Generic

import numpy as np

from fe_models.dynamics.curves.continuation import Refinement, SolutionCurve, follow
from fe_models.dynamics.curves.curve_steps import ContinuationControl, CurvePoint, first_point
from fe_models.dynamics.curves.followed_curve import FollowedCurve
from fe_models.dynamics.curves.newton import L, NewtonControl, NewtonSolution, solve
from fe_models.dynamics.periodic.harmonic_balance import SAMPLES_PER_PERIOD
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution, ResolutionError
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError, Resolution
from fe_models.dynamics.periodic.resolution_error import extended_problem, resolution_error
from sa_solver import checks
from sa_solver.steps import Steps
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


# Search for the solution of a curve's equations from initial unknowns, at a parameter.
Search = Callable[[FollowedCurve[L], Array, float, ContinuationControl], NewtonSolution[L]]


def by_newton(
    curve: FollowedCurve[L], unknowns: Array, parameter: float, control: ContinuationControl
) -> NewtonSolution[L]:
    """Search for the solution by Newton's method alone."""
    return solve(curve.equations, unknowns, parameter, NewtonControl(control.tolerance))


class MotionRecorder(Generic[L]):
    """Recorder of the motions of a curve, which requests refined equations where needed.

    Parameters
    ----------
    curve
        The curve at its first resolution.
    accuracy
        Accuracy of the motions; if None, the resolution does not change.
    """

    def __init__(self, curve: FollowedCurve[L], accuracy: Accuracy | None) -> None:
        self.curve, self._accuracy = curve, accuracy
        self.solutions: list[HarmonicSolution] = []

    def find_first(
        self,
        unknowns: Array,
        parameter: float,
        upward: bool,
        control: ContinuationControl,
        steps: Steps,
        find: Search[L] = by_newton,
    ) -> CurvePoint | str:
        """Return the first point, whose motion is recorded, or the reason why there is none.

        Parameters
        ----------
        unknowns
            Initial unknowns ``(n,)``.
        parameter
            Parameter of the first point.
        upward
            Whether the parameter grows or falls first.
        control, steps
            Control and runner of the steps.
        find
            Search for the solution at the parameter.
        """

        def found(unknowns: Array) -> tuple[CurvePoint, HarmonicSolution] | str:
            solution = find(self.curve, unknowns, parameter, control)
            if not solution.converged:
                return solution.message
            point = first_point(solution, parameter, upward, control.first)
            return point, self.describe(point, solution.at)

        while True:
            first = steps("first point of a curve", partial(found, unknowns))
            if isinstance(first, str):
                return first
            point, motion = first
            finer = self.take(motion)
            if finer is None:
                return point
            unknowns = finer.lift(point.unknowns)

    def follow(
        self,
        start: CurvePoint,
        span: tuple[float, float],
        control: ContinuationControl,
        steps: Steps,
        end: float | None = None,
    ) -> SolutionCurve:
        """Follow the curve from a point; see :func:`fe_models.dynamics.curves.continuation.follow`.

        Steps are relative to the vibration, since the displacement under the constant load may be
        far larger.
        """
        curve = self.curve
        return follow(
            curve.equations,
            start,
            span,
            control,
            self,
            curve.origin,
            curve.problem.rounding,
            end,
            steps,
        )

    def describe(self, point: CurvePoint, at: L) -> HarmonicSolution:
        """Return the motion at a point, with its error if an accuracy is given."""
        motion = replace(
            self.curve.motion_of(point.unknowns, point.parameter, at),
            iterations=point.iterations,
            residual=at.relative,
        )
        if self._accuracy is None:
            return motion
        return replace(motion, error=resolution_error(self.curve.problem, motion))

    def take(self, description: HarmonicSolution) -> Refinement[L] | None:
        """Store a motion, or request refined equations if it is not accurate."""
        finer = self._finer_for(description)
        if finer is not None:
            return self._refine(finer)
        # A stored motion has a resolution object of its own: let all motions share one.
        shared = self.curve.problem.resolution
        self.solutions.append(replace(description, resolution=shared))
        return None

    def _finer_for(self, motion: HarmonicSolution) -> Resolution | None:
        """Return the resolution that a motion needs, or None if the present one suffices."""
        if self._accuracy is None or motion.error is None:
            return None
        # When the error was estimated in an earlier run, the richer problem grew; it must grow here
        # too.
        extended_problem(self.curve.problem, motion)
        return finer_resolution(self.curve.problem.resolution, motion.error, self._accuracy)

    def _refine(self, finer: Resolution) -> Refinement[L]:
        problem = self.curve.problem
        coarse, directions, size = problem.resolution, problem.joints.directions, problem.size
        self.curve = self.curve.refined(problem.with_resolution(finer))

        def lift(unknowns: Array) -> Array:
            joints = unknowns[:size].reshape(-1, coarse.size, directions)
            return np.append(finer.adopt(joints, coarse), unknowns[size:])

        return Refinement(self.curve.equations, lift)


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
