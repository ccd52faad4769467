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
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from fe_models.dynamics.curves.sizes import norm
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray, by_function
from fe_models.dynamics.periodic.joints import DeviatingJoints, Deviations
from fe_models.dynamics.periodic.period_times import PeriodTimes
from fe_models.dynamics.rings.sector import Ring
from fe_models.dynamics.rings.whole_ring import JoinedDeviations, motion_of
from fe_models.dynamics.stability.deviating_structure import (
    ActiveJoints,
    Deviating,
    Driven,
    ModalStructure,
    deviating,
)
from fe_models.dynamics.transient.linear_steps import SPLIT
from sa_solver.types import Array

# A motion is found where two steps in succession change it by no more than this share of its
# vibration, in at most so many steps: a single step says what becomes of deviations from the motion
# before it, and where a stop is barely met that is another matter.
FOUND, MOST_STEPS = 1e-6, 15
# Share of its vibration by which the motion in time may differ from that in harmonics: one further
# away may be another.
NEAR = 0.1

# Share of the steps with which the motion is found once more, in steps that begin elsewhere, and
# levels left out there: steps in which joints change are then so many times as long, and more.
COARSER, LEVELS_LESS = 0.625, 2
EVENTS_LONGER = SPLIT**LEVELS_LESS

Path = Callable[[Array], Array]
"""Displacements of joints ``(t, j d)`` [mm] at shares ``(t,)`` of a period."""


class RefinedMotion(NamedTuple):
    """A motion in time: its ``path``, the ``times`` at which it was found, what a period makes of
    deviations from it, how many of these are ``neutral``, and the same with joints that become
    stiffer one shortest step ``late``.
    """

    path: Path
    times: PeriodTimes
    deviating: Deviating
    neutral: int
    late: Callable[[], Deviating]


