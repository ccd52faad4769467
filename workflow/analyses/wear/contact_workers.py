"""Contacts in worker processes, one process for each interface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Any

from sa_solver.types import Tally, unseen
from wear.contact.contacts import Answer, answering
from workflow.models.contact import FaceContact
from workflow.models.progress import ReportsProgress
from workflow.shell.processes import Workers, workers

# Estimated ratio of frictional increments in the first jump to those in the first cycle. Implicit
# steps solve the cycle on the new surfaces; later jumps, which have a coarse companion, also solve
# it on the companion's.
FIRST_JUMP = 2


def contact_workers(stages: Sequence[FaceContact]) -> AbstractContextManager[Workers]:
    """Start a worker process for each of these contacts, and end all of them on exit."""
    return workers(answering, [stage.settings for stage in stages])


class WorkerCalls(ReportsProgress):
    """Calls of a function for contacts in worker processes, one for each contact.

    It is a :class:`wear.contact.contacts.Call`. The first call that reports progress solves a
    cycle of as many ``increments`` as all contacts have; the number solved in a call is the
    estimate for the next one.
    """

    def __init__(self, team: Workers, increments: int) -> None:
        self._team, self._expected, self._growth = team, increments, FIRST_JUMP

    def __call__(
        self, function: Callable[[Any, Any], Answer], shares: Sequence[Any]
    ) -> list[Answer]:
        progress = self._progress
        if progress is unseen:
            return self._team.call(function, shares)

        def reported(done: int, expected: int) -> None:
            progress(done, max(done, expected))

        solved = Tally(reported, self._expected)
        answers = self._team.call(function, shares, done=solved)
        self._expected, self._growth = max(solved.done, 1) * self._growth, 1
        return answers
