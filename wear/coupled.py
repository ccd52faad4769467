"""The coupled loop: loads, contacts, wear, and worn gaps that change the loads.

Contacts wear in jumps of many cycles. After each one the source of their loads is asked, by a cheap
probe, how far wear has moved the resultants since it was last solved; if that is too far, it is
solved again with the worn gaps. :meth:`CoupledWear.march` yields the state after every jump; a run
goes on from any of them as if it had never stopped. Whatever else is to happen on the way, such as
records and progress, is up to :class:`Observer` s.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.ties import first_largest
from sa_solver.types import Array, resultant_change
from wear.contact.contacts import KINETICS, Contacts
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceState
from wear.steps.steppers import ROUNDING
from wear.worn import Spent

AT_STOP = 1e-3
"""How near to a stop a run must come: a jump that is to reach it is cut short to do so."""

RESPONSE = 0.5
"""By how much slips and energies change with the share of the load that wear moves over a face: by
3 % with 7 % of it on the default dovetail in the plane."""

Stage = Literal["contact, first cycle", "wear", "drift probe", "structural friction"]


# --- what is given --------------------------------------------------------------------------------


@dataclass(frozen=True)
class JumpSize:
    """How far one jump goes: so many ``cycles``, or until so much ``depth`` [mm] or ``volume`` of
    all bodies [mm³] is worn at the present rates.

    One of them at most. Without any, as far as the automatic steps of all contacts would go.

    Examples
    --------
    Jumps until a micrometre is worn; a jump of two sizes has no meaning:

    >>> from wear import JumpSize
    >>> print(JumpSize(depth=1e-3))
    JumpSize(cycles=None, depth=0.001, volume=None)
    >>> JumpSize(cycles=1000.0, depth=1e-3)
    Traceback (most recent call last):
        ...
    sa_solver.errors.InputError: a jump of more than one size: give cycles, depth or volume
    """

    cycles: float | None = None
    depth: float | None = None
    volume: float | None = None

    def __post_init__(self) -> None:
        if sum(size is not None for size in vars(self).values()) > 1:
            raise InputError("a jump of more than one size: give cycles, depth or volume")
        checks.numbers(self, "cycles", "depth", "volume", above=0.0)


@dataclass(frozen=True)
class Stop:
    """Where a run ends before its cycles are over: at the first of these that is reached to 0.1 %.

    ``depth`` [mm] is the largest of any body, ``volume`` [mm³] that of all bodies together.

    Examples
    --------
    A run of 10⁶ cycles that ends earlier where 20 µm are worn:

    >>> from wear import CoupledSettings, Stop
    >>> settings = CoupledSettings(cycles=1e6, stop=Stop(depth=0.02))
    >>> print(settings.stop)
    Stop(depth=0.02, volume=None)
    """

    depth: float | None = None
    volume: float | None = None

    def __post_init__(self) -> None:
        checks.numbers(self, "depth", "volume", above=0.0)


@dataclass(frozen=True)
class CoupledSettings:
    """How far a run of so many ``cycles`` goes, in which jumps, and when loads are solved again.

    ``jump`` bounds how far it goes at once, ``stop`` how far in all.
    ``resultants`` constant: never; every: after each jump; drift: where the probe has changed by
    more than the share ``drift`` (:func:`sa_solver.types.resultant_change`), or where as much is to
    be expected of slips and energies, as wear has moved the load over a face (:data:`RESPONSE`).
    With ``friction`` evolving the source is told the coefficients that contacts have come to.

    Examples
    --------
    A run of 10⁵ cycles in jumps of 10⁴, whose loads are solved again after each of them:

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

    def ended(self, state: CoupledState) -> bool:
        """Whether a run that has got to ``state`` is over."""
        stop, reached = self.stop, 1.0 - AT_STOP
        return bool(
            state.cycles[-1] >= self.cycles * (1.0 - ROUNDING)
            or (stop.depth is not None and state.depth >= stop.depth * reached)
            or (stop.volume is not None and state.volume >= stop.volume * reached)
        )


class LoadSource(Protocol):
    """Loads and slips of every contact over one closed cycle.

    Worn depths are nodal, ``(n,)`` per contact, of both bodies together [mm]. Coefficients of
    friction are one per contact; those before any wear where they are not given.
    """

    def worn(
        self, depths: list[Array], friction: Sequence[float] | None = None
    ) -> Sequence[FaceLoads]:
        """The closed cycle with worn faces."""
        ...

    def probe(self, depths: list[Array], friction: Sequence[float] | None = None) -> Array:
        """Resultants ``(contacts, 6)`` that wear moves as it moves those of the cycle, but cheap.

        Those at peak load if nothing else is at hand.
        """
        ...


