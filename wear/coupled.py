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

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Generic, Literal, cast

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array, resultant_change
from wear.contact.contacts import KINETICS, Contacts, WearingContacts
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceState
from wear.load_sources import CycleSource
from wear.steps.steppers import ROUNDING
from wear.worn import Cost, WornState

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    Worn = TypeVar("Worn", bound=WornState, default=InterfaceState)
else:
    from typing import TypeVar

    Worn = TypeVar("Worn", bound=WornState)

AT_STOP = 1e-3
"""Relative tolerance of a stop. A jump that would pass the stop is shortened to end within it."""

RESPONSE = 0.5
"""Relative change of slips and energies over the share of the load that wear moves across a face:
on the default two-dimensional dovetail they change by 3 % where 7 % of the load moves.
"""

NOTHING = Cost()
"""Cost of what is known already."""

Stage = Literal["contact, first cycle", "wear", "drift probe", "structural friction"]


# --- settings ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class JumpSize:
    """Length of one jump, as a number of cycles or as an amount of wear at the present rates.

    Give one size at most. Without any, a jump is as long as the automatic steps of all contacts
    allow.

    Parameters
    ----------
    cycles
        Number of cycles.
    depth
        Largest depth that any body loses in the jump [mm].
    volume
        Volume that all bodies together lose in the jump [mm³].

    Examples
    --------
    A jump lasts until a micrometre is worn; two sizes at once are refused:

    >>> from wear import JumpSize
    >>> print(JumpSize(depth=1e-3))
    JumpSize(cycles=None, depth=0.001, volume=None)
    >>> JumpSize(cycles=1000.0, depth=1e-3)
    Traceback (most recent call last):
        ...
    sa_solver.errors.InputError: a jump has more than one size: give one of cycles, depth and volume
    """

    cycles: float | None = None
    depth: float | None = None
    volume: float | None = None

    def __post_init__(self) -> None:
        if sum(size is not None for size in vars(self).values()) > 1:
            raise InputError("a jump has more than one size: give one of cycles, depth and volume")
        checks.numbers(self, "cycles", "depth", "volume", above=0.0)


@dataclass(frozen=True)
class Stop:
    """Wear limits that end a run before its last cycle, each reached to 0.1 %.

    The run ends at the limit that it reaches first.

    Parameters
    ----------
    depth
        Largest depth of any body [mm].
    volume
        Volume of all bodies together [mm³].

    Examples
    --------
    A run of 10⁶ cycles ends earlier if 20 µm are worn:

    >>> from wear import CoupledSettings, Stop
    >>> settings = CoupledSettings(cycles=1e6, stop=Stop(depth=0.02))
    >>> print(settings.stop)
    Stop(depth=0.02, volume=None)
    """

    depth: float | None = None
    volume: float | None = None

    def __post_init__(self) -> None:
        checks.numbers(self, "depth", "volume", above=0.0)


class Schedule(ABC):
    """Base class of the lengths of the jumps of a run, and of its end.

    ``resultants``, ``drift`` and ``friction`` are those of :class:`CoupledSettings`: without them,
    loads are never solved again.
    """

    resultants: Literal["constant", "drift", "every"] = "constant"
    drift: float = 0.0
    friction: Literal["constant", "evolving"] = "constant"

    @property
    def automatic(self) -> bool:
        """True if jumps are as long as the steps of the contacts, which grow."""
        return False

    @abstractmethod
    def ended(self, state: CoupledState[Any]) -> bool:
        """Return whether a run that has reached ``state`` is over."""

    @abstractmethod
    def next_jump(self, state: CoupledState[Any]) -> float:
        """Return the cycles of the next jump."""

    @abstractmethod
    def left(self, state: CoupledState[Any]) -> float:
        """Return the cycles to the end of the run at the present rates."""

    def share_to_stop(self, before: CoupledState[Any], kinetics: Array) -> float:
        """Return the share of a jump at which it passed the end, or 1 if it did not.

        ``kinetics`` is the row of kinetics after the jump.
        """
        return 1.0


