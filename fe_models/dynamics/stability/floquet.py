"""Stability of periodic motions of structures with joints: Floquet's multipliers.

A small deviation from a periodic motion is multiplied in a period by the monodromy matrix; where
all its eigenvalues, the multipliers, lie within the unit circle, deviations die out (Nayfeh and
Balachandran 1995, *Applied Nonlinear Dynamics*, section 3.2). The state that deviates is that of
the structure and of all that joints remember: of hysteretic joints Hill's determinant, made of the
Jacobian of harmonic balance, knows only the steady loop, as if sliders came back by themselves.

Neutral deviations, which neither grow nor die, are told by what joints are, not by a tolerance: a
slider that sticks all period long may stand where it likes (its multiplier is 1), and it is a
spring to all else; a structure that only sliders hold may be displaced as a whole.

Of structures with few modes and joints the motion is first refined in time
(:mod:`fe_models.dynamics.stability.refined_motion`): multipliers are those of the motion that the
harmonics are near to. Their error is told by longer steps that begin at other times, and by
Liouville's product of all multipliers; where no motion is found nearby nothing is said. Of larger
structures, and of rings, it is told by half as many times of the period, and by a motion that is as
far off as the given one may be. Where a multiplier is no farther from the circle than its error,
more times are taken, and in the end nothing is said.
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
    deviating,
    modes_below,
)
from fe_models.dynamics.stability.refined_motion import EVENTS_LONGER, MotionInTime
from fe_models.dynamics.transient.linear_steps import SPLIT
from sa_solver import checks
from sa_solver.types import Array

Verdict = Literal["stable", "unstable", "unknown"]
# Times of a period at first, at least: so many steps of equal length, which then are divided in
# four, so often, where a joint changes what it does.
SAMPLES, DEEPEST = 128, 3
# The same of a motion that is refined in time; how many more levels there are where it shows when
# joints change what they do, and attempts, the others with four times as many times.
DEEPEST_IN_TIME, DEEPER, ATTEMPTS = 4, 4, 4
# Error of the sum of all multipliers, as a share of the largest or of 1, above which more times are
# taken: of a pair off the real axis it shows what their sizes do not.
WANTED = 3e-4
# Where multipliers are nearer to the circle than their error, so often four times as many times.
FINER = 2
# Multipliers that are told, and those below which one is of no account.
TOLD, SMALL = 8, 1e-3
# Estimates of error that a multiplier must be away from the circle.
SURE = 2.0
# Of a multiplier, by the steps of a period and the eigenvalues of their product.
ROUNDING = 1e-9
# Modes up to which all of a structure are taken; of more those slower than so many times the
# highest harmonic of the motion. Times of a period of these, or with more directions of joints than
# so many, and times per highest harmonic.
MOST_MODES, HIGHEST, MOST_DIRECTIONS, LARGE_SAMPLES, PER_HARMONIC = 64, 3.0, 12, 128, 4
# What is left of the equations of a motion, relative to their terms, beyond which it is none.
SOLVED = 1e-4
# Modes of all sectors of a ring, of which none is left out: more take minutes.
MOST_OF_RING = 256


@dataclass(frozen=True)
class Stability:
    """Whether deviations from a motion die out: the ``verdict``.

    ``multipliers`` ``(k,)`` are the largest, by size, without the ``neutral`` ones, so many, which
    are 1 whatever the motion is; ``unstable`` of them are beyond the circle. ``error`` is that of
    the largest, infinite where it is not known. ``message`` says why nothing can be said, where it
    is unknown.
    """

    verdict: Verdict
    multipliers: ComplexArray
    unstable: int
    neutral: int
    error: float
    message: str

    @property
    def resolved(self) -> bool:
        """True where the error of the multipliers is known."""
        return bool(np.isfinite(self.error))

    @property
    def beyond(self) -> int:
        """Multipliers beyond the circle, however near to it."""
        return int((np.abs(self.multipliers) > 1.0).sum())

    @property
    def largest(self) -> float:
        """Size of the largest multiplier; 0 without any."""
        return float(abs(self.multipliers[0])) if len(self.multipliers) else 0.0


class Floquet:
    """Stability of the motions of one ``problem``.

    Of a structure of more than ``most_modes`` those are followed that a motion may move.

    Examples
    --------
    A mass on a spring that hardens has three motions at 0.22 Hz, of which the middle one repels:

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
        # Sectors in a wave are followed one by one: deviations need not travel as it does.
        receptance = problem.receptance
        self._sector = receptance.sector if isinstance(receptance, WaveReceptance) else None
        self._sectors = 1 if self._sector is None else self._sector.ring.sectors

    def _structure(self, motion: HarmonicSolution) -> ModalStructure:
        """All modes of a small structure; of a large one those that this motion may move."""
        problem = self._problem
        if self._sector is not None:
            self._reduced = self._reduced or ring_structure(self._sector, self._joints.directions)
            return self._reduced
        if len(problem.alone.squares) <= self._most_modes:
            return ModalStructure.whole(problem)
        highest = 2.0 * np.pi * motion.frequency * motion.resolution.harmonics[-1]
        count = modes_below(problem, HIGHEST * highest)
        if self._reduced is None or count != len(self._reduced.squares):
            self._reduced = ModalStructure.reduced(problem, count)
        return self._reduced

    @property
    def cheap(self) -> bool:
        """Whether it takes milliseconds for a motion; otherwise it may be seconds."""
        modes, directions = (
            self._sectors * len(part)
            for part in (self._problem.model.mass, self._problem.model.connection)
        )
        return modes <= self._most_modes and directions <= MOST_DIRECTIONS

    def stability(self, motion: HarmonicSolution) -> Stability:
        """Of a motion of the problem, at whatever resolution."""
        if not isinstance(self._joints, DeviatingJoints):
            return _unknown("the joints do not tell what becomes of small deviations")
        if self._problem.model.structural is not None:
            return _unknown(
                "a loss factor is of harmonics, and of no deviation in time: half of it as damping "
                "ratio is the same at resonance"
            )
        modes = self._sectors * len(self._problem.model.mass)
        if self._sector is not None and modes > MOST_OF_RING:
            return _unknown(
                f"it is a matter of all sectors of the ring, which have {modes} modes: more than "
                f"{MOST_OF_RING}"
            )
        structure = self._structure(motion)
        samples = SAMPLES if self.cheap else LARGE_SAMPLES
        while samples < PER_HARMONIC * motion.resolution.harmonics[-1]:
            samples *= 2
        few = len(structure.squares) <= MOST_MODES
        if few and len(structure.at_joints) <= MOST_DIRECTIONS:
            return self._in_time(motion, structure, samples)
        return self._in_harmonics(motion, structure, samples)

    def multipliers(self, motion: HarmonicSolution) -> ComplexArray:
        """Multipliers along a motion as its harmonics have it, whether or not they are enough.

        Where a curve of such motions folds, one of them is 1.
        """
        samples = SPLIT**FINER * SAMPLES if self.cheap else LARGE_SAMPLES
        times = self._times(motion, samples, DEEPEST if self.cheap else 0)
        deviations, structure = self._deviations(motion, times), self._structure(motion)
        joints = ActiveJoints.of(deviations, structure)
        period = deviating(structure, motion.frequency, times, deviations, joints)
        return _largest(period.multipliers)

    def _in_time(
        self, motion: HarmonicSolution, structure: ModalStructure, samples: int
    ) -> Stability:
        """By the motion in time that is near to this one, if there is one."""
        ring = None if self._sector is None else self._sector.ring
        in_time, told = MotionInTime(self._problem, structure, motion, ring), None
        path, deepest = None, DEEPEST_IN_TIME
        for _ in range(ATTEMPTS if motion.residual <= SOLVED else 0):
            found = in_time.found(samples, deepest, path)
            others = None if found is None else in_time.others(found)
            if found is None or others is None:
                samples *= SPLIT
                continue
            fine, path = found.deviating.multipliers, found.path
            late, coarse = (other.multipliers for other in others)
            errors = np.maximum(_apart(fine, late), _apart(fine, coarse))
            errors += in_time.volume_error(found) * np.abs(fine)
            told = _judged(fine, errors, found.neutral)
            by_events, by_steps = (abs(np.sum(fine) - np.sum(each)) for each in (late, coarse))
            enough = max(by_events, by_steps) <= WANTED * max(told.largest, 1.0)
            if told.verdict != "unknown" and enough:
                return told
            # In longer steps it shows that many times as much when joints become stiffer.
            if 2.0 * EVENTS_LONGER * by_events > by_steps:
                deepest += DEEPER
            else:
                samples *= SPLIT
        if told is not None:
            return told
        lost = "no periodic motion in time is found near to these harmonics: give more of them"
        return replace(_unknown(lost), multipliers=self.multipliers(motion))

    def _in_harmonics(
        self, motion: HarmonicSolution, structure: ModalStructure, samples: int
    ) -> Stability:
        """By the motion as its harmonics have it."""
        # Of many joints one changes in every step: none of them is divided.
        finest, deepest = (FINER, DEEPEST) if self.cheap else (0, 0)
        for finer in range(finest + 1):
            times = self._times(motion, SPLIT**finer * samples, deepest + finer)
            half = times.halved()
            # Half as many times, and the same of a motion as far off as this one may be.
            first, *others = self._alike(
                (motion, times), (motion, half), (_displaced(motion), half)
            )
            joints = ActiveJoints.of(first, structure)
            at = structure, motion.frequency
            period = deviating(*at, times, first, joints)
            coarse, moved = (deviating(*at, half, of, joints).multipliers for of in others)
            fine = period.multipliers
            errors = _apart(fine, coarse) + _apart(moved, coarse)
            told = _judged(fine, errors, joints.neutral + period.shifts.shape[1])
            if told.verdict != "unknown":
                break
        return told

    def _times(self, motion: HarmonicSolution, samples: int, deepest: int) -> PeriodTimes:
        """Those of a period, in short steps where joints change what they do."""
        return PeriodTimes.following(
            lambda times: self._deviations(motion, times).regimes, samples, deepest
        )

    def _alike(self, *of: tuple[HarmonicSolution, PeriodTimes]) -> list[Deviations]:
        """What joints make of deviations from motions, as many numbers of memory in each."""
        every = [self._deviations(*motion) for motion in of]
        memory = max(each.kept.shape[2] for each in every)
        return [
            each if each.kept.shape[2] == memory else self._deviations(*motion, memory)
            for each, motion in zip(every, of, strict=True)
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
        every = [motion_of(ring, motion, sector).coefficients for sector in sectors]
        parts = [linearise(each, basis, lead, memory) for each in every]
        most = max(part.kept.shape[2] for part in parts)
        return JoinedDeviations.of(
            part if part.kept.shape[2] == most else linearise(each, basis, lead, most)
            for part, each in zip(parts, every, strict=True)
        )


def _unknown(message: str) -> Stability:
    """Nothing can be said."""
    return Stability("unknown", np.empty(0, dtype=complex), 0, 0, np.inf, message)


def _displaced(motion: HarmonicSolution) -> HarmonicSolution:
    """A motion whose vibration is larger by the error of the given one, or by what its harmonics
    leave out where that is not known."""
    share = motion.left_out if motion.error is None else motion.error.vibration
    coefficients = (1.0 + share) * motion.coefficients
    if motion.resolution.harmonics[0] == 0:
        coefficients[:, 0] = motion.coefficients[:, 0]
    return replace(motion, coefficients=coefficients)


def _apart(some: ComplexArray, others: ComplexArray) -> Array:
    """By how much the largest differs in size, the second largest, and so on; of the first."""
    sizes = np.zeros(max(len(some), len(others)))
    sizes[: len(some)] += np.abs(some)
    sizes[: len(others)] -= np.abs(others)
    return np.abs(sizes[: len(some)])


def _largest(multipliers: ComplexArray) -> ComplexArray:
    """Return the multipliers that are reported."""
    return multipliers[np.abs(multipliers) > SMALL][:TOLD]


def _judged(fine: ComplexArray, errors: Array, neutral: int) -> Stability:
    """Return the verdict that multipliers allow, given the errors ``(k,)`` of their sizes.

    What counts is how large the largest is, the second largest, and so on.
    """
    sizes, errors = np.abs(fine), errors + ROUNDING
    beyond = sizes - 1.0
    unstable, undecided = beyond > SURE * errors, np.abs(beyond) <= SURE * errors
    verdict: Verdict = "unstable" if unstable.any() else "stable"
    message = ""
    if undecided.any() and verdict == "stable":
        place = int(np.argmax(undecided))
        verdict = "unknown"
        message = (
            f"a multiplier of size {sizes[place]:.6g} is as near to 1 as its error, "
            f"{errors[place]:.1g}"
        )
    error = float(errors[:1].sum())
    return Stability(verdict, _largest(fine), int(unstable.sum()), neutral, error, message)
