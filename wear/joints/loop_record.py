"""A record of hysteresis loops: its columns, its reversals, its branches from one to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sa_solver.errors import InputError
from sa_solver.types import Array, Indices

REVERSAL = 0.5
"""A reversal turns back by more than this share of the range: inner loops are no cycles."""

NOISE_BAND = 4.0
"""The reversal is among the samples this many standard deviations of noise from the extreme one,"""

SHOULDER = 0.05
"""and there where lines over this share of the two branches meet, be it a corner or not."""

ENOUGH = 5
"""Reversals, ends included, that make a cycle without the ends."""

COMPLETE = 0.98
"""In shorter records a branch from or to an end counts if it covers this share of the stroke."""

CLOSED = 0.05
"""One period that begins anywhere is a loop if it ends this close to its beginning, in ranges."""

SMOOTHING = 0.1
"""Share of a cycle over which a cubic is laid through the displacement: at a reversal it falls
short of a harmonic motion by 1e-4 of its amplitude, and leaves 0.2 of the noise of 500 samples."""

FEWEST_SMOOTHED = 7
"""Samples in that window: fewer leave the noise as it is."""

ROUNDED = 4.0
"""Smoothing rounds the reversals if it takes off them more than this many standard errors."""


SIGNAL = 0.5
"""Share of what smoothing takes that may go from sample to sample alike: motion then, not noise."""


class MeasuredLoopError(InputError):
    """A record that holds no loop, or not what is asked of it."""


@dataclass(frozen=True)
class LoopBranch:
    """From a reversal to the next: their samples ``begin`` and ``end``, and ``sense`` ±1."""

    begin: int
    end: int
    sense: int

    @property
    def samples(self) -> slice:
        return slice(self.begin, self.end + 1)


class LoopRecord(NamedTuple):
    """Displacement [mm], resisting force [N] and normal load [N], each ``(t,)``.

    The samples are evenly spaced in time; a normal load that is not known is NaN.
    """

    displacement: Array
    force: Array
    normal_load: Array

    def travel(self, branch: LoopBranch) -> float:
        """Displacement that the branch covers, above 0 [mm]."""
        return float(branch.sense * np.diff(self.displacement[[branch.begin, branch.end]])[0])

    def rise(self, branch: LoopBranch) -> float:
        """What the force gains along the branch in its sense [N]."""
        return float(branch.sense * np.diff(self.force[[branch.begin, branch.end]])[0])


def loop_record(
    displacement: Array,
    force: Array,
    normal_load: float | Array | None = None,
    time: Array | None = None,
) -> LoopRecord:
    """A record of ``t`` samples; with ``time`` ``(t,)`` it is put on even times of its own number.

    Raises MeasuredLoopError for columns of other shapes, numbers that are not finite, a time that
    does not grow and a normal load that is not above 0.
    """
    motion = np.asarray(displacement, dtype=float)
    columns = {"displacement": motion, "force": np.asarray(force, dtype=float)}
    if normal_load is not None:
        load = np.asarray(normal_load, dtype=float)
        columns["normal load"] = np.full(motion.shape, load) if load.ndim == 0 else load
    if time is not None:
        columns["time"] = np.asarray(time, dtype=float)
    for name, values in columns.items():
        if values.ndim != 1 or values.shape != motion.shape:
            raise MeasuredLoopError(
                f"{name} has the shape {values.shape}; allowed: a number for each of the "
                f"{motion.size} samples"
            )
        if not np.isfinite(values).all():
            raise MeasuredLoopError(f"{name}: a number is not finite; allowed: finite numbers")
    loads = columns.get("normal load", np.full(motion.shape, np.nan))
    if (loads <= 0.0).any():
        raise MeasuredLoopError("a normal load is not above 0; allowed: loads above 0")
    record = LoopRecord(motion, columns["force"], loads)
    return record if time is None else _evenly(record, columns["time"])


def _evenly(record: LoopRecord, time: Array) -> LoopRecord:
    """The record at even times."""
    if not (np.diff(time) > 0.0).all():
        raise MeasuredLoopError("time does not grow from sample to sample; allowed: growing times")
    even = np.linspace(time[0], time[-1], len(time))
    return LoopRecord(*(np.interp(even, time, column) for column in record))


# --- reversals ----------------------------------------------------------------------------------


def reversals(displacement: Array) -> Indices:
    """Samples at which ``displacement`` ``(t,)`` turns back, and its extremes at both ends.

    Noise does not turn it: a reversal is one if the displacement then goes back by more than
    ``REVERSAL`` of its range. The first and the last sample given may be where the record begins
    or ends. Raises MeasuredLoopError for a record that never moves.
    """
    motion = np.asarray(displacement, dtype=float)
    reach = REVERSAL * float(np.ptp(motion)) if motion.size else 0.0
    if not reach > 0.0:
        raise MeasuredLoopError("the displacement never changes; allowed: a record of loops")
    turns = _turning_points(motion.tolist(), reach)
    if len(turns) < 3:
        return np.array(turns, dtype=np.int64)
    first, *inner, last = turns
    band = min(NOISE_BAND * _noise(motion), 0.25 * reach)
    neighbours = zip([first, *inner[:-1]], inner, [*inner[1:], last], strict=True)
    middle = [_amid(motion, place, band) for place in neighbours]
    return np.array([first, *middle, last], dtype=np.int64)


def _turning_points(motion: Sequence[float], reach: float) -> list[int]:
    """Extremes, after each of which but the last the motion goes back by more than ``reach``."""
    turns: list[int] = []
    low = high = sense = 0
    for place, value in enumerate(motion):
        if sense >= 0 and value > motion[high]:
            high = place
        if sense <= 0 and value < motion[low]:
            low = place
        if sense >= 0 and motion[high] - value > reach:
            turns.append(high)
            sense, low = -1, place
        elif sense <= 0 and value - motion[low] > reach:
            turns.append(low)
            sense, high = 1, place
    return [*turns, high if sense > 0 else low]


def _noise(motion: Array) -> float:
    """Standard deviation of the noise, from third differences, in which the motion drops out."""
    if motion.size < 4:
        return 0.0
    # Of white noise they have the variance 1 + 9 + 9 + 1; the median of |N(0, 1)| is 0.6745.
    return float(np.median(np.abs(np.diff(motion, 3)))) / float(0.6745 * np.sqrt(20.0))


def _amid(motion: Array, places: tuple[int, int, int], band: float) -> int:
    """Where the lines before and after ``places[1]`` meet, among the samples as extreme as it."""
    before, turn, after = places
    first, last = (before + turn) // 2, (turn + after) // 2
    near = first + np.flatnonzero(np.abs(motion[first : last + 1] - motion[turn]) <= band)
    middle = int(np.median(near))
    reach = int(SHOULDER * (after - before))
    if reach < 2 or middle - reach < 0 or middle + reach >= len(motion):
        return middle
    steps = np.arange(reach + 1)
    up, level = np.polyfit(steps - reach, motion[middle - reach : middle + 1], 1)
    down, other = np.polyfit(steps, motion[middle : middle + reach + 1], 1)
    meet = middle + round((other - level) / (up - down)) if up != down else middle
    return int(np.clip(meet, near[0], near[-1]))


# --- branches -----------------------------------------------------------------------------------


def complete_branches(record: LoopRecord) -> tuple[LoopRecord, tuple[LoopBranch, ...]]:
    """The two branches of every complete cycle, one after the other, and the record they are of.

    In that record the displacement is smoothed; one closed period that begins anywhere is turned
    to begin at a reversal. Raises MeasuredLoopError for a record without a complete cycle.
    """
    turns = reversals(record.displacement)
    branches = _complete(record, turns)
    if len(branches) < 2 <= len(turns) and _closed(record):
        record = _begun_at(record, int(turns[1]))
        branches = _complete(record, reversals(record.displacement))
    if len(branches) < 2:
        raise MeasuredLoopError(
            "no complete cycle; allowed: a record that has one from reversal to reversal, or one "
            "closed period"
        )
    branches = branches[: len(branches) // 2 * 2]
    smooth = _smoothed(record.displacement, branches)
    return record._replace(displacement=smooth), tuple(branches)


def _complete(record: LoopRecord, places: Indices) -> list[LoopBranch]:
    """Branches from reversal to reversal; those at the ends of a record only if there are few."""
    if len(places) < 3:
        return []
    moved = np.diff(record.displacement[places])
    whole = np.abs(moved) >= COMPLETE * np.abs(moved).max()
    whole[1:-1] = True
    if len(places) >= ENOUGH:
        whole[[0, -1]] = False
    pairs = zip(pairwise(places.tolist()), np.sign(moved).astype(int).tolist(), whole, strict=True)
    return [LoopBranch(begin, end, sense) for (begin, end), sense, taken in pairs if taken]


def _closed(record: LoopRecord) -> bool:
    """Whether the record ends where it began."""
    return all(abs(column[-1] - column[0]) <= CLOSED * np.ptp(column) for column in record[:2])


def _begun_at(record: LoopRecord, start: int) -> LoopRecord:
    """One closed period, begun at sample ``start``, which is repeated at the end."""
    # A period that repeats its first sample at its end already has it once too often.
    count = len(record.force)
    step = np.median(np.abs(np.diff(record.displacement)))
    if abs(record.displacement[-1] - record.displacement[0]) < 0.5 * step:
        count -= 1
    order = np.append(np.roll(np.arange(count), -start), start)
    return LoopRecord(*(column[order] for column in record))


def _smoothed(motion: Array, branches: Sequence[LoopBranch]) -> Array:
    """The displacement without some of its noise, or as it is if that would bend the motion."""
    period = 2.0 * float(np.median([branch.end - branch.begin for branch in branches]))
    half = int(0.5 * SMOOTHING * period)
    if 2 * half + 1 < FEWEST_SMOOTHED:
        return motion
    # Half a second to import: where it is used.
    from scipy.signal import savgol_filter

    smooth: Array = savgol_filter(motion, 2 * half + 1, 3)
    taken = motion - smooth
    if taken[1:] @ taken[:-1] > SIGNAL * (taken @ taken):
        return motion
    turns = np.array([[branch.end, branch.sense] for branch in branches[:-1]])
    near = turns[:, :1] + np.arange(-half // 4, half // 4 + 1)
    rounding = turns[:, 1] * taken[near].mean(axis=1)
    error = float(np.std(taken)) / np.sqrt(near.size)
    return motion if abs(float(rounding.mean())) > ROUNDED * error else smooth