class MotionInTime:
    """A ``motion`` of a problem with few joints and modes, at times of a period.

    Of a sector in a wave ``ring`` tells how all sectors of its ring follow it.
    """

    def __init__(
        self,
        problem: HarmonicBalance,
        structure: ModalStructure,
        motion: HarmonicSolution,
        ring: Ring | None,
    ) -> None:
        assert isinstance(problem.joints, DeviatingJoints)
        self._joints, self._structure = problem.joints, structure
        self._frequency, self._mean = motion.frequency, motion.resolution.harmonics[0] == 0
        self._harmonics = np.array(motion.resolution.harmonics)
        self._load = _load(problem, motion, ring, len(structure.at_points))
        sectors = [motion] if ring is None else _every(ring, motion)
        count, _, directions = motion.coefficients.shape
        # Functions of time are the displacements themselves.
        each = np.eye(count * directions).reshape(-1, count, directions)
        self._each = np.ascontiguousarray(each.transpose(1, 0, 2))
        rows = np.hstack([by_function(of.coefficients) for of in sectors])
        self.in_harmonics: Path = lambda shares: motion.resolution.functions_during(shares) @ rows
        self._vibration = float(np.linalg.norm(np.ptp(self._values(self.in_harmonics), axis=0)))

    @staticmethod
    def _values(path: Path) -> Array:
        return path(np.arange(128) / 128)

    def found(self, samples: int, deepest: int, path: Path | None = None) -> RefinedMotion | None:
        """The motion near to a path, that in harmonics at first, with so many steps and levels.

        None where steps go on to change it.
        """
        path, before = path or self.in_harmonics, np.inf
        for _ in range(MOST_STEPS):
            refined, change = self._stepped(path, self._times(path, samples, deepest))
            if refined is None:
                return None
            path = refined.path
            if max(before, change) <= FOUND:
                return refined if self._distance(path) <= NEAR else None
            before = change
        return None

    def others(self, refined: RefinedMotion) -> tuple[Deviating, Deviating] | None:
        """Return the map of one period with joints that stiffen a step later, and in longer steps.

        The longer steps begin at other times; None where the motion is not found in these.
        """
        times = refined.times
        steps = 2 * int(0.5 * COARSER * times.samples), max(times.deepest - LEVELS_LESS, 0)
        coarser = self.found(*steps, refined.path)
        return None if coarser is None else (refined.late(), coarser.deviating)

    def volume_error(self, refined: RefinedMotion) -> float:
        """Relative error of the product of all multipliers, by Liouville's formula exp(-T tr M⁻¹C).

        It holds where joints remember nothing; 0 where they do.
        """
        matrix, damping = refined.deviating.matrix, self._structure.damping
        if len(matrix) != 2 * len(damping):
            return 0.0
        sign, size = np.linalg.slogdet(matrix)
        error = sign * np.exp(size + np.trace(damping) / self._frequency) - 1.0
        return abs(float(error))

    def _distance(self, path: Path) -> float:
        """Return how far a motion is from the one in harmonics, as a share of the vibration."""
        away = self._values(path) - self._values(self.in_harmonics)
        return float(np.linalg.norm(np.abs(away).max(axis=0))) / self._vibration

    def _stepped(self, path: Path, times: PeriodTimes) -> tuple[RefinedMotion | None, float]:
        """The motion by one step of Newton's method, and by how much it has changed."""
        shares = times.starts / times.parts
        moved = path(shares)
        deviations = self._deviations(moved, times)
        joints = ActiveJoints.of(deviations, self._structure, every=True)
        driven = Driven(self._harmonics, self._load, moved)
        at = self._structure, self._frequency, times, deviations, joints
        linear = deviating(*at, driven)
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
        late = partial(deviating, *at, late=True)
        return RefinedMotion(spline, times, linear, neutral, late), size

    def _times(self, path: Path, samples: int, deepest: int) -> PeriodTimes:
        """Steps of a period, short where joints change what they do."""

        def moved(times: PeriodTimes) -> Array:
            return path(times.starts / times.parts)

        def regimes(times: PeriodTimes) -> np.ndarray:
            return self._deviations(moved(times), times).regimes

        return PeriodTimes.following(regimes, samples, deepest, moved)

    def _deviations(self, moved: Array, times: PeriodTimes) -> Deviations:
        steps = np.diff(np.append(times.starts, times.parts)) / times.parts
        mean = steps @ (0.5 * (moved + np.roll(moved, -1, axis=0)))
        lead = np.vstack([mean, moved[0]]) if self._mean else moved[:1]
        count = len(self._each[0])
        parts = [slice(first, first + count) for first in range(0, moved.shape[1], count)]

        def of(part: slice, memory: int) -> Deviations:
            return self._joints.linearise(self._each, moved[:, part], lead[:, part], memory)

        if len(parts) == 1:
            return of(parts[0], 0)
        memory = max(of(part, 0).kept.shape[2] for part in parts)
        return JoinedDeviations.of(of(part, memory) for part in parts)


def _every(ring: Ring, motion: HarmonicSolution) -> list[HarmonicSolution]:
    """The motions of all sectors of a ring."""
    return [motion_of(ring, motion, sector) for sector in range(ring.sectors)]


def _load(
    problem: HarmonicBalance, motion: HarmonicSolution, ring: Ring | None, points: int
) -> ComplexArray:
    """The load ``(k, p)`` on a structure of so many ``points`` in the harmonics of a motion."""
    harmonics = motion.resolution.harmonics
    load = np.zeros((len(harmonics), points), dtype=complex)
    for row, harmonic in enumerate(harmonics):
        angular = 2.0 * np.pi * motion.frequency * harmonic
        amplitude = problem.load.amplitude(harmonic, angular, motion.force)
        if ring is None:
            load[row] = amplitude
        else:
            shift = ring.shift(harmonic)
            later = [ring.phase(sector * shift) for sector in range(ring.sectors)]
            whole = np.broadcast_to(amplitude, points // ring.sectors)
            load[row] = np.outer(later, whole).ravel()
    return load
