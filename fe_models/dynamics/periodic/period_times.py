"""Times of a period: uniform steps, some of which are divided in four repeatedly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_models.dynamics.transient.linear_steps import SPLIT

# Probe steps per step that detect changes of the joints, and the number of levels to which all
# steps with a change are divided. Deeper levels are only for changes that last less than a probe
# step.
PROBE_REFINEMENT, PROBED_LEVELS = 8, 2


@dataclass(frozen=True)
class PeriodTimes:
    """Steps of a period, of different lengths.

    Parameters
    ----------
    starts
        Starts ``(t,)`` of the steps, as multiples of the period over :attr:`parts`.
    levels
        Level ``(t,)`` of each step. A step of level 0 is the period over ``samples``; each further
        level divides it in four.
    samples
        Number of steps of level 0 in the period.
    deepest
        Deepest level allowed.
    """

    starts: np.ndarray
    levels: np.ndarray
    samples: int
    deepest: int

    @classmethod
    def uniform(cls, samples: int, deepest: int) -> PeriodTimes:
        """Return ``samples`` steps of equal length."""
        starts = SPLIT**deepest * np.arange(samples)
        return cls(starts, np.zeros(samples, np.int64), samples, deepest)

    @classmethod
    def adapted(
        cls,
        regimes: Callable[[PeriodTimes], np.ndarray],
        samples: int,
        deepest: int,
        path: Callable[[PeriodTimes], np.ndarray] | None = None,
    ) -> PeriodTimes:
        """Return steps that are divided to the deepest level where joints change their state.

        Joint states that last less than a step are not missed, because the states are also probed
        at more times. Turning points of the path are among them, since a stop may be touched there
        only for a moment.

        Parameters
        ----------
        regimes
            Function that returns the joint states ``(t, j)`` at given times.
        samples
            Number of steps of level 0.
        deepest
            Deepest level.
        path
            Function that returns the joint displacements ``(t, d)`` at given times; without it
            turning points are not probed.
        """
        times = cls.uniform(samples, deepest)
        probe = cls.uniform(PROBE_REFINEMENT * samples, deepest)
        if path is not None:
            # Sorting is faster than numpy's union by hashes.
            starts = np.sort(np.concatenate([probe.starts, probe.turns(path(probe))]))
            starts = starts[np.diff(starts, prepend=-1) > 0]
            probe = replace(probe, starts=starts, levels=np.zeros(len(starts), np.int64))
        known = regimes(probe)
        differs = known != np.roll(known, -1, axis=0)
        changes = differs.any(axis=1)
        brief = (differs & np.roll(differs, 1, axis=0)).any(axis=1)
        for level in range(deepest):
            marked = np.zeros(len(times.starts), bool)
            events = probe.starts[changes if level < PROBED_LEVELS else brief]
            within = np.searchsorted(times.starts, events // PROBE_REFINEMENT, side="right")
            marked[within - 1] = True
            times = times.with_divided(marked & (times.levels == level))
        while True:
            known = regimes(times)
            changes = (known != np.roll(known, -1, axis=0)).any(axis=1)
            # The joint changes in this step or, where the motion turns, in the next one.
            marked = changes | np.roll(changes, 1)
            if not (marked & (times.levels < deepest)).any():
                return times
            times = times.with_divided(marked)

    @property
    def parts(self) -> int:
        """Number of units of time in the period."""
        return int(self.samples * SPLIT**self.deepest)

    def turns(self, values: np.ndarray) -> np.ndarray:
        """Return the times, in parts, of the extrema of ``values`` ``(t, d)`` at uniform steps.

        The extrema are those of parabolas through three values.
        """
        before, after = values - np.roll(values, 1, axis=0), np.roll(values, -1, axis=0) - values
        steps, numbers = np.nonzero((before * after <= 0.0) & (before != after))
        first, second = before[steps, numbers], after[steps, numbers]
        offset = 0.5 * (first + second) / (first - second)
        length = self.parts // self.samples
        return np.rint(self.starts[steps] + offset * length).astype(np.int64) % self.parts

    def with_divided(self, marked: np.ndarray) -> PeriodTimes:
        """Return times in which the ``marked`` ``(t,)`` steps are divided in four.

        Steps at the deepest level stay as they are. The first two steps, the next two, and so on
        are divided together, so that :meth:`halved` can merge them.
        """
        marked = np.repeat(marked.reshape(-1, 2).any(axis=1), 2)
        pieces = np.where(marked & (self.levels < self.deepest), SPLIT, 1)
        levels = np.repeat(self.levels + (pieces > 1), pieces)
        within = np.arange(len(levels)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        starts = np.repeat(self.starts, pieces) + within * SPLIT ** (self.deepest - levels)
        return PeriodTimes(starts, levels, self.samples, self.deepest)

    def halved(self) -> PeriodTimes:
        """Return times with every two steps merged into one; steps of a level come in pairs."""
        return PeriodTimes(self.starts[::2] // 2, self.levels[::2], self.samples // 2, self.deepest)
