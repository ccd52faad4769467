"""Contact stages in processes of their own, one for each interface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import partial
from typing import Any

from wear.coupled import Contacts, CoupledState
from wear.interface import InterfaceState
from wear.tractions import ContactFields, CycleTractions
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.contact_loops import WornLoop
from workflow.analyses.wear.contact_stage import ContactStage
from workflow.analyses.wear.load_source import ContactFace
from workflow.shell.processes import Workers, workers


def contact_workers(
    case: WearCase, faces: Sequence[ContactFace]
) -> AbstractContextManager[Workers]:
    """Start a worker for every face of a case and end them all at the end."""
    return workers(partial(_worker, case), faces)


def _worker(case: WearCase, face: ContactFace) -> Callable[..., Any]:
    """What answers for one contact, made where it is to live."""
    contacts = Contacts([ContactStage(case, face)])

    def answer(method: str, *arguments: Any) -> Any:
        (result,) = contacts.call(method, *([argument] for argument in arguments))
        return result

    return answer


class StagedContacts(Contacts):
    """The contacts of all faces of a case, as ``stages`` describe them."""

    def __init__(self, stages: list[ContactStage]) -> None:
        super().__init__(stages)
        self.stages = stages

    def restored(self, state: CoupledState) -> CoupledState:
        """A state that was kept on the disk, with what had not to be."""
        return state

    @property
    def names(self) -> list[str]:
        return [stage.name for stage in self.stages]

    def fields(self, states: Sequence[InterfaceState], increment: int) -> list[ContactFields]:
        """Tractions and slip of an increment on the present surfaces."""
        return self.call("fields", states, self.each(increment))

    def loops(self, states: Sequence[InterfaceState], increment: int) -> list[WornLoop]:
        """Tangential loops on the present surfaces, under the loads of an increment."""
        return self.call("loop", states, self.each(increment))

    def tractions(self, states: Sequence[InterfaceState]) -> list[CycleTractions]:
        """Tractions of a cycle on the present surfaces."""
        return self.call("tractions", states)


class ContactProcesses(StagedContacts):
    """Contacts that wear side by side; what is quick is done here, by ``stages`` like theirs."""

    def __init__(self, stages: list[ContactStage], team: Workers) -> None:
        super().__init__(stages)
        self._team = team

    def call(self, method: str, *arguments: Sequence[Any]) -> list[Any]:
        return self._team.call(method, *arguments)
