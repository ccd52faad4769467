"""How long a wear step may be, and what to do when it was too long.

A stepper advances what wears by at most so many cycles, given the contact that belongs to any state
of it. Explicit steps and Heun's keep below their stability limit, and need to know of a contact
only what a cycle takes off: cells of a half-space or nodes of a structure
(:mod:`wear.contact.nodes`). Implicit steps and those of second order solve a half-space contact on
the way, and are as long as the caller says or as an error estimate allows.

The errors of steps and their bounds are those of :mod:`wear.steps.step_errors`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Generic, Protocol, Self, TypeVar

import numpy as np

from sa_solver.errors import InputError
from wear.steps.step_errors import (
    GROWTH,
    SAFETY,
    SHRINKAGE,
    ErrorControl,
    judged,
    root_mean_square,
    steps_to_come,
)
from wear.worn import Spent, State, WearStep

LAST = 0.5
"""Length of the last pair of steps over that of the pairs before it. What those miss is pressed
away by what follows; the pressure at the end shows what the last ones miss."""

FIRST_STEP, FIRST_SHARE = 24.0, 0.5 / (1.0 + LAST)
"""First automatic step over the explicit limit, and its largest share of the run: short enough to
be accepted at 1 %, if not always, and steps may grow eightfold from one to the next."""

SHORTEST = 0.01
"""Steps so short, over the explicit limit, are not tried again: something other than their length
is wrong."""

ROUNDING = 1e-9
"""Steps that add up to the cycles asked for but for this share leave none over."""

Contact = TypeVar("Contact", contravariant=True)
Worn = TypeVar("Worn", contravariant=True)


class StabilityError(InputError):
    """Steps of a given length would be unstable; the message says which length is not."""


class Stepper(Protocol[State, Contact]):
    """A way to advance the surfaces of one interface."""

    def step(
        self, state: State, most: float, left: float, contact_at: Callable[[State], Contact]
    ) -> WearStep[State]:
        """Wear at most ``most`` cycles of the ``left`` ones of the whole run.

        ``contact_at`` gives the contact with the pressures or slips that belong to a state.
        """
        ...


# --- steps at what a contact is ------------------------------------------------------------------


class ExplicitContact(Protocol[State]):
    """A contact that can wear at the pressures and slips that it has."""

    def explicit_step(self, state: State, cycles: float) -> WearStep[State]:
        """Wear ``cycles`` cycles at what the contact is on the surfaces of ``state``."""
        ...

    def stable_cycles(self, state: State, cycles: float = 0.0) -> float:
        """Longest explicit step in which no error grows, by the laws of a step of ``cycles``."""
        ...


class AveragedContact(ExplicitContact[State], Protocol[State]):
    """Such a contact whose pressures are known, and can be averaged with those of another."""

    def averaged(self, other: Self) -> Self:
        """The contact that takes off the mean of what both do."""
        ...


@dataclass(frozen=True)
class ExplicitStepper:
    """Explicit Euler: steps of ``fraction`` times the stability limit, of so many ``cycles``, or as
    long as may be.

    Steps of given cycles raise :class:`StabilityError` beyond the limit.

    Examples
    --------
    Steps of 0.9 of the limit beyond which roughness would grow:

    >>> import numpy as np
    >>> from sa_solver import ElasticPair, Grid, LoadHistory, Material
    >>> from wear import *
    >>> grid, steel, law = Grid.strips(1.4, 70), Material(210e3, 0.3), ArchardLaw(1e-4, 3000.0)
    >>> contact = InterfaceContact(InterfaceSettings(
    ...     name="cylinder", grid=grid, gap=grid.x**2 / 20.0, transfer=CellNodes(grid),
    ...     pair=ElasticPair(steel, steel), laws=(law, law),
    ...     friction=lambda energy: 0.5, stepper=ExplicitStepper(fraction=0.9),
    ... ))
    >>> zero, slip = np.zeros(1), np.zeros((1, 2, 70))
    >>> slip[:, 0] = 0.04
    >>> loads = [CycleLoads(LoadHistory(zero + 50.0, *[zero] * 7, sliding=zero == 0.0), slip)]
    >>> settings = CoupledSettings(cycles=1e4)
    >>> loop = CoupledWear(settings, ConstantLoads(loads), Contacts([contact]))
    >>> unworn, first = loop.begin(loads)
    >>> *_, end = loop.march(unworn)
    >>> print(f"{end.volume:.2e} mm^3/mm of {1e4 * 2 * 1e-4 * 0.04 * 50.0 / 3000.0:.2e}")
    1.33e-03 mm^3/mm of 1.33e-03
    >>> print(end.spent.steps, "steps")
    120 steps
    """

    fraction: float | None = None
    cycles: float | None = None

    def step(
        self,
        state: State,
        most: float,
        left: float,
        contact_at: Callable[[State], ExplicitContact[State]],
    ) -> WearStep[State]:
        contact, cycles = contact_at(state), most
        if self.fraction is not None:
            cycles = _stable(contact, state, most, self.fraction)
        elif self.cycles is not None:
            limit = contact.stable_cycles(state, self.cycles)
            if self.cycles > limit:
                raise StabilityError(
                    f"steps of {self.cycles:g} cycles: take at most {limit:.4g} cycles"
                )
            cycles = min(most, self.cycles)
        return contact.explicit_step(state, cycles)


@dataclass(frozen=True)
class HeunStepper:
    """Heun's method, of second order: at the mean of the contact before and after an explicit step.

    Each is taken in two halves, and as a whole by the companion of the state. Halves are at most a
    ``share`` of the stability limit, so that the companion presses errors away as well, and such
    that the explicit step differs by no more than ``tolerance`` of what they wear, in root mean
    square. Those much shorter than the limit are not tried again: something other than their length
    is wrong.

    Examples
    --------
    A node of area A on a spring k, pushed by δ: its depth comes to δ as exp(-N / N0), with
    N0 = A / k α µ s cycles.

    >>> import numpy as np
    >>> from types import SimpleNamespace
    >>> from wear import EnergyLaw, HeunStepper
    >>> from wear.contact.nodes import NodalContact, NodalState
    >>> law, area, spring, push = EnergyLaw(1e-8), np.array([0.1]), 1e3, 2e-3
    >>> def contact_at(state):
    ...     pressure = spring / area * (push - state.surfaces.depth)
    ...     cycle = SimpleNamespace(
    ...         slip=np.full((1, 1), 0.02), pressure=pressure[None], friction=0.5, areas=area,
    ...         start=None, stable_cycles=lambda lost: 2.0 * area[0] / (spring * lost.sum()),
    ...     )
    ...     return NodalContact((law, law), (cycle,))
    >>> scale = area[0] / (spring * 2e-8 * 0.5 * 0.02)
    >>> state, left, steps = NodalState.unworn(np.zeros(1)), scale, 0
    >>> while left > 1e-9 * scale:
    ...     step = HeunStepper(tolerance=0.02).step(state, left, left, contact_at)
    ...     state, left, steps = step.state, left - step.cycles, steps + 1
    >>> print(f"{state.surfaces.depth[0]:.3e} mm of {push * (1.0 - np.exp(-1.0)):.3e}")
    1.264e-03 mm of 1.264e-03
    """

    tolerance: float
    share: float = 0.375

    def step(
        self,
        state: State,
        most: float,
        left: float,
        contact_at: Callable[[State], AveragedContact[State]],
    ) -> WearStep[State]:
        contact, companion = contact_at(state), state.companion
        with_companion = contact if companion is state else contact_at(companion)
        first = 2.0 * _stable(contact, state, 0.5 * min(most, state.next_cycles), self.share)

        def trial(cycles: float) -> _Trial[State]:
            half = 0.5 * cycles
            begun, error_1, end_1 = _heuns(state, half, contact, contact_at)
            done, error_2, end_2 = _heuns(begun.state, half, contact_at(begun.state), contact_at)
            whole, _, _ = _heuns(companion, cycles, with_companion, contact_at)
            error, change = max(error_1, error_2), GROWTH
            if error > 0.0:
                change = float(np.clip(SAFETY * self.tolerance / error, SHRINKAGE, GROWTH))
            further = cycles * change
            if cycles == first < state.next_cycles:
                # It was cut short, by the end or by stability, not by its error.
                further = max(further, state.next_cycles)
            after = replace(done.state, next_cycles=further, coarse=whole.state, order=2.0)
            spent = replace(begun.spent + done.spent + whole.spent, steps=2)
            shortest = _shortest(self.share * min(contact.stable_cycles(state), end_1, end_2))
            return _Trial(
                WearStep(after, cycles, spent),
                fits=error <= self.tolerance,
                shorter=cycles * change,
                shortest=2.0 * shortest,
            )

        return _accepted(trial, first)


def _heuns(
    state: State,
    cycles: float,
    contact: AveragedContact[State],
    contact_at: Callable[[State], AveragedContact[State]],
) -> tuple[WearStep[State], float, float]:
    """A step of Heun's method, what the explicit one misses of it, and its limit at the end."""
    predicted = contact.explicit_step(state, cycles)
    following = contact_at(predicted.state)
    step = contact.averaged(following).explicit_step(state, cycles)
    worn = step.state.surfaces.depth - state.surfaces.depth
    missed = step.state.surfaces.depth - predicted.state.surfaces.depth
    size = root_mean_square(worn, worn)
    error = root_mean_square(missed, worn) / size if size > 0.0 else 0.0
    spent = predicted.spent + step.spent
    return replace(step, spent=spent), error, following.stable_cycles(predicted.state)


