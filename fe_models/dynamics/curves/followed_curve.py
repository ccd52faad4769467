"""Curves of periodic motions, and points between two of their points.

Such a point is found from the chord between the two: Newton's method leads to the curve in the
plane across the chord.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic

import numpy as np

from fe_models.dynamics.curves.curve_steps import ContinuationControl, CurvePoint, Scaling, correct
from fe_models.dynamics.curves.newton import Equations, L
from fe_models.dynamics.curves.sizes import norm
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from sa_solver.types import Array

# Largest distance of a motion from the chord between its neighbours, over the length of the chord.
# A curve whose tangent turns by 30 degrees in a step is a tenth away.
MAX_DISTANCE = 0.5


@dataclass(frozen=True)
class FollowedCurve(Generic[L]):
    """Equations of a curve of motions, and the relation between motions and points of the curve.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    equations
        Equations of the curve.
    origin
        Unknowns ``(n,)`` from which steps are measured relatively.
    unknowns_of, parameter_of
        Functions that return unknowns and parameter of a motion.
    motion_of
        Function that returns the motion for unknowns, a parameter and the equations there.
    refined
        Function that returns the curve of the same problem at another resolution.
    """

    problem: HarmonicBalance
    equations: Equations[L]
    origin: Array
    unknowns_of: Callable[[HarmonicSolution], Array]
    parameter_of: Callable[[HarmonicSolution], float]
    motion_of: Callable[[Array, float, L], HarmonicSolution]
    refined: Callable[[HarmonicBalance], FollowedCurve[L]]

    def coordinates_of(self, motion: HarmonicSolution) -> Array:
        """Return unknowns and parameter of a motion ``(n + 1,)``."""
        return np.append(self.unknowns_of(motion), self.parameter_of(motion))


def curve_by_frequency(problem: HarmonicBalance, force: float) -> FollowedCurve[Balance]:
    """Return the curve of motions under a force, with the frequency as parameter."""
    return FollowedCurve(
        problem,
        problem.by_frequency(force),
        problem.guess(None),
        problem.guess,
        lambda motion: motion.frequency,
        lambda unknowns, frequency, at: problem.describe(unknowns, at, frequency, force),
        lambda finer: curve_by_frequency(finer, force),
    )


def curve_by_force(problem: HarmonicBalance, frequency: float) -> FollowedCurve[Balance]:
    """Return the curve of motions at a frequency [Hz], with the force as parameter."""
    return FollowedCurve(
        problem,
        problem.by_force(frequency),
        problem.guess(None),
        problem.guess,
        lambda motion: motion.force,
        lambda unknowns, force, at: problem.describe(unknowns, at, frequency, force),
        lambda finer: curve_by_force(finer, frequency),
    )


@dataclass(frozen=True)
class LocatedPoint(Generic[L]):
    """Point of a curve that has been located between two others.

    ``equations`` are those at the ``point``, and ``parameter_direction`` is the component of the
    curve's direction along the parameter; it is 0 at a fold.
    """

    point: CurvePoint
    equations: L
    parameter_direction: float


@dataclass(frozen=True)
class Chord(Generic[L]):
    """Chord between two points ``(n + 1,)`` of a curve; a share of 0 is its start, 1 its end."""

    curve: FollowedCurve[L]
    begin: Array
    end: Array
    control: ContinuationControl

    def at(self, share: float) -> LocatedPoint[L] | None:
        """Return the point of the curve across the chord at a share of it, or None."""
        # A step of the length of the chord that leads to this share of it.
        start = self._point(self.begin + (share - 1.0) * self._difference)
        corrected = correct(self.curve.equations, start, self._step, self._scaling, self.control)
        if corrected is None:
            return None
        point, equations, tangent = corrected
        return LocatedPoint(point, equations, float(tangent[-1]))

    def contains(self, coordinates: Array) -> bool:
        """Return whether a point ``(n + 1,)`` is close to the chord, between its ends."""
        offset, length = self._scaling.scaled(coordinates - self.begin), norm(self._step)
        share = float(offset @ self._step) / length**2
        return 0.0 <= share <= 1.0 and norm(offset - share * self._step) <= MAX_DISTANCE * length

    @cached_property
    def _difference(self) -> Array:
        return self.end - self.begin

    @cached_property
    def _step(self) -> Array:
        return self._scaling.scaled(self._difference)

    @cached_property
    def _scaling(self) -> Scaling:
        curve = self.curve
        scaling = Scaling(abs(float(self.end[-1])), curve.origin, curve.problem.rounding)
        scaling.adapt(self._point(self.begin))
        return scaling

    def _point(self, coordinates: Array) -> CurvePoint:
        return CurvePoint(
            coordinates[:-1], float(coordinates[-1]), self._difference, 1.0, 0, 0, 0.0
        )