@dataclass(frozen=True)
class CoupledSettings(Schedule):
    """Settings of a coupled run: its cycles, its jumps, and when the loads are solved again.

    Parameters
    ----------
    cycles
        Number of cycles of the run.
    jump
        Length of one jump.
    stop
        Wear limits at which the run ends earlier.
    resultants
        When the load source is solved again. "constant": never; "every": after each jump; "drift":
        where the relative change since the last solution exceeds ``drift``. The change is the
        larger of that of the probed resultants (:func:`sa_solver.types.resultant_change`) and that
        expected of slips and energies from the load that wear has moved across a face
        (:data:`RESPONSE`).
    drift
        Largest relative change without a new solution.
    friction
        "evolving": the load source is given the present coefficients of friction of the contacts.

    Examples
    --------
    A run of 10⁵ cycles in jumps of 10⁴ solves its loads again after each jump:

    >>> from wear import CoupledSettings, JumpSize
    >>> settings = CoupledSettings(cycles=1e5, jump=JumpSize(cycles=1e4), resultants="every")
    >>> print(settings.cycles / settings.jump.cycles, settings.stop)
    10.0 Stop(depth=None, volume=None)
    """

    cycles: float
    jump: JumpSize = JumpSize()
    stop: Stop = Stop()
    resultants: Literal["constant", "drift", "every"] = "drift"
    drift: float = 0.02
    friction: Literal["constant", "evolving"] = "constant"

    def __post_init__(self) -> None:
        checks.numbers(self, "cycles", "drift", least=0.0)
        checks.choice("resultants", self.resultants, ("constant", "drift", "every"))
        checks.choice("friction", self.friction, ("constant", "evolving"))

    @property
    def automatic(self) -> bool:
        return self.jump == JumpSize()

    def ended(self, state: CoupledState[Any]) -> bool:
        stop, reached = self.stop, 1.0 - AT_STOP
        return bool(
            state.cycles[-1] >= self.cycles * (1.0 - ROUNDING)
            or (stop.depth is not None and state.depth >= stop.depth * reached)
            or (stop.volume is not None and state.volume >= stop.volume * reached)
        )

    def next_jump(self, state: CoupledState[Any]) -> float:
        """Return the cycles of the next jump, from the requested size at the present rates."""
        size, left = self.jump, self._left(state)
        if size.cycles is not None:
            cycles = size.cycles
        elif size.depth is not None or size.volume is not None:
            cycles = _cycles_to(size.depth, size.volume, state)
        else:
            cycles = _cycles_of_steps(state.interfaces, left)
        cycles = min(cycles, self._to_stop(state))
        return left if cycles > left * (1.0 - ROUNDING) else float(cycles)

    def left(self, state: CoupledState[Any]) -> float:
        return min(self._left(state), self._to_stop(state))

    def share_to_stop(self, before: CoupledState[Any], kinetics: Array) -> float:
        stop, share = self.stop, 1.0
        for limit, then, now in (
            (stop.depth, before.depth, _depth(kinetics)),
            (stop.volume, before.volume, _volume(kinetics)),
        ):
            if limit is not None and now > limit * (1.0 + AT_STOP):
                share = min(share, (limit - then) / (now - then))
        return share

    def _left(self, state: CoupledState[Any]) -> float:
        """Return the cycles to the last one."""
        return self.cycles - float(state.cycles[-1])

    def _to_stop(self, state: CoupledState[Any]) -> float:
        """Return the cycles to the nearest stop at the present rates, at least one."""
        stop = self.stop
        depth = None if stop.depth is None else stop.depth - state.depth
        volume = None if stop.volume is None else stop.volume - state.volume
        return max(1.0, _cycles_to(depth, volume, state))


