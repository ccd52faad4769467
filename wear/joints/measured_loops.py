"""Friction, stiffness and energy of hysteresis loops, measured or computed.

Each loop that closes in a record gives

- the stick slope, that of the force right after a reversal. From the reversal until the force has
  risen through half of the loop's height a parabola is laid through force over displacement, and
  the slope is its tangent at the reversal. There the laws of :mod:`wear.joints` are exactly that:
  Jenkins and Bouc-Wen (σ = 1/2) are straight, uniform Iwan is a parabola. The parabola's bend is
  one for the whole record, and none if it does not soften by more than the noise would. For other
  laws the tangent is approximate: a sphere's (Mindlin) comes out 0.4 % high; Bouc-Wen with another
  σ starts with 2 σ kt by its own equation;
- the sliding branches, the straight last part of each branch: their slope is the residual
  stiffness kr, their distance ΔT, at one displacement so that kr drops out, is 2 µ N;
- the energy, ∮ T dδ by trapezoids (the shoelace formula), and the stroke.

Loops are averaged only with loops that are like them: a step is made of loops that close one after
the other and have the same stroke, range of force, energy and normal load, within :data:`ALIKE` and
the noise. Whether and how far loops slide, and how their stick branches bend, is found step by
step. A mean position that drifts makes no other step: nothing here depends on it.

The stick slope is what the loop shows, residual stiffness included, as measured stiffnesses are
printed; laws with the residual spring in parallel (Jenkins, Iwan) need it without, which is
:attr:`MeasuredLoops.contact_stiffness`; Bouc-Wen takes the whole one.

A stuck contact moves little, so it is the noise of the displacement that matters. It is smoothed
(:mod:`wear.joints.loop_record`); what is left would flatten the slope of a plain regression (Fuller
1987, *Measurement Error Models*, chapter 1). The time since the reversal has no noise: it is the
instrument of the fit, as a cosine, the motion of a harmonic drive. Any other motion that grows in
time gives an estimate as free of bias, only with more scatter. Errors of the displacement are
errors of a compliance; so compliances are averaged, not stiffnesses.

Source of ΔT / 2N: Li et al. 2020, Wear, doi:10.1016/j.wear.2020.203411, section 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sa_solver.types import Array, Indices, Mask
from wear.joints.loop_record import (
    LoopBranch,
    LoopPair,
    LoopRecord,
    MeasuredLoopError,
    closed_loops,
    loop_record,
    noise_of,
    resolution,
    smoothed,
)

ALIKE = 0.02
"""Loops of one step differ by less than this share of stroke, force and load, ..."""

ALIKE_NOISE = 4.0
"""... or by less than this many standard deviations that noise makes of it."""

GIVING = 0.01
"""Loops give energy, by a wrong sign, if they give more than this share of force times stroke."""

NOUGHT = 1e-12
"""Share of force times stroke that is an energy of rounding."""

WINDOW = 0.5
"""The stick slope is taken until the force has risen through this share of the loop's height:
there a Bouc-Wen branch begins to bend, and a uniform Iwan branch is a parabola all along."""

FEWEST_STUCK = 4
"""Samples in that window: one more than a parabola has coefficients."""

BENT = 3.0
"""Standard errors by which the bend of the stick branches must stand out, not to be noise."""

SHARES = (0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15)
"""Of the stroke that may be found to slide, tried in this order; less could be microslip."""

MARGIN = 0.9
"""Of that share, the part that is used: where sliding begins the branch may still be bent."""

FEWEST_SLIDING = 5
"""Samples of a sliding branch: a parabola and its uncertainty."""

SLIDING_SLOPE = 0.25
"""A branch slides where its slope is below this share of the stick slope, ..."""

SLIDING_TURN = 0.05
"""... changes along the branch by less than this share of it, noise included (in microslip an Iwan
branch with a slope so low turns by 0.12 even over the smallest of ``SHARES``), ..."""

SLIDING_BEND = 0.001
"""... and where the force is off a straight line by less than this share of its range (but for
noise), which is the error to be expected of the friction force."""


@dataclass(frozen=True)
class MeanEstimate:
    """Mean over cycles and its standard error, which is NaN for a single cycle."""

    value: float
    error: float


def mean_estimate(values: Array) -> MeanEstimate:
    """Mean of the cycles' ``values`` ``(c,)``."""
    count = len(values)
    error = float(np.std(values, ddof=1)) / np.sqrt(count) if count > 1 else np.nan
    return MeanEstimate(float(np.mean(values)), float(error))


