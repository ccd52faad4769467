"""The coupled loop: loads, contacts, wear, and worn gaps that change the loads.

Contacts wear in jumps of many cycles. After each jump a cheap probe of the load source tells how
far wear has changed the resultants since the source was last solved. If the change is too large,
the source is solved again with the worn gaps. :meth:`CoupledWear.march` yields the state after
every jump, and a run can be resumed from any of these states with the same results.
:meth:`CoupledWear.run` stores and resumes them by itself. Records, progress and the like are left
to :class:`Observer` objects. A contact whose motion follows from its own surfaces, such as that of
a vibrating structure, wears in the same loop without a load source.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any, Generic, Literal, cast

import numpy as np

from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array, resultant_change
from wear.contact.contacts import Contacts, LoadedContacts, WearingContacts
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact
from wear.coupled_state import CoupledState, Observer, Worn, observed
from wear.load_sources import CycleSource
from wear.schedule import CoupledSettings, Schedule
from wear.steps.steppers import ROUNDING
from wear.worn import Cost

RESPONSE = 0.5
"""Relative change of slips and energies over the share of the load that wear moves across a face:
on the default two-dimensional dovetail they change by 3 % where 7 % of the load moves.
"""

NOTHING = Cost()
"""Cost of what is known already."""

Stage = Literal["contact, first cycle", "wear", "drift probe", "structural friction"]


@dataclass(frozen=True)
class CoupledWear(Generic[Worn]):
    """The coupled loop of loads, contacts and wear.

    Its methods raise the exceptions of its load source and its contacts.

    Parameters
    ----------
    settings
        Length of the run, its jumps, and when the loads are solved again: those of
        :class:`CoupledSettings`, or another :class:`Schedule`.
    source
        Source of the loads of :class:`Contacts`; None for a contact with its own.
    contacts
        The wearing contacts: :class:`Contacts`, or a :class:`wear.contact.contacts.SoleContact`.
        Those under the loads of a ``source`` are :class:`wear.contact.contacts.LoadedContacts`.
    observers
        Objects that follow the run.

    Examples
    --------
    The loop stops once a micrometre is worn; an observer prints its jumps:

    >>> import numpy as np
    >>> from sa_solver import ElasticPair, Grid, LoadHistory, Material
    >>> from wear import *
    >>> class PrintJumps(Observer):
    ...     def jump_finished(self, before, after):
    ...         print(f"{after.cycles[-1]:.0f} cycles, {1e3 * after.depth:.3f} um")
    >>> grid, steel, law = Grid.line_contact(1.4, 70), Material(210e3, 0.3), ArchardLaw(1e-4,
    ...     3000.0)
    >>> contact = InterfaceContact(InterfaceSettings(
    ...     name="cylinder", grid=grid, gap=grid.x**2 / 20.0, transfer=CellNodes(grid),
    ...     pair=ElasticPair(steel, steel), laws=(law, law),
    ...     friction=lambda energy: 0.5, stepper=ImplicitStepper(),
    ... ))
    >>> zero, slip = np.zeros(1), np.zeros((1, 2, 70))
    >>> slip[:, 0] = 0.04
    >>> loads = [CycleLoads(LoadHistory(zero + 50.0, *[zero] * 7, sliding=zero == 0.0), slip)]
    >>> settings = CoupledSettings(1e5, jump=JumpSize(cycles=2000.0), stop=Stop(depth=1e-3))
    >>> loop = CoupledWear(settings, ConstantLoads(loads), Contacts([contact]), [PrintJumps()])
    >>> unworn, first = loop.begin(loads)
    >>> *_, end = loop.march(unworn)
    1767 cycles, 0.537 um
    3584 cycles, 0.894 um
    4163 cycles, 0.995 um
    4194 cycles, 1.000 um
    """

    settings: Schedule
    source: CycleSource | None
    contacts: WearingContacts[Worn]
    observers: Sequence[Observer] = ()

    def begin(self, unworn: Sequence[FaceLoads]) -> tuple[CoupledState[Worn], list[FirstContact]]:
        """Return the state before the first jump, and the contact of the first cycle.

        ``unworn`` are the loads of all contacts before any wear.
        """
        assert isinstance(self.settings, CoupledSettings)
        with self._stage("contact, first cycle"):
            states, firsts = self._loaded.begin(unworn, self.settings.cycles)
        return self.unworn(states, sum((first.cost for first in firsts), Cost())), firsts

    def unworn(self, interfaces: Sequence[Worn], cost: Cost = NOTHING) -> CoupledState[Worn]:
        """Return the state before the first jump, from those of the contacts and their cost."""
        return CoupledState(
            interfaces=tuple(interfaces),
            cycles=np.zeros(1),
            kinetics=self.contacts.kinetics(interfaces)[None],
            drift=np.zeros(1),
            solved_resultants=self._probe(interfaces),
            solutions=1,
            cost=cost,
        )

    def march(self, state: CoupledState[Worn]) -> Iterator[CoupledState[Worn]]:
        """Yield the state after every jump from ``state``, until the run ends or reaches a stop."""
        for observer in self.observers:
            observer.begin(state)
        while (after := self._advance(state)) is not None:
            state = after
            yield state

    def run(self, state: CoupledState[Worn], steps: Steps = COMPUTED) -> CoupledState[Worn]:
        """Return the state at the end of a run from ``state``; its jumps are marched by ``steps``.

        With stored steps, the run resumes from the last state that was stored.
        """
        for observer in self.observers:
            observer.begin(state)
        return steps.march("jump", state, self._advance)

    def remaining_jumps(self, state: CoupledState[Worn]) -> int:
        """Return an estimate of the number of jumps that are left.

        All jumps are taken to be as long as the next one, or to go on growing as they have over the
        last half of all jumps so far. Automatic jumps are taken to double until two of them are
        known.
        """
        settings = self.settings
        if settings.ended(state):
            return 0
        following, lengths = settings.next_jump(state), np.diff(state.cycles)
        count = settings.left(state) / following
        growth = 1.0 if settings.automatic else 0.0
        if back := len(lengths) // 2:
            growth = (following / float(lengths[-back - 1])) ** (1.0 / (back + 1.0)) - 1.0
        if count > 1.0 and growth > 0.0:
            count = float(np.log1p(count * growth) / np.log1p(growth))
        return max(1, int(np.ceil(count * (1.0 - ROUNDING))))

    def _stage(self, name: Stage) -> AbstractContextManager[None]:
        return observed(self.observers, name)

    # -- one jump ----------------------------------------------------------------------------------
    def _advance(self, state: CoupledState[Worn]) -> CoupledState[Worn] | None:
        """Return the state after the next jump, or None if the run has ended."""
        if self.settings.ended(state):
            return None
        if self.observers and state.jump:
            jumps = self.remaining_jumps(state)
            for observer in self.observers:
                observer.remaining(state, jumps)
        after = self._jump(state)
        for observer in self.observers:
            observer.jump_finished(state, after)
        return after

    def _jump(self, state: CoupledState[Worn]) -> CoupledState[Worn]:
        settings, cost = self.settings, Cost()
        cycles = settings.next_jump(state)
        for observer in self.observers:
            observer.jump_started(state, cycles)
        # Steppers treat the last cycles of a run differently, and a stop may end it earlier.
        left = max(cycles, settings.left(state))
        begun: Sequence[Worn] = state.interfaces
        while True:
            with self._stage("wear"):
                if settings.automatic:
                    begun = _in_phase(state.interfaces, cycles)
                worn = self.contacts.jump(begun, cycles, left)
            cost = sum((further for _, further in worn), cost)
            interfaces = tuple(interface for interface, _ in worn)
            shorter = cycles * settings.share_to_stop(state, self.contacts.kinetics(interfaces))
            if shorter == cycles or cycles <= 1.0:
                break
            cycles = left = max(1.0, shorter)
        state = replace(state, interfaces=interfaces, cost=state.cost + cost)
        state, drift = self._follow_drift(state)
        return state.record(float(state.cycles[-1]) + cycles, self.contacts, drift)

    # -- loads -------------------------------------------------------------------------------------
    @property
    def _loaded(self) -> LoadedContacts[Worn]:
        """The contacts under the loads of the source."""
        return cast("LoadedContacts[Worn]", self.contacts)

    def _follow_drift(self, state: CoupledState[Any]) -> tuple[CoupledState[Any], float]:
        """Solve the loads again if their resultants have drifted too far, and return the drift."""
        settings, source = self.settings, self.source
        if source is None or settings.resultants == "constant":
            return state, 0.0
        contacts = cast("Contacts", self.contacts)
        with self._stage("drift probe"):
            probe = self._probe(state.interfaces)
        sizes = np.array([contact.grid.size for contact in contacts.contacts])
        change = np.abs(resultant_change(probe, state.solved_resultants, sizes))
        moved = max(contacts.moved(state.interfaces))
        drift = max(float(change.max()), RESPONSE * moved)
        if settings.resultants == "drift" and drift <= settings.drift:
            return state, drift
        with self._stage("structural friction"):
            depths = contacts.nodal_depths(state.interfaces)
            histories = source.worn(depths, self._friction(state.interfaces))
        followed = contacts.follow(state.interfaces, histories)
        return replace(
            state,
            interfaces=tuple(interface for interface, _ in followed),
            solved_resultants=probe,
            solutions=state.solutions + 1,
            cost=sum((further for _, further in followed), state.cost),
        ), drift

    def _probe(self, interfaces: Sequence[Any]) -> Array:
        if self.source is None:
            return np.empty((0, 6))
        return self.source.probe(self._loaded.nodal_depths(interfaces), self._friction(interfaces))

    def _friction(self, interfaces: Sequence[Any]) -> list[float] | None:
        """Return the coefficients of friction of the interfaces, or None if they are constant."""
        constant = self.settings.friction == "constant"
        return None if constant else cast("Contacts", self.contacts).friction(interfaces)


def _in_phase(interfaces: Sequence[Worn], cycles: float) -> Sequence[Worn]:
    """Return the contacts before a jump of ``cycles``, so that all end a pair of steps with it.

    Where some contacts have done one of two steps, the others take two steps in this jump. Out of
    phase, some contacts would always begin a pair within what is left: jumps would be halved
    forever, and the run would never end.
    """
    if not any(interface.half_way for interface in interfaces):
        return interfaces
    return [
        interface
        if interface.half_way
        else replace(interface, next_cycles=min(interface.next_cycles, 0.5 * cycles))
        for interface in interfaces
    ]
