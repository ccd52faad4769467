"""Samples of measured hysteresis loops, chosen for the fit of a joint law.

Nothing is averaged: samples of single loops are used as they are, from some of the loops that are
similar (:class:`wear.joints.measured.measured_loops.MeasuredLoops`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.types import Array, Indices
from wear.fitting.problem import FitError
from wear.joints.measured.loop_record import (
    LoopBranch,
    LoopRecord,
    MeasuredLoopError,
    noise_along,
)
from wear.joints.measured.measured_loops import MeasuredLoops

POINTS = 40
"""Most samples of each branch of a loop."""

MOST_LOOPS = 12
"""Most similar loops that are fitted: each has two turning points that are fitted as well."""

MOBILISED = 1.2
"""Initial value of the friction over the mobilised one, where no loop slides."""


@dataclass(frozen=True)
class LoopData:
    """Samples of l loops of one step of a record.

    Attributes
    ----------
    name
        Name of the record.
    displacement
        Displacements about their mean ``(n,)`` [mm].
    force
        Forces ``(n,)`` [N].
    sense
        Direction ±1 of the branch of each sample ``(n,)``.
    loop
        Number of the loop of each sample ``(n,)``, 0 to l - 1.
    turns
        Lowest and highest sample of each loop ``(l, 2)`` [mm], which are not among the samples.
    spacing
        Distance of these samples from their neighbours ``(l,)`` [mm].
    noise
        Standard deviations of displacement [mm] and force [N].
    amplitude
        Half of the stroke [mm].
    normal_load
        Normal load [N], NaN if it is not known.
    stiffness, residual_stiffness, limit
        Stiffnesses [N/mm] and friction force [N] of the record, as initial values.

    Examples
    --------
    The friction force and amplitude from the record of a Jenkins joint:

    >>> import numpy as np
    >>> from wear.fitting import loop_data
    >>> from wear.joints import Jenkins, march_joints, measure_loops
    >>> law = Jenkins(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> motion = 0.03 * np.sin(2.0 * np.pi * np.arange(801) / 160)
    >>> record = march_joints(law, law.rest(1), np.zeros((1, 1)), motion[:, None, None])
    >>> loop = loop_data("first", measure_loops(motion, record.force.ravel(), 100.0))
    >>> print(f"{loop.limit:.2f} N, {loop.amplitude:.4f} mm")
    50.00 N, 0.0300 mm
    """

    name: str
    displacement: Array
    force: Array
    sense: Array
    loop: Indices
    turns: Array
    spacing: Array
    noise: tuple[float, float]
    amplitude: float
    normal_load: float
    stiffness: float
    residual_stiffness: float
    limit: float


def loop_data(name: str, measured: MeasuredLoops, most: int = MOST_LOOPS) -> LoopData:
    """Return up to ``most`` of the similar loops as data of :func:`loop_problem`.

    Each branch has up to :data:`POINTS` samples. Raises MeasuredLoopError for loops of several
    steps and for branches without samples between their reversals.

    Examples
    --------
    See :class:`LoopData`.

    >>> from wear.fitting import loop_data
    """
    if checks.whole("most", most, FitError) < 1:
        raise FitError(f"{most} loops at most; allowed: 1 or more")
    measured.require_one_step()
    record, count = measured.record, len(measured.branches)
    places = np.linspace(0, count - 1, min(count, most)).round().astype(int)
    pairs = [sorted(measured.branches[place], key=lambda one: one.sense) for place in places]
    branches = [branch for pair in pairs for branch in pair]
    noise = noise_along(record, branches)
    chosen = [_chosen(record, branch, noise[0] == 0.0) for branch in branches]
    counts = [len(one) for one in chosen]
    if min(counts) == 0:
        raise MeasuredLoopError(
            f"sample {branches[int(np.argmin(counts))].begin}: no samples between two reversals; "
            "allowed: at least one"
        )
    motion = record.displacement[np.concatenate(chosen)]
    # A branch of sense -1 ends at the lowest sample, the other at the highest.
    turns = np.array([[record.displacement[branch.end] for branch in pair] for pair in pairs])
    ends = [branch.samples[[0, 1, -2, -1]] for branch in branches]
    gaps = np.abs(np.diff(record.displacement[ends], axis=1))[:, [0, 2]]
    force = record.force[np.concatenate(chosen)]
    limit = MOBILISED * 0.5 * float(np.ptp(force))
    if measured.slides:
        limit = float(measured.friction_force.mean())
    middle = float(motion.mean())
    return LoopData(
        name=name,
        displacement=motion - middle,
        force=force,
        sense=np.repeat([float(branch.sense) for branch in branches], counts),
        loop=np.repeat(np.arange(len(branches)) // 2, counts),
        turns=turns - middle,
        spacing=gaps.reshape(-1, 4).max(axis=1),
        noise=noise,
        amplitude=0.5 * float(measured.stroke.mean()),
        normal_load=float(measured.normal_load.mean()),
        stiffness=_stiffness(measured, limit),
        residual_stiffness=float(np.nan_to_num(measured.residual_stiffness).mean()),
        limit=limit,
    )


def _chosen(record: LoopRecord, branch: LoopBranch, exact: bool) -> Indices:
    """Return up to :data:`POINTS` samples of a branch without its ends, at equal times.

    For an ``exact`` displacement, the path counts as much as the time, so that rests do not matter.
    """
    motion = record.displacement[branch.samples]
    last = len(motion) - 1
    phase = np.arange(last + 1) / last
    if exact:
        path = np.maximum.accumulate(branch.sense * (motion - motion[0]))
        phase = 0.5 * (phase + path / path[-1])
    count = min(POINTS, last - 1)
    places = np.interp((np.arange(count) + 0.5) / max(count, 1), phase, np.arange(last + 1.0))
    return branch.samples[_spread(places, last)]


def _spread(places: Array, last: int) -> Indices:
    """Return distinct integers from 1 to ``last`` - 1, each near one of the rising ``places``."""
    count = len(places)
    order = np.arange(count)
    taken = np.maximum.accumulate(np.clip(np.rint(places).astype(int), 1, last - 1) - order)
    return np.minimum(taken, last - count) + order


def _stiffness(measured: MeasuredLoops, limit: float) -> float:
    """Return the stick stiffness, or that of a slider with the same energy if it is not known.

    The energy of a slider is 4 µN (A - µN/kt).
    """
    if np.isfinite(measured.stick_stiffness).all():
        return measured.stick_estimate.value
    amplitude = 0.5 * float(measured.stroke.mean())
    stuck = amplitude - float(measured.energy.mean()) / (4.0 * limit)
    return limit / max(stuck, 0.01 * amplitude)
