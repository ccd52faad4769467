"""A record of hysteresis loops: its columns, its reversals, its branches from one to the next."""

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
"""A reversal turns back by more than this many standard deviations of the noise, the most that the
extremes of a million samples of it are apart, ..."""

SMALLEST, LARGEST = 0.01, 0.5
"""... and by more than the first share of the range, as less are ripples of the drive; by more than
the second it is one whatever the noise."""

SHORT = 2
"""Steps up to which a way from one sample that turns to the next is a sign of noise."""

BACKWARDS = 3.0
"""Steps back of white noise exceed its standard deviation half of the time: three times as much is
an upper bound."""

CLOSING = 0.02
"""A loop is closed if it ends this close to where it began, in its stroke, ..."""

NOISE_BAND = 4.0
"""The reversal is among the samples this many standard deviations of noise from the extreme one
(no loop is closed better than that either), ..."""

SHOULDER = 0.05
"""... and there where lines over this share of the two branches meet, be it a corner or not."""

ENOUGH = 5
"""Reversals, ends included, that make a loop without the beginning of a record."""

COMPLETE = 0.98
"""In shorter records the first branch counts if it covers this share of the stroke."""

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
    """Way from a reversal to the next: its ``samples`` ``(k,)`` of a record, and ``sense`` ±1.

    Samples of smaller loops that close on the way are left out.
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
    """Return the samples at which ``displacement`` ``(t,)`` turns back, and both ends.

    Noise does not turn it: a reversal is one if the displacement then goes back by more than
    :func:`resolution`. The first and the last sample given may be where the record begins or ends.
    Raises MeasuredLoopError for a record that never moves.
    """
    motion = np.asarray(displacement, dtype=float)
    turns = _turning_points(motion.tolist(), resolution(motion))
    if len(turns) < 3:
        return np.array(turns, dtype=np.int64)
    first, *inner, last = turns
    band = NOISE_BAND * noise_of(motion)
    neighbours = zip([first, *inner[:-1]], inner, [*inner[1:], last], strict=True)
    middle = [_amid(motion, place, band) for place in neighbours]
    return np.array([first, *middle, last], dtype=np.int64)


def resolution(displacement: Array) -> float:
    """Return the smallest way back of ``displacement`` ``(t,)`` that counts as a reversal [mm].

    Raises MeasuredLoopError for a record that never moves.
    """
    extent = float(np.ptp(displacement)) if displacement.size else 0.0
    if not extent > 0.0:
        raise MeasuredLoopError("the displacement never changes; allowed: a record of loops")
    return float(np.clip(NOISE_REACH * noise_of(displacement), SMALLEST * extent, LARGEST * extent))


def noise_of(values: Array) -> float:
    """Return the standard deviation of the noise of ``values`` ``(t,)``, 0 where none shows.

    It is that of the third differences, in which a motion drops out that is sampled finely. In one
    of a few points a branch it does not; so the noise is no larger than the ways that turn back
    within :data:`SHORT` steps, of which a motion without noise has none.
    """
    moving = values[np.append(True, np.diff(values) != 0.0)]
    turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(moving))))
    short = np.abs(np.diff(moving[turns]))[np.diff(turns) <= SHORT]
    if short.size == 0 or moving.size < 4:
        return 0.0
    # Of white noise they have the variance 1 + 9 + 9 + 1; the median of |N(0, 1)| is 0.6745.
    spread = float(np.median(np.abs(np.diff(moving, 3)))) / float(0.6745 * np.sqrt(20.0))
    return min(spread, float(short.max()))


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


# --- loops --------------------------------------------------------------------------------------

LoopPair = tuple[LoopBranch, LoopBranch]


@dataclass(frozen=True)
class _Way:
    """A way of one ``sense`` ±1, in ``pieces`` from one place of a record to another.

    Places between samples are meant as well; ``whole`` says whether it begins at a reversal.
    """

    pieces: tuple[tuple[float, float], ...]
    sense: int
    whole: bool = True

    def travel(self, motion: Array) -> float:
        """Displacement that it covers [mm]."""
        ends = self.pieces[0][0], self.pieces[-1][1]
        return self.sense * float(np.diff(np.interp(ends, np.arange(len(motion)), motion))[0])


def closed_loops(record: LoopRecord) -> tuple[LoopRecord, tuple[LoopPair, ...]]:
    """Return the two branches of every closed loop, in the order in which they close.

    A loop closes where the displacement comes back to the reversal at which it began; it is taken
    out, and what was before goes on behind it (Masing's memory, which counts loops as rainflow
    does). Where that is between two samples of a branch that goes on, the record that is returned
    has one more sample there. One closed period that begins anywhere is turned to begin at a
    reversal. Raises MeasuredLoopError for a record without a loop.
    """
    turns = reversals(record.displacement)
    loops = _closed_ways(record.displacement, turns)
    if not loops and len(turns) >= 2 and _closed(record):
        record = _begun_at(record, int(turns[1]))
        loops = _closed_ways(record.displacement, reversals(record.displacement))
    if not loops:
        raise MeasuredLoopError(
            "no complete cycle; allowed: a record that has one from reversal to reversal, or of "
            "strokes that fall two cycles of each, or one closed period"
        )
    ends = [end for loop in loops for way in loop for piece in way.pieces for end in piece]
    samples = np.arange(len(record.force))
    places = np.union1d(samples, ends)
    record = LoopRecord(*(np.interp(places, samples, column) for column in record))
    return record, tuple((_branch(out, places), _branch(back, places)) for out, back in loops)


def _branch(way: _Way, places: Array) -> LoopBranch:
    """The samples of a way, once the record has all ``places``."""
    parts = [
        np.arange(*(np.searchsorted(places, piece) + np.array([0, 1]))) for piece in way.pieces
    ]
    # Pieces that follow each other share a sample.
    return LoopBranch(np.unique(np.concatenate(parts)), way.sense)


def _closed_ways(motion: Array, turns: Indices) -> list[tuple[_Way, _Way]]:
    """The ways of all loops that close between ``turns``."""
    ways = [
        _Way(((float(begin), float(end)),), 1 if motion[end] > motion[begin] else -1)
        for begin, end in pairwise(turns.tolist())
    ]
    longest = max((way.travel(motion) for way in ways), default=0.0)
    if ways and (len(turns) >= ENOUGH or ways[0].travel(motion) < COMPLETE * longest):
        ways[0] = replace(ways[0], whole=False)
    slack = NOISE_BAND * noise_of(motion)
    loops: list[tuple[_Way, _Way]] = []
    opened: list[_Way] = []
    for way in ways:
        while opened and opened[-1].whole:
            stroke = opened[-1].travel(motion)
            short = max(CLOSING * stroke, slack)
            if way.travel(motion) < stroke - short:
                break
            before = opened.pop()
            back, rest = _parted(motion, way, before, way.travel(motion) > stroke + short)
            loops.append((before, back))
            if not opened:
                way = replace(rest, whole=False)
                break
            outer = opened.pop()
            way = replace(outer, pieces=(*outer.pieces, *rest.pieces))
        opened.append(way)
    return loops


def _parted(motion: Array, way: _Way, before: _Way, beyond: bool) -> tuple[_Way, _Way]:
    """A way up to where ``before`` began, or to its end unless it goes ``beyond``, and the rest."""
    *pieces, (begin, end) = way.pieces
    place = end
    if beyond:
        level = motion[int(before.pieces[0][0])]
        inside = np.arange(int(np.ceil(begin)), int(end))
        below = inside[way.sense * (motion[inside] - level) < 0.0]
        last = int(below[-1]) if below.size else int(np.floor(begin))
        step = motion[last + 1] - motion[last]
        share = (level - motion[last]) / step if step != 0.0 else 0.0
        place = float(np.clip(last + share, begin, end))
    back = replace(way, pieces=(*pieces, (begin, place)))
    return back, replace(way, pieces=((place, end),))


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


def noise_along(record: LoopRecord, branches: Sequence[LoopBranch]) -> tuple[float, float]:
    """Return the standard deviations of the noise of displacement [mm] and force [N].

    Where a branch has few points its force jumps as noise does, but not backwards: its noise is no
    more than :data:`BACKWARDS` times what half of the steps back exceed, and 0 without any.
    """
    steps = [branch.sense * np.diff(record.force[branch.samples]) for branch in branches]
    back = -np.concatenate(steps)
    back = back[back > 0.0]
    most = BACKWARDS * float(np.median(back)) if back.size else 0.0
    return noise_of(record.displacement), min(noise_of(record.force), most)


def smoothed(motion: Array, branches: Sequence[LoopBranch]) -> Array:
    """Return the displacement ``(t,)`` without some of the noise, right on ``branches`` alone.

    It is the displacement as it is if it shows no noise, or if smoothing would bend the motion.
    Branches follow each other in pairs, the first of which ends at a reversal.
    """
    if noise_of(motion) == 0.0:
        return motion
    period = 2.0 * float(np.median([len(branch.samples) - 1 for branch in branches]))
    half = int(0.5 * SMOOTHING * period)
    if 2 * half + 1 < FEWEST_SMOOTHED or len(motion) < 2 * half + 1:
        return motion
    # Half a second to import: where it is used.
    from scipy.signal import savgol_filter

    smooth: Array = savgol_filter(motion, 2 * half + 1, 3)
    used = np.unique(np.concatenate([branch.samples for branch in branches]))
    taken = (motion - smooth)[used]
    if taken[1:] @ taken[:-1] > SIGNAL * (taken @ taken):
        return motion
    turns = np.array([[branch.end, branch.sense] for branch in branches[::2]])
    inside = (turns[:, 0] >= half) & (turns[:, 0] < len(motion) - half)
    if not inside.any():
        return motion
    near = turns[inside, :1] + np.arange(-half // 4, half // 4 + 1)
    rounding = turns[inside, 1] * (motion - smooth)[near].mean(axis=1)
    error = float(np.std(taken)) / np.sqrt(near.size)
    return motion if abs(float(rounding.mean())) > ROUNDED * error else smooth
