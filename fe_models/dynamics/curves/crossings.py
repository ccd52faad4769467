"""The motions of a branch at one frequency: every crossing of its curve, solved for there.

Between two points of the curve that lie on either side of the frequency there is a crossing.
Newton's method at the frequency finds it from between them, and is believed where what it finds
lies along the chord; otherwise the curve is cut by planes across the chord, and the share of the
chord at which it crosses is bracketed. Where the curve turns back beside the frequency it may do so
beyond it, between two points: its farthest point is looked for, on either side of which it crosses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from fe_models.dynamics.curves.control import ContinuationControl
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

# Of a chord: where a curve crosses a frequency, and where it is farthest.
SHARE_TOLERANCE, FARTHEST_TOLERANCE = 1e-9, 1e-6
# Motions that differ by less, as a share of the vibration, are one.
SAME = 1e-6


def motions_at(
    branch: ResponseBranch,
    frequency: float,
    control: ContinuationControl | None = None,
    steps: Steps = COMPUTED,
) -> tuple[HarmonicSolution, ...]:
    """The motions in which a branch crosses a ``frequency`` [Hz], in the order of its curve.

    They are solved for at the resolution with which the branch ended, to the tolerance of
    ``control``; one that is not found has a ``message``. There are none where the curve does not
    get to the frequency. Each of the ``steps`` finds one.

    Examples
    --------
    At 200 Hz exactly, the motion on a branch is that which is found there alone:

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
    curve = _Curve(branch, control)
    found: list[HarmonicSolution] = []
    for begin, end in curve.crossed(frequency):
        motion = steps("motion at a frequency", partial(curve.crossing, begin, end, frequency))
        if not any(curve.same(motion, other) for other in found):
            found.append(motion)
    return tuple(found)


class _Curve:
    """The points ``(n + 1,)`` of a branch, unknowns and frequency, at its last resolution."""

    def __init__(self, branch: ResponseBranch, control: ContinuationControl) -> None:
        force = branch.solutions[0].force if branch.solutions else 0.0
        self._problem, self._control, self._force = branch.problem, control, force
        self._curve = curve_by_frequency(self._problem, force)
        self._points = [self._curve.coordinates_of(motion) for motion in branch.solutions]

    def crossed(self, frequency: float) -> Iterator[tuple[Array, Array]]:
        """Points between which the curve crosses a frequency, in its order."""
        for place, (begin, end) in enumerate(pairwise(self._points)):
            if begin[-1] == frequency:
                yield begin, begin
            if (begin[-1] - frequency) * (end[-1] - frequency) < 0.0:
                yield begin, end
            elif self._may_turn_beyond(place, frequency):
                farthest = _farthest(self._chord(begin, end), frequency)
                if farthest is not None:
                    yield begin, farthest
                    yield farthest, end
        if self._points and self._points[-1][-1] == frequency:
            yield self._points[-1], self._points[-1]

    def crossing(self, begin: Array, end: Array, frequency: float) -> HarmonicSolution:
        """The motion at a frequency between two points."""
        solution = self._between(begin, end, frequency)
        motion = self._problem.describe(
            solution.unknowns, solution.at, frequency, self._force, solution.iterations
        )
        return replace(motion, message=solution.message)

    def same(self, motion: HarmonicSolution, other: HarmonicSolution) -> bool:
        """Whether two motions are one."""
        problem = self._problem
        apart = norm(problem.guess(motion) - problem.guess(other))
        return apart <= SAME * problem.vibration(motion.coefficients)

    def _between(self, begin: Array, end: Array, frequency: float) -> NewtonSolution[Balance]:
        way = float(end[-1] - begin[-1])
        share = (frequency - float(begin[-1])) / way if way else 0.0
        direct = self._solve(begin + share * (end - begin), frequency)
        if not way:
            return direct
        chord = self._chord(begin, end)
        if direct.converged and chord.along(np.append(direct.unknowns, frequency)):
            return direct
        across = _crossing(chord, frequency)
        return direct if across is None else self._solve(across, frequency)

    def _solve(self, coordinates: Array, frequency: float) -> NewtonSolution[Balance]:
        newton = NewtonControl(self._control.tolerance)
        return solve(self._curve.equations, coordinates[:-1], frequency, newton)

    def _may_turn_beyond(self, place: int, frequency: float) -> bool:
        """Whether the curve turns back at an end of a chord, and may have got to a frequency.

        Between points it may get farther than they are by no more than they are apart.
        """
        at = [float(point[-1]) for point in self._points]
        for turn in (place, place + 1):
            if not 0 < turn < len(at) - 1:
                continue
            before, after = at[turn] - at[turn - 1], at[turn] - at[turn + 1]
            beyond = (frequency - at[turn]) * np.sign(before)
            if before * after > 0.0 and 0.0 <= beyond <= max(abs(before), abs(after)):
                return True
        return False

    def _chord(self, begin: Array, end: Array) -> Chord[Balance]:
        return Chord(self._curve, begin, end, self._control)


def _crossing(chord: Chord[Balance], frequency: float) -> Array | None:
    """Where a curve crosses a frequency that lies between those of a chord's ends, if found."""

    def beyond(share: float) -> float:
        return _frequency(chord, share) - frequency

    ends = beyond(0.0), beyond(1.0)
    if not ends[0] * ends[1] < 0.0:
        return None
    share = brentq(beyond, 0.0, 1.0, xtol=SHARE_TOLERANCE, disp=False)
    found = chord.at(float(share))
    return None if found is None else found.point.coordinates


def _farthest(chord: Chord[Balance], frequency: float) -> Array | None:
    """The point in which a curve turns back beyond a frequency, if it gets there."""
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
    """That of the curve across a chord; NaN where it is not found."""
    found = chord.at(share)
    return np.nan if found is None else found.point.parameter