def _stable(contact: ExplicitContact[State], state: State, most: float, fraction: float) -> float:
    """Cycles of a step, at most ``most``, of this fraction of its stability limit or less."""
    cycles = min(most, fraction * contact.stable_cycles(state))
    while cycles > fraction * contact.stable_cycles(state, cycles):
        cycles *= 0.5
    return cycles


# --- attempts -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Trial(Generic[State]):
    """A step that was tried, and whether its error ``fits``.

    If not it is to be ``shorter``; steps of the ``shortest`` length are taken as they are [cycles].
    """

    step: WearStep[State]
    fits: bool
    shorter: float
    shortest: float


def _accepted(attempt: Callable[[float], _Trial[State]], cycles: float) -> WearStep[State]:
    """A step whose error fits, begun with so many cycles; what all attempts have taken is its."""
    spent = Spent()
    while True:
        trial = attempt(cycles)
        spent += trial.step.spent
        if trial.fits or cycles <= trial.shortest:
            return replace(trial.step, spent=replace(spent, steps=trial.step.spent.steps))
        cycles = max(trial.shorter, trial.shortest)


def _shortest(stable: float) -> float:
    """Cycles of a step that is not tried again.

    Nothing wears, and any length is stable, until an energy threshold is passed.
    """
    return SHORTEST * stable if np.isfinite(stable) else 0.0


