"""Records of hysteresis loops: columns, reversals, and the branches between reversals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Indices

NOISE_REACH = 10.0
"""A reversal turns back by more than this number of standard deviations of the noise, the largest
distance of extremes in a million samples of noise, ...
"""

SMALLEST, LARGEST = 0.01, 0.5
"""... and by more than the first share of the range, as smaller ones are ripples of the drive. A
larger turn than the second share is a reversal whatever the noise.
"""

SHORT = 2
"""Number of steps up to which the distance from one turning sample to the next indicates noise."""

BACKWARDS = 3.0
"""Half of the backward steps of white noise exceed its standard deviation; three times the median
is an upper bound.
"""

CLOSING = 0.02
"""A loop is closed if it ends this close to where it began, over its stroke, ..."""

NOISE_BAND = 4.0
"""The reversal is among the samples within this number of standard deviations of noise from the
extreme one (no loop is closed better than that either), ...
"""

FITTED_SHARE = 0.05
"""... at the intersection of lines fitted to this share of both branches, for sharp and round
reversals.
"""

ENOUGH_REVERSALS = 5
"""Number of reversals, ends included, that give a loop without the beginning of a record."""

COMPLETE = 0.98
"""In shorter records the first branch counts if it covers this share of the stroke."""

CLOSED = 0.05
"""A single period that begins anywhere is a loop if it ends this close to its beginning, over its
range.
"""

SMOOTHING = 0.1
"""Share of a cycle over which the displacement is smoothed by a cubic. At the reversals of a
harmonic motion it is too small by 1e-4 of the amplitude, and it leaves 0.2 of the noise of 500
samples.
"""

FEWEST_SMOOTHED = 7
"""Least number of samples in that window: with fewer the noise is not smoothed."""

MOST_ROUNDING = 4.0
"""Smoothing is rejected if it changes the reversals by more than this number of standard errors."""


MOST_CORRELATION = 0.5
"""Largest correlation of the removed part from sample to sample: above it motion is removed, not
noise.
"""


class MeasuredLoopError(InputError):
    """A record contains no loop, or not what is asked of it."""


@dataclass(frozen=True)
class LoopBranch:
    """Branch from a reversal to the next.

    ``samples`` ``(k,)`` are its samples in a record, without those of smaller loops that close on
    the way; ``sense`` is ±1.
    """

    samples: Indices
    sense: int

    @property
    def begin(self) -> int:
        return int(self.samples[0])

    @property
    def end(self) -> int:
        return int(self.samples[-1])


class LoopRecord(NamedTuple):
    """Displacement [mm], resisting force [N] and normal load [N] of a record, each ``(t,)``.

    The samples are evenly spaced in time. An unknown normal load is NaN.
    """

    displacement: Array
    force: Array
    normal_load: Array

    def travel(self, branch: LoopBranch) -> float:
        """Return the displacement that a branch covers, above 0 [mm]."""
        return float(branch.sense * np.diff(self.displacement[[branch.begin, branch.end]])[0])

    def rise(self, branch: LoopBranch) -> float:
        """Return the growth of the force along a branch in its sense [N]."""
        return float(branch.sense * np.diff(self.force[[branch.begin, branch.end]])[0])


def loop_record(
    displacement: Array,
    force: Array,
    normal_load: float | Array | None = None,
    time: Array | None = None,
) -> LoopRecord:
    """Return a checked record of ``t`` samples, at even times.

    Parameters
    ----------
    displacement, force
        Displacement [mm] and resisting force [N] ``(t,)``.
    normal_load
        Normal load [N], a number or ``(t,)``, if known.
    time
        Times of the samples ``(t,)``; the record is interpolated to as many even times.

    Raises
    ------
    MeasuredLoopError
        If shapes differ, numbers are not finite, the time does not grow, or a normal load is not
        above 0.
    """

    def column(name: str, values: object) -> Array:
        return checks.array(
            f"values of {name}", values, None, error=MeasuredLoopError, finite=False
        )

    motion = column("displacement", displacement)
    columns = {"displacement": motion, "force": column("force", force)}
    if normal_load is not None:
        load = column("normal load", normal_load)
        columns["normal load"] = np.full(motion.shape, load) if load.ndim == 0 else load
    if time is not None:
        columns["time"] = column("time", time)
    for name, values in columns.items():
        if values.ndim != 1 or values.shape != motion.shape:
            raise MeasuredLoopError(
                f"the {name} has the shape {values.shape}; allowed: a number for each of the "
                f"{motion.size} samples"
            )
        if not np.isfinite(values).all():
            raise MeasuredLoopError(f"the {name} has a number that is not finite; allowed: finite")
    loads = columns.get("normal load", np.full(motion.shape, np.nan))
    if (loads <= 0.0).any():
        raise MeasuredLoopError("a normal load is not above 0; allowed: loads above 0")
    record = LoopRecord(motion, columns["force"], loads)
    return record if time is None else _evenly(record, columns["time"])


def _evenly(record: LoopRecord, time: Array) -> LoopRecord:
    """Return the record at even times."""
    if not (np.diff(time) > 0.0).all():
        raise MeasuredLoopError(
            "the time does not grow from sample to sample; allowed: growing times"
        )
    even = np.linspace(time[0], time[-1], len(time))
    return LoopRecord(*(np.interp(even, time, column) for column in record))


# --- reversals ----------------------------------------------------------------------------------


def reversals(displacement: Array) -> Indices:
    """Return the samples at which ``displacement`` ``(t,)`` turns back, and both ends.

    A turn is a reversal if the displacement then goes back by more than :func:`resolution`; smaller
    turns are noise. The first and the last sample given may be the ends of the record. Raise
    MeasuredLoopError for a record that never moves.
    """
    motion = np.asarray(displacement, dtype=float)
    turns = _turning_points(motion.tolist(), resolution(motion))
    if len(turns) < 3:
        return np.array(turns, dtype=np.int64)
    first, *inner, last = turns
    band = NOISE_BAND * noise_of(motion)
    neighbours = zip([first, *inner[:-1]], inner, [*inner[1:], last], strict=True)
    middle = [_refined_reversal(motion, place, band) for place in neighbours]
    return np.array([first, *middle, last], dtype=np.int64)


def resolution(displacement: Array) -> float:
    """Return the smallest backward motion of ``displacement`` ``(t,)`` that is a reversal [mm].

    Raise MeasuredLoopError for a record that never moves.
    """
    extent = float(np.ptp(displacement)) if displacement.size else 0.0
    if not extent > 0.0:
        raise MeasuredLoopError("the displacement never changes; allowed: a record of loops")
    return float(np.clip(NOISE_REACH * noise_of(displacement), SMALLEST * extent, LARGEST * extent))


def noise_of(values: Array) -> float:
    """Return the standard deviation of the noise of ``values`` ``(t,)``, 0 where none is visible.

    It is that of the third differences, in which a finely sampled motion vanishes. A motion of a
    few samples per branch does not vanish there. The noise is therefore taken to be no larger than
    the distances between turns within :data:`SHORT` steps, of which a motion without noise has
    none.
    """
    moving = values[np.append(True, np.diff(values) != 0.0)]
    turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(moving))))
    short = np.abs(np.diff(moving[turns]))[np.diff(turns) <= SHORT]
    if short.size == 0 or moving.size < 4:
        return 0.0
    # Third differences of white noise have 1 + 9 + 9 + 1 times its variance, and the median of
    # |N(0, 1)| is 0.6745.
    spread = float(np.median(np.abs(np.diff(moving, 3)))) / float(0.6745 * np.sqrt(20.0))
    return min(spread, float(short.max()))


def _turning_points(motion: Sequence[float], reach: float) -> list[int]:
    """Return the extremes after each of which, except the last, the motion turns back.

    It turns back if it goes back by more than ``reach``.
    """
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


def _refined_reversal(motion: Array, places: tuple[int, int, int], band: float) -> int:
    """Return the sample at which the lines fitted before and after ``places[1]`` intersect.

    It is limited to samples as extreme as ``places[1]`` within ``band``.
    """
    before, turn, after = places
    first, last = (before + turn) // 2, (turn + after) // 2
    near = first + np.flatnonzero(np.abs(motion[first : last + 1] - motion[turn]) <= band)
    middle = int(np.median(near))
    reach = int(FITTED_SHARE * (after - before))
    if reach < 2 or middle - reach < 0 or middle + reach >= len(motion):
        return middle
    steps = np.arange(reach + 1)
    up, level = np.polyfit(steps - reach, motion[middle - reach : middle + 1], 1)
    down, other = np.polyfit(steps, motion[middle : middle + reach + 1], 1)
    meet = middle + round((other - level) / (up - down)) if up != down else middle
    return int(np.clip(meet, near[0], near[-1]))


# --- loops --------------------------------------------------------------------------------------

LoopPair = tuple[LoopBranch, LoopBranch]


@dataclass(frozen=True)
class _Path:
    """A path of one ``sense`` ±1, in ``pieces`` from one place of a record to another.

    Places may lie between samples; ``whole`` says whether it begins at a reversal.
    """

    pieces: tuple[tuple[float, float], ...]
    sense: int
    whole: bool = True

    def travel(self, motion: Array) -> float:
        """Return the displacement that it covers [mm]."""
        ends = self.pieces[0][0], self.pieces[-1][1]
        return self.sense * float(np.diff(np.interp(ends, np.arange(len(motion)), motion))[0])


def closed_loops(record: LoopRecord) -> tuple[LoopRecord, tuple[LoopPair, ...]]:
    """Return the record with the two branches of every closed loop, in the order of closing.

    A loop closes where the displacement returns to the reversal at which it began. It is then
    removed, and the branch before it continues after it (Masing's memory, the same as rainflow
    counting). Where that point lies between two samples of a continuing branch, the record returned
    has one more sample there. A single closed period that begins anywhere is rotated to begin at a
    reversal. Raise MeasuredLoopError for a record without a loop.
    """
    turns = reversals(record.displacement)
    loops = _closed_paths(record.displacement, turns)
    if not loops and len(turns) >= 2 and _is_closed(record):
        record = _rotated_to(record, int(turns[1]))
        loops = _closed_paths(record.displacement, reversals(record.displacement))
    if not loops:
        raise MeasuredLoopError(
            "the record has no complete cycle; allowed: a record with a cycle from reversal to "
            "reversal, with two cycles of each stroke if strokes fall, or of one closed period"
        )
    ends = [end for loop in loops for path in loop for piece in path.pieces for end in piece]
    samples = np.arange(len(record.force))
    places = np.union1d(samples, ends)
    record = LoopRecord(*(np.interp(places, samples, column) for column in record))
    return record, tuple((_branch(out, places), _branch(back, places)) for out, back in loops)


def _branch(path: _Path, places: Array) -> LoopBranch:
    """Return the samples of a path, once the record contains all ``places``."""
    parts = [
        np.arange(*(np.searchsorted(places, piece) + np.array([0, 1]))) for piece in path.pieces
    ]
    # Adjacent pieces share a sample.
    return LoopBranch(np.unique(np.concatenate(parts)), path.sense)


def _closed_paths(motion: Array, turns: Indices) -> list[tuple[_Path, _Path]]:
    """Return the paths of all loops that close between ``turns``."""
    paths = [
        _Path(((float(begin), float(end)),), 1 if motion[end] > motion[begin] else -1)
        for begin, end in pairwise(turns.tolist())
    ]
    longest = max((path.travel(motion) for path in paths), default=0.0)
    if paths and (len(turns) >= ENOUGH_REVERSALS or paths[0].travel(motion) < COMPLETE * longest):
        paths[0] = replace(paths[0], whole=False)
    slack = NOISE_BAND * noise_of(motion)
    loops: list[tuple[_Path, _Path]] = []
    opened: list[_Path] = []
    for path in paths:
        while opened and opened[-1].whole:
            stroke = opened[-1].travel(motion)
            short = max(CLOSING * stroke, slack)
            if path.travel(motion) < stroke - short:
                break
            before = opened.pop()
            back, rest = _split_where_begun(
                motion, path, before, path.travel(motion) > stroke + short
            )
            loops.append((before, back))
            if not opened:
                path = replace(rest, whole=False)
                break
            outer = opened.pop()
            path = replace(outer, pieces=(*outer.pieces, *rest.pieces))
        opened.append(path)
    return loops


def _split_where_begun(
    motion: Array, path: _Path, before: _Path, beyond: bool
) -> tuple[_Path, _Path]:
    """Split a path where ``before`` began, and return both parts.

    A path that does not go ``beyond`` that point is the first part as a whole.
    """
    *pieces, (begin, end) = path.pieces
    place = end
    if beyond:
        level = motion[int(before.pieces[0][0])]
        inside = np.arange(int(np.ceil(begin)), int(end))
        below = inside[path.sense * (motion[inside] - level) < 0.0]
        last = int(below[-1]) if below.size else int(np.floor(begin))
        step = motion[last + 1] - motion[last]
        share = (level - motion[last]) / step if step != 0.0 else 0.0
        place = float(np.clip(last + share, begin, end))
    back = replace(path, pieces=(*pieces, (begin, place)))
    return back, replace(path, pieces=((place, end),))


def _is_closed(record: LoopRecord) -> bool:
    """Return whether the record ends where it began."""
    return all(abs(column[-1] - column[0]) <= CLOSED * np.ptp(column) for column in record[:2])


def _rotated_to(record: LoopRecord, start: int) -> LoopRecord:
    """Return a closed period rotated to begin at sample ``start``, which is repeated at the end."""
    # A period whose last sample repeats the first one must lose it before it is rotated.
    count = len(record.force)
    step = np.median(np.abs(np.diff(record.displacement)))
    if abs(record.displacement[-1] - record.displacement[0]) < 0.5 * step:
        count -= 1
    order = np.append(np.roll(np.arange(count), -start), start)
    return LoopRecord(*(column[order] for column in record))


def noise_along(record: LoopRecord, branches: Sequence[LoopBranch]) -> tuple[float, float]:
    """Return the standard deviations of the noise of displacement [mm] and force [N].

    The force of a branch with few samples jumps as noise does, but not backward. Its noise is
    therefore at most :data:`BACKWARDS` times the median of the backward steps, and 0 without any.
    """
    steps = [branch.sense * np.diff(record.force[branch.samples]) for branch in branches]
    back = -np.concatenate(steps)
    back = back[back > 0.0]
    most = BACKWARDS * float(np.median(back)) if back.size else 0.0
    return noise_of(record.displacement), min(noise_of(record.force), most)


def smoothed(motion: Array, branches: Sequence[LoopBranch]) -> Array:
    """Return the displacement ``(t,)`` with less noise, valid on ``branches`` only.

    The displacement is returned unchanged if it shows no noise, or if smoothing would distort the
    motion. Branches follow each other in pairs, the first of which ends at a reversal.
    """
    if noise_of(motion) == 0.0:
        return motion
    period = 2.0 * float(np.median([len(branch.samples) - 1 for branch in branches]))
    half = int(0.5 * SMOOTHING * period)
    if 2 * half + 1 < FEWEST_SMOOTHED or len(motion) < 2 * half + 1:
        return motion
    # The import takes half a second, so that it stands where it is needed.
    from scipy.signal import savgol_filter

    smooth: Array = savgol_filter(motion, 2 * half + 1, 3)
    used = np.unique(np.concatenate([branch.samples for branch in branches]))
    taken = (motion - smooth)[used]
    if taken[1:] @ taken[:-1] > MOST_CORRELATION * (taken @ taken):
        return motion
    turns = np.array([[branch.end, branch.sense] for branch in branches[::2]])
    inside = (turns[:, 0] >= half) & (turns[:, 0] < len(motion) - half)
    if not inside.any():
        return motion
    near = turns[inside, :1] + np.arange(-half // 4, half // 4 + 1)
    rounding = turns[inside, 1] * (motion - smooth)[near].mean(axis=1)
    error = float(np.std(taken)) / np.sqrt(near.size)
    return motion if abs(float(rounding.mean())) > MOST_ROUNDING * error else smooth
