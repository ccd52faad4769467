"""All contacts of a model, as the coupled loop calls them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from wear.contact.contacts import Contacts
from wear.contact.interface import InterfaceState
from wear.contact.tractions import ContactFields
from workflow.models.contact import ContactEnd, FaceContact
from workflow.models.loops import TangentialLoops, WornLoop
from workflow.models.progress import ReportsProgress


class FaceContacts(ReportsProgress, Contacts):
    """The contacts of all faces of a model, which wear one after the other in this process.

    ``stages`` are the contacts, in the order of the faces.
    """

    def __init__(self, stages: Sequence[FaceContact]) -> None:
        super().__init__(stages)
        self.stages = list(stages)

    @property
    def names(self) -> list[str]:
        return [stage.name for stage in self.stages]

    def fields(self, states: Sequence[InterfaceState], increment: int) -> list[ContactFields]:
        """Return tractions and slip of an increment on the present surfaces."""
        pairs = zip(self.stages, states, strict=True)
        seen = [stage.seen(state, increment) for stage, state in pairs]
        return self.call("fields", seen, self.each(increment))

    def loops(
        self, states: Sequence[InterfaceState], increment: int, loops: TangentialLoops
    ) -> list[WornLoop]:
        """Return tangential loops on the present surfaces, under the loads of an increment."""
        return self.call("loop", states, self.each(increment), self.each(loops))

    def ends(self, states: Sequence[InterfaceState]) -> Callable[[], list[ContactEnd]]:
        """Return a function that gives the cycles on the surfaces at the end.

        They may be found in other processes meanwhile.
        """
        return partial(self.call, "end", states)