@dataclass(frozen=True)
class MeasuredLoops:
    """What the ``c`` loops of a record say, in the order in which they close.

    Each ``(c,)``: ``stroke`` [mm] peak to peak, ``energy`` [N mm] of a loop, ``stick_stiffness``
    [N/mm] the slope after a reversal, NaN where there are too few samples (``bend_spread`` is the
    relative standard error that a step has in common, that of the branches' bend),
    ``residual_stiffness`` [N/mm] and ``friction_force`` [N], half the height between the sliding
    branches, both NaN where they do not slide; ``force`` [N] half the range of the force;
    ``normal_load`` [N] its mean, NaN if not given. ``sliding`` is the share of the stroke taken to
    slide, 0 where none does. ``step`` counts the steps of like loops from 0 on. ``branches`` are
    the two branches of each loop in the ``record``. Reversals closer to each other than
    ``resolution`` [mm] were taken for noise.
    """

    stroke: Array
    energy: Array
    stick_stiffness: Array
    bend_spread: Array
    residual_stiffness: Array
    friction_force: Array
    force: Array
    normal_load: Array
    sliding: Array
    step: Indices
    branches: tuple[LoopPair, ...]
    record: LoopRecord
    resolution: float

    @property
    def steps(self) -> tuple[MeasuredLoops, ...]:
        """The loops step by step: those of one are alike, and may be averaged."""
        return tuple(self._of(self.step == number) for number in np.unique(self.step))

    def _of(self, chosen: Mask) -> MeasuredLoops:
        """Some of the loops."""
        values: dict[str, Any] = {
            name: value[chosen]
            for name, value in vars(self).items()
            if isinstance(value, np.ndarray)
        }
        values["branches"] = tuple(self.branches[place] for place in np.flatnonzero(chosen))
        return replace(self, **values)

    @property
    def widest(self) -> MeasuredLoops:
        """The step of the largest stroke."""
        return self._of(self.step == self.step[np.argmax(self.stroke)])

    @property
    def reversals(self) -> Indices:
        """Samples of ``record`` at which loops begin, turn and end, ``(c, 3)``."""
        return np.array([(out.begin, out.end, back.end) for out, back in self.branches])

    @property
    def slides(self) -> bool:
        """Whether the branches of all loops end in sliding."""
        return bool((self.sliding > 0.0).all())

    @property
    def stick_estimate(self) -> MeanEstimate:
        """Stick stiffness of loops that are alike [N/mm]: that of their mean compliance.

        Raises MeasuredLoopError for loops of several steps.
        """
        self.require_alike()
        compliance = mean_estimate(1.0 / self.stick_stiffness)
        value = 1.0 / compliance.value
        spread = float(self.bend_spread[0])
        return MeanEstimate(value, float(np.hypot(compliance.error * value, spread)) * value)

    def require_alike(self) -> None:
        """Raise MeasuredLoopError unless the loops are all of one step."""
        if (self.step != self.step[0]).any():
            raise MeasuredLoopError(
                f"the loops are of {len(np.unique(self.step))} steps, strokes of "
                f"{self.stroke.min():.4g} to {self.stroke.max():.4g} mm, and have no mean; "
                "allowed: one of their steps"
            )

    @property
    def contact_stiffness(self) -> Array:
        """Stick slope without the residual stiffness, ``(c,)`` [N/mm]: kt of Jenkins and Iwan."""
        return self.stick_stiffness - self.residual_stiffness

    @property
    def friction(self) -> Array:
        """Friction coefficient ΔT / 2N, ``(c,)``, NaN of loops that do not slide.

        Raises MeasuredLoopError where none slides (:attr:`mobilised` is a lower bound then) and
        without a normal load.
        """
        if not self.sliding.any():
            bound = "" if np.isnan(self.normal_load).any() else f" of {np.max(self.mobilised):.4g}"
            raise MeasuredLoopError(
                "the loops have no sliding branch, so that their force over the normal load is "
                f"only a lower bound{bound} of the friction coefficient; allowed: a larger stroke"
            )
        return self.friction_force / self._loads()

    @property
    def mobilised(self) -> Array:
        """Half the range of the force over the normal load, ``(c,)``.

        A lower bound of the friction coefficient where nothing slides, a residual stiffness apart.
        Raises MeasuredLoopError without a normal load.
        """
        return self.force / self._loads()

    def _loads(self) -> Array:
        if np.isnan(self.normal_load).any():
            raise MeasuredLoopError("a friction coefficient needs the normal load of the record")
        return self.normal_load

    @property
    def work(self) -> Array:
        """Work of the force since the record began, at each of its samples ``(t,)`` [N mm]."""
        motion, force = self.record.displacement, self.record.force
        steps = 0.5 * (force[1:] + force[:-1]) * np.diff(motion)
        return np.append(0.0, np.cumsum(steps))

    @property
    def left_out(self) -> tuple[float, float, float]:
        """Work of a record that is in none of its loops, before, between and after them [N mm]."""
        work, reversals = self.work, self.reversals
        begin, end = work[reversals.min()], work[reversals.max()]
        between = float(end - begin - self.energy.sum())
        return float(begin), between, float(work[-1] - end)


