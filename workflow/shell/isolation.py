"""What only tells of a run or shows it cannot end the run: a failure there becomes a warning."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from workflow.errors import UNWRITTEN, one_line


class Isolation:
    """Contexts out of which no failure gets: it is handed to ``warn``, once for each of them.

    They stand around progress, forecasts, the log, the terminal, figures and the report, on which
    no result depends. Only where the system lets nothing more be written is the error raised again:
    the run then stops as it does at any other file, and goes on once there is room.
    """

    def __init__(self, warn: Callable[[str], None]) -> None:
        self._warn = warn
        self._failed: set[str] = set()

    @contextmanager
    def __call__(self, what: str, needed: bool = True) -> Iterator[None]:
        """Isolate what ``what`` names to users; as a decorator, each call of a function.

        What is not ``needed`` is done without even where nothing more can be written.
        """
        try:
            yield
        except Exception as error:
            if needed and isinstance(error, OSError) and error.errno in UNWRITTEN:
                raise
            if what not in self._failed:
                self._failed.add(what)
                told = f"{type(error).__name__}: {one_line(error)}"
                self._warn(f"{what}: not written ({told}); the results are whole")
