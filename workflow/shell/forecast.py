"""How long the rest of a run will take, told by how long its work so far has taken."""

from __future__ import annotations

import time
from collections.abc import Callable

MINUTE, HOUR, DAY = 60.0, 3600.0, 86400.0
# Below a minute, what a time is told as, the nearest by its logarithm [s].
FEW, ROUND = "a few seconds", (5.0, 10.0, 20.0, 30.0, 40.0)


class Forecast:
    """The time that is left of work, by what its share that is done has taken.

    As soon as there is more, the first step does not count: with it libraries are loaded and laws
    compiled. Times are those of a ``clock`` [s].
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self._now, self.share = clock(), 0.0
        self.go_on()

    def go_on(self) -> None:
        """What is done by now was kept from an earlier run: it says nothing about the rest."""
        self._begin = self._first = self._clock(), self.share
        self.steps = 0

    def reach(self, share: float) -> None:
        """So large a share of all work is done; a smaller one than before where more has shown.

        Whoever reckons it may be wrong: below 0, or where it is no number, nothing is done yet, and
        above 1 all is.
        """
        share = min(share, 1.0) if share > 0.0 else 0.0
        self._now, self.share = self._clock(), share
        self.steps += 1
        if self.steps == 1:
            self._first = self._now, share

    @property
    def measured(self) -> float:
        """Time from which the rest is told [s]."""
        return self._now - self._since[0]

    @property
    def left(self) -> float | None:
        """Time to the end [s], None while nothing is done."""
        done = self.share - self._since[1]
        return self.measured * (1.0 - self.share) / done if done > 0.0 else None

    @property
    def _since(self) -> tuple[float, float]:
        """Time and share from which on steps count."""
        return self._first if self.steps > 1 and self.share > self._first[1] else self._begin


def in_words(seconds: float) -> str:
    """A time as roughly as it is known: a few seconds, 20 s, 12 min, 3 h, 2 days."""
    if seconds < ROUND[0]:
        return FEW
    if seconds < 0.8 * MINUTE:
        return f"{min(ROUND, key=lambda told: max(told / seconds, seconds / told)):.0f} s"
    for unit, name, beyond in ((MINUTE, "min", HOUR), (HOUR, "h", 2.0 * DAY)):
        if seconds < 0.95 * beyond:
            return f"{_round(seconds / unit)} {name}"
    return f"{_round(seconds / DAY)} days"


def about(seconds: float) -> str:
    """The same as part of a sentence: about 12 min, but not about a few seconds."""
    told = in_words(seconds)
    return told if told == FEW else f"about {told}"


def _round(number: float) -> str:
    """Two digits, of small numbers one."""
    return f"{max(number, 1.0):.0f}" if number < 20.0 else f"{5.0 * round(number / 5.0):.0f}"
