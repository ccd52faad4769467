"""Contacts as the coupled loop uses them: those of all interfaces of a structure, or just one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceContact, InterfaceState
from wear.contact.settings import InterfaceSettings
from wear.steps.marching import advance_cycles
from wear.steps.steppers import Contact, Stepper
from wear.steps.stepping import failures_of
from wear.worn import Cost, State, WornState

KINETICS = ("depth_1", "depth_2", "volume_1", "volume_2", "energy")
"""Columns of the kinetics of one interface, in mm, mm³ and N mm."""

Answer = TypeVar("Answer")
Solution = TypeVar("Solution")


class LastSolved(Generic[State, Solution]):
    """Solutions of the last states, each solved once: those before and after a step.

    States with the same surfaces and the same energy have the same solution.
    """

    def __init__(self, solve: Callable[[State], Solution]) -> None:
        self._solve = solve
        self._known: deque[tuple[State, Solution]] = deque(maxlen=2)

    def __call__(self, state: State) -> Solution:
        for known, solution in self._known:
            if known.surfaces is state.surfaces and known.energy == state.energy:
                return solution
        solution = self._solve(state)
        self._known.append((state, solution))
        return solution


class WearingContacts(Protocol[State]):
    """Protocol of contacts that wear together."""

    def jump(self, states: Sequence[State], cycles: float, left: float) -> list[tuple[State, Cost]]:
        """Wear ``cycles`` of the ``left`` cycles of the run; return the states and their costs."""
        ...

    def kinetics(self, states: Sequence[State]) -> Array:
        """Return a row of :data:`KINETICS` for every contact ``(contacts, 5)``."""
        ...


@dataclass(frozen=True)
class SoleContact(Generic[State, Contact]):
    """A contact whose loads and slips follow from its own surfaces.

    Parameters
    ----------
    stepper
        Method and length of its wear steps.
    contact_at
        Function that returns the contact in a state.
    areas
        Area of each cell, or of each node ``(n,)`` [mm²].
    steps
        Source of the wear steps: computed, or stored earlier.
    reached
        Callback after each wear step, with the cycles of the jump and those done.
    """

    stepper: Stepper[State, Contact]
    contact_at: Callable[[State], Contact]
    areas: Array | float
    steps: Steps = COMPUTED
    reached: Callable[[float, float], None] = lambda cycles, done: None

    def jump(self, states: Sequence[State], cycles: float, left: float) -> list[tuple[State, Cost]]:
        (state,), reached = states, partial(self.reached, cycles)
        worn = advance_cycles(
            self.stepper, state, cycles, left, self.contact_at, self.steps, reached
        )
        return [(worn.state, worn.cost)]

    def kinetics(self, states: Sequence[State]) -> Array:
        (state,) = states
        return np.array([kinetics_of(state, lambda depth: float(np.sum(depth * self.areas)))])


class LoadedContacts(WearingContacts[State], Protocol):
    """Protocol of wearing contacts under the loads of a source, which has loads for each face."""

    def begin(
        self, histories: Sequence[FaceLoads], cycles: float
    ) -> tuple[Sequence[State], list[FirstContact]]:
        """Return the unworn states of a run of ``cycles``, and the first cycle of every face."""
        ...

    def nodal_depths(self, states: Sequence[State]) -> list[Array]:
        """Return the worn depth of both bodies at the nodes ``(n,)`` of every face [mm]."""
        ...


class Call(Protocol):
    """Protocol of a call of one function for every contact, here or in other processes.

    The ``function`` takes a contact and its share of the ``shares``.
    """

    def __call__(
        self, function: Callable[[Any, Any], Answer], shares: Sequence[Any]
    ) -> list[Answer]: ...


def call_in_turn(
    contacts: Sequence[Any], function: Callable[[Any, Any], Answer], shares: Sequence[Any]
) -> list[Answer]:
    """Call a function for every one of the ``contacts``, one after the other."""
    answers = []
    for contact, share in zip(contacts, shares, strict=True):
        with failures_of(contact.name):
            answers.append(function(contact, share))
    return answers


def answering(
    settings: InterfaceSettings, solved: Callable[[], None]
) -> Callable[[Callable[[Any, Any], Answer], Any], Answer]:
    """Return a function that answers calls for the contact of these settings.

    ``solved`` is called after each increment of a cycle with friction. A process that answers for
    one contact needs nothing else of a model.
    """
    contact = InterfaceContact(settings)
    contact.solved = solved

    def answer(function: Callable[[Any, Any], Answer], share: Any) -> Answer:
        (result,) = call_in_turn([contact], function, [share])
        return result

    return answer


class Contacts:
    """The contacts of all interfaces, each of which wears by itself.

    :class:`wear.contact.interface.InterfaceContact` documents the methods, which are called here
    for every contact: one after the other, unless ``call`` calls them in another way.
    """

    def __init__(self, contacts: Sequence[InterfaceContact], call: Call | None = None) -> None:
        self.contacts, self._call = contacts, call or partial(call_in_turn, contacts)

    def begin(
        self, histories: Sequence[FaceLoads], cycles: float
    ) -> tuple[list[InterfaceState], list[FirstContact]]:
        begun = self._call(partial(InterfaceContact.begin, cycles=cycles), histories)
        return [state for state, _ in begun], [first for _, first in begun]

    def jump(
        self, states: Sequence[InterfaceState], cycles: float, left: float
    ) -> list[tuple[InterfaceState, Cost]]:
        return self._call(partial(InterfaceContact.jump, cycles=cycles, left=left), states)

    def follow(
        self, states: Sequence[InterfaceState], histories: Sequence[FaceLoads]
    ) -> list[tuple[InterfaceState, Cost]]:
        triples = zip(self.contacts, states, histories, strict=True)
        return [contact.follow(state, history) for contact, state, history in triples]

    def moved(self, states: Sequence[InterfaceState]) -> list[float]:
        return [c.moved(state) for c, state in zip(self.contacts, states, strict=True)]

    def friction(self, states: Sequence[InterfaceState]) -> list[float]:
        pairs = zip(self.contacts, states, strict=True)
        return [contact.settings.friction(state.energy) for contact, state in pairs]

    def kinetics(self, states: Sequence[InterfaceState]) -> Array:
        """Return a row of :data:`KINETICS` for every interface ``(interfaces, 5)``."""
        pairs = zip(self.contacts, states, strict=True)
        return np.array([kinetics_of(state, contact.volume) for contact, state in pairs])

    def nodal_depths(self, states: Sequence[InterfaceState]) -> list[Array]:
        pairs = zip(self.contacts, states, strict=True)
        return [contact.at_nodes(state.surfaces.depth) for contact, state in pairs]


def kinetics_of(state: WornState, volume: Callable[[Array], float]) -> list[float]:
    """Return the columns of :data:`KINETICS` of a contact."""
    depths = state.surfaces.depths
    return [*(float(depth.max()) for depth in depths), *map(volume, depths), state.energy]
