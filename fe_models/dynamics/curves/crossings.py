"""Motions of a branch at one frequency: all crossings of its curve with that frequency.

If two consecutive points of the curve lie on either side of the frequency, there is a crossing
between them. Newton's method at the frequency starts between them, and its result is accepted if it
lies along the chord. Otherwise the curve is intersected with planes across the chord, and the share
of the chord at which it crosses is bracketed. Where the curve turns back close to the frequency, it
may cross it twice between two points: then its turning point is located, with a crossing on either
side.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.followed_curve import Chord, curve_by_frequency
from fe_models.dynamics.curves.forced_response import ResponseBranch
from fe_models.dynamics.curves.newton import NewtonControl, NewtonSolution, solve
from fe_models.dynamics.curves.sizes import norm
from fe_models.dynamics.periodic.harmonic_balance import Balance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError
from sa_solver import checks
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

# Tolerances of a crossing and of a turning point, as shares of the chord.
SHARE_TOLERANCE, FARTHEST_TOLERANCE = 1e-9, 1e-6
# Difference below which two motions are the same one, relative to the vibration.
SAME_MOTION = 1e-6


def motions_at(
    branch: ResponseBranch,
    frequency: float,
    control: ContinuationControl | None = None,
    steps: Steps = COMPUTED,
) -> tuple[HarmonicSolution, ...]:
    """Return the motions in which a branch crosses a frequency, in the order of its curve.

    The result is empty if the curve does not reach the frequency. A motion that is not found has a
    ``message``.

    Parameters
    ----------
    branch
        The branch. Its last resolution is used.
    frequency
        Frequency [Hz].
    control
        Control of the continuation, with the tolerance of the motions.
    steps
        Runner of the steps, each of which finds one motion; see :class:`sa_solver.steps.Steps`.

    Examples
    --------
    At exactly 200 Hz, the motion on a branch equals the one that is solved for at 200 Hz directly:

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.02)
    >>> load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
    >>> problem = HarmonicBalance(rig, PeriodicMarch(law), load, Resolution((1, 3), 128))
    >>> branch = along_frequency(problem, 10.0, (150.0, 250.0))
    >>> (motion,) = motions_at(branch, 200.0)
    >>> alone = problem.solve(200.0, 10.0)
    >>> print(motion.frequency, abs(motion.amplitude(0) / alone.amplitude(0) - 1.0) < 1e-9)
    200.0 True
    """
    checks.number("frequency", frequency, above=0.0, error=HarmonicBalanceError)
    control = control or ContinuationControl()
    curve = _BranchCurve(branch, control)
    found: list[HarmonicSolution] = []
    for begin, end in curve.segments_across(frequency):
        motion = steps("motion at a frequency", partial(curve.crossing, begin, end, frequency))
        if not any(curve.is_same(motion, other) for other in found):
            found.append(motion)
    return tuple(found)


class _BranchCurve:
    """Points ``(n + 1,)`` of a branch, unknowns and frequency, at its last resolution."""

    def __init__(self, branch: ResponseBranch, control: ContinuationControl) -> None:
        force = branch.solutions[0].force if branch.solutions else 0.0
        self._problem, self._control, self._force = branch.problem, control, force
        self._curve = curve_by_frequency(self._problem, force)
        self._points = [self._curve.coordinates_of(motion) for motion in branch.solutions]

    def segments_across(self, frequency: float) -> Iterator[tuple[Array, Array]]:
        """Yield pairs of points between which the curve crosses a frequency, in its order."""
        for index, (begin, end) in enumerate(pairwise(self._points)):
            if begin[-1] == frequency:
                yield begin, begin
            if (begin[-1] - frequency) * (end[-1] - frequency) < 0.0:
                yield begin, end
            elif self._may_turn_back_beyond(index, frequency):
                farthest = _turning_point(self._chord(begin, end), frequency)
                if farthest is not None:
                    yield begin, farthest
                    yield farthest, end
        if self._points and self._points[-1][-1] == frequency:
            yield self._points[-1], self._points[-1]

    def crossing(self, begin: Array, end: Array, frequency: float) -> HarmonicSolution:
        """Return the motion at a frequency between two points."""
        solution = self._solve_between(begin, end, frequency)
        motion = self._problem.describe(
            solution.unknowns, solution.at, frequency, self._force, solution.iterations
        )
        return replace(motion, message=solution.message)

    def is_same(self, motion: HarmonicSolution, other: HarmonicSolution) -> bool:
        """Return whether two motions are the same one."""
        problem = self._problem
        distance = norm(problem.guess(motion) - problem.guess(other))
        return distance <= SAME_MOTION * problem.vibration(motion.coefficients)

    def _solve_between(self, begin: Array, end: Array, frequency: float) -> NewtonSolution[Balance]:
        difference = float(end[-1] - begin[-1])
        share = (frequency - float(begin[-1])) / difference if difference else 0.0
        direct = self._solve(begin + share * (end - begin), frequency)
        if not difference:
            return direct
        chord = self._chord(begin, end)
        if direct.converged and chord.contains(np.append(direct.unknowns, frequency)):
            return direct
        crossing = _crossing_point(chord, frequency)
        return direct if crossing is None else self._solve(crossing, frequency)

    def _solve(self, coordinates: Array, frequency: float) -> NewtonSolution[Balance]:
        newton = NewtonControl(self._control.tolerance)
        return solve(self._curve.equations, coordinates[:-1], frequency, newton)

    def _may_turn_back_beyond(self, index: int, frequency: float) -> bool:
        """Return whether the curve turns back at an end of a segment, perhaps beyond a frequency.

        Between two points it may exceed them by no more than the distance between them.
        """
        at = [float(point[-1]) for point in self._points]
        for turn in (index, index + 1):
            if not 0 < turn < len(at) - 1:
                continue
            before, after = at[turn] - at[turn - 1], at[turn] - at[turn + 1]
            excess = (frequency - at[turn]) * np.sign(before)
            if before * after > 0.0 and 0.0 <= excess <= max(abs(before), abs(after)):
                return True
        return False

    def _chord(self, begin: Array, end: Array) -> Chord[Balance]:
        return Chord(self._curve, begin, end, self._control)


def _crossing_point(chord: Chord[Balance], frequency: float) -> Array | None:
    """Return the point where a curve crosses a frequency between the ends of a chord, if found."""

    def excess(share: float) -> float:
        return _frequency(chord, share) - frequency

    ends = excess(0.0), excess(1.0)
    if not ends[0] * ends[1] < 0.0:
        return None
    share = brentq(excess, 0.0, 1.0, xtol=SHARE_TOLERANCE, disp=False)
    found = chord.at(float(share))
    return None if found is None else found.point.coordinates


def _turning_point(chord: Chord[Balance], frequency: float) -> Array | None:
    """Return the point where a curve turns back beyond a frequency, or None if it does not."""
    sense = float(np.sign(frequency - chord.begin[-1]))

    def nearness(share: float) -> float:
        far = sense * _frequency(chord, share)
        return -far if np.isfinite(far) else np.inf

    search = minimize_scalar(
        nearness, bounds=(0.0, 1.0), method="bounded", options={"xatol": FARTHEST_TOLERANCE}
    )
    found = chord.at(float(search.x)) if -search.fun > sense * frequency else None
    return None if found is None else found.point.coordinates


def _frequency(chord: Chord[Balance], share: float) -> float:
    """Return the frequency of the curve across a chord; NaN if the curve is not found."""
    found = chord.at(share)
    return np.nan if found is None else found.point.parameter
