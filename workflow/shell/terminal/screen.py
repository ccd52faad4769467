"""Live progress at the bottom of a terminal: one row for each task in progress.

Nothing is shown if stderr is not a terminal, or only a dumb one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from enum import IntEnum
from functools import cache

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, ProgressColumn, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Column

from workflow.shell.folders.isolation import Isolation

# Seconds after which a row is shown.
BRIEF = 0.3
BAR_WIDTH = 20
# Width of a terminal, in columns, below which there is no room for words next to a bar.
NARROW = 60
# Part that is isolated from the run, as a warning names it.
ROWS = "progress on the terminal"


class Loudness(IntEnum):
    """Amount of output on the terminal; the log has everything."""

    QUIET = 0  # errors and warnings
    NORMAL = 1
    VERBOSE = 2  # all that goes to the log


@cache
def console() -> Console:
    """Return the console on stderr, shared so that the rows of nested runs appear together."""
    return Console(stderr=True, highlight=False, force_jupyter=False)


def tables_console(file_width: int) -> Console:
    """Return a console on stdout for tables, of ``file_width`` columns if it is no terminal."""
    stdout = Console(highlight=False, markup=False)
    if not stdout.is_terminal:
        stdout.width = file_width
    return stdout


class ProgressRow:
    """Row of one task, with its progress as a bar and in words."""

    def __init__(self, rows: Progress, task: TaskID, isolated: Isolation) -> None:
        self._rows, self._task, self._isolated = rows, task, isolated

    def show(self, share: float, at: str, left: str) -> None:
        """Show the finished ``share``, its description ``at``, and the remaining time ``left``."""
        with self._isolated(ROWS):
            self._rows.update(self._task, total=1.0, completed=share, at=at, left=left)

    def doing(self, at: str) -> None:
        """Change the description; the finished share stays the same."""
        with self._isolated(ROWS):
            self._rows.update(self._task, at=at)


class _Rows(Progress):
    """Progress display of the tasks that have lasted a while, or else of the first one.

    Shorter tasks would only flicker.
    """

    def get_renderables(self) -> Iterable[RenderableType]:
        lasting = [task for task in self.tasks[1:] if (task.elapsed or 0.0) > BRIEF]
        yield self.make_tasks_table(lasting or self.tasks[:1])


class Screen:
    """Rows of a run; nothing is shown unless it is ``on``, and its failures never end a run."""

    def __init__(self, on: bool, isolated: Isolation | None = None) -> None:
        self._isolated = isolated or Isolation(lambda kind, text: None)
        columns = _columns(console().width)
        self._rows = _Rows(*columns, console=console(), transient=True, expand=True)
        self._between = self._rows.add_task("working", total=None, at="", left="")
        self._on = on and console().is_terminal and not console().is_dumb_terminal
        if self._on:
            with self._isolated(ROWS):
                self._rows.start()

    @property
    def on(self) -> bool:
        """True if rows are visible."""
        return self._on

    @contextmanager
    def row(self, name: str) -> Iterator[ProgressRow]:
        """Show a row while a task of this ``name`` is in progress."""
        # An invalid number, used if the row cannot be added.
        task = TaskID(-1)
        with self._isolated(ROWS):
            task = self._rows.add_task(name, total=None, at="", left="")
        try:
            yield ProgressRow(self._rows, task, self._isolated)
        finally:
            with self._isolated(ROWS):
                self._rows.remove_task(task)
                self._rows.reset(self._between)

    def close(self) -> None:
        """Remove all rows from the terminal."""
        if self._on:
            with self._isolated(ROWS):
                self._rows.stop()


def _columns(width: int) -> tuple[ProgressColumn, ...]:
    """Return the columns: name, bar, seconds, progress, remaining time; long texts are cut."""
    cut = Column(ratio=1, no_wrap=True, overflow="ellipsis")
    name, seconds = TextColumn("{task.description}", markup=False), TimeElapsedColumn()
    at = TextColumn("{task.fields[at]}", markup=False, table_column=cut)
    if width < NARROW:
        return name, seconds, at
    return name, BarColumn(BAR_WIDTH), seconds, at, TextColumn("{task.fields[left]}", markup=False)