# --- steps held against others of twice the length ------------------------------------------------


class ComparedContact(Protocol[Worn]):
    """What limits steps: see :class:`wear.steps.stepping.WearingContact`."""

    def stable_cycles(self, state: Worn) -> float: ...
    def comparable_cycles(self, state: Worn) -> float: ...


Compared = TypeVar("Compared", bound=ComparedContact[Any])
At = Callable[[State], Compared]


@dataclass(frozen=True)
class ComparingStepper(ABC, Generic[State, Compared]):
    """Steps, as long as asked for or as ``control`` lets them be, and their companion's.

    Those of given length may go ``alone``: nothing tells their error then.
    """

    control: ErrorControl | None = None
    alone: bool = False

    @abstractmethod
    def _advance(
        self, state: State, cycles: float, contact: Compared, at: At[State, Compared], last: bool
    ) -> WearStep[State]:
        """So many cycles at once from ``state``, whose contact is given; to the end if ``last``."""

    @abstractmethod
    def _order(self, contact: Compared) -> float:
        """Of the error in the length of the steps."""

    def _longest(self, contact: Compared, state: State) -> float:
        """How long a step may be to be compared."""
        return 2.0 / self._order(contact) * contact.comparable_cycles(state)

    def _share(self, most: float, longest: float) -> float:
        """Cycles of a step of ``most`` cycles to come that may have the ``longest``."""
        return min(most, longest)

    def _following(self, contact: Compared, after: State, proposed: float, left: float) -> float:
        """Cycles of the step that follows, of the ``left`` ones, if so many are ``proposed``."""
        return proposed

    def step(
        self, state: State, most: float, left: float, contact_at: At[State, Compared]
    ) -> WearStep[State]:
        """A step, tried again until ``control`` agrees with its error."""
        contact, control = contact_at(state), self.control

        @cache
        def with_companion() -> Compared:
            companion = state.companion
            return contact if companion is state else contact_at(companion)

        def trial(cycles: float) -> _Trial[State]:
            last = cycles >= left * (1.0 - ROUNDING)
            step = self._compared(state, cycles, (contact, with_companion), contact_at, last)
            after = step.state
            shortest = 2.0 * _shortest(min(contact.stable_cycles(end) for end in (state, after)))
            fits, proposed = True, cycles
            if control is not None:
                fits, change = self._judged(contact, control, (state, after), cycles, left)
                proposed = max(cycles * float(np.clip(change, SHRINKAGE, GROWTH)), shortest)
            following = self._following(contact, after, proposed, left - cycles)
            step = replace(step, state=replace(after, next_cycles=following))
            return _Trial(step, fits, self._share(most, min(proposed, 0.5 * cycles)), shortest)

        longest = self._longest(contact, state)
        if control is not None:
            longest = min(longest, state.next_cycles)
        return _accepted(trial, self._share(most, longest))

    def _compared(
        self,
        state: State,
        cycles: float,
        contacts: tuple[Compared, Callable[[], Compared]],
        at: At[State, Compared],
        last: bool,
    ) -> WearStep[State]:
        """Two steps of half the length and the companion's whole one, unless they go alone.

        ``contacts`` are that of the state and, to be asked for, that of its companion.
        """
        half, (contact, with_companion) = 0.5 * cycles, contacts
        first = self._advance(state, half, contact, at, last)
        second = self._advance(first.state, half, at(first.state), at, last)
        after, spent = second.state, first.spent + second.spent
        if not self.alone:
            whole = self._advance(state.companion, cycles, with_companion(), at, last)
            after, spent = replace(after, coarse=whole.state), spent + whole.spent
        after = replace(after, order=self._order(contact))
        return WearStep(after, cycles, replace(spent, steps=2))

    def _judged(
        self,
        contact: Compared,
        control: ErrorControl,
        ends: tuple[State, State],
        cycles: float,
        left: float,
    ) -> tuple[bool, float]:
        """Whether the error after a step will do, and the change of length that fills what it may.

        ``ends`` are the states before and after its ``cycles`` of the ``left`` ones.
        """
        return judged(control, *ends, steps_to_come(*ends, cycles, left))


def first_cycles(contact: ComparedContact[Worn], state: Worn, total: float) -> float:
    """How far the first automatic step of a run of ``total`` cycles goes."""
    return in_pairs(min(FIRST_STEP * contact.stable_cycles(state), FIRST_SHARE * total), total)


def in_pairs(longest: float, total: float) -> float:
    """Cycles of the next of the fewest pairs of steps that make the ``total``, ``longest`` at most.

    All are alike but the last pair, which is shorter where that takes no more of them: its steps
    are :data:`LAST` times as long then, or what is left.
    """
    before = float(np.ceil(0.5 * total / longest * (1.0 - ROUNDING))) - 1.0
    return min(longest, 0.5 * total / (before + LAST)) if before else 0.5 * total