@dataclass(frozen=True)
class ConstantLoads:
    """A source of loads that wear does not change: one of ``histories`` per contact.

    Examples
    --------
    What a structure would say of a contact, said once:

    >>> import numpy as np
    >>> from sa_solver import LoadHistory
    >>> from wear import ConstantLoads, CycleLoads
    >>> P, zero = np.array([50.0, 100.0]), np.zeros(2)
    >>> cycle = CycleLoads(LoadHistory(P, *[zero] * 7, sliding=zero == 0.0), np.zeros((2, 2, 1)))
    >>> source = ConstantLoads([cycle])
    >>> print(source.worn([np.full(1, 0.01)])[0] is cycle, source.probe([])[0, 0])
    True 100.0
    """

    histories: Sequence[FaceLoads]

    def worn(
        self, depths: list[Array], friction: Sequence[float] | None = None
    ) -> Sequence[FaceLoads]:
        return self.histories

    def probe(self, depths: list[Array], friction: Sequence[float] | None = None) -> Array:
        """Resultants where each contact is loaded most."""
        return np.array([h.loads.resultants[first_largest(h.loads.P)] for h in self.histories])


# --- what comes out -------------------------------------------------------------------------------


@dataclass(frozen=True)
class CoupledState:
    """Everything that a run needs to go on.

    ``interfaces`` are the states of the contacts; ``cycles`` ``(j,)`` those at the end of every
    jump so far, the unworn state included; ``kinetics`` ``(j, interfaces, 5)`` has the columns
    :data:`wear.contact.contacts.KINETICS`; ``solved_resultants`` ``(interfaces, 6)`` is the probe
    at the last solution of the source; ``drift`` ``(j,)`` the drift found after each jump;
    ``solutions`` counts the solutions, ``spent`` what the contacts have taken.
    """

    interfaces: tuple[InterfaceState, ...]
    cycles: Array
    kinetics: Array
    drift: Array
    solved_resultants: Array
    solutions: int
    spent: Spent

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

    def record(self, cycles: float, contacts: Contacts, drift: float) -> CoupledState:
        """The state with a row of kinetics added."""
        return replace(
            self,
            cycles=np.append(self.cycles, cycles),
            kinetics=np.concatenate([self.kinetics, contacts.kinetics(self.interfaces)[None]]),
            drift=np.append(self.drift, drift),
        )


class Observer:
    """Looks on while a run goes; a subclass has those methods that it needs.

    The example of :class:`CoupledWear` has one; those of ``fretscale`` write log and results.
    """

    def stage(self, name: Stage) -> AbstractContextManager[object]:
        """Entered while the part ``name`` of a run is computed."""
        return nullcontext()

    def begin(self, state: CoupledState) -> None:
        """The march begins from a state: unworn, or one that an earlier run has got to."""

    def jumping(self, state: CoupledState, cycles: float) -> None:
        """A jump of so many cycles is to begin; near a stop it may be cut short."""

    def jumped(self, before: CoupledState, after: CoupledState) -> None:
        """A jump is done, and the loads follow it."""