# --- state and observers --------------------------------------------------------------------------


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
    """

    interfaces: tuple[Worn, ...]
    cycles: Array
    kinetics: Array
    drift: Array
    solved_resultants: Array
    solutions: int
    cost: Cost

    @property
    def jump(self) -> int:
        """Number of jumps done."""
        return len(self.cycles) - 1

    @property
    def depth(self) -> float:
        """Largest depth that any body has lost [mm]."""
        return _depth(self.kinetics[-1])

    @property
    def volume(self) -> float:
        """Volume that all bodies have lost [mm³]."""
        return _volume(self.kinetics[-1])

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


@contextmanager
def observed(observers: Sequence[Observer], name: str) -> Iterator[None]:
    """Enter the contexts of all observers while the part ``name`` of a run is computed."""
    with ExitStack() as stack:
        for observer in observers:
            stack.enter_context(observer.stage(name))
        yield


# --- the loop -------------------------------------------------------------------------------------


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

    def begin(
        self: CoupledWear[InterfaceState], unworn: Sequence[FaceLoads]
    ) -> tuple[CoupledState, list[FirstContact]]:
        """Return the state before the first jump, and the contact of the first cycle.

        ``unworn`` are the loads of all contacts before any wear.
        """
        assert isinstance(self.settings, CoupledSettings)
        with self._stage("contact, first cycle"):
            begun = self._faces.begin(unworn, self.settings.cycles)
        cost = sum((first.cost for _, first in begun), Cost())
        return self.unworn([state for state, _ in begun], cost), [first for _, first in begun]

    def unworn(self, interfaces: Sequence[Worn], cost: Cost = NOTHING) -> CoupledState[Worn]:
        """Return the state before the first jump, from those of the contacts and their cost."""
        state = CoupledState(
            interfaces=tuple(interfaces),
            cycles=np.empty(0),
            kinetics=np.empty((0, len(interfaces), len(KINETICS))),
            drift=np.empty(0),
            solved_resultants=self._probe(interfaces),
            solutions=1,
            cost=cost,
        )
        return state.record(0.0, self.contacts, 0.0)

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
    def _faces(self) -> Contacts:
        """The contacts under the loads of the source."""
        return cast("Contacts", self.contacts)

    def _follow_drift(self, state: CoupledState[Any]) -> tuple[CoupledState[Any], float]:
        """Solve the loads again if their resultants have drifted too far, and return the drift."""
        settings, contacts, source = self.settings, self._faces, self.source
        if source is None or settings.resultants == "constant":
            return state, 0.0
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
        return self.source.probe(self._faces.nodal_depths(interfaces), self._friction(interfaces))

    def _friction(self, interfaces: Sequence[Any]) -> list[float] | None:
        """Return the coefficients of friction of the interfaces, or None if they are constant."""
        constant = self.settings.friction == "constant"
        return None if constant else self._faces.friction(interfaces)


def _depth(kinetics: Array) -> float:
    """Return the largest depth of any body [mm] in a row of kinetics ``(interfaces, 5)``."""
    return float(kinetics[:, :2].max())


def _volume(kinetics: Array) -> float:
    """Return the volume of all bodies [mm³] in a row of kinetics ``(interfaces, 5)``."""
    return float(kinetics[:, 2:4].sum(axis=1).sum())


def _cycles_of_steps(interfaces: Sequence[WornState], left: float) -> float:
    """Return the cycles of a jump as long as the contacts' own steps, out of the ``left`` ones.

    Where a contact has done one of two steps that are judged together, the jump ends with the
    second.
    """
    half_way = [interface.next_cycles for interface in interfaces if interface.half_way]
    if half_way:
        return min(max(half_way), left)
    # The cycles left are divided evenly, so that no jump is a mere remainder.
    proposed = min(interface.next_cycles for interface in interfaces)
    return left / float(max(1.0, np.ceil(left / proposed * (1.0 - ROUNDING))))


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


def _cycles_to(depth: float | None, volume: float | None, state: CoupledState[Any]) -> float:
    """Return the cycles in which the present rates wear so much more, infinite without wear.

    ``depth`` is that of the fastest wearing body [mm], ``volume`` that of all bodies [mm³].
    """
    limits = (
        (depth, max(interface.depth_rate for interface in state.interfaces)),
        (volume, sum(interface.volume_rate for interface in state.interfaces)),
    )
    cycles = [limit / rate for limit, rate in limits if limit is not None and rate > 0.0]
    return min(cycles, default=np.inf)
