"""Stick slope and sliding branches of similar hysteresis loops.

- The stick slope is that of the force right after a reversal. From the reversal until the force has
  risen through half of the loop's height, force over displacement is fitted by a parabola, and the
  slope is its tangent at the reversal. There the laws of :mod:`wear.joints` have exactly this form:
  Jenkins and Bouc-Wen (σ = 1/2) are straight, uniform Iwan is a parabola. All loops share one bend,
  which is 0 unless it softens by more than the noise would. For other laws the tangent is
  approximate: that of a sphere (Mindlin) is 0.4 % too high; Bouc-Wen with another σ starts with
  2 σ kt by its own equation.
- The sliding branches are the straight last part of each branch. Their slope is the residual
  stiffness kr. Their distance ΔT at one displacement, in which kr cancels, is 2 µ N.

A sticking contact moves little, so that the noise of the displacement matters. The displacement is
smoothed (:func:`wear.joints.measured.loop_record.smoothed`). The remaining noise would make the
slope of a plain regression too small (Fuller 1987, *Measurement Error Models*, chapter 1). The time
since the reversal has no noise: as a cosine, the motion of a harmonic drive, it is the instrumental
variable of the fit. For any other motion that grows with time the estimate is equally free of bias,
with more scatter. Errors of the displacement are errors of a compliance; compliances are therefore
averaged, not stiffnesses.

Source of ΔT / 2N: Li et al. 2020, Wear, doi:10.1016/j.wear.2020.203411, section 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array, Indices
from wear.joints.measured.loop_record import LoopBranch, LoopPair, LoopRecord

WINDOW = 0.5
"""Share of the loop's height through which the force rises in the fit of the stick slope. There a
Bouc-Wen branch begins to bend, and a uniform Iwan branch is a parabola throughout.
"""

FEWEST_STUCK = 4
"""Least number of samples in that range: one more than a parabola has coefficients."""

NEAREST = 1e-6
"""Share of a branch below which the distance of a sample from the reversal gives no slope."""

BEND_SIGNIFICANCE = 3.0
"""Standard errors by which the bend of the stick branches must exceed 0 to be no noise."""

SHARES = (0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15)
"""Shares of the stroke that are tested for sliding, in this order; a smaller one could be
microslip.
"""

MARGIN = 0.9
"""Part of that share that is used: where sliding begins the branch may still be bent."""

FEWEST_SLIDING = 5
"""Least number of samples of a sliding branch, for a parabola and its uncertainty."""

SLIDING_SLOPE = 0.25
"""A branch slides if its slope is below this share of the stick slope, ..."""

SLIDING_TURN = 0.05
"""... changes along the branch by less than this share of it, noise included (in microslip the
slope of an Iwan branch as flat as that changes by 0.12 even over the smallest of ``SHARES``), ...
"""

SLIDING_BEND = 0.001
"""... and if the force deviates from a straight line by less than this share of its range, apart
from noise; this is the expected error of the friction force.
"""


def _crossing(values: Array, level: float) -> int:
    """Return the sample at which rising noisy ``values`` pass ``level``.

    It is the middle between the first and the last passage.
    """
    above, below = np.flatnonzero(values >= level), np.flatnonzero(values < level)
    first = int(above[0]) if above.size else len(values)
    last = int(below[-1]) + 1 if below.size else 0
    return (first + last) // 2


# --- sticking -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Stick:
    """Samples after a reversal ``(k,)``.

    ``moved`` and ``risen`` are the displacement and the rise of the force since the reversal, and
    ``instrument`` is the instrumental variable of their fit.
    """

    instrument: Array
    moved: Array
    risen: Array


def stick_slopes(
    record: LoopRecord, branches: Sequence[LoopBranch], rises: Sequence[float]
) -> tuple[Array, float]:
    """Return the slopes of the force at the beginning of the branches, and a standard error.

    The slopes are ``(b,)`` [N/mm], and NaN where a branch has fewer than :data:`FEWEST_STUCK`
    samples in the range. The error is the relative standard error that all slopes share, that of
    the bend.
    """
    sticks = [_stick(record, *one) for one in zip(branches, rises, strict=True)]
    if min(len(stick.moved) for stick in sticks) < FEWEST_STUCK:
        return np.full(len(sticks), np.nan), 0.0
    bend, error = _common_bend(sticks)
    compliances, leverages = [], []
    for stick in sticks:
        weight = stick.instrument - stick.instrument.mean()
        moved = float(weight @ (stick.moved * (1.0 + bend * stick.moved)))
        compliances.append(moved / float(weight @ stick.risen))
        leverages.append(float(weight @ stick.moved**2) / moved)
    return 1.0 / np.array(compliances), error * float(np.mean(leverages))


def _stick(record: LoopRecord, branch: LoopBranch, rise: float) -> _Stick:
    """Return the part of a branch until the force has risen by ``rise``."""
    force = branch.sense * (record.force[branch.samples] - record.force[branch.begin])
    count = _crossing(force, rise)
    phase = np.arange(count) / (len(branch.samples) - 1)
    motion = branch.sense * record.displacement[branch.samples][:count]
    # The displacement at the reversal is fitted on one side only, so as not to round a corner.
    start = np.polyfit(phase, motion, 2)[-1] if count >= FEWEST_STUCK else 0.0
    return _Stick(1.0 - np.cos(np.pi * phase), motion - start, force[:count])


def _common_bend(sticks: Sequence[_Stick]) -> tuple[float, float]:
    """Return the bend b of the force k (D + b D²), and its standard error [1/mm].

    D is the displacement. Both are 0 if the bend may be noise, or has the wrong sign.
    """
    size = float(np.mean([stick.moved[-1] for stick in sticks]))
    instruments = [_centred_powers(stick.instrument) for stick in sticks]
    moved = [_centred_powers(stick.moved / size) for stick in sticks]
    risen = [stick.risen - stick.risen.mean() for stick in sticks]
    inverse = np.linalg.inv(sum(z.T @ x for z, x in zip(instruments, moved, strict=True)))
    slope, bend = inverse @ sum(z.T @ y for z, y in zip(instruments, risen, strict=True))
    left = [y - x @ np.array([slope, bend]) for x, y in zip(moved, risen, strict=True)]
    # Use the scatter of samples, or of branches if smoothing has made samples dependent.
    freedom = max(sum(map(len, left)) - len(left) - 2, 1)
    of_samples = sum(float(e @ e) for e in left) / freedom * sum(z.T @ z for z in instruments)
    pulls = np.array([z.T @ e for z, e in zip(instruments, left, strict=True)])
    variance = max((inverse @ middle @ inverse.T)[1, 1] for middle in (of_samples, pulls.T @ pulls))
    error = float(np.sqrt(variance))
    # Slip can only soften: an upward bend is noise, or not due to friction.
    if -bend <= BEND_SIGNIFICANCE * error:
        return 0.0, 0.0
    return float(bend / slope / size), abs(error / slope / size)


def _centred_powers(values: Array) -> Array:
    """Return the first and second powers ``(k, 2)``, each without its mean."""
    powers = np.stack([values, values**2], axis=1)
    return np.asarray(powers - powers.mean(axis=0))


def chords_of(record: LoopRecord, branches: Sequence[LoopBranch], rises: Sequence[float]) -> Array:
    """Return the slopes from reversals to the first samples above the ``rises`` ``(b,)`` [N/mm].

    They are smaller than the stick slopes.
    """
    chords = []
    for branch, rise in zip(branches, rises, strict=True):
        force = branch.sense * (record.force[branch.samples] - record.force[branch.begin])
        moved = branch.sense * (
            record.displacement[branch.samples] - record.displacement[branch.begin]
        )
        above = max(int(np.argmax(force >= rise)), 1)
        chords.append(force[above] / max(moved[above], NEAREST * record.travel(branch)))
    return np.array(chords)


# --- sliding ------------------------------------------------------------------------------------


def _tail(record: LoopRecord, branch: LoopBranch, share: float) -> Indices:
    """Return the samples of the last ``share`` of a branch's stroke."""
    motion = branch.sense * record.displacement[branch.samples]
    level = motion[-1] - share * record.travel(branch)
    return branch.samples[_crossing(motion, level) :]


