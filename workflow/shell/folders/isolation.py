"""Isolation of code that only reports or shows a run: a failure there becomes a warning."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from workflow.errors import UNWRITTEN, one_line
from workflow.messages.warning_kinds import WarningKind


class Isolation:
    """Context managers that turn an exception into one call of ``warn`` for each named part.

    They surround progress, forecasts, the log, the terminal, figures and the report, on which no
    result depends. The error is raised again only if the system can write nothing more, for example
    on a full disk: the run then stops as for any other file, and can be resumed once there is room.
    """

    def __init__(self, warn: Callable[[WarningKind, str], None]) -> None:
        self._warn = warn
        self._failed: set[str] = set()

    @contextmanager
    def __call__(self, what: str, needed: bool = True) -> Iterator[None]:
        """Isolate the part that ``what`` names to users; as a decorator, isolate each call.

        A part that is not ``needed`` is skipped even if nothing more can be written.
        """
        try:
            yield
        except Exception as error:
            if needed and isinstance(error, OSError) and error.errno in UNWRITTEN:
                raise
            if what not in self._failed:
                self._failed.add(what)
                reason = f"{type(error).__name__}: {one_line(error)}"
                text = f"{what}: not written ({reason}); the results are complete"
                self._warn(WarningKind.NOT_WRITTEN, text)
