"""Progress of long computations, reported to a callable."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from sa_solver.types import Progress, unseen


class ReportsProgress:
    """A computation that reports its progress while :meth:`reporting_to` is entered."""

    _progress: Progress = staticmethod(unseen)

    @contextmanager
    def reporting_to(self, progress: Progress) -> Iterator[None]:
        """Call ``progress`` with the steps done and the total number, within this context."""
        self._progress = progress
        try:
            yield
        finally:
            self._progress = unseen
