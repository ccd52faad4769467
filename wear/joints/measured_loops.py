"""Friction, stiffness and energy of hysteresis loops, measured or computed.

Each cycle of a record gives

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
from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array, Indices
from wear.joints.loop_record import (
    LoopBranch,
    LoopRecord,
    MeasuredLoopError,
    complete_branches,
    loop_record,
)

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
    """What the ``c`` cycles of a record say.

    Each ``(c,)``: ``stroke`` [mm] peak to peak, ``energy`` [N mm] of a loop, ``stick_stiffness``
    [N/mm] the slope after a reversal (``bend_spread`` is the relative standard error common to all,
    that of the branches' bend), ``residual_stiffness`` [N/mm] and ``friction_force`` [N],
    half the height between the sliding branches, both NaN if they do not slide; ``force`` [N] half
    the range of the force; ``normal_load`` [N] its mean, NaN if not given. ``sliding`` is the share
    of the stroke taken to slide, 0 if none does. ``reversals`` ``(c, 3)`` are the samples of
    ``record`` at which a cycle begins, turns and ends.
    """

    stroke: Array
    energy: Array
    stick_stiffness: Array
    bend_spread: float
    residual_stiffness: Array
    friction_force: Array
    force: Array
    normal_load: Array
    sliding: float
    reversals: Indices
    record: LoopRecord

    @property
    def slides(self) -> bool:
        """Whether the branches of the loops end in sliding."""
        return self.sliding > 0.0

    @property
    def stick_estimate(self) -> MeanEstimate:
        """Stick stiffness of all cycles [N/mm]: that of their mean compliance."""
        compliance = mean_estimate(1.0 / self.stick_stiffness)
        value = 1.0 / compliance.value
        return MeanEstimate(
            value, float(np.hypot(compliance.error * value, self.bend_spread)) * value
        )

    @property
    def contact_stiffness(self) -> Array:
        """Stick slope without the residual stiffness, ``(c,)`` [N/mm]: kt of Jenkins and Iwan."""
        return self.stick_stiffness - self.residual_stiffness

    @property
    def friction(self) -> Array:
        """Friction coefficient ΔT / 2N, ``(c,)``.

        Raises MeasuredLoopError for loops that do not slide (:attr:`mobilised` is a lower bound
        then) and without a normal load.
        """
        if not self.slides:
            bound = "" if np.isnan(self.normal_load).any() else f" of {np.mean(self.mobilised):.4g}"
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


def measure_loops(
    displacement: Array,
    force: Array,
    normal_load: float | Array | None = None,
    time: Array | None = None,
) -> MeasuredLoops:
    """Measure the loops of a record of ``t`` samples.

    ``displacement`` [mm] and the resisting ``force`` [N] are ``(t,)``, in the order of time;
    ``normal_load`` [N] is a number or ``(t,)``; ``time`` ``(t,)``, in any unit, is needed where the
    samples are not evenly spaced. The loops of a record are taken to be alike: whether and how far
    they slide, and how their stick branches bend, is found for all together. Raises
    MeasuredLoopError for a record without a complete cycle, with too few samples after a reversal,
    or whose loops give energy instead of taking it.

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
    record, branches = complete_branches(loop_record(displacement, force, normal_load, time))
    rises = [WINDOW * record.rise(branch) for branch in branches]
    slopes, spread = _stick_slopes(record, branches, rises)
    sliding = _sliding_share(record, branches, float(np.mean(slopes)))
    pairs = list(zip(branches[0::2], branches[1::2], strict=True))
    lines = np.full((len(pairs), 2), np.nan)
    if sliding > 0.0:
        lines = np.array([_sliding_lines(record, pair, sliding) for pair in pairs])
        heights = np.repeat(2.0 * lines[:, 1], 2)
        slopes, spread = _stick_slopes(record, branches, (WINDOW * heights).tolist())
    energy = np.array([_energy(record, pair) for pair in pairs])
    if not energy.mean() > 0.0:
        raise MeasuredLoopError(
            "the loops give energy; allowed: the force that resists the displacement "
            "(change the sign of one of them)"
        )
    cycles = np.array([(go.begin, go.end, back.end) for go, back in pairs])
    return MeasuredLoops(
        stroke=_of_cycles([record.travel(branch) for branch in branches]),
        energy=energy,
        stick_stiffness=1.0 / _of_cycles(1.0 / slopes),
        bend_spread=spread,
        residual_stiffness=lines[:, 0],
        friction_force=lines[:, 1],
        force=0.5 * _of_cycles([record.rise(branch) for branch in branches]),
        normal_load=np.array([record.normal_load[i : k + 1].mean() for i, _, k in cycles]),
        sliding=sliding,
        reversals=cycles,
        record=record,
    )


def _of_cycles(values: Sequence[float] | Array) -> Array:
    """Means of the two branches of each cycle, ``(c,)``."""
    return np.asarray(np.reshape(values, (-1, 2)).mean(axis=1))


def _energy(record: LoopRecord, pair: tuple[LoopBranch, LoopBranch]) -> float:
    """∮ T dδ of the closed polygon [N mm]."""
    here = slice(pair[0].begin, pair[1].end + 1)
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

    And the relative standard error that they share, of the bend.
    """
    sticks = [_stick(record, *one) for one in zip(branches, rises, strict=True)]
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
    if count < FEWEST_STUCK:
        raise MeasuredLoopError(
            f"sample {branch.begin}: {count} samples from this reversal until half of the loop's "
            f"height; allowed: at least {FEWEST_STUCK}, of a record sampled faster"
        )
    phase = np.arange(count) / (branch.end - branch.begin)
    motion = branch.sense * record.displacement[branch.samples][:count]
    # Where the reversal is, one-sided: a corner must not be rounded.
    start = np.polyfit(phase, motion, 2)[-1]
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


def _tail(record: LoopRecord, branch: LoopBranch, share: float) -> slice:
    """The samples of the last ``share`` of a branch's stroke."""
    motion = branch.sense * record.displacement[branch.samples]
    level = motion[-1] - share * record.travel(branch)
    return slice(branch.begin + _passage(motion, level), branch.end + 1)


def _sliding_share(record: LoopRecord, branches: Sequence[LoopBranch], stick_slope: float) -> float:
    """The largest of ``SHARES`` over which the branches end straight and flat, less a margin."""
    span = float(np.mean([record.rise(branch) for branch in branches]))
    for share in SHARES:
        tails = [_tail(record, branch, share) for branch in branches]
        if min(tail.stop - tail.start for tail in tails) < FEWEST_SLIDING:
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


def _shape(record: LoopRecord, tail: slice, branch: LoopBranch) -> tuple[float, ...]:
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


def _sliding_lines(
    record: LoopRecord, pair: tuple[LoopBranch, LoopBranch], share: float
) -> tuple[float, float]:
    """Common slope of the two sliding branches [N/mm], and half the height between them [N]."""
    tails = [_tail(record, branch, share) for branch in pair]
    motion = [record.displacement[tail] for tail in tails]
    force = [record.force[tail] for tail in tails]
    about = [moved - moved.mean() for moved in motion]
    product = sum(float(moved @ other) for moved, other in zip(about, force, strict=True))
    slope = product / sum(float(moved @ moved) for moved in about)
    rests = [f.mean() - slope * d.mean() for d, f in zip(motion, force, strict=True)]
    return slope, float(0.5 * pair[0].sense * (rests[0] - rests[1]))
