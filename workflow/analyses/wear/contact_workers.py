"""Contact stages in processes of their own, one for each interface."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any, TypeVar

from sa_solver.types import Array, Grid
from wear.interface import (
    ContactFields,
    CycleTractions,
    FaceLoads,
    FirstContact,
    InterfaceState,
    failures_of,
)
from wear.worn import Spent
from workflow.analyses.wear.contact_loops import WornLoop
from workflow.analyses.wear.contact_stage import ContactStage, StageSettings
from workflow.shell.processes import Workers, workers

Number = TypeVar("Number", int, float)


def contact_workers(settings: Sequence[StageSettings]) -> AbstractContextManager[Workers]:
    """Start a worker for every interface and end them all at the end."""
    return workers(_NamedStage, settings)


class _NamedStage:
    """A contact stage whose failures name it."""

    def __init__(self, settings: StageSettings) -> None:
        self._stage = ContactStage(settings)

    def __call__(self, method: str, *arguments: Any) -> Any:
        with failures_of(self._stage.name):
            return getattr(self._stage, method)(*arguments)


class ContactProcesses:
    """Contacts that wear side by side: see :class:`wear.coupled.Contacts`.

    What is quick is done here, by ``stages`` of the same settings.
    """

    def __init__(self, stages: list[ContactStage], team: Workers) -> None:
        self.stages, self._team = stages, team

    @property
    def names(self) -> list[str]:
        return [stage.name for stage in self.stages]

    @property
    def grids(self) -> list[Grid]:
        return [stage.grid for stage in self.stages]

    def begin(
        self, histories: Sequence[FaceLoads], cycles: float
    ) -> list[tuple[InterfaceState, FirstContact]]:
        return self._team.call("begin", histories, self._each(cycles))

    def jump(
        self, states: Sequence[InterfaceState], cycles: float, left: float
    ) -> list[tuple[InterfaceState, Spent]]:
        return self._team.call("jump", states, self._each(cycles), self._each(left))

    def follow(
        self, states: Sequence[InterfaceState], histories: Sequence[FaceLoads]
    ) -> list[InterfaceState]:
        triples = zip(self.stages, states, histories, strict=True)
        return [stage.follow(state, history) for stage, state, history in triples]

    def nodal_depths(self, states: Sequence[InterfaceState]) -> list[Array]:
        return [s.nodal_depth(own) for s, own in zip(self.stages, states, strict=True)]

    def fields(self, states: Sequence[InterfaceState], increment: int) -> list[ContactFields]:
        """Tractions and slip of an increment on the present surfaces."""
        return self._team.call("fields", states, self._each(increment))

    def loops(self, states: Sequence[InterfaceState], increment: int) -> list[WornLoop]:
        """Tangential loops on the present surfaces, under the loads of an increment."""
        return self._team.call("loop", states, self._each(increment))

    def tractions(self, states: Sequence[InterfaceState]) -> list[CycleTractions]:
        """Tractions of a cycle on the present surfaces."""
        return self._team.call("tractions", states)

    def _each(self, number: Number) -> list[Number]:
        """The same for every contact."""
        return [number] * len(self.stages)
