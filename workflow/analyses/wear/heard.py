"""What takes long and tells whoever listens how far it is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from sa_solver.types import Progress, unseen


class Heard:
    """Tells ``_progress``, which is nobody's but within :meth:`heard`."""

    _progress: Progress = staticmethod(unseen)

    @contextmanager
    def heard(self, progress: Progress) -> Iterator[None]:
        """What is costly of it tells ``progress`` how far it is."""
        self._progress = progress
        try:
            yield
        finally:
            self._progress = unseen
