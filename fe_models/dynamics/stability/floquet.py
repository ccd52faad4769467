"""Stability of periodic motions of structures with joints: Floquet multipliers.

The monodromy matrix maps a small deviation from a periodic motion over one period. Deviations decay
if all its eigenvalues, the multipliers, lie inside the unit circle (Nayfeh and Balachandran 1995,
*Applied Nonlinear Dynamics*, section 3.2). A deviation concerns the state of the structure and all
state variables of its joints. For hysteretic joints Hill's determinant, made of the Jacobian of
harmonic balance, is not enough: it describes the steady loop alone, as if sliders returned by
themselves.

Neutral deviations neither grow nor decay. They are identified by the state of the joints, not by a
tolerance. A slider that sticks all period long may be at any position (its multiplier is 1), and
acts as a spring on everything else. A structure that only sliders hold may be displaced as a whole.

For structures with few modes and joints, the motion is first refined in time
(:mod:`fe_models.dynamics.stability.refined_motion`); the multipliers are those of the refined
motion. Their error is estimated with longer steps that start at other times, and by Liouville's
formula for the product of all multipliers. If there is no refined motion nearby, there is no
verdict. For larger structures, and for rings, the error is estimated with half as many times per
period, and with a motion that differs by the error of the given one. If the distance of a
multiplier from the circle is not larger than its error, more times are taken; if that does not
help, there is no verdict.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray
from fe_models.dynamics.periodic.joints import DeviatingJoints, Deviations
from fe_models.dynamics.periodic.period_times import PeriodTimes
from fe_models.dynamics.rings.travelling_wave import WaveReceptance
from fe_models.dynamics.rings.whole_ring import JoinedDeviations, motion_of, ring_structure
from fe_models.dynamics.stability.deviating_structure import (
    ActiveJoints,
    ModalStructure,
    modes_below,
    period_map,
)
from fe_models.dynamics.stability.refined_motion import EVENT_STEP_RATIO, MotionInTime
from fe_models.dynamics.transient.linear_steps import SPLIT
from sa_solver import checks
from sa_solver.types import Array

Verdict = Literal["stable", "unstable", "unknown"]
# Smallest number of steps of a period, and levels by which steps are divided in four where a joint
# changes its state.
SAMPLES, DEEPEST = 128, 3
# Levels for a motion refined in time, levels added where the instants of changes matter, and number
# of attempts, each with four times as many steps or deeper levels.
DEEPEST_IN_TIME, EXTRA_LEVELS, ATTEMPTS = 4, 4, 4
# Error of the sum of all multipliers, relative to the largest or to 1, above which more steps are
# taken: for a complex pair it shows errors that their magnitudes do not.
SUM_TOLERANCE = 3e-4
# Number of refinements, each with four times as many steps, where the error exceeds the distance of
# multipliers from the circle.
REFINEMENTS = 2
# Number of multipliers that are reported, and magnitude below which one is negligible.
REPORTED, NEGLIGIBLE = 8, 1e-3
# Smallest distance of a multiplier from the circle, in estimated errors, for a verdict.
SAFETY = 2.0
# Rounding error of a multiplier, due to the product of steps and its eigenvalues.
ROUNDING = 1e-9
# Largest number of modes that are all taken, and frequency limit of modes beyond that number, over
# the highest harmonic of the motion. Largest number of joint directions of small structures; steps
# of a period of large ones; steps per period of the highest harmonic.
MOST_MODES, MODE_CUTOFF, MOST_DIRECTIONS, LARGE_SAMPLES, SAMPLES_PER_HARMONIC = 64, 3.0, 12, 128, 4
# Relative residual of harmonic balance above which a motion is not a solution.
MAX_RESIDUAL = 1e-4
# Largest number of modes of all sectors of a ring, none of which is neglected: more take minutes.
MOST_OF_RING = 256


@dataclass(frozen=True)
class Stability:
    """Stability of a periodic motion.

    Parameters
    ----------
    verdict
        Stable, unstable or unknown: whether deviations decay.
    multipliers
        Largest multipliers ``(k,)`` in descending order of magnitude, without the neutral ones.
    unstable
        Number of multipliers outside the unit circle by more than their errors.
    neutral
        Number of neutral deviations, whose multipliers are 1 for every motion.
    error
        Error of the largest multiplier, infinite where it is not known.
    message
        Reason why the verdict is unknown, else empty.
    """

    verdict: Verdict
    multipliers: ComplexArray
    unstable: int
    neutral: int
    error: float
    message: str

    @property
    def resolved(self) -> bool:
        """True if the error of the multipliers is known."""
        return bool(np.isfinite(self.error))

    @property
    def beyond(self) -> int:
        """Number of multipliers outside the unit circle, however close to it."""
        return int((np.abs(self.multipliers) > 1.0).sum())

    @property
    def largest(self) -> float:
        """Magnitude of the largest multiplier; 0 if there is none."""
        return float(abs(self.multipliers[0])) if len(self.multipliers) else 0.0


class Floquet:
    """Stability analysis of the motions of one problem.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    most_modes
        Number of modes above which only modes within reach of the motion's harmonics are followed.

    Examples
    --------
    A mass on a hardening spring has three motions at 0.22 Hz, of which the middle one is unstable:

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import PeriodicMarch, PolynomialSpring
    >>> rig = lumped_rig({"m": 1.0}, {Link("m"): 1.0}, [[Link("m")]], damping_ratio=0.05)
    >>> joints = PeriodicMarch(PolynomialSpring(0.0, cubic=1.0))
    >>> load = PeriodicLoad({1: unit_force(rig, "m")})
    >>> problem = HarmonicBalance(rig, joints, load, Resolution((1, 3, 5), 64))
    >>> branch = along_frequency(problem, 0.3, (0.1, 0.4))
    >>> passes = np.flatnonzero(np.diff(np.sign(branch.frequencies - 0.22)))
    >>> motions = [problem.solve(0.22, 0.3, branch.solutions[place]) for place in passes]
    >>> floquet = Floquet(problem)
    >>> for motion in motions:
    ...     print(f"{abs(motion.amplitude(0)):.2f} mm:", floquet.stability(motion).verdict)
    1.20 mm: stable
    0.89 mm: unstable
    0.36 mm: stable
    """

    def __init__(self, problem: HarmonicBalance, most_modes: int = MOST_MODES) -> None:
        self._most_modes = checks.whole("most_modes", most_modes)
        self._problem, self._joints = problem, problem.joints
        self._reduced: ModalStructure | None = None
        # Each sector has its own deviations, which need not travel like the wave.
        receptance = problem.receptance
        self._sector = receptance.sector if isinstance(receptance, WaveReceptance) else None
        self._sectors = 1 if self._sector is None else self._sector.ring.sectors

    def _structure(self, motion: HarmonicSolution) -> ModalStructure:
        """Return all modes of a small structure, or those that this motion may excite."""
        problem = self._problem
        if self._sector is not None:
            self._reduced = self._reduced or ring_structure(self._sector, self._joints.directions)
            return self._reduced
        if len(problem.uniform_receptance.squares) <= self._most_modes:
            return ModalStructure.whole(problem)
        highest = 2.0 * np.pi * motion.frequency * motion.resolution.harmonics[-1]
        count = modes_below(problem, MODE_CUTOFF * highest)
        if self._reduced is None or count != len(self._reduced.squares):
            self._reduced = ModalStructure.reduced(problem, count)
        return self._reduced

    @property
    def is_fast(self) -> bool:
        """True if the analysis of a motion takes milliseconds; otherwise it may take seconds."""
        modes, directions = (
            self._sectors * len(part)
            for part in (self._problem.model.mass, self._problem.model.connection)
        )
        return modes <= self._most_modes and directions <= MOST_DIRECTIONS

    def stability(self, motion: HarmonicSolution) -> Stability:
        """Return the stability of a motion of the problem, at any resolution."""
        if not isinstance(self._joints, DeviatingJoints):
            return _unknown("a contact of two bodies cannot be linearised about a motion")
        if self._problem.model.structural is not None:
            return _unknown(
                "a loss factor is defined for harmonic motion, not for deviations in time: use "
                "half of it as a damping ratio, which is the same at resonance"
            )
        modes = self._sectors * len(self._problem.model.mass)
        if self._sector is not None and modes > MOST_OF_RING:
            return _unknown(
                f"stability concerns all sectors of the ring, which have {modes} modes: more than "
                f"{MOST_OF_RING}"
            )
        structure = self._structure(motion)
        samples = SAMPLES if self.is_fast else LARGE_SAMPLES
        while samples < SAMPLES_PER_HARMONIC * motion.resolution.harmonics[-1]:
            samples *= 2
        few_modes = len(structure.squares) <= MOST_MODES
        if few_modes and len(structure.at_joints) <= MOST_DIRECTIONS:
            return self._by_refined_motion(motion, structure, samples)
        return self._by_harmonics(motion, structure, samples)

    def multipliers(self, motion: HarmonicSolution) -> ComplexArray:
        """Return the multipliers of a motion as given by its harmonics, without refinement.

        Where a curve of such motions folds, one of the multipliers is 1.
        """
        samples = SPLIT**REFINEMENTS * SAMPLES if self.is_fast else LARGE_SAMPLES
        times = self._times(motion, samples, DEEPEST if self.is_fast else 0)
        deviations, structure = self._deviations(motion, times), self._structure(motion)
        joints = ActiveJoints.of(deviations, structure)
        period = period_map(structure, motion.frequency, times, deviations, joints)
        return _largest(period.multipliers)

    def _by_refined_motion(
        self, motion: HarmonicSolution, structure: ModalStructure, samples: int
    ) -> Stability:
        """Return the stability of the refined motion near a motion, if there is one."""
        ring = None if self._sector is None else self._sector.ring
        in_time, stability = MotionInTime(self._problem, structure, motion, ring), None
        path, deepest = None, DEEPEST_IN_TIME
        for _ in range(ATTEMPTS if motion.residual <= MAX_RESIDUAL else 0):
            found = in_time.refine(samples, deepest, path)
            others = None if found is None else in_time.comparison_maps(found)
            if found is None or others is None:
                samples *= SPLIT
                continue
            fine, path = found.period_map.multipliers, found.path
            delayed, coarse = (other.multipliers for other in others)
            errors = np.maximum(_size_differences(fine, delayed), _size_differences(fine, coarse))
            errors += in_time.volume_error(found) * np.abs(fine)
            stability = _verdict(fine, errors, found.neutral)
            by_events, by_steps = (abs(np.sum(fine) - np.sum(each)) for each in (delayed, coarse))
            accurate = max(by_events, by_steps) <= SUM_TOLERANCE * max(stability.largest, 1.0)
            if stability.verdict != "unknown" and accurate:
                return stability
            # With longer steps, the error due to the instants of changes grows by this ratio.
            if 2.0 * EVENT_STEP_RATIO * by_events > by_steps:
                deepest += EXTRA_LEVELS
            else:
                samples *= SPLIT
        if stability is not None:
            return stability
        message = "no periodic motion in time is found near these harmonics: give more harmonics"
        return replace(_unknown(message), multipliers=self.multipliers(motion))

    def _by_harmonics(
        self, motion: HarmonicSolution, structure: ModalStructure, samples: int
    ) -> Stability:
        """Return the stability of a motion as given by its harmonics."""
        # With many joints, one changes in every step: no step is divided.
        refinements, deepest = (REFINEMENTS, DEEPEST) if self.is_fast else (0, 0)
        for refinement in range(refinements + 1):
            times = self._times(motion, SPLIT**refinement * samples, deepest + refinement)
            half = times.halved()
            # Maps with half as many steps, and the same for a motion that differs by the error of
            # this one.
            first, *others = self._with_equal_memory(
                (motion, times), (motion, half), (_scaled_by_error(motion), half)
            )
            joints = ActiveJoints.of(first, structure)
            at = structure, motion.frequency
            period = period_map(*at, times, first, joints)
            coarse, moved = (
                period_map(*at, half, deviations, joints).multipliers for deviations in others
            )
            fine = period.multipliers
            errors = _size_differences(fine, coarse) + _size_differences(moved, coarse)
            stability = _verdict(fine, errors, joints.neutral + period.shifts.shape[1])
            if stability.verdict != "unknown":
                break
        return stability

    def _times(self, motion: HarmonicSolution, samples: int, deepest: int) -> PeriodTimes:
        """Return the steps of a period, short where joints change their state."""
        return PeriodTimes.adapted(
            lambda times: self._deviations(motion, times).regimes, samples, deepest
        )

    def _with_equal_memory(self, *of: tuple[HarmonicSolution, PeriodTimes]) -> list[Deviations]:
        """Return the joint maps of several motions, padded to equally many state variables."""
        all_deviations = [self._deviations(*motion) for motion in of]
        memory = max(each.kept.shape[2] for each in all_deviations)
        return [
            each if each.kept.shape[2] == memory else self._deviations(*motion, memory)
            for each, motion in zip(all_deviations, of, strict=True)
        ]

    def _deviations(
        self, motion: HarmonicSolution, times: PeriodTimes, memory: int = 0
    ) -> Deviations:
        assert isinstance(self._joints, DeviatingJoints)
        basis = motion.resolution.functions_at(times.starts, times.parts)
        lead, linearise = motion.resolution.lead, self._joints.linearise
        if self._sector is None:
            return linearise(motion.coefficients, basis, lead, memory)
        ring, sectors = self._sector.ring, range(self._sectors)
        all_coefficients = [motion_of(ring, motion, sector).coefficients for sector in sectors]
        parts = [linearise(each, basis, lead, memory) for each in all_coefficients]
        most = max(part.kept.shape[2] for part in parts)
        return JoinedDeviations.of(
            part if part.kept.shape[2] == most else linearise(each, basis, lead, most)
            for part, each in zip(parts, all_coefficients, strict=True)
        )


def _unknown(message: str) -> Stability:
    """Return a stability without a verdict."""
    return Stability("unknown", np.empty(0, dtype=complex), 0, 0, np.inf, message)


def _scaled_by_error(motion: HarmonicSolution) -> HarmonicSolution:
    """Return a motion whose vibration is larger by its error.

    If the error is not known, the share of the neglected harmonics takes its place.
    """
    share = motion.left_out if motion.error is None else motion.error.vibration
    coefficients = (1.0 + share) * motion.coefficients
    if motion.resolution.harmonics[0] == 0:
        coefficients[:, 0] = motion.coefficients[:, 0]
    return replace(motion, coefficients=coefficients)


def _size_differences(some: ComplexArray, others: ComplexArray) -> Array:
    """Return the differences of magnitudes, the multipliers sorted by magnitude.

    The result has one entry for each of the first multipliers.
    """
    sizes = np.zeros(max(len(some), len(others)))
    sizes[: len(some)] += np.abs(some)
    sizes[: len(others)] -= np.abs(others)
    return np.abs(sizes[: len(some)])


def _largest(multipliers: ComplexArray) -> ComplexArray:
    """Return the multipliers that are reported."""
    return multipliers[np.abs(multipliers) > NEGLIGIBLE][:REPORTED]


def _verdict(fine: ComplexArray, errors: Array, neutral: int) -> Stability:
    """Return the verdict from the multipliers and the errors ``(k,)`` of their magnitudes.

    Multipliers are compared in order of magnitude: the largest, the second largest, and so on.
    """
    sizes, errors = np.abs(fine), errors + ROUNDING
    beyond = sizes - 1.0
    unstable, undecided = beyond > SAFETY * errors, np.abs(beyond) <= SAFETY * errors
    verdict: Verdict = "unstable" if unstable.any() else "stable"
    message = ""
    if undecided.any() and verdict == "stable":
        place = int(np.argmax(undecided))
        verdict = "unknown"
        message = (
            f"the magnitude {sizes[place]:.6g} of a multiplier is as close to 1 as its error, "
            f"{errors[place]:.1g}"
        )
    error = float(errors[:1].sum())
    return Stability(verdict, _largest(fine), int(unstable.sum()), neutral, error, message)
