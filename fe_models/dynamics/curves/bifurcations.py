"""Bifurcations on a curve of periodic motions: where their stability changes, and where it folds.

Between two points the curve is followed along the chord, across which Newton's method leads back to
it. Where multipliers leave the unit circle the one that does so is brought to it there, and says
what happens: at 1 the curve folds, or another one branches off, as where a motion loses its
symmetry; at -1 the period doubles; a pair elsewhere is a Neimark-Sacker bifurcation (Seydel 2010,
*Practical Bifurcation and Stability Analysis*, 3rd ed., section 7.4).

Folds are found by the curve itself, where it turns: the multiplier of a motion of few harmonics is
1 nearby. Everything else is looked for only between motions whose multipliers are known. Joints
that begin to touch or to slip may take multipliers past the circle in a jump.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Generic, Literal

import numpy as np
from scipy.optimize import brentq

from fe_models.dynamics.curves.control import ContinuationControl
from fe_models.dynamics.curves.followed_curve import Chord, FollowedCurve, Place
from fe_models.dynamics.curves.newton import L
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.stability.floquet import Floquet, Stability
from sa_solver.errors import ConvergenceError

Kind = Literal["fold", "branching", "period_doubling", "neimark_sacker", "jump"]
# Share of the way between two points to which a bifurcation is located.
LOCATED = 1e-5
# Distance of a multiplier from the circle at a bifurcation beyond which it has jumped past it.
NEAR = 2e-2
# Angle [rad] from 1 or -1 up to which one on the circle is taken as real: two that meet there part
# along it as the root of how far they are past it.
REAL = 2e-2


@dataclass(frozen=True)
class Bifurcation:
    """A ``motion`` of a ``kind``, between two points of a curve of which one comes ``after`` so
    many others.

    ``multiplier`` is the one that passes the circle there; of a fold, the nearest to 1.
    ``unstable`` is how many are beyond the circle at the points before and after, None where that
    is not known.
    """

    kind: Kind
    motion: HarmonicSolution
    multiplier: complex
    after: int
    unstable: tuple[int | None, int | None]


def find_bifurcations(
    curve: FollowedCurve[L], motions: Sequence[HarmonicSolution], stability: Sequence[Stability]
) -> tuple[Bifurcation, ...]:
    """Those between ``motions`` of a curve, in their order, of which the ``stability`` is known.

    Where Newton's method does not find the curve between two points none is told there.
    """
    floquet = Floquet(curve.problem)
    places = [curve.coordinates_of(motion) for motion in motions]
    control = ContinuationControl()
    ways = [_Way(Chord(curve, *ends, control), floquet) for ends in pairwise(places)]
    folds = {place: fold for place in _turns(curve, motions, ways) if (fold := ways[place].fold())}
    counts: dict[int, tuple[int | None, int | None]] = {}
    found = []
    for place in _changes(stability):
        changed = stability[place].beyond, stability[place + 1].beyond
        for motion, multiplier in ways[place].passages(*changed):
            kind = _kind_of(multiplier)
            near = [at for at in (place, place - 1, place + 1) if at in folds]
            if near and kind in ("branching", "jump"):
                counts[near[0]] = changed
            else:
                found.append(Bifurcation(kind, motion, multiplier, place, changed))
    for place, (motion, multiplier) in folds.items():
        beside = stability[place], stability[place + 1]
        before, after = (at.beyond if at.resolved else None for at in beside)
        unstable = counts.get(place, (before, after))
        found.append(Bifurcation("fold", motion, multiplier, place, unstable))
    return tuple(sorted(found, key=lambda bifurcation: bifurcation.after))


def _changes(stability: Sequence[Stability]) -> Iterator[int]:
    """Points between which and the next the number of multipliers beyond the circle changes.

    Where several of no verdict lie between two that have one, only if it does between these, and
    if the multipliers of all of them are known.
    """
    known = [place for place, at in enumerate(stability) if at.verdict != "unknown"]
    for first, last in pairwise(known):
        resolved = all(at.resolved for at in stability[first:last])
        if resolved and stability[first].beyond != stability[last].beyond:
            for place in range(first, last):
                if stability[place].beyond != stability[place + 1].beyond:
                    yield place


def _turns(
    curve: FollowedCurve[L], motions: Sequence[HarmonicSolution], ways: Sequence[_Way[L]]
) -> Iterator[int]:
    """Points between which and the next the curve turns back in its parameter."""
    steps = np.diff([curve.parameter_of(motion) for motion in motions])
    for place in range(1, len(steps)):
        if steps[place - 1] * steps[place] < 0.0:
            # On which side of the farthest point it turns is told by its direction there.
            ahead = ways[place].at(0.0)
            turned = ahead is not None and ahead.turning * steps[place] > 0.0
            yield place - 1 if turned else place


def _kind_of(multiplier: complex) -> Kind:
    """What happens where a multiplier passes the circle."""
    if abs(abs(multiplier) - 1.0) > NEAR:
        return "jump"
    angle = abs(np.angle(multiplier))
    if angle <= REAL:
        return "branching"
    return "period_doubling" if np.pi - angle <= REAL else "neimark_sacker"


class _Lost(ConvergenceError):
    """Newton's method does not find the curve."""