def measure_loops(
    displacement: Array,
    force: Array,
    normal_load: float | Array | None = None,
    time: Array | None = None,
) -> MeasuredLoops:
    """Measure the closed loops of a record of ``t`` samples.

    ``displacement`` [mm] and the resisting ``force`` [N] are ``(t,)``, in the order of time;
    ``normal_load`` [N] is a number or ``(t,)``; ``time`` ``(t,)``, in any unit, is needed where the
    samples are not evenly spaced. Strokes may change: :attr:`MeasuredLoops.steps` has like loops
    together. Raises MeasuredLoopError for a record without a closed loop, with too few samples to
    tell anything but energies, or whose loops give energy instead of taking it.

    Examples
    --------
    Two cycles of a joint of known friction and stiffness:

    >>> import numpy as np
    >>> from wear.joints import Jenkins, march_joints, measure_loops
    >>> law = Jenkins(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> motion = 0.03 * np.sin(2.0 * np.pi * np.arange(401) / 160)
    >>> record = march_joints(law, law.rest(1), np.zeros((1, 1)), motion[:, None, None])
    >>> loops = measure_loops(motion, record.force.ravel(), normal_load=100.0)
    >>> print(f"µ = {loops.friction.mean():.4f}, kt = {loops.stick_estimate.value:.0f} N/mm")
    µ = 0.5000, kt = 10000 N/mm
    >>> print(f"{loops.energy.mean():.3f} N mm of {law.loop_energy(0.03):.3f}")
    4.998 N mm of 5.000
    """
    record, pairs = closed_loops(loop_record(displacement, force, normal_load, time))
    energy = np.array([_energy(record, pair) for pair in pairs])
    sizes = np.array([_of_pair(record, pair) for pair in pairs])
    box = 2.0 * sizes[:, 0] * sizes[:, 1]
    if (box <= 0.0).all() or energy.sum() < -GIVING * np.abs(box).sum():
        raise MeasuredLoopError(
            "the loops give energy; allowed: the force that resists the displacement "
            "(change the sign of one of them)"
        )
    energy = np.where(np.abs(energy) > NOUGHT * np.abs(box), energy, 0.0)
    loads = np.array([record.normal_load[_samples(pair)].mean() for pair in pairs])
    step = _steps(record, pairs, sizes, energy, loads)
    measured = [
        _measured(record, [pairs[k] for k in np.flatnonzero(step == number)])
        for number in range(step[-1] + 1)
    ]
    stick, spread, residual, friction, sliding, stroke = map(
        np.concatenate, zip(*measured, strict=True)
    )
    if not sliding.any() and np.isnan(stick).all():
        raise MeasuredLoopError(
            f"sample {pairs[0][0].begin}: fewer than {FEWEST_STUCK} samples from this reversal, as "
            "from all others, until half of the loop's height; allowed: a record sampled faster"
        )
    return MeasuredLoops(
        stroke=stroke,
        energy=energy,
        stick_stiffness=stick,
        bend_spread=spread,
        residual_stiffness=residual,
        friction_force=friction,
        force=sizes[:, 1],
        normal_load=loads,
        sliding=sliding,
        step=step,
        branches=pairs,
        record=record,
        resolution=resolution(record.displacement),
    )


def _samples(pair: LoopPair) -> Indices:
    """All samples of a loop."""
    return np.concatenate([pair[0].samples, pair[1].samples[1:]])


def _of_pair(record: LoopRecord, pair: LoopPair) -> tuple[float, float]:
    """Means of the two branches: displacement that they cover, and half of what the force gains."""
    travel = float(np.mean([record.travel(branch) for branch in pair]))
    return travel, 0.5 * float(np.mean([record.rise(branch) for branch in pair]))


