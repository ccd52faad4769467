"""What a run says while it works: stages and jumps on the terminal, everything in ``run.log``."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)


class Reporter:
    """Times stages, logs lines and collects warnings."""

    def __init__(self, log: Path, append: bool = False) -> None:
        self._log = log.open("a" if append else "w", encoding="utf-8")
        self._console = Console(stderr=True, highlight=False)
        self._bar_shown = False
        self.seconds: dict[str, float] = {}
        self.warnings: list[str] = []

    def close(self) -> None:
        self._log.close()

    def say(self, line: str) -> None:
        """A line on the terminal and in the log."""
        self._console.print(line, markup=False, soft_wrap=True)
        self.log(line)

    def log(self, line: str) -> None:
        """A line in the log only."""
        self._log.write(f"{time.strftime('%H:%M:%S')} {line}\n")
        self._log.flush()

    def warn(self, line: str) -> None:
        """A warning: said once, and kept for the summary."""
        if line not in self.warnings:
            self.warnings.append(line)
            self.say(f"warning: {line}")

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Show and time a stage; seconds of the same name add up."""
        begin = time.perf_counter()
        # One thing at a time can live on the screen.
        shown = nullcontext() if self._bar_shown else self._console.status(name)
        try:
            with shown:
                yield
        finally:
            spent = time.perf_counter() - begin
            self.seconds[name] = self.seconds.get(name, 0.0) + spent
            self.log(f"{name}: {spent:.2f} s")

    @contextmanager
    def increments(self, total: int) -> Iterator[Callable[[int], None]]:
        """A bar over the increments of a path; yields what is told the number reached."""
        with self._bar("contact", total, MofNCompleteColumn()) as update:
            yield lambda reached: update(completed=reached)

    @contextmanager
    def jumps(self, total: float, done: float) -> Iterator[Callable[[float, int], None]]:
        """A bar over the cycles of a run; yields what is told those reached, and of the jumps."""
        with self._bar("wear", total, TextColumn("{task.fields[text]}")) as update:

            def show(cycles: float, jump: int) -> None:
                update(completed=cycles, text=f"jump {jump}, {cycles:.4g} cycles")

            show(done, 0)
            yield show

    @contextmanager
    def _bar(
        self, name: str, total: float, reached: ProgressColumn
    ) -> Iterator[Callable[..., None]]:
        """A bar on the screen, where no stage is shown beside it; yields what moves it."""
        left = TextColumn("left"), TimeRemainingColumn()
        columns = TextColumn(name), BarColumn(), reached, TimeElapsedColumn(), *left
        self._bar_shown = True
        try:
            with Progress(*columns, console=self._console, transient=True) as progress:
                yield partial(progress.update, progress.add_task(name, total=total, text=""))
        finally:
            self._bar_shown = False
