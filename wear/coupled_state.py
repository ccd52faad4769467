"""State of the coupled loop, and observers that follow it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Generic

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array
from wear.contact.contacts import WearingContacts
from wear.contact.interface import InterfaceState
from wear.worn import Cost, WornState

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    Worn = TypeVar("Worn", bound=WornState, default=InterfaceState)
else:
    from typing import TypeVar

    Worn = TypeVar("Worn", bound=WornState)


@dataclass(frozen=True)
class CoupledState(Generic[Worn]):
    """Everything that is needed to resume a run.

    Parameters
    ----------
    interfaces
        States of the contacts.
    cycles
        Cycles at the end of every jump so far, the unworn state included ``(j,)``.
    kinetics
        Wear after every jump ``(j, interfaces, 5)``, with the columns
        :data:`wear.contact.contacts.KINETICS`.
    drift
        Drift of the loads found after each jump ``(j,)``.
    solved_resultants
        Probed resultants at the last solution of the load source ``(interfaces, 6)``.
    solutions
        Number of solutions of the load source.
    cost
        Cost of all contact solutions.
    origin
        Digests of the parts of the model that the state belongs to; empty where the caller ensures
        that.
    """

    interfaces: tuple[Worn, ...]
    cycles: Array
    kinetics: Array
    drift: Array
    solved_resultants: Array
    solutions: int
    cost: Cost
    origin: Mapping[str, str] = field(default_factory=dict)

    @property
    def jump(self) -> int:
        """Number of jumps done."""
        return len(self.cycles) - 1

    @property
    def depth(self) -> float:
        """Largest depth that any body has lost [mm]."""
        return largest_depth(self.kinetics[-1])

    @property
    def volume(self) -> float:
        """Volume that all bodies have lost [mm³]."""
        return total_volume(self.kinetics[-1])

    def record(
        self, cycles: float, contacts: WearingContacts[Worn], drift: float
    ) -> CoupledState[Worn]:
        """Return the state with a row of kinetics added."""
        return replace(
            self,
            cycles=np.append(self.cycles, cycles),
            kinetics=np.concatenate([self.kinetics, contacts.kinetics(self.interfaces)[None]]),
            drift=np.append(self.drift, drift),
        )


class Observer:
    """Base class of everything that follows a run; a subclass overrides the methods it needs.

    ``CoupledWear`` has an example; the observers of ``fretscale`` write logs and results.
    """

    def stage(self, name: str) -> AbstractContextManager[object]:
        """Return a context that is entered while the part ``name`` of a run is computed."""
        return nullcontext()

    def begin(self, state: CoupledState[Any]) -> None:
        """Handle the start of the run from a state, which is unworn or that of an earlier run."""

    def jump_started(self, state: CoupledState[Any], cycles: float) -> None:
        """Handle the start of a jump of ``cycles``, which may be shortened near a stop."""

    def jump_finished(self, before: CoupledState[Any], after: CoupledState[Any]) -> None:
        """Handle the end of a jump, after the loads have been updated."""

    def remaining(self, state: CoupledState[Any], jumps: int) -> None:
        """Handle the estimated number of ``jumps`` from ``state`` on, which is worn already."""

    def reached(self, share: float) -> None:
        """Handle that about this ``share`` of a curve, or of a motion in time, is computed."""


def check_observers(observers: object) -> None:
    """Raise InputError unless ``observers`` are a list or tuple of them."""
    if not isinstance(observers, list | tuple):
        raise InputError(f"observers are {checks.shown(observers)}: give a list, even of one")
    for observer in observers:
        if not isinstance(observer, Observer):
            raise InputError(f"observers have {checks.shown(observer)}: give an Observer")


@contextmanager
def observed(observers: Sequence[Observer], name: str) -> Iterator[None]:
    """Enter the contexts of all observers while the part ``name`` of a run is computed."""
    with ExitStack() as stack:
        for observer in observers:
            stack.enter_context(observer.stage(name))
        yield


def largest_depth(kinetics: Array) -> float:
    """Return the largest depth of any body [mm] in a row of kinetics ``(interfaces, 5)``."""
    return float(kinetics[:, :2].max())


def total_volume(kinetics: Array) -> float:
    """Return the volume of all bodies [mm³] in a row of kinetics ``(interfaces, 5)``."""
    return float(kinetics[:, 2:4].sum(axis=1).sum())
