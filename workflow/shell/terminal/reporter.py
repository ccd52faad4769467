"""Reporter of a run: stages, forecasts and warnings, all of them logged in ``run.log``."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from sa_solver.types import Progress
from workflow.messages.warning_kinds import Notice, WarningKind
from workflow.shell.folders.isolation import Isolation
from workflow.shell.folders.store import check_regular
from workflow.shell.forecast import Forecast, about
from workflow.shell.run_time import RunTime
from workflow.shell.terminal.screen import Loudness, ProgressRow, Screen, console
from workflow.shell.terminal.signals import end_if_interrupted

T = TypeVar("T")
NOTHING_EXPECTED = RunTime(after=0.0)

# Seconds of work before a forecast is shown; the same after a single step, which may include
# loading; and the length of a run that needs no forecast.
FIRST_WORK, FIRST_STEP, SHORT_RUN = 1.0, 10.0, 10.0
# Share of the work at which the measured time and the expected time have equal weight.
LITTLE = 0.05
# A forecast is shown again when the forecast of the whole time has changed by this factor.
CHANGED = 1.5
# Seconds between two updates of the progress of a stage, and between two lines about it where
# there is no screen.
LOOK, LINE = 0.1, 60.0
# Parts that are isolated from the run, as warnings name them.
FORECAST, LOG, TERMINAL = "progress", "run.log", "terminal"


@dataclass
class _Course:
    """Progress of the long part of a run; ``reported`` is the last forecast shown."""

    name: str
    row: ProgressRow
    forecast: Forecast
    reported: float | None = None


class _Stage:
    """Progress callback of a stage for ``fe_models`` or ``wear``; it may be called at any rate."""

    def __init__(
        self,
        name: str,
        of: str,
        row: ProgressRow,
        say: Callable[[str], None] | None,
        isolated: Isolation,
    ) -> None:
        self._name, self._of, self._row, self._say = name, of, row, say
        self._forecast, self._looked = Forecast(), time.perf_counter()
        self._printed, self._isolated = self._looked, isolated

    def __call__(self, done: int, total: int) -> None:
        """Show that ``done`` of ``total`` are done. Raises KeyboardInterrupt if one was lost."""
        end_if_interrupted()
        with self._isolated(FORECAST):
            self._look(done, total)

    def _look(self, done: int, total: int) -> None:
        now = time.perf_counter()
        if now - self._looked < LOOK:
            return
        self._looked = now
        self._forecast.reach(done / max(total, 1))
        at, left = f"{done} of {total} {self._of}".rstrip(), self._forecast.left
        remaining = "" if left is None else f"{about(left)} more"
        self._row.show(self._forecast.share, at, remaining)
        if self._say and now - self._printed > LINE:
            self._printed = now
            self._say(f"{self._name}: {at}, {remaining}".rstrip(", "))


class Reporter:
    """Reporter that times stages, logs lines, collects warnings and forecasts the run time.

    The time after the long part is scaled from its ``expected`` value by the same factor by which
    the time before it was exceeded. Failures of the reporter never end a run; ``isolated`` protects
    the run from other code that only shows it, too. Raises UserError if the path of ``log`` is not
    a regular file, for example a pipe.
    """

    def __init__(
        self,
        log: Path,
        append: bool = False,
        expected: RunTime = NOTHING_EXPECTED,
        loudness: Loudness = Loudness.NORMAL,
    ) -> None:
        check_regular(log)
        self._log = log.open("a" if append else "w", encoding="utf-8")
        self.warnings: list[str] = []
        self.isolated = Isolation(self.warn)
        self._loudness, self._screen = loudness, Screen(loudness > Loudness.QUIET, self.isolated)
        self._begin, self.expected, self._after = time.perf_counter(), expected, 0.0
        self._course: _Course | None = None
        self._span, self._names = (0.0, 1.0), ""
        self.seconds: dict[str, float] = {}

    def close(self) -> None:
        self._screen.close()
        with self.isolated(LOG, needed=False):
            self._log.close()

    @property
    def elapsed(self) -> float:
        """Time since the reporter was created [s]."""
        return time.perf_counter() - self._begin

    def say(self, line: str, always: bool = False) -> None:
        """Write a line to the terminal and the log; ``always`` writes it even in quiet mode."""
        self._write(line)
        if always or self._loudness > Loudness.QUIET:
            self._print(line)

    def log(self, line: str) -> None:
        """Write a line to the log, and to the terminal in verbose mode."""
        self._write(line)
        if self._loudness is Loudness.VERBOSE:
            self._print(line)

    def _write(self, line: str) -> None:
        with self.isolated(LOG, needed=False):
            self._log.write(f"{time.strftime('%H:%M:%S')} {line}\n")
            self._log.flush()

    def _print(self, line: str) -> None:
        with self.isolated(TERMINAL):
            console().print(line, markup=False, soft_wrap=True)

    def warn(self, kind: WarningKind, text: str) -> None:
        """Show a warning once with its code, and store it for the summary."""
        self.repeat(kind.marked(text))

    def warn_each(self, notices: Iterable[Notice]) -> None:
        """Show warnings as :meth:`warn` does."""
        for notice in notices:
            self.warn(*notice)

    def repeat(self, line: str) -> None:
        """Show a warning that has its code already, unless it was shown before."""
        if line not in self.warnings:
            self.warnings.append(line)
            self.say(f"warning: {line}", always=True)

    @contextmanager
    def stage(self, name: str, of: str = "") -> Iterator[Progress]:
        """Show and time a stage; times of stages with the same name are added.

        The yielded callback takes the number of finished items, named by ``of``, and the total.
        Raises KeyboardInterrupt if one was lost.
        """
        end_if_interrupted()
        begin = time.perf_counter()
        try:
            with self._screen.row(name) as row:
                yield _Stage(name, of, row, None if self._screen.on else self.say, self.isolated)
        finally:
            spent = time.perf_counter() - begin
            self.seconds[name] = self.seconds.get(name, 0.0) + spent
            self.log(f"{name}: {spent:.2f} s")

    # -- forecast ------------------------------------------------------------------------------

    @contextmanager
    def course(self, name: str) -> Iterator[None]:
        """Show the long part of a run, whose progress :meth:`part` and :meth:`reached` report."""
        with self._screen.row(name) as row:
            self._course = _Course(name, row, Forecast())
            with self.isolated(FORECAST):
                self._after = self.expected.after * max(1.0, self.elapsed / self.expected.begun)
                if (expected := self.expected.course) > 0.0:
                    row.show(0.0, "", f"{about(expected + self._after)} to go")
            try:
                yield
            finally:
                self._course = None

    @contextmanager
    def part(self, begin: float, end: float, name: str = "") -> Iterator[None]:
        """Mark work as the range between two shares of the enclosing part, or of the course."""
        (first, last), names = around = self._span, self._names
        size = last - first
        self._span = first + begin * size, first + end * size
        self._names = f"{names}{name}: " if name else names
        try:
            yield
            self.reached(1.0)
        finally:
            self._span, self._names = around

    def _blended(self, measured: float, share: float) -> float:
        """Return the time to the end of the course, from the measured and the expected time [s].

        The smaller the finished ``share``, the more the expected time counts, because harmonics and
        contacts become more expensive as the run proceeds.
        """
        expected = self.expected.course * (1.0 - share)
        if not measured * expected > 0.0:
            return measured
        trust = share / (share + LITTLE)
        return float(measured**trust * expected ** (1.0 - trust))

    def parts(self, items: Sequence[T], name: Callable[[T], str]) -> Iterator[T]:
        """Yield items one after the other, each as an equal and named :meth:`part` of the work."""
        for number, item in enumerate(items):
            with self.part(number / len(items), (number + 1) / len(items), name(item)):
                yield item

    def goes_on(self) -> None:
        """Mark the work reported so far as restored from an earlier run."""
        if self._course:
            self._course.forecast.go_on()

    def doing(self, text: str) -> None:
        """Show on the screen what the long part is doing at the moment."""
        if self._course:
            self._course.row.doing(text)

    def reached(self, share: float, text: str = "") -> None:
        """Report that about this ``share`` of the present part is done; ``text`` describes it."""
        if self._course is not None:
            with self.isolated(FORECAST):
                self._tell(self._course, share, text)

    def _tell(self, course: _Course, share: float, text: str) -> None:
        begin, end = self._span
        course.forecast.reach(begin + (end - begin) * share)
        at = f"{self._names}{text}".rstrip(": ")
        if course.forecast.left is None:
            course.row.show(course.forecast.share, at, "")
            return
        to_go = self._blended(course.forecast.left, course.forecast.share) + self._after
        remaining = f"{about(to_go)} to go"
        course.row.show(course.forecast.share, at, remaining)
        whole, before = self.elapsed + to_go, course.reported
        least = FIRST_STEP if course.forecast.steps == 1 else FIRST_WORK
        if course.forecast.measured < least or whole < SHORT_RUN:
            return
        if before is None or max(whole / before, before / whole) > CHANGED:
            where = ", ".join(filter(None, (course.name, at)))
            (self.say if before is None else self.log)(f"{where}: {remaining}")
            course.reported = whole


class _Telling(logging.Handler):
    """Logging handler that passes log records to the reporter of a run."""

    def __init__(self, reporter: Reporter) -> None:
        super().__init__()
        self._reporter = reporter

    def emit(self, record: logging.LogRecord) -> None:
        with self._reporter.isolated(LOG):
            self._reporter.say(record.getMessage(), always=record.levelno >= logging.WARNING)


@contextmanager
def telling(reporter: Reporter) -> Iterator[None]:
    """Pass the log records of our modules to the reporter."""
    ours, handler = logging.getLogger("workflow"), _Telling(reporter)
    ours.addHandler(handler)
    try:
        yield
    finally:
        ours.removeHandler(handler)