def sliding_share(record: LoopRecord, branches: Sequence[LoopBranch], stick_slope: float) -> float:
    """Return the largest of ``SHARES`` over which branches end straight and flat, less a margin."""
    span = float(np.mean([record.rise(branch) for branch in branches]))
    for share in SHARES:
        tails = [_tail(record, branch, share) for branch in branches]
        if min(map(len, tails)) < FEWEST_SLIDING:
            break
        lines = np.array([_shape(record, *one) for one in zip(tails, branches, strict=True)])
        slope, turn, bend = lines[:, :3].mean(axis=0)
        turn_error, bend_error = np.sqrt((lines[:, 3:] ** 2).sum(axis=0)) / len(branches)
        flat = abs(slope) <= SLIDING_SLOPE * stick_slope
        steady = abs(turn) + turn_error <= SLIDING_TURN * stick_slope
        straight = abs(bend) <= SLIDING_BEND * span + bend_error
        if flat and steady and straight:
            return MARGIN * share
    return 0.0


def _shape(record: LoopRecord, tail: Indices, branch: LoopBranch) -> tuple[float, ...]:
    """Return the shape of the end of a branch by a parabola.

    It consists of the slope, its change from end to end, the bend [N], and the standard errors of
    the latter two.
    """
    motion = branch.sense * record.displacement[tail]
    middle, half = 0.5 * (motion[-1] + motion[0]), 0.5 * (motion[-1] - motion[0])
    powers = np.vander((motion - middle) / half, 3, increasing=True)
    force = branch.sense * record.force[tail]
    inverse = np.linalg.inv(powers.T @ powers)
    coefficients = inverse @ (powers.T @ force)
    left = force - powers @ coefficients
    bend = float(coefficients[2])
    error = float(np.sqrt(left @ left / (len(force) - 3) * inverse[2, 2]))
    # From -1 to 1 the slope of bend x² changes by 4 bend.
    return float(coefficients[1]) / half, 4.0 * bend / half, bend, 4.0 * error / half, error


def sliding_lines(record: LoopRecord, pair: LoopPair, share: float) -> tuple[float, float]:
    """Return the common slope of the two sliding branches [N/mm], and half their distance [N]."""
    tails = [_tail(record, branch, share) for branch in pair]
    motion = [record.displacement[tail] for tail in tails]
    force = [record.force[tail] for tail in tails]
    about = [moved - moved.mean() for moved in motion]
    product = sum(float(moved @ other) for moved, other in zip(about, force, strict=True))
    slope = product / sum(float(moved @ moved) for moved in about)
    rests = [f.mean() - slope * d.mean() for d, f in zip(motion, force, strict=True)]
    return slope, float(0.5 * pair[0].sense * (rests[0] - rests[1]))