# --- the loop -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class CoupledWear:
    """The coupled loop: loads of a ``source`` wear ``contacts`` as ``settings`` say, watched by
    ``observers``. Its methods raise what source and contacts raise.

    Examples
    --------
    The loop stops where a micrometre is worn; an observer tells its jumps:

    >>> import numpy as np
    >>> from sa_solver import ElasticPair, Grid, LoadHistory, Material
    >>> from wear import *
    >>> class Told(Observer):
    ...     def jumped(self, before, after):
    ...         print(f"{after.cycles[-1]:.0f} cycles, {1e3 * after.depth:.3f} um")
    >>> grid, steel, law = Grid.strips(1.4, 70), Material(210e3, 0.3), ArchardLaw(1e-4, 3000.0)
    >>> contact = InterfaceContact(InterfaceSettings(
    ...     name="cylinder", grid=grid, gap=grid.x**2 / 20.0, transfer=CellNodes(grid),
    ...     pair=ElasticPair(steel, steel), laws=(law, law),
    ...     friction=lambda energy: 0.5, stepper=ImplicitStepper(),
    ... ))
    >>> zero, slip = np.zeros(1), np.zeros((1, 2, 70))
    >>> slip[:, 0] = 0.04
    >>> loads = [CycleLoads(LoadHistory(zero + 50.0, *[zero] * 7, sliding=zero == 0.0), slip)]
    >>> settings = CoupledSettings(1e5, jump=JumpSize(cycles=2000.0), stop=Stop(depth=1e-3))
    >>> loop = CoupledWear(settings, ConstantLoads(loads), Contacts([contact]), [Told()])
    >>> unworn, first = loop.begin(loads)
    >>> *_, end = loop.march(unworn)
    1767 cycles, 0.537 um
    3584 cycles, 0.894 um
    4163 cycles, 0.995 um
    4194 cycles, 1.000 um
    """

    settings: CoupledSettings
    source: LoadSource
    contacts: Contacts
    observers: Sequence[Observer] = ()

    def begin(self, unworn: Sequence[FaceLoads]) -> tuple[CoupledState, list[FirstContact]]:
        """The state before the first jump, and the contact of the first cycle.

        ``unworn`` are the loads of all contacts before any wear.
        """
        with self._stage("contact, first cycle"):
            begun = self.contacts.begin(unworn, self.settings.cycles)
        interfaces = tuple(unworn_state for unworn_state, _ in begun)
        state = CoupledState(
            interfaces=interfaces,
            cycles=np.empty(0),
            kinetics=np.empty((0, len(interfaces), len(KINETICS))),
            drift=np.empty(0),
            solved_resultants=self._probe(interfaces),
            solutions=1,
            spent=sum((first.spent for _, first in begun), Spent()),
        )
        return state.record(0.0, self.contacts, 0.0), [first for _, first in begun]

    def march(self, state: CoupledState) -> Iterator[CoupledState]:
        """The states after every jump from ``state``, until cycles are over or a stop is met."""
        for observer in self.observers:
            observer.begin(state)
        while not self.settings.ended(state):
            before, state = state, self._jump(state)
            for observer in self.observers:
                observer.jumped(before, state)
            yield state

    def jumps_left(self, state: CoupledState) -> int:
        """About how many jumps are left, if their length goes on as it has of late.

        All are as long as the next one, or grow as they have grown over the last half of all jumps;
        automatic ones are taken to double until two of them are known.
        """
        if self.settings.ended(state):
            return 0
        following, lengths = self._jump_cycles(state), np.diff(state.cycles)
        count = min(self._left(state), self._to_stop(state)) / following
        growth = 1.0 if self.settings.jump == JumpSize() else 0.0
        if back := len(lengths) // 2:
            growth = (following / float(lengths[-back - 1])) ** (1.0 / (back + 1.0)) - 1.0
        if count > 1.0 and growth > 0.0:
            count = float(np.log1p(count * growth) / np.log1p(growth))
        return max(1, int(np.ceil(count * (1.0 - ROUNDING))))

    @contextmanager
    def _stage(self, name: Stage) -> Iterator[None]:
        with ExitStack() as stack:
            for observer in self.observers:
                stack.enter_context(observer.stage(name))
            yield

    # -- one jump ----------------------------------------------------------------------------------
    def _jump(self, state: CoupledState) -> CoupledState:
        cycles, spent = self._jump_cycles(state), Spent()
        for observer in self.observers:
            observer.jumping(state, cycles)
        # The run ends at a stop if it comes to that.
        left = max(cycles, min(self._left(state), self._to_stop(state)))
        while True:
            with self._stage("wear"):
                jumped = self.contacts.jump(self._begun(state, cycles), cycles, left)
            spent = sum((further for _, further in jumped), spent)
            interfaces = tuple(worn for worn, _ in jumped)
            shorter = cycles * self._share_to_stop(state, interfaces)
            if shorter == cycles or cycles <= 1.0:
                break
            cycles = left = max(1.0, shorter)
        state = replace(state, interfaces=interfaces, spent=state.spent + spent)
        state, drift = self._follow_drift(state)
        return state.record(float(state.cycles[-1]) + cycles, self.contacts, drift)

    def _jump_cycles(self, state: CoupledState) -> float:
        """Cycles of the next jump, by the size that is asked for at the present rates."""
        size, left = self.settings.jump, self._left(state)
        if size.cycles is not None:
            cycles = size.cycles
        elif size.depth is not None or size.volume is not None:
            cycles = _cycles_to(size.depth, size.volume, state)
        else:
            cycles = _cycles_of_steps(state.interfaces, left)
        cycles = min(cycles, self._to_stop(state))
        return left if cycles > left * (1.0 - ROUNDING) else float(cycles)

    def _begun(self, state: CoupledState, cycles: float) -> Sequence[InterfaceState]:
        """The contacts as they begin a jump of so many ``cycles``."""
        automatic = self.settings.jump == JumpSize()
        return _in_phase(state.interfaces, cycles) if automatic else state.interfaces

    def _left(self, state: CoupledState) -> float:
        """Cycles to the end of the run."""
        return self.settings.cycles - float(state.cycles[-1])

    def _to_stop(self, state: CoupledState) -> float:
        """Cycles to the nearest stop at the present rates, one at least."""
        stop = self.settings.stop
        depth = None if stop.depth is None else stop.depth - state.depth
        volume = None if stop.volume is None else stop.volume - state.volume
        return max(1.0, _cycles_to(depth, volume, state))

    def _share_to_stop(self, before: CoupledState, interfaces: Sequence[InterfaceState]) -> float:
        """Share of a jump at which it came to a stop that it went past; else 1."""
        after, stop, share = self.contacts.kinetics(interfaces), self.settings.stop, 1.0
        for limit, then, now in (
            (stop.depth, before.depth, _depth(after)),
            (stop.volume, before.volume, _volume(after)),
        ):
            if limit is not None and now > limit * (1.0 + AT_STOP):
                share = min(share, (limit - then) / (now - then))
        return share

    # -- loads -------------------------------------------------------------------------------------
    def _follow_drift(self, state: CoupledState) -> tuple[CoupledState, float]:
        """Solve the source again where its resultants have drifted too far."""
        settings = self.settings
        if settings.resultants == "constant":
            return state, 0.0
        with self._stage("drift probe"):
            probe = self._probe(state.interfaces)
        sizes = np.array([contact.grid.size for contact in self.contacts.contacts])
        change = np.abs(resultant_change(probe, state.solved_resultants, sizes))
        moved = max(self.contacts.moved(state.interfaces))
        drift = max(float(change.max()), RESPONSE * moved)
        if settings.resultants == "drift" and drift <= settings.drift:
            return state, drift
        with self._stage("structural friction"):
            depths = self.contacts.nodal_depths(state.interfaces)
            histories = self.source.worn(depths, self._friction(state.interfaces))
        followed = self.contacts.follow(state.interfaces, histories)
        return replace(
            state,
            interfaces=tuple(interface for interface, _ in followed),
            solved_resultants=probe,
            solutions=state.solutions + 1,
            spent=sum((further for _, further in followed), state.spent),
        ), drift

    def _probe(self, interfaces: Sequence[InterfaceState]) -> Array:
        return self.source.probe(self.contacts.nodal_depths(interfaces), self._friction(interfaces))

    def _friction(self, interfaces: Sequence[InterfaceState]) -> list[float] | None:
        """Coefficients of friction of the interfaces, where they change."""
        constant = self.settings.friction == "constant"
        return None if constant else self.contacts.friction(interfaces)


