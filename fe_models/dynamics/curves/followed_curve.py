"""Curves of periodic motions once they are followed: what of one lies between two of its points.

It is found along the chord between them, across which Newton's method leads back to the curve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic

import numpy as np

from fe_models.dynamics.curves.continuation import CurvePoint, Scaling, correct
from fe_models.dynamics.curves.control import ContinuationControl
from fe_models.dynamics.curves.newton import Equations, L
from fe_models.dynamics.curves.phase_resonance import PhaseBalance, PhaseResonance
from fe_models.dynamics.curves.sizes import norm
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from sa_solver.types import Array

# Of a chord's length: how far from it a motion between its ends may be. A curve whose tangent turns
# by 30 degrees in a step is off by a tenth.
BESIDE = 0.5


@dataclass(frozen=True)
class FollowedCurve(Generic[L]):
    """The ``equations`` of a curve of motions of a ``problem``, and how motions are points of it.

    ``unknowns_of`` and ``parameter_of`` a motion; ``motion_of`` unknowns, a parameter and the
    equations there; steps are shares of what unknowns differ from the ``origin`` ``(n,)``.
    """

    problem: HarmonicBalance
    equations: Equations[L]
    origin: Array
    unknowns_of: Callable[[HarmonicSolution], Array]
    parameter_of: Callable[[HarmonicSolution], float]
    motion_of: Callable[[Array, float, L], HarmonicSolution]

    def coordinates_of(self, motion: HarmonicSolution) -> Array:
        """Unknowns and parameter ``(n + 1,)``."""
        return np.append(self.unknowns_of(motion), self.parameter_of(motion))


def curve_by_frequency(problem: HarmonicBalance, force: float) -> FollowedCurve[Balance]:
    """Motions under a force, along the frequency."""
    return FollowedCurve(
        problem,
        problem.by_frequency(force),
        problem.guess(None),
        problem.guess,
        lambda motion: motion.frequency,
        lambda unknowns, frequency, at: problem.describe(unknowns, at, frequency, force),
    )


def curve_by_force(problem: HarmonicBalance, frequency: float) -> FollowedCurve[Balance]:
    """Motions at a frequency [Hz], along the force."""
    return FollowedCurve(
        problem,
        problem.by_force(frequency),
        problem.guess(None),
        problem.guess,
        lambda motion: motion.force,
        lambda unknowns, force, at: problem.describe(unknowns, at, frequency, force),
    )


def curve_by_phase(problem: HarmonicBalance, near: HarmonicSolution) -> FollowedCurve[PhaseBalance]:
    """Phase resonances, along the force; frequencies are counted from that of one of them."""
    equations = PhaseResonance.near(problem, near)

    def unknowns_of(motion: HarmonicSolution) -> Array:
        return np.append(problem.guess(motion), equations.place_of(motion.frequency))

    def motion_of(unknowns: Array, force: float, at: PhaseBalance) -> HarmonicSolution:
        return problem.describe(unknowns[:-1], at.balance, at.frequency, force)

    origin = np.append(problem.guess(None), 0.0)
    return FollowedCurve(
        problem, equations, origin, unknowns_of, lambda motion: motion.force, motion_of
    )


@dataclass(frozen=True)
class Place(Generic[L]):
    """A ``point`` of a curve, the ``equations`` there, and its direction along the parameter."""

    point: CurvePoint
    equations: L
    turning: float


@dataclass(frozen=True)
class Chord(Generic[L]):
    """The way from one point ``(n + 1,)`` of a ``curve`` to another, by shares of it."""

    curve: FollowedCurve[L]
    begin: Array
    end: Array
    control: ContinuationControl

    def at(self, share: float) -> Place[L] | None:
        """The point of the curve across the chord at a share of it; None where it is not found."""
        # A step as long as the chord, from where it leads to this share of it.
        start = self._point(self.begin + (share - 1.0) * self._way)
        corrected = correct(self.curve.equations, start, self._step, self._scaling, self.control)
        if corrected is None:
            return None
        point, equations, tangent = corrected
        return Place(point, equations, float(tangent[-1]))

    def along(self, coordinates: Array) -> bool:
        """Whether a point ``(n + 1,)`` lies beside the chord, between its ends."""
        way, length = self._scaling.scaled(coordinates - self.begin), norm(self._step)
        share = float(way @ self._step) / length**2
        return 0.0 <= share <= 1.0 and norm(way - share * self._step) <= BESIDE * length

    @cached_property
    def _way(self) -> Array:
        return self.end - self.begin

    @cached_property
    def _step(self) -> Array:
        return self._scaling.scaled(self._way)

    @cached_property
    def _scaling(self) -> Scaling:
        curve = self.curve
        scaling = Scaling(abs(float(self.end[-1])), curve.origin, curve.problem.rounding)
        scaling.adapt(self._point(self.begin))
        return scaling

    def _point(self, coordinates: Array) -> CurvePoint:
        return CurvePoint(coordinates[:-1], float(coordinates[-1]), self._way, 1.0, 0, 0, 0.0)