def _steps(
    record: LoopRecord, pairs: Sequence[LoopPair], sizes: Array, energy: Array, loads: Array
) -> Indices:
    """The step ``(c,)`` that each loop is of: a new one where it is unlike the mean of the last."""
    motion, force = noise_of(record.displacement), noise_of(record.force)
    stroke, half = np.maximum(np.abs(sizes), np.finfo(float).tiny).T
    counts = np.array([len(_samples(pair)) for pair in pairs])
    # Noise of the energy: that of the force on the increments of the motion, and the reverse.
    uncertain = np.pi * np.hypot(force * stroke, 2.0 * motion * half) / np.sqrt(counts)
    features = [
        # Values, what they are measured by, and their noise.
        (sizes[:, 0], stroke, np.full_like(stroke, 2.0 * motion)),
        (sizes[:, 1], half, np.full_like(half, force)),
        (energy, 2.0 * stroke * half, uncertain),
        (loads, loads, np.zeros_like(loads)),
    ]
    step = np.zeros(len(pairs), dtype=np.int64)
    first = 0
    for place in range(1, len(pairs)):
        alike = all(
            not abs(values[place] - values[first:place].mean())
            > ALIKE * scale[place] + ALIKE_NOISE * noise[place]
            for values, scale, noise in features
        )
        step[place] = step[place - 1] + (not alike)
        first = first if alike else place
    return step


def _measured(record: LoopRecord, pairs: Sequence[LoopPair]) -> tuple[Array, ...]:
    """What the loops of one step say, each ``(c,)``.

    Stick stiffness and the standard error common to all, residual stiffness, friction force, share
    that slides, and stroke.
    """
    branches = [branch for pair in pairs for branch in pair]
    record = record._replace(displacement=smoothed(record.displacement, branches))
    rises = [WINDOW * record.rise(branch) for branch in branches]
    slopes, spread = _stick_slopes(record, branches, rises)
    rough = slopes if np.isfinite(slopes).all() else _chords(record, branches, rises)
    sliding = _sliding_share(record, branches, float(np.mean(rough)))
    lines = np.full((len(pairs), 2), np.nan)
    if sliding > 0.0:
        lines = np.array([_sliding_lines(record, pair, sliding) for pair in pairs])
        heights = np.repeat(2.0 * lines[:, 1], 2)
        slopes, spread = _stick_slopes(record, branches, (WINDOW * heights).tolist())
    alike = np.ones(len(pairs))
    stroke = _of_cycles([record.travel(branch) for branch in branches])
    stick = 1.0 / _of_cycles(1.0 / slopes)
    return stick, spread * alike, lines[:, 0], lines[:, 1], sliding * alike, stroke


def _chords(record: LoopRecord, branches: Sequence[LoopBranch], rises: Sequence[float]) -> Array:
    """Slopes ``(b,)`` from the reversals to the first samples above the ``rises`` [N/mm].

    They are less than the stick slopes.
    """
    chords = []
    for branch, rise in zip(branches, rises, strict=True):
        force = branch.sense * (record.force[branch.samples] - record.force[branch.begin])
        moved = branch.sense * (
            record.displacement[branch.samples] - record.displacement[branch.begin]
        )
        above = max(int(np.argmax(force >= rise)), 1)
        chords.append(force[above] / max(moved[above], np.finfo(float).tiny))
    return np.array(chords)


def _of_cycles(values: Sequence[float] | Array) -> Array:
    """Means of the two branches of each cycle, ``(c,)``."""
    return np.asarray(np.reshape(values, (-1, 2)).mean(axis=1))


def _energy(record: LoopRecord, pair: LoopPair) -> float:
    """∮ T dδ of the closed polygon [N mm]."""
    here = _samples(pair)
    motion, force = record.displacement[here], record.force[here]
    return float(0.5 * np.sum((force + np.roll(force, -1)) * (np.roll(motion, -1) - motion)))


def _passage(values: Array, level: float) -> int:
    """Sample at which rising noisy ``values`` pass ``level``: amid the first and the last time."""
    above, below = np.flatnonzero(values >= level), np.flatnonzero(values < level)
    first = int(above[0]) if above.size else len(values)
    last = int(below[-1]) + 1 if below.size else 0
    return (first + last) // 2


# --- sticking -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Stick:
    """Samples after a reversal, ``(k,)``: what was moved and what the force has risen since."""

    instrument: Array
    moved: Array
    risen: Array


