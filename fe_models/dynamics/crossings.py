"""The motions of a branch at one frequency: every crossing of its curve, solved for there.

Between two points of the curve that lie on either side of the frequency there is a crossing.
Newton's method at the frequency finds it from between them, and is believed where what it finds
lies along the chord; otherwise the curve is cut by planes across the chord, and the share of the
chord at which it crosses is bracketed. Where the curve turns back beside the frequency it may do so
beyond it, between two points: its farthest point is looked for, on either side of which it crosses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from fe_models.dynamics.bordered import Bordered, LinearMap
from fe_models.dynamics.continuation import ContinuationControl, Scaling
from fe_models.dynamics.forced_response import ResponseBranch
from fe_models.dynamics.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.harmonic_solution import HarmonicSolution
from fe_models.dynamics.newton import NewtonControl, NewtonSolution, solve
from fe_models.dynamics.sizes import norm
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

# Of a chord's length: how far from it a motion between its ends may be. A curve whose tangent turns
# by 30 degrees in a step is off by a tenth.
BESIDE = 0.5
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
        self._problem, self._control = branch.problem, control
        self._points = [
            np.append(self._problem.guess(motion), motion.frequency) for motion in branch.solutions
        ]
        self._force = branch.solutions[0].force if branch.solutions else 0.0

    def crossed(self, frequency: float) -> Iterator[tuple[Array, Array]]:
        """Points between which the curve crosses a frequency, in its order."""
        for place, (begin, end) in enumerate(pairwise(self._points)):
            if begin[-1] == frequency:
                yield begin, begin
            if (begin[-1] - frequency) * (end[-1] - frequency) < 0.0:
                yield begin, end
            elif self._may_turn_beyond(place, frequency):
                farthest = self._chord(begin, end).farthest(frequency)
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
        across = chord.crossing(frequency)
        return direct if across is None else self._solve(across, frequency)

    def _solve(self, coordinates: Array, frequency: float) -> NewtonSolution[Balance]:
        equations = self._problem.by_frequency(self._force)
        newton = NewtonControl(self._control.tolerance)
        return solve(equations, coordinates[:-1], frequency, newton)

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

    def _chord(self, begin: Array, end: Array) -> _Chord:
        problem = self._problem
        scaling = Scaling(float(end[-1]), problem.guess(None), problem.rounding)
        scaling.unknowns = norm(begin[:-1] - problem.guess(None)) or 1.0
        scaling.parameter = float(begin[-1])
        return _Chord(problem, self._force, begin, end, scaling, self._control.tolerance)


@dataclass(frozen=True)
class _Across:
    """A balance and how far it is from a plane: equations for unknowns and frequency.

    ``left`` [mm] is the distance, ``row`` ``(n + 1,)`` its derivative, ``unit`` the size by which
    it counts.
    """

    balance: Balance
    left: float
    row: Array
    unit: float

    @cached_property
    def residual(self) -> Array:
        return np.append(self.balance.residual, self.left)

    @cached_property
    def jacobian(self) -> Array | LinearMap:
        bordered = Bordered(self.balance.jacobian, self.balance.slope, self.row)
        return bordered.assembled() if isinstance(bordered.inner, np.ndarray) else bordered

    @property
    def slope(self) -> Array:
        """By the share of the chord: not asked for."""
        raise NotImplementedError

    @property
    def size(self) -> float:
        return self.balance.size

    @property
    def relative(self) -> float:
        return float(np.hypot(self.balance.relative, self.left / self.unit))


@dataclass(frozen=True)
class _Chord:
    """Two points of a curve, measured by a ``scaling``, and what of the curve is between them."""

    problem: HarmonicBalance
    force: float
    begin: Array
    end: Array
    scaling: Scaling
    tolerance: float

    @cached_property
    def _way(self) -> Array:
        return self.scaling.scaled(self.end - self.begin)

    def along(self, coordinates: Array) -> bool:
        """Whether a point lies beside the chord, between its ends."""
        way, length = self.scaling.scaled(coordinates - self.begin), norm(self._way)
        share = float(way @ self._way) / length**2
        return 0.0 <= share <= 1.0 and norm(way - share * self._way) <= BESIDE * length

    def __call__(self, unknowns: Array, parameter: float) -> _Across:
        """The equations at a point, for the plane at a share of the chord."""
        unit, direction = self.scaling.unknowns, self._way / norm(self._way)
        frequency = float(unknowns[-1])
        balance = self.problem.evaluate(unknowns[:-1], frequency, self.force, "frequency")
        on_the_way = self.scaling.scaled(unknowns - self.begin) - parameter * self._way
        row = direction.copy()
        row[-1] *= unit / self.scaling.parameter
        return _Across(balance, unit * float(direction @ on_the_way), row, unit)

    def at(self, share: float) -> Array:
        """The point ``(n + 1,)`` of the curve at a share of the chord; NaN if it is not found."""
        guess = self.begin + share * (self.end - self.begin)
        solution = solve(self, guess, share, NewtonControl(self.tolerance))
        return solution.unknowns if solution.converged else np.full_like(guess, np.nan)

    def crossing(self, frequency: float) -> Array | None:
        """Where the curve crosses a frequency that lies between those of the ends, if found."""

        def beyond(share: float) -> float:
            return float(self.at(share)[-1]) - frequency

        ends = beyond(0.0), beyond(1.0)
        if not ends[0] * ends[1] < 0.0:
            return None
        share = brentq(beyond, 0.0, 1.0, xtol=SHARE_TOLERANCE, disp=False)
        found = self.at(float(share))
        return found if np.isfinite(found).all() else None

    def farthest(self, frequency: float) -> Array | None:
        """The point in which the curve turns back beyond a frequency, if it gets there."""
        sense = float(np.sign(frequency - self.begin[-1]))

        def nearness(share: float) -> float:
            far = sense * float(self.at(share)[-1])
            return -far if np.isfinite(far) else np.inf

        search = minimize_scalar(
            nearness, bounds=(0.0, 1.0), method="bounded", options={"xatol": FARTHEST_TOLERANCE}
        )
        return self.at(float(search.x)) if -search.fun > sense * frequency else None
