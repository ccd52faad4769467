"""Stability of periodic motions of structures with joints: Floquet's multipliers.

A small deviation from a periodic motion is multiplied in a period by the monodromy matrix; where
all its eigenvalues, the multipliers, lie within the unit circle, deviations die out (Nayfeh and
Balachandran 1995, *Applied Nonlinear Dynamics*, section 3.2). The state that deviates is that of
the structure and of all that joints remember: of hysteretic joints Hill's determinant, made of the
Jacobian of harmonic balance, knows only the steady loop, as if sliders came back by themselves.

Neutral deviations, which neither grow nor die, are told by what joints are, not by a tolerance: a
slider that sticks all period long may stand where it likes (its multiplier is 1), and it is a
spring to all else; a structure that only sliders hold may be displaced as a whole.

Two resolutions of the period tell the error of the multipliers; where one is no farther from the
circle than that, nothing is said, or more times are taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fe_models.dynamics.deviating_structure import (
    ActiveJoints,
    ModalStructure,
    modes_below,
    multipliers_of,
)
from fe_models.dynamics.harmonic_balance import HarmonicBalance
from fe_models.dynamics.harmonic_solution import HarmonicSolution
from fe_models.dynamics.harmonics import ComplexArray
from fe_models.dynamics.linear_steps import SPLIT
from fe_models.dynamics.period_times import PeriodTimes
from fe_models.dynamics.periodic_joints import DeviatingJoints, Deviations

Verdict = Literal["stable", "unstable", "unknown"]
# Times of a period at first, at least: so many steps of equal length, which then are divided in
# four, so often, where a joint changes what it does.
SAMPLES, DEEPEST = 128, 3
# Where multipliers are nearer to the circle than their error, so often four times as many times.
FINER = 2
# Multipliers that are told, and those below which one is of no account.
TOLD, SMALL = 8, 1e-3
# Modes up to which all of a structure are taken; of more those slower than so many times the
# highest harmonic of the motion. Times of a period of such a structure, and per highest harmonic.
MOST_MODES, HIGHEST, LARGE_SAMPLES, PER_HARMONIC = 64, 3.0, 128, 4


@dataclass(frozen=True)
class Stability:
    """Whether deviations from a motion die out.

    ``multipliers`` ``(k,)`` are the largest, by size, without the ``neutral`` ones, so many, which
    are 1 whatever the motion is; ``unstable`` of them are beyond the circle. ``error`` is that of
    the largest. ``message`` says why nothing can be said, where the ``verdict`` is unknown.
    """

    verdict: Verdict
    multipliers: ComplexArray
    unstable: int
    neutral: int
    error: float
    message: str

    @property
    def largest(self) -> float:
        """Size of the largest multiplier; 0 without any."""
        return float(abs(self.multipliers[0])) if len(self.multipliers) else 0.0


class Floquet:
    """Stability of the motions of one problem."""

    def __init__(self, problem: HarmonicBalance) -> None:
        self._problem, self._joints = problem, problem.joints
        self._reduced: ModalStructure | None = None

    def _structure(self, motion: HarmonicSolution) -> ModalStructure:
        """All modes of a small structure; of a large one those that this motion may move."""
        problem = self._problem
        if len(problem.receptance.squares) <= MOST_MODES:
            return ModalStructure.whole(problem)
        highest = 2.0 * np.pi * motion.frequency * motion.resolution.harmonics[-1]
        count = modes_below(problem, HIGHEST * highest)
        if self._reduced is None or count != len(self._reduced.squares):
            self._reduced = ModalStructure.reduced(problem, count)
        return self._reduced

    def stability(self, motion: HarmonicSolution) -> Stability:
        """Of a motion of the problem, at whatever resolution."""
        if not isinstance(self._joints, DeviatingJoints):
            nothing = np.empty(0, dtype=complex)
            message = "the joints do not tell what becomes of small deviations"
            return Stability("unknown", nothing, 0, 0, np.inf, message)
        structure = self._structure(motion)
        samples, deepest, finest = SAMPLES, DEEPEST, FINER
        if structure.residual is not None:
            # Of many joints one changes in every step: none of them is divided.
            samples, deepest, finest = LARGE_SAMPLES, 0, 0
        while samples < PER_HARMONIC * motion.resolution.harmonics[-1]:
            samples *= 2
        for finer in range(finest + 1):
            times, deviations = self._marched(motion, SPLIT**finer * samples, deepest + finer)
            joints = ActiveJoints.of(deviations, structure)
            at = structure, motion.frequency
            fine, shifts = multipliers_of(*at, times, deviations, joints)
            half = times.halved()
            rough = self._deviations(motion, half)
            coarse, _ = multipliers_of(*at, half, rough, joints)
            told = _judged(fine, coarse, joints.neutral + shifts)
            if told.verdict != "unknown":
                break
        return told

    def _marched(
        self, motion: HarmonicSolution, samples: int, deepest: int
    ) -> tuple[PeriodTimes, Deviations]:
        """What joints make of deviations, in short steps where they change what they do."""
        times = PeriodTimes.even(samples, deepest)
        while True:
            deviations = self._deviations(motion, times)
            regimes = deviations.regimes
            changes = (regimes != np.roll(regimes, -1, axis=0)).any(axis=1)
            # It changes in this step or, where the motion turns, in the next.
            marked = changes | np.roll(changes, 1)
            if not (marked & (times.levels < deepest)).any():
                return times, deviations
            times = times.divided(marked)

    def _deviations(self, motion: HarmonicSolution, times: PeriodTimes) -> Deviations:
        assert isinstance(self._joints, DeviatingJoints)
        basis = motion.resolution.functions_at(times.starts, times.parts)
        return self._joints.linearise(motion.coefficients, basis, motion.resolution.lead)


def _judged(fine: ComplexArray, coarse: ComplexArray, neutral: int) -> Stability:
    """What a resolution of the period says, with the next coarser one as the measure of error."""
    multipliers = fine[np.abs(fine) > SMALL]
    errors = np.abs(multipliers[:, None] - np.append(coarse, 0.0)).min(axis=1)
    beyond = np.abs(multipliers) - 1.0
    unstable, undecided = beyond > errors, np.abs(beyond) <= errors
    verdict: Verdict = "unstable" if unstable.any() else "stable"
    message = ""
    if undecided.any() and verdict == "stable":
        place = int(np.argmax(undecided))
        verdict = "unknown"
        message = (
            f"a multiplier of size {abs(multipliers[place]):.6g} is nearer to 1 than its error "
            f"{errors[place]:.1g}"
        )
    told, error = multipliers[:TOLD], float(errors[:1].sum())
    return Stability(verdict, told, int(unstable.sum()), neutral, error, message)
