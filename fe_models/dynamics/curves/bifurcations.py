"""Bifurcations on a curve of periodic motions: changes of stability, and folds.

Between two points, the curve is parametrised by the chord between them: Newton's method leads to
the curve in the plane across the chord. Where the number of multipliers outside the unit circle
changes, the point is located at which one of them crosses the circle. The multiplier there says
what happens: at 1 the curve folds or another one branches off, as where a motion loses its
symmetry; at -1 the period doubles; a complex pair indicates a Neimark-Sacker bifurcation (Seydel
2010, *Practical Bifurcation and Stability Analysis*, 3rd ed., section 7.4).

Folds are located where the curve itself turns back, since for a motion of few harmonics the
multiplier is 1 only nearby. All other bifurcations are located only between motions whose
multipliers are known. Joints that close or begin to slip may make multipliers jump across the
circle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Generic, Literal

import numpy as np
from scipy.optimize import brentq

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.followed_curve import Chord, FollowedCurve, LocatedPoint
from fe_models.dynamics.curves.newton import L
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.stability.floquet import Floquet, Stability
from sa_solver.errors import ConvergenceError

Kind = Literal["fold", "branching", "period_doubling", "neimark_sacker", "jump"]
# Tolerance of the location of a bifurcation, as a share of the chord between two points.
LOCATION_TOLERANCE = 1e-5
# Distance of a multiplier from the unit circle at a bifurcation beyond which it has jumped across.
JUMP_DISTANCE = 2e-2
# Angle [rad] from 1 or -1 up to which a multiplier on the circle counts as real. Two multipliers
# that meet there move apart along the circle with the square root of the distance beyond the
# bifurcation.
REAL_ANGLE = 2e-2


@dataclass(frozen=True)
class Bifurcation:
    """Bifurcation of a curve of motions.

    Parameters
    ----------
    kind
        Kind of the bifurcation.
    motion
        The motion at the bifurcation.
    multiplier
        The multiplier that crosses the unit circle there; for a fold, the one nearest to 1.
    after
        Index of the last point of the curve before the bifurcation.
    unstable
        Number of multipliers outside the circle at the points before and after, None where unknown.
    """

    kind: Kind
    motion: HarmonicSolution
    multiplier: complex
    after: int
    unstable: tuple[int | None, int | None]


def find_bifurcations(
    curve: FollowedCurve[L], motions: Sequence[HarmonicSolution], stability: Sequence[Stability]
) -> tuple[Bifurcation, ...]:
    """Return the bifurcations between the motions of a curve, in their order.

    None is reported between two motions where Newton's method does not find the curve.

    Parameters
    ----------
    curve
        The curve.
    motions
        Motions of the curve, in their order.
    stability
        Stability of each motion.
    """
    floquet = Floquet(curve.problem)
    points = [curve.coordinates_of(motion) for motion in motions]
    control = ContinuationControl()
    segments = [_Segment(Chord(curve, *ends, control), floquet) for ends in pairwise(points)]
    folds = {
        index: fold
        for index in _fold_segments(curve, motions, segments)
        if (fold := segments[index].fold())
    }
    counts: dict[int, tuple[int | None, int | None]] = {}
    found = []
    for index in _stability_changes(stability):
        changed = stability[index].beyond, stability[index + 1].beyond
        for motion, multiplier in segments[index].circle_crossings(*changed):
            kind = _kind_of(multiplier)
            nearest_fold = [at for at in (index, index - 1, index + 1) if at in folds]
            if nearest_fold and kind in ("branching", "jump"):
                counts[nearest_fold[0]] = changed
            else:
                found.append(Bifurcation(kind, motion, multiplier, index, changed))
    for index, (motion, multiplier) in folds.items():
        neighbours = stability[index], stability[index + 1]
        before, after = (at.beyond if at.resolved else None for at in neighbours)
        unstable = counts.get(index, (before, after))
        found.append(Bifurcation("fold", motion, multiplier, index, unstable))
    return tuple(sorted(found, key=lambda bifurcation: bifurcation.after))


def _stability_changes(stability: Sequence[Stability]) -> Iterator[int]:
    """Yield the index of each motion after which the number of unstable multipliers changes.

    Motions without a verdict between two with a verdict are skipped, unless the number differs
    between these two and the multipliers of all motions between them are known.
    """
    known = [index for index, at in enumerate(stability) if at.verdict != "unknown"]
    for first, last in pairwise(known):
        resolved = all(at.resolved for at in stability[first:last])
        if resolved and stability[first].beyond != stability[last].beyond:
            for index in range(first, last):
                if stability[index].beyond != stability[index + 1].beyond:
                    yield index


def _fold_segments(
    curve: FollowedCurve[L], motions: Sequence[HarmonicSolution], segments: Sequence[_Segment[L]]
) -> Iterator[int]:
    """Yield the index of each motion after which the curve turns back in its parameter."""
    steps = np.diff([curve.parameter_of(motion) for motion in motions])
    for index in range(1, len(steps)):
        if steps[index - 1] * steps[index] < 0.0:
            # The direction of the curve at the farthest point tells on which side of it the fold
            # lies.
            located = segments[index].at(0.0)
            turned = located is not None and located.parameter_direction * steps[index] > 0.0
            yield index - 1 if turned else index


def _kind_of(multiplier: complex) -> Kind:
    """Return the kind of bifurcation at which a multiplier crosses the unit circle."""
    if abs(abs(multiplier) - 1.0) > JUMP_DISTANCE:
        return "jump"
    angle = abs(np.angle(multiplier))
    if angle <= REAL_ANGLE:
        return "branching"
    return "period_doubling" if np.pi - angle <= REAL_ANGLE else "neimark_sacker"


class _CurveLost(ConvergenceError):
    """Error raised where Newton's method does not find the curve."""


