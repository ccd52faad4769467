"""The contacts of all interfaces of a structure, as the coupled loop uses them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from sa_solver.types import Array
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceContact, InterfaceState
from wear.steps.stepping import failures_of
from wear.worn import Spent

KINETICS = ("depth_1", "depth_2", "volume_1", "volume_2", "energy")
"""Columns of the kinetics of one interface, in mm, mm³ and N mm."""

Same = TypeVar("Same")


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
    ) -> list[tuple[InterfaceState, Spent]]:
        return self.call("jump", states, self.each(cycles), self.each(left))

    def follow(
        self, states: Sequence[InterfaceState], histories: Sequence[FaceLoads]
    ) -> list[tuple[InterfaceState, Spent]]:
        triples = zip(self.contacts, states, histories, strict=True)
        return [contact.follow(state, history) for contact, state, history in triples]

    def moved(self, states: Sequence[InterfaceState]) -> list[float]:
        return [c.moved(state) for c, state in zip(self.contacts, states, strict=True)]

    def friction(self, states: Sequence[InterfaceState]) -> list[float]:
        pairs = zip(self.contacts, states, strict=True)
        return [contact.settings.friction(state.energy) for contact, state in pairs]

    def kinetics(self, states: Sequence[InterfaceState]) -> Array:
        """Return a row of :data:`KINETICS` for every interface ``(interfaces, 5)``."""
        rows = []
        for contact, state in zip(self.contacts, states, strict=True):
            depths = state.surfaces.depths
            volumes = map(contact.volume, depths)
            rows.append([*(float(depth.max()) for depth in depths), *volumes, state.energy])
        return np.array(rows)

    def nodal_depths(self, states: Sequence[InterfaceState]) -> list[Array]:
        return [c.nodal_depth(state) for c, state in zip(self.contacts, states, strict=True)]
