"""Times of a period: steps of equal length, some of which are divided in four, again and again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_models.dynamics.transient.linear_steps import SPLIT

# Times in a step at which it is looked what joints do, and levels to which it is divided for that.
PROBE, PROBED = 8, 2


@dataclass(frozen=True)
class PeriodTimes:
    """Steps that begin at ``starts`` ``(t,)``, as ``parts`` of the period, of ``levels`` ``(t,)``.

    Of level 0 are ``samples`` steps; one of each next level is a quarter as long, until the
    ``deepest``.
    """

    starts: np.ndarray
    levels: np.ndarray
    samples: int
    deepest: int

    @classmethod
    def even(cls, samples: int, deepest: int) -> PeriodTimes:
        """Steps of equal length, as many as there are samples."""
        starts = SPLIT**deepest * np.arange(samples)
        return cls(starts, np.zeros(samples, np.int64), samples, deepest)

    @classmethod
    def following(
        cls,
        regimes: Callable[[PeriodTimes], np.ndarray],
        samples: int,
        deepest: int,
        path: Callable[[PeriodTimes], np.ndarray] | None = None,
    ) -> PeriodTimes:
        """Steps that are divided to the ``deepest`` level where ``regimes`` ``(t, j)`` change.

        What joints do for less than a step is looked for at more times, and not passed over: also
        at those at which a ``path`` ``(t, d)`` turns, as a stop may be met there for a moment only.
        """
        times, probe = cls.even(samples, deepest), cls.even(PROBE * samples, deepest)
        if path is not None:
            starts = np.union1d(probe.starts, probe.turns(path(probe)))
            probe = replace(probe, starts=starts, levels=np.zeros(len(starts), np.int64))
        known = regimes(probe)
        differs = known != np.roll(known, -1, axis=0)
        changes = differs.any(axis=1)
        moments = (differs & np.roll(differs, 1, axis=0)).any(axis=1)
        for level in range(deepest):
            marked = np.zeros(len(times.starts), bool)
            sought = probe.starts[changes if level < PROBED else moments]
            within = np.searchsorted(times.starts, sought // PROBE, side="right")
            marked[within - 1] = True
            times = times.divided(marked & (times.levels == level))
        while True:
            known = regimes(times)
            changes = (known != np.roll(known, -1, axis=0)).any(axis=1)
            # It changes in this step or, where the motion turns, in the next.
            marked = changes | np.roll(changes, 1)
            if not (marked & (times.levels < deepest)).any():
                return times
            times = times.divided(marked)

    @property
    def parts(self) -> int:
        """In which times are counted."""
        return int(self.samples * SPLIT**self.deepest)

    def turns(self, values: np.ndarray) -> np.ndarray:
        """Times, in parts, at which ``values`` ``(t, d)`` at steps of equal length turn.

        They are those of parabolas through three values.
        """
        before, after = values - np.roll(values, 1, axis=0), np.roll(values, -1, axis=0) - values
        steps, numbers = np.nonzero((before * after <= 0.0) & (before != after))
        first, second = before[steps, numbers], after[steps, numbers]
        offset = 0.5 * (first + second) / (first - second)
        length = self.parts // self.samples
        return np.rint(self.starts[steps] + offset * length).astype(np.int64) % self.parts

    def divided(self, marked: np.ndarray) -> PeriodTimes:
        """With the ``marked`` ``(t,)`` steps in four, if they are not of the deepest level.

        The first two steps, the next two, ... are divided together, so that :meth:`halved` is of
        the same times.
        """
        marked = np.repeat(marked.reshape(-1, 2).any(axis=1), 2)
        pieces = np.where(marked & (self.levels < self.deepest), SPLIT, 1)
        levels = np.repeat(self.levels + (pieces > 1), pieces)
        within = np.arange(len(levels)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        starts = np.repeat(self.starts, pieces) + within * SPLIT ** (self.deepest - levels)
        return PeriodTimes(starts, levels, self.samples, self.deepest)

    def halved(self) -> PeriodTimes:
        """With every step twice as long: those of a level come in pairs."""
        return PeriodTimes(self.starts[::2] // 2, self.levels[::2], self.samples // 2, self.deepest)
