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
from wear.steps.marching import advance_cycles
from wear.steps.steppers import Contact, Stepper
from wear.steps.stepping import failures_of
from wear.worn import Cost, State, WornState

KINETICS = ("depth_1", "depth_2", "volume_1", "volume_2", "energy")
"""Columns of the kinetics of one interface, in mm, mm³ and N mm."""

Same = TypeVar("Same")
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
        return np.array([_kinetics(state, lambda depth: float(np.sum(depth * self.areas)))])


class Contacts:
    """The contacts of all interfaces, which wear one after the other in this process.

    :class:`wear.contact.interface.InterfaceContact` documents the methods, which are called here
    for every contact. A subclass that overrides :meth:`call` may run the contacts in parallel.
    """

    def __init__(self, contacts: Sequence[InterfaceContact]) -> None:
        self.contacts = contacts

    def call(self, method: str, *arguments: Sequence[Any]) -> list[Any]:
        """Call a method of every contact, each with its own share of the ``arguments``."""
        answers = []
        for contact, *shares in zip(self.contacts, *arguments, strict=True):
            with failures_of(contact.name):
                answers.append(getattr(contact, method)(*shares))
        return answers

    def each(self, same: Same) -> list[Same]:
        """Return a list with the same value for every contact."""
        return [same] * len(self.contacts)

    def begin(
        self, histories: Sequence[FaceLoads], cycles: float
    ) -> list[tuple[InterfaceState, FirstContact]]:
        return self.call("begin", histories, self.each(cycles))

    def jump(
        self, states: Sequence[InterfaceState], cycles: float, left: float
    ) -> list[tuple[InterfaceState, Cost]]:
        return self.call("jump", states, self.each(cycles), self.each(left))

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
        return np.array([_kinetics(state, contact.volume) for contact, state in pairs])

    def nodal_depths(self, states: Sequence[InterfaceState]) -> list[Array]:
        return [c.nodal_depth(state) for c, state in zip(self.contacts, states, strict=True)]


def _kinetics(state: WornState, volume: Callable[[Array], float]) -> list[float]:
    """Return the columns of :data:`KINETICS` of a contact."""
    depths = state.surfaces.depths
    return [*(float(depth.max()) for depth in depths), *map(volume, depths), state.energy]
