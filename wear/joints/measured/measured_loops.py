"""Friction, stiffness and energy of hysteresis loops, measured or computed.

Each closed loop of a record gives its stick slope and, where it slides, residual stiffness and
friction (:mod:`wear.joints.measured.loop_shape`); its energy, ∮ T dδ by trapezoids (the shoelace
formula); and its stroke.

Only similar loops are averaged. A step consists of consecutive loops with the same stroke, range of
force, energy and normal load, within :data:`ALIKE` and the noise. Whether and how far loops slide,
and how their stick branches bend, is determined for each step. A drifting mean position does not
begin a new step: no result depends on it.

The stick slope is that of the loop, residual stiffness included, as measured stiffnesses are
published. Bouc-Wen takes this total. Laws with the residual spring in parallel (Jenkins, Iwan) need
it without, which is :attr:`MeasuredLoops.contact_stiffness`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sa_solver.types import Array, Indices, Mask
from wear.joints.measured.loop_record import (
    LoopPair,
    LoopRecord,
    MeasuredLoopError,
    closed_loops,
    loop_record,
    noise_along,
    resolution,
    smoothed,
)
from wear.joints.measured.loop_shape import (
    FEWEST_STUCK,
    WINDOW,
    chords_of,
    sliding_lines,
    sliding_share,
    stick_slopes,
)

FEWEST_SAMPLES = 8
"""Least number of samples of a branch: with fewer neither sticking nor sliding is visible."""

ALIKE = 0.02
"""Loops of one step differ by less than this share of stroke, force and load, ..."""

ALIKE_NOISE = 4.0
"""... or by less than this number of standard deviations due to noise."""

RANGE_NOISE = 4.0
"""Standard deviations by which noise may increase half of a range."""

GENERATING = 0.01
"""Loops generate energy, due to a wrong sign, if they give more than this share of force times
stroke.
"""

LEAST_RISE = 0.25
"""The force of a joint is largest near the reversals. Below this share of its range from reversal
to reversal it follows the velocity rather than the displacement: that of a spring and a dashpot
that leads by more than 75°. The slope after a reversal is then no stiffness.
"""

NEAR_ZERO = 1e-12
"""Share of force times stroke below which an energy is rounding."""


@dataclass(frozen=True)
class MeanEstimate:
    """Mean over cycles and its standard error, which is NaN for a single cycle."""

    value: float
    error: float


def mean_estimate(values: Array) -> MeanEstimate:
    """Return the mean of ``values`` ``(c,)`` of cycles."""
    count = len(values)
    error = float(np.std(values, ddof=1)) / np.sqrt(count) if count > 1 else np.nan
    return MeanEstimate(float(np.mean(values)), float(error))


@dataclass(frozen=True)
class MeasuredLoops:
    """Results of the ``c`` closed loops of a record, in the order in which they close.

    Parameters
    ----------
    stroke
        Stroke from peak to peak ``(c,)`` [mm].
    energy
        Energy of a loop ``(c,)`` [N mm].
    stick_stiffness
        Slope after a reversal ``(c,)`` [N/mm], NaN if there are too few samples.
    bend_spread
        Relative standard error that the slopes of a step share, that of the bend ``(c,)``.
    residual_stiffness
        Slope of the sliding branches ``(c,)`` [N/mm], NaN without sliding.
    friction_force
        Half the distance of the sliding branches ``(c,)`` [N], NaN without sliding.
    force
        Half the range of the force ``(c,)`` [N].
    normal_load
        Mean normal load ``(c,)`` [N], NaN if unknown.
    sliding
        Share of the stroke taken to slide ``(c,)``, 0 without sliding.
    step
        Number of the step of similar loops, from 0 ``(c,)``.
    branches
        Both branches of each loop in the ``record``.
    record
        The record.
    resolution
        Distance of reversals below which they were taken for noise [mm].
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
        """The loops by steps; those of one step are similar, and may be averaged."""
        return tuple(self._of(self.step == number) for number in np.unique(self.step))

    def _of(self, chosen: Mask) -> MeasuredLoops:
        """Return the chosen loops."""
        values: dict[str, Any] = {
            name: value[chosen]
            for name, value in vars(self).items()
            if isinstance(value, np.ndarray)
        }
        values["branches"] = tuple(self.branches[place] for place in np.flatnonzero(chosen))
        return replace(self, **values)

    @property
    def widest(self) -> MeasuredLoops:
        """The step with the largest stroke."""
        return self._of(self.step == self.step[np.argmax(self.stroke)])

    @property
    def reversals(self) -> Indices:
        """Samples of ``record`` at which loops begin, turn and end ``(c, 3)``."""
        return np.array([(out.begin, out.end, back.end) for out, back in self.branches])

    @property
    def slides(self) -> bool:
        """True if the branches of all loops end in sliding."""
        return bool((self.sliding > 0.0).all())

    @property
    def stick_estimate(self) -> MeanEstimate:
        """Stick stiffness of similar loops, from their mean compliance [N/mm].

        Raises MeasuredLoopError for loops of several steps.
        """
        self.require_one_step()
        compliance = mean_estimate(1.0 / self.stick_stiffness)
        value = 1.0 / compliance.value
        spread = float(self.bend_spread[0])
        return MeanEstimate(value, float(np.hypot(compliance.error * value, spread)) * value)

    def require_one_step(self) -> None:
        """Raise MeasuredLoopError unless all loops belong to one step."""
        if (self.step != self.step[0]).any():
            raise MeasuredLoopError(
                f"the loops are of {len(np.unique(self.step))} steps, with strokes of "
                f"{self.stroke.min():.4g} to {self.stroke.max():.4g} mm, and have no common mean; "
                "allowed: the loops of one step"
            )

    @property
    def contact_stiffness(self) -> Array:
        """Stick slope less the residual stiffness ``(c,)`` [N/mm]: kt of Jenkins and Iwan."""
        return self.stick_stiffness - self.residual_stiffness

    @property
    def friction(self) -> Array:
        """Friction coefficient ΔT / 2N ``(c,)``, NaN for loops that do not slide.

        Raises MeasuredLoopError without a normal load, or if no loop slides; :attr:`mobilised` is
        then a lower bound.
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
        """Half the range of the force over the normal load ``(c,)``.

        It is a lower bound of the friction coefficient where nothing slides, apart from the
        residual stiffness. Raises MeasuredLoopError without a normal load.
        """
        return self.force / self._loads()

    def _loads(self) -> Array:
        if np.isnan(self.normal_load).any():
            raise MeasuredLoopError(
                "the record has no normal load, which a friction coefficient needs; give "
                "normal_load"
            )
        return self.normal_load

    @property
    def work(self) -> Array:
        """Work of the force since the beginning of the record, at each sample ``(t,)`` [N mm]."""
        motion, force = self.record.displacement, self.record.force
        steps = 0.5 * (force[1:] + force[:-1]) * np.diff(motion)
        return np.append(0.0, np.cumsum(steps))

    @property
    def left_out(self) -> tuple[float, float, float]:
        """Work of the record before, between and after its loops [N mm]."""
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

    The stroke may change within the record: :attr:`MeasuredLoops.steps` groups similar loops.

    Parameters
    ----------
    displacement
        Displacement in the order of time ``(t,)`` [mm].
    force
        Resisting force ``(t,)`` [N].
    normal_load
        Normal load [N], a number or ``(t,)``, if known.
    time
        Times of the samples ``(t,)`` in any unit, needed if these are not evenly spaced.

    Returns
    -------
    MeasuredLoops
        Stiffness, friction and energy of each loop.

    Raises
    ------
    wear.joints.measured.loop_record.MeasuredLoopError
        If no loop closes, there are too few samples for anything but energies, loops generate
        energy, or the force is not largest near the reversals.

    Examples
    --------
    Two cycles of a joint with known friction and stiffness:

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
    sizes = np.array([_pair_means(record, pair) for pair in pairs])
    ranges = np.array([0.5 * np.ptp(record.force[_samples(pair)]) for pair in pairs])
    box = 2.0 * sizes[:, 0] * ranges
    _check_resisting(energy, box, sizes[:, 1], ranges)
    energy = np.where(np.abs(energy) > NEAR_ZERO * np.abs(box), energy, 0.0)
    # With a few samples per loop the outermost may lie on either branch: use the range of forces.
    noise = noise_along(record, [branch for pair in pairs for branch in pair])
    sizes[:, 1] = np.maximum(sizes[:, 1], ranges - RANGE_NOISE * noise[1])
    loads = np.array([record.normal_load[_samples(pair)].mean() for pair in pairs])
    step = _assign_steps(record, pairs, sizes, energy, loads, noise)
    measured = [
        _measure_step(record, [pairs[k] for k in np.flatnonzero(step == number)])
        for number in range(step[-1] + 1)
    ]
    stick, spread, residual, friction, sliding, stroke = map(
        np.concatenate, zip(*measured, strict=True)
    )
    longest = max(len(branch.samples) for pair in pairs for branch in pair)
    if not sliding.any() and np.isnan(stick).all() and longest < FEWEST_SAMPLES:
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


def _check_resisting(energy: Array, box: Array, rises: Array, ranges: Array) -> None:
    """Raise MeasuredLoopError unless loops dissipate, and resist the displacement at its reversals.

    ``box`` ``(c,)`` is stroke times force, ``rises`` and ``ranges`` ``(c,)`` are half of the growth
    of the force from reversal to reversal, and half of its range.
    """
    if energy.sum() < -GENERATING * np.abs(box).sum():
        raise MeasuredLoopError(
            "the loops give energy instead of dissipating it; allowed: the force that resists the "
            "displacement (change the sign of one of them)"
        )
    if not (rises < LEAST_RISE * ranges).all():
        return
    share = 100.0 * float(rises.sum() / max(ranges.sum(), np.finfo(float).tiny))
    if share < -100.0 * LEAST_RISE:
        raise MeasuredLoopError(
            "the force falls where the displacement grows; allowed: the force that resists the "
            "displacement (change the sign of one of them), without forces of inertia"
        )
    raise MeasuredLoopError(
        f"from reversal to reversal the force changes by only {share:.0f} % of its range: it "
        "follows the velocity, as that of a dashpot does, and shows neither stick stiffness nor "
        "friction; allowed: the force of a joint, largest near the reversals"
    )


def _samples(pair: LoopPair) -> Indices:
    """Return all samples of a loop."""
    return np.concatenate([pair[0].samples, pair[1].samples[1:]])


def _pair_means(record: LoopRecord, pair: LoopPair) -> tuple[float, float]:
    """Return the displacement and half the rise of the force that both branches have on average."""
    travel = float(np.mean([record.travel(branch) for branch in pair]))
    return travel, 0.5 * float(np.mean([record.rise(branch) for branch in pair]))


def _assign_steps(
    record: LoopRecord,
    pairs: Sequence[LoopPair],
    sizes: Array,
    energy: Array,
    loads: Array,
    noise: tuple[float, float],
) -> Indices:
    """Return the step ``(c,)`` of each loop.

    A new step begins where a loop differs from the mean of the last step.
    """
    motion, force = noise
    stroke, half = np.maximum(np.abs(sizes), np.finfo(float).tiny).T
    counts = np.array([len(_samples(pair)) for pair in pairs])
    # Reversals lie between samples, so that the distance of samples there is uncertain.
    gaps = np.array([_gaps(record, pair) for pair in pairs])
    # Noise of the energy comes from that of the force on the motion, and the other way around.
    uncertain = np.pi * np.hypot(force * stroke, 2.0 * motion * half) / np.sqrt(counts)
    features = [
        # Each row has the values, their scale and their uncertainty.
        (sizes[:, 0], stroke, ALIKE_NOISE * 2.0 * motion + gaps[:, 0]),
        (sizes[:, 1], half, ALIKE_NOISE * force + gaps[:, 1]),
        (energy, 2.0 * stroke * half, ALIKE_NOISE * uncertain + 4.0 * half * gaps[:, 0]),
        (loads, loads, np.zeros_like(loads)),
    ]
    step = np.zeros(len(pairs), dtype=np.int64)
    first = 0
    for place in range(1, len(pairs)):
        alike = all(
            not abs(values[place] - values[first:place].mean())
            > ALIKE * scale[place] + max(wrong[place], wrong[first:place].mean())
            for values, scale, wrong in features
        )
        step[place] = step[place - 1] + (not alike)
        first = first if alike else place
    return step


def _gaps(record: LoopRecord, pair: LoopPair) -> tuple[float, float]:
    """Return the largest distances of samples next to reversals, in displacement and force."""
    next_to = np.concatenate([branch.samples[[0, 1, -2, -1]] for branch in pair]).reshape(-1, 2)
    motion, force = (np.abs(np.diff(record[k][next_to], axis=1)).max() for k in (0, 1))
    return float(motion), float(force)


def _measure_step(record: LoopRecord, pairs: Sequence[LoopPair]) -> tuple[Array, ...]:
    """Return the results of the loops of one step ``(c,)`` each.

    These are the stick stiffness and the standard error common to all, residual stiffness, friction
    force, share of sliding, and stroke.
    """
    branches = [branch for pair in pairs for branch in pair]
    record = record._replace(displacement=smoothed(record.displacement, branches))
    rises = [WINDOW * record.rise(branch) for branch in branches]
    slopes, spread = stick_slopes(record, branches, rises)
    rough = slopes if np.isfinite(slopes).all() else chords_of(record, branches, rises)
    sliding = sliding_share(record, branches, float(np.mean(rough)))
    lines = np.full((len(pairs), 2), np.nan)
    if sliding > 0.0:
        lines = np.array([sliding_lines(record, pair, sliding) for pair in pairs])
    if (lines[:, 1] <= 0.0).any():
        # With a few samples the branches may lie in the wrong order: this is no sliding.
        lines, sliding = np.full((len(pairs), 2), np.nan), 0.0
    if sliding > 0.0:
        heights = np.repeat(2.0 * lines[:, 1], 2)
        slopes, spread = stick_slopes(record, branches, (WINDOW * heights).tolist())
    alike = np.ones(len(pairs))
    stroke = _of_cycles([record.travel(branch) for branch in branches])
    stick = 1.0 / _of_cycles(1.0 / slopes)
    return stick, spread * alike, lines[:, 0], lines[:, 1], sliding * alike, stroke


def _of_cycles(values: Sequence[float] | Array) -> Array:
    """Return the means of the two branches of each cycle ``(c,)``."""
    return np.asarray(np.reshape(values, (-1, 2)).mean(axis=1))


def _energy(record: LoopRecord, pair: LoopPair) -> float:
    """Return ∮ T dδ of the closed polygon [N mm]."""
    here = _samples(pair)
    motion, force = record.displacement[here], record.force[here]
    return float(0.5 * np.sum((force + np.roll(force, -1)) * (np.roll(motion, -1) - motion)))