def _stick_slopes(
    record: LoopRecord, branches: Sequence[LoopBranch], rises: Sequence[float]
) -> tuple[Array, float]:
    """Slopes of the force at the reversals that begin the branches, ``(b,)`` [N/mm].

    And the relative standard error that they share, of the bend. NaN where there are fewer than
    :data:`FEWEST_STUCK` samples to tell it.
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
    """The part of a branch until the force has risen by ``rise``."""
    force = branch.sense * (record.force[branch.samples] - record.force[branch.begin])
    count = _passage(force, rise)
    phase = np.arange(count) / (len(branch.samples) - 1)
    motion = branch.sense * record.displacement[branch.samples][:count]
    # Where the reversal is, one-sided: a corner must not be rounded.
    start = np.polyfit(phase, motion, 2)[-1] if count >= FEWEST_STUCK else 0.0
    return _Stick(1.0 - np.cos(np.pi * phase), motion - start, force[:count])


def _common_bend(sticks: Sequence[_Stick]) -> tuple[float, float]:
    """b of the force k (D + b D²) over the displacement D, and its standard error [1/mm].

    Both are 0 if the bend may be noise, or goes the wrong way.
    """
    size = float(np.mean([stick.moved[-1] for stick in sticks]))
    instruments = [_centred_powers(stick.instrument) for stick in sticks]
    moved = [_centred_powers(stick.moved / size) for stick in sticks]
    risen = [stick.risen - stick.risen.mean() for stick in sticks]
    inverse = np.linalg.inv(sum(z.T @ x for z, x in zip(instruments, moved, strict=True)))
    slope, bend = inverse @ sum(z.T @ y for z, y in zip(instruments, risen, strict=True))
    left = [y - x @ np.array([slope, bend]) for x, y in zip(moved, risen, strict=True)]
    # The scatter of samples, or of branches where smoothing has tied samples to each other.
    freedom = max(sum(map(len, left)) - len(left) - 2, 1)
    of_samples = sum(float(e @ e) for e in left) / freedom * sum(z.T @ z for z in instruments)
    pulls = np.array([z.T @ e for z, e in zip(instruments, left, strict=True)])
    variance = max((inverse @ middle @ inverse.T)[1, 1] for middle in (of_samples, pulls.T @ pulls))
    error = float(np.sqrt(variance))
    # Slip only softens: an upward bend is noise, or no friction.
    if -bend <= BENT * error:
        return 0.0, 0.0
    return float(bend / slope / size), abs(error / slope / size)


def _centred_powers(values: Array) -> Array:
    """First and second powers ``(k, 2)``, each without its mean."""
    powers = np.stack([values, values**2], axis=1)
    return np.asarray(powers - powers.mean(axis=0))


# --- sliding ------------------------------------------------------------------------------------


def _tail(record: LoopRecord, branch: LoopBranch, share: float) -> Indices:
    """The samples of the last ``share`` of a branch's stroke."""
    motion = branch.sense * record.displacement[branch.samples]
    level = motion[-1] - share * record.travel(branch)
    return branch.samples[_passage(motion, level) :]


def _sliding_share(record: LoopRecord, branches: Sequence[LoopBranch], stick_slope: float) -> float:
    """The largest of ``SHARES`` over which the branches end straight and flat, less a margin."""
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
    """Slope of a tail, its change from end to end, its bend [N], standard errors of the latter."""
    motion = branch.sense * record.displacement[tail]
    middle, half = 0.5 * (motion[-1] + motion[0]), 0.5 * (motion[-1] - motion[0])
    powers = np.vander((motion - middle) / half, 3, increasing=True)
    force = branch.sense * record.force[tail]
    inverse = np.linalg.inv(powers.T @ powers)
    coefficients = inverse @ (powers.T @ force)
    left = force - powers @ coefficients
    bend = float(coefficients[2])
    error = float(np.sqrt(left @ left / (len(force) - 3) * inverse[2, 2]))
    # Over the tail, -1 to 1, the slope of bend x² changes by 4 bend.
    return float(coefficients[1]) / half, 4.0 * bend / half, bend, 4.0 * error / half, error


def _sliding_lines(record: LoopRecord, pair: LoopPair, share: float) -> tuple[float, float]:
    """Common slope of the two sliding branches [N/mm], and half the height between them [N]."""
    tails = [_tail(record, branch, share) for branch in pair]
    motion = [record.displacement[tail] for tail in tails]
    force = [record.force[tail] for tail in tails]
    about = [moved - moved.mean() for moved in motion]
    product = sum(float(moved @ other) for moved, other in zip(about, force, strict=True))
    slope = product / sum(float(moved @ moved) for moved in about)
    rests = [f.mean() - slope * d.mean() for d, f in zip(motion, force, strict=True)]
    return slope, float(0.5 * pair[0].sense * (rests[0] - rests[1]))
