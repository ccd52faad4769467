"""All contacts of a model: what the coupled loop wears, and its states face by face."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from wear.contact.contacts import Call, Contacts, LoadedContacts, call_in_turn
from wear.contact.interface import InterfaceContact, InterfaceState
from wear.contact.tractions import ContactFields
from wear.coupled_state import CoupledState
from workflow.models.contact import FaceContact, FaceSolution, FaceState, WornFaces
from workflow.models.loops import TangentialLoops, WornLoop, worn_loop


@dataclass(frozen=True)
class FaceContacts:
    """The contacts of all faces of a model.

    Parameters
    ----------
    stages
        The contacts, in the order of the faces.
    wearing
        What wears them in the coupled loop.
    call
        Call of a function for what solves each contact.
    views
        Returns the state of every face from those of the loop.
    """

    stages: Sequence[FaceContact]
    wearing: LoadedContacts[Any]
    call: Call
    views: Callable[[Sequence[Any]], Sequence[FaceState]] = list

    @classmethod
    def half_spaces(cls, stages: Sequence[FaceContact], call: Call | None = None) -> FaceContacts:
        """Return half-space contacts, called one after the other in this process by default."""
        contacts = [stage.contact for stage in stages]
        call = call or partial(call_in_turn, contacts)
        return cls(stages, Contacts(contacts, call), call)

    def states(self, state: CoupledState[Any]) -> Sequence[FaceState]:
        """Return the state of every face."""
        return self.views(state.interfaces)

    def faces(self, state: CoupledState[Any]) -> WornFaces:
        """Return every face with its state."""
        return list(zip(self.stages, self.states(state), strict=True))

    def fields(self, state: CoupledState[Any], increment: int) -> list[ContactFields]:
        """Return tractions and slip of an increment on the present surfaces."""
        seen = [_seen(stage, of_face, increment) for stage, of_face in self.faces(state)]
        return self.call(partial(_fields, increment=increment), seen)

    def loops(self, state: CoupledState[Any], peak: int, loops: TangentialLoops) -> list[WornLoop]:
        """Return tangential loops of half-spaces on the present surfaces, at the ``peak`` load."""
        return self.call(partial(_loop, peak=peak, loops=loops), self.states(state))


def _seen(stage: FaceContact, state: FaceState, increment: int) -> FaceState:
    """Return the part of a state that tells the fields of an increment.

    Where slips are given it is about a tenth of the state, and faster to send to a process.
    """
    if stage.settings.method == "full" or not isinstance(state, InterfaceState):
        return state
    starts = {t: start for t, start in state.starts.items() if t == increment}
    return replace(state, starts=starts, coarse=None)


def _fields(contact: FaceSolution, state: FaceState, increment: int) -> ContactFields:
    return contact.fields(state, increment)


def _loop(
    contact: InterfaceContact, state: InterfaceState, peak: int, loops: TangentialLoops
) -> WornLoop:
    lift = state.link.lift(peak, contact.transfer.places)
    tilt = contact.settings.drive.tilt
    frictional = contact.frictional(state.energy)
    return worn_loop(frictional, loops, contact.name, state, peak, tilt, lift)
