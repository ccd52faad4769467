"""Contacts in worker processes, one process for each interface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import partial
from typing import Any

from sa_solver.types import Tally
from wear.contact.contacts import Contacts
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceState
from wear.worn import Cost
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.translation import face_contact
from workflow.models.contact import ContactEnd, FaceContact
from workflow.models.contacts import FaceContacts
from workflow.models.loads import ContactFace
from workflow.shell.processes import Done, Workers, workers

# Estimated ratio of frictional increments in the first jump to those in the first cycle. Implicit
# steps solve the cycle on the new surfaces; later jumps, which have a coarse companion, also solve
# it on the companion's.
FIRST_JUMP = 2


def contact_workers(
    case: WearCase, faces: Sequence[ContactFace]
) -> AbstractContextManager[Workers]:
    """Start a worker process for every face of a case, and end all of them on exit."""
    return workers(partial(_worker, case), faces)


def _worker(case: WearCase, face: ContactFace, solved: Done) -> Callable[..., Any]:
    """Return the function that answers for one contact; ``solved`` is called per increment."""
    stage = face_contact(case, face)
    stage.solved = solved
    contacts = Contacts([stage])

    def answer(method: str, *arguments: Any) -> Any:
        (result,) = contacts.call(method, *([argument] for argument in arguments))
        return result

    return answer


class ContactProcesses(FaceContacts):
    """Contacts that wear in parallel processes; quick tasks run here on equal ``stages``."""

    def __init__(self, stages: Sequence[FaceContact], team: Workers) -> None:
        super().__init__(stages)
        self._team, self._expected = team, 1

    def begin(
        self, histories: Sequence[FaceLoads], cycles: float
    ) -> list[tuple[InterfaceState, FirstContact]]:
        self._expected = sum(len(history.loads) for history in histories)
        begun = self._counted("begin", histories, self.each(cycles))
        self._expected *= FIRST_JUMP
        return begun

    def jump(
        self, states: Sequence[InterfaceState], cycles: float, left: float
    ) -> list[tuple[InterfaceState, Cost]]:
        return self._counted("jump", states, self.each(cycles), self.each(left))

    def call(self, method: str, *arguments: Sequence[Any]) -> list[Any]:
        return self._team.call(method, *arguments)

    def ends(self, states: Sequence[InterfaceState]) -> Callable[[], list[ContactEnd]]:
        return self._team.begin("end", states)

    def _counted(self, method: str, *arguments: Sequence[Any]) -> list[Any]:
        """Return the workers' answers; the increments of a call are the next call's estimate."""
        progress = self._progress

        def reported(done: int, expected: int) -> None:
            progress(done, max(done, expected))

        solved = Tally(reported, self._expected)
        answers = self._team.call(method, *arguments, done=solved)
        self._expected = max(solved.done, 1)
        return answers
