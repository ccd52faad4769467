"""Times of a period: steps of equal length, some of which are divided in four, again and again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe_models.dynamics.linear_steps import SPLIT

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
        cls, regimes: Callable[[PeriodTimes], np.ndarray], samples: int, deepest: int
    ) -> PeriodTimes:
        """Steps that are divided to the ``deepest`` level where ``regimes`` ``(t, j)`` change.

        What joints do for less than a step is looked for at more times, and not passed over.
        """
        times, probe = cls.even(samples, deepest), cls.even(PROBE * samples, deepest)
        known = regimes(probe)
        changes = (known != np.roll(known, -1, axis=0)).any(axis=1)
        for level in range(min(PROBED, deepest)):
            marked = np.zeros(len(times.starts), bool)
            within = np.searchsorted(times.starts, probe.starts[changes] // PROBE, side="right")
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
