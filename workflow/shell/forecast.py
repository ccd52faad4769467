"""Forecast of the remaining time of a run from the time its work has taken so far."""

from __future__ import annotations

import time
from collections.abc import Callable

MINUTE, HOUR, DAY = 60.0, 3600.0, 86400.0
# Rounded values for times below a minute; the nearest on a logarithmic scale is used [s].
FEW, ROUND = "a few seconds", (5.0, 10.0, 20.0, 30.0, 40.0)


class Forecast:
    """Remaining time of work, extrapolated from the share that is done.

    The first step does not count once there is a second: during the first, libraries are loaded and
    laws compiled. Times are those of a ``clock`` [s].
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self._now, self.share = clock(), 0.0
        self.go_on()

    def go_on(self) -> None:
        """Restart the measurement: the work done so far was restored from an earlier run."""
        self._begin = self._first = self._clock(), self.share
        self.steps = 0

    def reach(self, share: float) -> None:
        """Set the share of all work that is done; it may fall if more work has appeared.

        The caller's estimate may be wrong: a value below 0 or NaN counts as 0, a value above 1 as
        1.
        """
        share = min(share, 1.0) if share > 0.0 else 0.0
        self._now, self.share = self._clock(), share
        self.steps += 1
        if self.steps == 1:
            self._first = self._now, share

    @property
    def measured(self) -> float:
        """Measured time on which the forecast is based [s]."""
        return self._now - self._since[0]

    @property
    def left(self) -> float | None:
        """Time to the end [s]; None while nothing is done."""
        done = self.share - self._since[1]
        return self.measured * (1.0 - self.share) / done if done > 0.0 else None

    @property
    def _since(self) -> tuple[float, float]:
        """Time and share at which the measurement starts."""
        return self._first if self.steps > 1 and self.share > self._first[1] else self._begin


def in_words(seconds: float) -> str:
    """Return a time rounded to its accuracy: a few seconds, 20 s, 12 min, 3 h, 2 days."""
    if seconds < ROUND[0]:
        return FEW
    if seconds < 0.8 * MINUTE:
        return f"{min(ROUND, key=lambda rounded: max(rounded / seconds, seconds / rounded)):.0f} s"
    for unit, name, beyond in ((MINUTE, "min", HOUR), (HOUR, "h", 2.0 * DAY)):
        if seconds < 0.95 * beyond:
            return f"{_round(seconds / unit)} {name}"
    return f"{_round(seconds / DAY)} days"


def about(seconds: float) -> str:
    """Return the rounded time for use in a sentence: "about 12 min", but "a few seconds"."""
    words = in_words(seconds)
    return words if words == FEW else f"about {words}"


def _round(number: float) -> str:
    """Round to two digits; numbers below 20 to an integer."""
    return f"{max(number, 1.0):.0f}" if number < 20.0 else f"{5.0 * round(number / 5.0):.0f}"
