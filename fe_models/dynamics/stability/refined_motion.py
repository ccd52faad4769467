"""Refinement of a periodic motion in time, with steps that resolve all changes of the joints.

Where a stop is stiff, or a slider sticks only for a moment, harmonics resolve poorly the instants
at which joints change their state, and multipliers depend on just these instants. The joint
displacements from harmonic balance are therefore the initial guess of Newton's method for all times
of a period at once. The structure takes exact steps under its load and under joint forces that are
linear in each step. Steps are short where joints change their state. The derivative of the very
same steps is the map of deviations over a period.
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
    DrivenMotion,
    ModalStructure,
    PeriodMap,
    period_map,
)
from fe_models.dynamics.transient.linear_steps import SPLIT
from sa_solver.types import Array

# The refinement has converged when two successive iterations change the motion by no more than this
# share of its vibration, within this number of iterations. A single small change is not enough:
# where a stop is barely touched, the map of deviations belongs to the motion before the change.
CONVERGED, MAX_ITERATIONS = 1e-6, 15
# Largest relative difference of the refined motion from that in harmonics: one farther away may be
# another motion.
MAX_DISTANCE = 0.1

# Share of the steps, and number of levels omitted, in a comparison with coarser steps that start at
# other times. Steps in which joints change their state are then longer by this ratio, and more.
COARSER_STEPS, FEWER_LEVELS = 0.625, 2
EVENT_STEP_RATIO = SPLIT**FEWER_LEVELS

Path = Callable[[Array], Array]
"""Function that returns joint displacements ``(t, j d)`` [mm] at shares ``(t,)`` of a period."""


class RefinedMotion(NamedTuple):
    """Motion refined in time.

    Parameters
    ----------
    path
        Displacements of the joints in the motion.
    times
        Steps of the period.
    period_map
        Map of deviations over the period.
    neutral
        Number of neutral deviations.
    delayed
        Function that returns the map with joints that become stiffer one shortest step later.
    """

    path: Path
    times: PeriodTimes
    period_map: PeriodMap
    neutral: int
    delayed: Callable[[], PeriodMap]


class MotionInTime:
    """Refinement of a motion in time, for a problem with few joints and modes.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    structure
        Its modes, those of all sectors for a ring.
    motion
        The motion from harmonic balance.
    ring
        For a sector in a travelling wave, its ring, else None.
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
        sectors = [motion]
        if ring is not None:
            sectors = [motion_of(ring, motion, sector) for sector in range(ring.sectors)]
        count, _, directions = motion.coefficients.shape
        # The functions of time are the displacements themselves.
        each = np.eye(count * directions).reshape(-1, count, directions)
        self._unit_coefficients = np.ascontiguousarray(each.transpose(1, 0, 2))
        rows = np.hstack([by_function(of.coefficients) for of in sectors])
        self.harmonic_path: Path = lambda shares: (
            motion.resolution.functions_at_shares(shares) @ rows
        )
        self._vibration = float(np.linalg.norm(np.ptp(self._values(self.harmonic_path), axis=0)))

    @staticmethod
    def _values(path: Path) -> Array:
        return path(np.arange(128) / 128)

    def refine(self, samples: int, deepest: int, path: Path | None = None) -> RefinedMotion | None:
        """Return the refined motion near a path, or None if the iterations do not converge.

        Parameters
        ----------
        samples
            Number of steps of level 0.
        deepest
            Deepest level of the steps.
        path
            Initial guess; the motion from harmonic balance if None.
        """
        path, before = path or self.harmonic_path, np.inf
        for _ in range(MAX_ITERATIONS):
            refined, change = self._newton_step(path, self._times(path, samples, deepest))
            if refined is None:
                return None
            path = refined.path
            if max(before, change) <= CONVERGED:
                return refined if self._distance(path) <= MAX_DISTANCE else None
            before = change
        return None

    def comparison_maps(self, refined: RefinedMotion) -> tuple[PeriodMap, PeriodMap] | None:
        """Return maps with joints that stiffen a step later, and with coarser steps.

        The coarser steps start at other times. The result is None if the motion is not found with
        them.
        """
        times = refined.times
        steps = 2 * int(0.5 * COARSER_STEPS * times.samples), max(times.deepest - FEWER_LEVELS, 0)
        coarser = self.refine(*steps, refined.path)
        return None if coarser is None else (refined.delayed(), coarser.period_map)

    def volume_error(self, refined: RefinedMotion) -> float:
        """Return the relative error of the product of all multipliers.

        Liouville's formula gives the product exp(-T tr M⁻¹C) if joints have no state variables;
        otherwise the result is 0.
        """
        matrix, damping = refined.period_map.matrix, self._structure.damping
        if len(matrix) != 2 * len(damping):
            return 0.0
        sign, size = np.linalg.slogdet(matrix)
        error = sign * np.exp(size + np.trace(damping) / self._frequency) - 1.0
        return abs(float(error))

    def _distance(self, path: Path) -> float:
        """Return the distance of a motion from that in harmonics, relative to the vibration."""
        difference = self._values(path) - self._values(self.harmonic_path)
        return float(np.linalg.norm(np.abs(difference).max(axis=0))) / self._vibration

    def _newton_step(self, path: Path, times: PeriodTimes) -> tuple[RefinedMotion | None, float]:
        """Return the motion after one step of Newton's method, and its relative change."""
        shares = times.starts / times.parts
        displacement = path(shares)
        deviations = self._deviations(displacement, times)
        joints = ActiveJoints.of(deviations, self._structure, every=True)
        driven = DrivenMotion(self._harmonics, self._load, displacement)
        at = self._structure, self._frequency, times, deviations, joints
        linear = period_map(*at, driven)
        try:
            change = linear.corrections()
        except np.linalg.LinAlgError:
            return None, np.inf
        size = norm(np.abs(change).max(axis=0)) / self._vibration
        if not size < 1.0:
            return None, size
        after = displacement + change
        ends = np.append(shares, 1.0), np.vstack([after, after[:1]])
        spline = CubicSpline(*ends, bc_type="periodic")
        neutral = joints.neutral + linear.shifts.shape[1]
        delayed = partial(period_map, *at, delayed=True)
        return RefinedMotion(spline, times, linear, neutral, delayed), size

    def _times(self, path: Path, samples: int, deepest: int) -> PeriodTimes:
        """Return the steps of a period, short where joints change their state."""

        def displacement(times: PeriodTimes) -> Array:
            return path(times.starts / times.parts)

        def regimes(times: PeriodTimes) -> np.ndarray:
            return self._deviations(displacement(times), times).regimes

        return PeriodTimes.adapted(regimes, samples, deepest, displacement)

    def _deviations(self, displacement: Array, times: PeriodTimes) -> Deviations:
        steps = np.diff(np.append(times.starts, times.parts)) / times.parts
        mean = steps @ (0.5 * (displacement + np.roll(displacement, -1, axis=0)))
        lead = np.vstack([mean, displacement[0]]) if self._mean else displacement[:1]
        count = len(self._unit_coefficients[0])
        parts = [slice(first, first + count) for first in range(0, displacement.shape[1], count)]

        def linearised(part: slice, memory: int) -> Deviations:
            return self._joints.linearise(
                self._unit_coefficients, displacement[:, part], lead[:, part], memory
            )

        if len(parts) == 1:
            return linearised(parts[0], 0)
        memory = max(linearised(part, 0).kept.shape[2] for part in parts)
        return JoinedDeviations.of(linearised(part, memory) for part in parts)


def _load(
    problem: HarmonicBalance, motion: HarmonicSolution, ring: Ring | None, points: int
) -> ComplexArray:
    """Return the load ``(k, p)`` on a structure of ``points`` points, in a motion's harmonics."""
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