class _Segment(Generic[L]):
    """Segment of a curve between two of its motions, parametrised by shares of the chord."""

    def __init__(self, chord: Chord[L], floquet: Floquet) -> None:
        self._chord, self._floquet = chord, floquet
        self._points: dict[float, LocatedPoint[L] | None] = {}
        self._stabilities: dict[float, Stability] = {}

    def at(self, share: float) -> LocatedPoint[L] | None:
        """Return the point of the curve across the chord at a share of it, or None."""
        if share not in self._points:
            self._points[share] = self._chord.at(share)
        return self._points[share]

    def fold(self) -> tuple[HarmonicSolution, complex] | None:
        """Return the motion at which the curve turns back, and the multiplier nearest to 1."""
        share = self._root(lambda share: self._require(share).parameter_direction)
        if share is None:
            return None
        # These are multipliers of the motion as given by its harmonics, since the fold is one of
        # that curve.
        multipliers = self._floquet.multipliers(self._motion(share))
        nearest = min(multipliers, key=lambda value: float(abs(value - 1.0)), default=0.0)
        return self._motion(share), complex(nearest)

    def circle_crossings(
        self, before: int, after: int
    ) -> Iterator[tuple[HarmonicSolution, complex]]:
        """Yield the motions at which a multiplier or a pair crosses the unit circle.

        ``before`` and ``after`` are the numbers of multipliers outside the circle at the ends.
        """
        index, last = min(before, after), max(before, after)
        while index < last:

            def distance(share: float, index: int = index) -> float:
                multipliers = self._stability(share).multipliers
                return float(abs(multipliers[index])) - 1.0 if index < len(multipliers) else -1.0

            share = self._root(distance)
            if share is None:
                return
            multiplier = complex(self._stability(share).multipliers[index])
            yield self._motion(share), multiplier
            index += 2 if _kind_of(multiplier) == "neimark_sacker" else 1

    def _root(self, function: Callable[[float], float]) -> float | None:
        """Return the share at which a function of it crosses zero, or None if it does not."""
        try:
            if function(0.0) * function(1.0) > 0.0:
                return None
            share = float(brentq(function, 0.0, 1.0, xtol=LOCATION_TOLERANCE))
            # The value at the root is cached for later.
            function(share)
            return share
        except _CurveLost:
            return None

    def _motion(self, share: float) -> HarmonicSolution:
        point = self._require(share)
        unknowns, parameter = point.point.unknowns, point.point.parameter
        return self._chord.curve.motion_of(unknowns, parameter, point.equations)

    def _stability(self, share: float) -> Stability:
        if share not in self._stabilities:
            self._stabilities[share] = self._floquet.stability(self._motion(share))
        if not self._stabilities[share].resolved:
            raise _CurveLost
        return self._stabilities[share]

    def _require(self, share: float) -> LocatedPoint[L]:
        point = self.at(share)
        if point is None:
            raise _CurveLost
        return point