class _Way(Generic[L]):
    """The way from one motion of a curve to another, by shares of the chord between them."""

    def __init__(self, chord: Chord[L], floquet: Floquet) -> None:
        self._chord, self._floquet = chord, floquet
        self._places: dict[float, Place[L] | None] = {}
        self._known: dict[float, Stability] = {}

    def at(self, share: float) -> Place[L] | None:
        """The point of the curve across the chord at a share of it; None where there is none."""
        if share not in self._places:
            self._places[share] = self._chord.at(share)
        return self._places[share]

    def fold(self) -> tuple[HarmonicSolution, complex] | None:
        """Where the curve turns, and the multiplier nearest to 1."""
        share = self._root(lambda share: self._require(share).turning)
        if share is None:
            return None
        # Of the curve as its harmonics have it: its fold is one of them.
        multipliers = self._floquet.multipliers(self._motion(share))
        nearest = min(multipliers, key=lambda value: float(abs(value - 1.0)), default=0.0)
        return self._motion(share), complex(nearest)

    def passages(self, before: int, after: int) -> Iterator[tuple[HarmonicSolution, complex]]:
        """Where multipliers, of which so many are beyond the circle, pass it, one or a pair."""
        number, last = min(before, after), max(before, after)
        while number < last:

            def distance(share: float, number: int = number) -> float:
                multipliers = self._stability(share).multipliers
                return float(abs(multipliers[number])) - 1.0 if number < len(multipliers) else -1.0

            share = self._root(distance)
            if share is None:
                return
            multiplier = complex(self._stability(share).multipliers[number])
            yield self._motion(share), multiplier
            number += 2 if _kind_of(multiplier) == "neimark_sacker" else 1

    def _root(self, function: Callable[[float], float]) -> float | None:
        """The share at which a function of it passes zero, None where it does not."""
        try:
            if function(0.0) * function(1.0) > 0.0:
                return None
            share = float(brentq(function, 0.0, 1.0, xtol=LOCATED))
            function(share)  # known there too
            return share
        except _Lost:
            return None

    def _motion(self, share: float) -> HarmonicSolution:
        place = self._require(share)
        unknowns, parameter = place.point.unknowns, place.point.parameter
        return self._chord.curve.motion_of(unknowns, parameter, place.equations)

    def _stability(self, share: float) -> Stability:
        if share not in self._known:
            self._known[share] = self._floquet.stability(self._motion(share))
        if not self._known[share].resolved:
            raise _Lost
        return self._known[share]

    def _require(self, share: float) -> Place[L]:
        place = self.at(share)
        if place is None:
            raise _Lost
        return place
