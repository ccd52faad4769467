"""What goes on, live at the foot of a terminal: a row for each thing that is being done.

Where stderr is no terminal, or one that only prints, there is nothing to see of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from enum import IntEnum
from functools import cache

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, ProgressColumn, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Column

from workflow.shell.isolation import Isolation

# Seconds before a row is worth being looked at.
BRIEF = 0.3
BAR_WIDTH = 20
# Columns of a terminal below which words have no room beside a bar.
NARROW = 60
# What is isolated from the run, as a warning names it.
ROWS = "progress on the terminal"


class Loudness(IntEnum):
    """What is said on the terminal; the log has everything."""

    QUIET = 0  # errors and warnings
    NORMAL = 1
    VERBOSE = 2  # all that goes to the log


@cache
def console() -> Console:
    """That of stderr: one for all, for a run within a run has its rows below those around it."""
    return Console(stderr=True, highlight=False, force_jupyter=False)


class Row:
    """One thing that is being done: how far that is, as a bar and in words."""

    def __init__(self, rows: Progress, task: TaskID, isolated: Isolation) -> None:
        self._rows, self._task, self._isolated = rows, task, isolated

    def show(self, share: float, at: str, left: str) -> None:
        """``share`` of it is done: how far ``at`` that is, and how long what is ``left`` takes."""
        with self._isolated(ROWS):
            self._rows.update(self._task, total=1.0, completed=share, at=at, left=left)

    def doing(self, at: str) -> None:
        """No more of it is done than before."""
        with self._isolated(ROWS):
            self._rows.update(self._task, at=at)


class _Rows(Progress):
    """The first row where there is no other, and those that are there for a while.

    What is done at once would only flicker.
    """

    def get_renderables(self) -> Iterable[RenderableType]:
        lasting = [task for task in self.tasks[1:] if (task.elapsed or 0.0) > BRIEF]
        yield self.make_tasks_table(lasting or self.tasks[:1])


class Screen:
    """The rows of a run; nothing is shown if it is not ``on``, and nothing ends a run."""

    def __init__(self, on: bool, isolated: Isolation | None = None) -> None:
        self._isolated = isolated or Isolation(lambda warning: None)
        columns = _columns(console().width)
        self._rows = _Rows(*columns, console=console(), transient=True, expand=True)
        self._between = self._rows.add_task("working", total=None, at="", left="")
        self._on = on and console().is_terminal and not console().is_dumb_terminal
        if self._on:
            with self._isolated(ROWS):
                self._rows.start()

    @property
    def on(self) -> bool:
        """Whether rows can be seen."""
        return self._on

    @contextmanager
    def row(self, name: str) -> Iterator[Row]:
        """A row as long as something of this ``name`` is being done."""
        # The number of none: where a row cannot be added, there is none to be shown.
        task = TaskID(-1)
        with self._isolated(ROWS):
            task = self._rows.add_task(name, total=None, at="", left="")
        try:
            yield Row(self._rows, task, self._isolated)
        finally:
            with self._isolated(ROWS):
                self._rows.remove_task(task)
                self._rows.reset(self._between)

    def close(self) -> None:
        """Nothing is left on the terminal."""
        if self._on:
            with self._isolated(ROWS):
                self._rows.stop()


def _columns(width: int) -> tuple[ProgressColumn, ...]:
    """Name, bar, seconds, how far, how long; what is too long for so wide a terminal is cut."""
    cut = Column(ratio=1, no_wrap=True, overflow="ellipsis")
    name, seconds = TextColumn("{task.description}", markup=False), TimeElapsedColumn()
    at = TextColumn("{task.fields[at]}", markup=False, table_column=cut)
    if width < NARROW:
        return name, seconds, at
    return name, BarColumn(BAR_WIDTH), seconds, at, TextColumn("{task.fields[left]}", markup=False)
