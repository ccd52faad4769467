"""Forced response of a structure with joints: its periodic motions along frequency or force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.dynamics.curves.continuation import SolutionCurve
from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.followed_curve import (
    FollowedCurve,
    curve_by_force,
    curve_by_frequency,
)
from fe_models.dynamics.curves.motion_recorder import Accuracy, MotionRecorder, Search
from fe_models.dynamics.curves.newton import NewtonSolution, solve
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError
from sa_solver import checks
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

Curve = FollowedCurve[Balance]


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
    checks.number("force", force, error=HarmonicBalanceError)
    _check(span, 0.0)

    def find(
        curve: Curve, unknowns: Array, frequency: float, control: ContinuationControl
    ) -> NewtonSolution[Balance]:
        return curve.problem.find(frequency, force, unknowns, control)

    curve = curve_by_frequency(problem, force)
    return _branch(curve, find, span, start, upward, control, accuracy, steps)


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
    checks.number("frequency", frequency, error=HarmonicBalanceError)
    _check(span, -np.inf)

    def find(
        curve: Curve, unknowns: Array, force: float, control: ContinuationControl
    ) -> NewtonSolution[Balance]:
        found = curve.problem.find(frequency, force, unknowns, control)
        # The derivatives must be those with respect to the force.
        return solve(curve.equations, found.unknowns, force) if found.converged else found

    curve = curve_by_force(problem, frequency)
    return _branch(curve, find, span, start, upward, control, accuracy, steps)


def _check(span: tuple[float, float], lower_bound: float) -> None:
    """Raise HarmonicBalanceError if a span does not ascend, or is not above its lower bound."""
    checks.array("ends of the span", span, (2,), error=HarmonicBalanceError, finite=False)
    if not lower_bound < span[0] < span[1] < np.inf:
        raise HarmonicBalanceError(
            f"the span from {span[0]:g} to {span[1]:g} is not possible: give its lower end first, "
            "and finite ends, above 0 if they are frequencies"
        )


def _branch(
    curve: Curve,
    find: Search[Balance],
    span: tuple[float, float],
    start: HarmonicSolution | ResponseBranch | None,
    upward: bool,
    control: ContinuationControl | None,
    accuracy: Accuracy | None,
    steps: Steps,
) -> ResponseBranch:
    """Return the branch along a curve; see :func:`along_frequency`."""
    control = control or ContinuationControl()
    if isinstance(start, ResponseBranch):
        recorder = MotionRecorder(curve.refined(start.problem), accuracy)
        # The last point knows in which direction the branch continues.
        followed = recorder.follow(start.curve.points[-1], span, control, steps)
    else:
        recorder = MotionRecorder(curve, accuracy)
        begin, end = span if upward else span[::-1]
        unknowns = curve.problem.guess(start)
        first = recorder.find_first(unknowns, begin, upward, control, steps, find)
        if isinstance(first, str):
            return ResponseBranch((), SolutionCurve((), first), curve.problem)
        followed = recorder.follow(first, span, control, steps, end)
    return ResponseBranch(tuple(recorder.solutions), followed, recorder.curve.problem)
