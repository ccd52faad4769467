"""Periodic motions in time: what a motion of few harmonics is near to, from event to event.

Where a stop is stiff, or a slider sticks for a moment only, harmonics show badly when joints change
what they do, and multipliers depend on just that. From the displacements of joints that harmonic
balance has found the motion is found again by Newton's method for all times of a period at once:
the structure is stepped exactly, under its load and under forces of joints that are linear in steps
which are short where joints change what they do. What a period makes of deviations from that motion
is the derivative of the very same steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from fe_models.dynamics.deviating_structure import (
    ActiveJoints,
    Deviating,
    Driven,
    ModalStructure,
    deviating,
)
from fe_models.dynamics.harmonic_balance import HarmonicBalance
from fe_models.dynamics.harmonic_solution import HarmonicSolution
from fe_models.dynamics.harmonics import by_function
from fe_models.dynamics.period_times import PeriodTimes
from fe_models.dynamics.periodic_joints import DeviatingJoints, Deviations
from fe_models.dynamics.sizes import norm
from sa_solver.types import Array

# A motion is found where a step changes it by no more than this share of its vibration, in at most
# so many steps.
FOUND, MOST_STEPS = 1e-8, 15
# Share of its vibration by which the motion in time may differ from that in harmonics: one further
# away may be another.
NEAR = 0.1

Path = Callable[[Array], Array]
"""Displacements of joints ``(t, j d)`` [mm] at shares ``(t,)`` of a period."""


class RefinedMotion(NamedTuple):
    """A motion in time: its ``path``, the ``times`` at which it was found, what a period makes of
    deviations from it, and how many of these are ``neutral``."""

    path: Path
    times: PeriodTimes
    deviating: Deviating
    neutral: int


class MotionInTime:
    """A ``motion`` of a problem with few joints and modes, at times of a period."""

    def __init__(
        self, problem: HarmonicBalance, structure: ModalStructure, motion: HarmonicSolution
    ) -> None:
        assert isinstance(problem.joints, DeviatingJoints)
        self._joints, self._structure = problem.joints, structure
        self._frequency = motion.frequency
        self._angular = motion.frequency * 2.0 * np.pi * np.array(motion.resolution.harmonics)
        of_motion = problem.refined(motion.resolution)
        self._amplitudes = of_motion.load_at(self._angular, motion.force)
        self._mean = motion.resolution.harmonics[0] == 0
        count, _, directions = motion.coefficients.shape
        # Functions of time are the displacements themselves.
        each = np.eye(count * directions).reshape(-1, count, directions)
        self._each = np.ascontiguousarray(each.transpose(1, 0, 2))
        rows = by_function(motion.coefficients)
        self.in_harmonics: Path = lambda shares: motion.resolution.functions_during(shares) @ rows
        self._vibration = float(np.linalg.norm(np.ptp(self._values(self.in_harmonics), axis=0)))

    @staticmethod
    def _values(path: Path) -> Array:
        return path(np.arange(128) / 128)

    def found(self, samples: int, deepest: int, path: Path) -> RefinedMotion | None:
        """The motion near to a path, with so many steps and levels; None where there is none."""
        for _ in range(MOST_STEPS):
            times = self._times(path, samples, deepest)
            refined, change = self._stepped(path, times)
            if refined is None:
                return None
            path = refined.path
            if change <= FOUND:
                return refined if self._distance(path) <= NEAR else None
        return None

    def coarser(self, refined: RefinedMotion) -> RefinedMotion | None:
        """The same motion in steps that are twice as long."""
        times, path = refined.times.halved(), refined.path
        for _ in range(MOST_STEPS):
            coarse, change = self._stepped(path, times)
            if coarse is None or change <= FOUND:
                return coarse
            path = coarse.path
        return None

    def _distance(self, path: Path) -> float:
        """Of a motion from that in harmonics, as a share of the vibration."""
        away = self._values(path) - self._values(self.in_harmonics)
        return float(np.linalg.norm(np.abs(away).max(axis=0))) / self._vibration

    def _stepped(self, path: Path, times: PeriodTimes) -> tuple[RefinedMotion | None, float]:
        """The motion by one step of Newton's method, and by how much it has changed."""
        shares = times.starts / times.parts
        moved = path(shares)
        deviations = self._deviations(moved, times)
        joints = ActiveJoints.of(deviations, self._structure, every=True)
        driven = Driven(self._angular, self._amplitudes, moved)
        linear = deviating(self._structure, self._frequency, times, deviations, joints, driven)
        try:
            change = linear.corrections()
        except np.linalg.LinAlgError:
            return None, np.inf
        size = norm(np.abs(change).max(axis=0)) / self._vibration
        if not size < 1.0:
            return None, size
        after = moved + change
        ends = np.append(shares, 1.0), np.vstack([after, after[:1]])
        spline = CubicSpline(*ends, bc_type="periodic")
        neutral = joints.neutral + linear.shifts.shape[1]
        return RefinedMotion(spline, times, linear, neutral), size

    def _times(self, path: Path, samples: int, deepest: int) -> PeriodTimes:
        """Steps of a period, short where joints change what they do."""

        def regimes(times: PeriodTimes) -> np.ndarray:
            return self._deviations(path(times.starts / times.parts), times).regimes

        return PeriodTimes.following(regimes, samples, deepest)

    def _deviations(self, moved: Array, times: PeriodTimes) -> Deviations:
        steps = np.diff(np.append(times.starts, times.parts)) / times.parts
        mean = steps @ (0.5 * (moved + np.roll(moved, -1, axis=0)))
        lead = np.vstack([mean, moved[0]]) if self._mean else moved[:1]
        return self._joints.linearise(self._each, moved, lead)