def _depth(kinetics: Array) -> float:
    """Largest depth of any body [mm] in a row of kinetics ``(interfaces, 5)``."""
    return float(kinetics[:, :2].max())


def _volume(kinetics: Array) -> float:
    """Volume of all bodies [mm³] in a row of kinetics ``(interfaces, 5)``."""
    return float(kinetics[:, 2:4].sum(axis=1).sum())


def _cycles_of_steps(interfaces: Sequence[InterfaceState], left: float) -> float:
    """Cycles of a jump as long as the contacts' own steps, of the ``left`` ones.

    Where a contact is half-way through two steps that are judged together, to where it ends them.
    """
    half_way = [interface.next_cycles for interface in interfaces if interface.half_way]
    if half_way:
        return min(max(half_way), left)
    # The steps that are left, all of one length: none of them is a mere remainder.
    proposed = min(interface.next_cycles for interface in interfaces)
    return left / float(max(1.0, np.ceil(left / proposed * (1.0 - ROUNDING))))


def _in_phase(interfaces: Sequence[InterfaceState], cycles: float) -> Sequence[InterfaceState]:
    """The contacts before a jump of so many ``cycles``, all of which end two steps with it.

    Where some are half-way, the others take two steps. Out of phase some would always begin the two
    that make up what is left: jumps would halve for ever, and the run never end.
    """
    if not any(interface.half_way for interface in interfaces):
        return interfaces
    return [
        interface
        if interface.half_way
        else replace(interface, next_cycles=min(interface.next_cycles, 0.5 * cycles))
        for interface in interfaces
    ]


def _cycles_to(depth: float | None, volume: float | None, state: CoupledState) -> float:
    """Cycles in which the present rates wear so much more [mm, mm³]; infinite where they do not."""
    limits = (
        (depth, max(interface.depth_rate for interface in state.interfaces)),
        (volume, sum(interface.volume_rate for interface in state.interfaces)),
    )
    cycles = [limit / rate for limit, rate in limits if limit is not None and rate > 0.0]
    return min(cycles, default=np.inf)
