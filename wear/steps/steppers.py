"""Length of wear steps, and what to do with a step that was too long.

A stepper advances a wearing contact by at most a given number of cycles, given a function that
returns the contact of any state. Explicit steps and Heun's stay below their stability limit. They
only need the wear of a cycle, and serve cells of a half-space and nodes of a structure
(:mod:`wear.contact.nodes`) alike. Implicit and second-order steps solve a half-space contact within
the step, and are as long as the caller asks for or as an error estimate allows.

Errors of steps and their bounds are those of :mod:`wear.steps.step_errors`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Generic, Protocol, Self, TypeVar

import numpy as np

from sa_solver.errors import InputError
from wear.steps.attempts import Trial, accepted_step, shortest_step
from wear.steps.step_errors import (
    GROWTH,
    SAFETY,
    SHRINKAGE,
    ErrorControl,
    assess,
    root_mean_square,
    steps_to_come,
)
from wear.worn import State, WearStep

LAST_PAIR = 0.5
"""Length of the last pair of steps over that of the pairs before. Later wear presses away the
errors of earlier pairs, while the pressure at the end shows the error of the last ones.
"""

FIRST_STEP, FIRST_SHARE = 24.0, 0.5 / (1.0 + LAST_PAIR)
"""First automatic step over the explicit limit, and its largest share of the run. It is short
enough to be accepted in most runs with a tolerance of 1 %; later steps may grow eightfold each.
"""

ROUNDING = 1e-9
"""Relative difference up to which steps add up to the cycles asked for."""

Contact = TypeVar("Contact", contravariant=True)
Worn = TypeVar("Worn", contravariant=True)


class StabilityError(InputError):
    """Steps of a given length would be unstable; the message says which length is stable."""


class Stepper(Protocol[State, Contact]):
    """Protocol of a method that advances the surfaces of one interface."""

    def step(
        self, state: State, most: float, left: float, contact_at: Callable[[State], Contact]
    ) -> WearStep[State]:
        """Wear at most ``most`` cycles of the ``left`` ones of the whole run.

        ``contact_at`` returns the contact with the pressures or slips that belong to a state.
        """
        ...


# --- explicit steps ------------------------------------------------------------------------------


class ExplicitContact(Protocol[State]):
    """Protocol of a contact that can wear at its present pressures and slips."""

    def explicit_step(self, state: State, cycles: float) -> WearStep[State]:
        """Wear ``cycles`` cycles at the pressures and slips on the surfaces of ``state``."""
        ...

    def stable_cycles(self, state: State, cycles: float = 0.0) -> float:
        """Return the longest stable explicit step, by the laws of a step of ``cycles``."""
        ...


class AveragedContact(ExplicitContact[State], Protocol[State]):
    """Protocol of such a contact whose pressures can be averaged with those of another."""

    def averaged(self, other: Self) -> Self:
        """Return the contact whose wear is the mean of this one's and the other one's."""
        ...


@dataclass(frozen=True)
class ExplicitStepper:
    """Explicit Euler, in steps relative to the stability limit or of given length.

    Steps have ``fraction`` times the stability limit, or the given ``cycles``, or are as long as
    the caller asks for. Steps of given cycles raise :class:`StabilityError` beyond the limit.

    Examples
    --------
    The steps have 0.9 of the limit beyond which roughness would grow:

    >>> import numpy as np
    >>> from sa_solver import ElasticPair, Grid, LoadHistory, Material
    >>> from wear import *
    >>> grid, steel, law = Grid.line_contact(1.4, 70), Material(210e3, 0.3), ArchardLaw(1e-4,
    ...     3000.0)
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
    >>> print(end.cost.steps, "steps")
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
        contact = contact_at(state)
        return contact.explicit_step(state, self.length(contact, state, most))

    def length(self, contact: ExplicitContact[State], state: State, most: float) -> float:
        """Return the length of the next step, at most ``most`` [cycles]."""
        if self.fraction is not None:
            return _stable(contact, state, most, self.fraction)
        if self.cycles is None:
            return most
        limit = contact.stable_cycles(state, self.cycles)
        if self.cycles > limit:
            raise StabilityError(
                f"steps of {self.cycles:g} cycles are unstable: take at most {limit:.4g} cycles"
            )
        return min(most, self.cycles)


@dataclass(frozen=True)
class HeunStepper:
    """Heun's method, of second order, which averages the contact before and after an Euler step.

    Each step is taken in two halves, and as a whole by the coarse companion. Halves are at most
    ``share`` times the stability limit, so that the companion presses errors away as well, and
    short enough that the explicit Euler step differs by no more than ``tolerance`` times its wear,
    in root mean square. Steps much shorter than the limit are not repeated: their error then has
    another cause than their length.

    Examples
    --------
    The depth of a node of area A on a spring k, pushed by δ, approaches δ as exp(-N / N0), with
    N0 = A / k α µ s cycles:

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
        contact, coarse_run = contact_at(state), state.coarse_run
        contact_of_coarse_run = contact if coarse_run is state else contact_at(coarse_run)
        first = 2.0 * _stable(contact, state, 0.5 * min(most, state.next_cycles), self.share)

        def trial(cycles: float) -> Trial[State]:
            half = 0.5 * cycles
            begun, error_1, end_1 = _heun_step(state, half, contact, contact_at)
            done, error_2, end_2 = _heun_step(
                begun.state, half, contact_at(begun.state), contact_at
            )
            whole, _, _ = _heun_step(coarse_run, cycles, contact_of_coarse_run, contact_at)
            error, change = max(error_1, error_2), GROWTH
            if error > 0.0:
                change = float(np.clip(SAFETY * self.tolerance / error, SHRINKAGE, GROWTH))
            further = cycles * change
            if cycles == first < state.next_cycles:
                # The end or the stability limit has shortened the step, not its error.
                further = max(further, state.next_cycles)
            after = replace(done.state, next_cycles=further, coarse=whole.state, order=2.0)
            cost = replace(begun.cost + done.cost + whole.cost, steps=2)
            shortest = shortest_step(self.share * min(contact.stable_cycles(state), end_1, end_2))
            return Trial(
                WearStep(after, cycles, cost),
                fits=error <= self.tolerance,
                shorter=cycles * change,
                shortest=2.0 * shortest,
            )

        return accepted_step(trial, first)


def _heun_step(
    state: State,
    cycles: float,
    contact: AveragedContact[State],
    contact_at: Callable[[State], AveragedContact[State]],
) -> tuple[WearStep[State], float, float]:
    """Take a Heun step; also return the error of its Euler step and the limit of stability then."""
    predicted = contact.explicit_step(state, cycles)
    following = contact_at(predicted.state)
    step = contact.averaged(following).explicit_step(state, cycles)
    worn = step.state.surfaces.depth - state.surfaces.depth
    missed = step.state.surfaces.depth - predicted.state.surfaces.depth
    size = root_mean_square(worn, worn)
    error = root_mean_square(missed, worn) / size if size > 0.0 else 0.0
    cost = predicted.cost + step.cost
    return replace(step, cost=cost), error, following.stable_cycles(predicted.state)


def _stable(contact: ExplicitContact[State], state: State, most: float, fraction: float) -> float:
    """Return the cycles of a step, at most ``most``, within a fraction of its stability limit."""
    cycles = min(most, fraction * contact.stable_cycles(state))
    while cycles > fraction * contact.stable_cycles(state, cycles):
        cycles *= 0.5
    return cycles


# --- steps compared with others of twice the length -----------------------------------------------


class ComparedContact(Protocol[Worn]):
    """Protocol of the limits of steps, as in :class:`wear.steps.stepping.WearingContact`."""

    def stable_cycles(self, state: Worn) -> float: ...
    def comparable_cycles(self, state: Worn) -> float: ...


Compared = TypeVar("Compared", bound=ComparedContact[Any])
At = Callable[[State], Compared]


@dataclass(frozen=True)
class ComparingStepper(ABC, Generic[State, Compared]):
    """Base class of steppers with a coarse companion.

    Steps are as long as the caller asks for, or as ``control`` allows. Steps of given length may go
    ``alone``, without a companion: their error is then unknown.
    """

    control: ErrorControl | None = None
    alone: bool = False

    @abstractmethod
    def _advance(
        self, state: State, cycles: float, contact: Compared, at: At[State, Compared], last: bool
    ) -> WearStep[State]:
        """Wear ``cycles`` cycles in one step from ``state``; ``last`` says that it ends the run."""

    @abstractmethod
    def _order(self, contact: Compared) -> float:
        """Return the order of the error in the length of the steps."""

    def _longest(self, contact: Compared, state: State) -> float:
        """Return the longest step whose error can be estimated [cycles]."""
        return 2.0 / self._order(contact) * contact.comparable_cycles(state)

    def _length(self, most: float, longest: float) -> float:
        """Return the length of the next step of ``most`` cycles, at most ``longest``."""
        return min(most, longest)

    def _next_length(self, contact: Compared, after: State, proposed: float, left: float) -> float:
        """Return the length of the following step, of ``left`` cycles, by the ``proposed`` one."""
        return proposed

    def step(
        self, state: State, most: float, left: float, contact_at: At[State, Compared]
    ) -> WearStep[State]:
        """Take a step, repeated until ``control`` accepts its error."""
        contact, control = contact_at(state), self.control

        @cache
        def contact_of_coarse_run() -> Compared:
            coarse_run = state.coarse_run
            return contact if coarse_run is state else contact_at(coarse_run)

        def trial(cycles: float) -> Trial[State]:
            last = cycles >= left * (1.0 - ROUNDING)
            step = self._compared(state, cycles, (contact, contact_of_coarse_run), contact_at, last)
            after = step.state
            shortest = 2.0 * shortest_step(
                min(contact.stable_cycles(end) for end in (state, after))
            )
            fits, proposed = True, cycles
            if control is not None:
                fits, change = self._assess(contact, control, (state, after), cycles, left)
                proposed = max(cycles * float(np.clip(change, SHRINKAGE, GROWTH)), shortest)
            following = self._next_length(contact, after, proposed, left - cycles)
            step = replace(step, state=replace(after, next_cycles=following))
            return Trial(step, fits, self._length(most, min(proposed, 0.5 * cycles)), shortest)

        longest = self._longest(contact, state)
        if control is not None:
            longest = min(longest, state.next_cycles)
        return accepted_step(trial, self._length(most, longest))

    def _compared(
        self,
        state: State,
        cycles: float,
        contacts: tuple[Compared, Callable[[], Compared]],
        at: At[State, Compared],
        last: bool,
    ) -> WearStep[State]:
        """Take two steps of half the length and the companion's step, unless steps go alone.

        ``contacts`` are the contact of the state and a function that returns that of its companion.
        """
        half, (contact, contact_of_coarse_run) = 0.5 * cycles, contacts
        first = self._advance(state, half, contact, at, last)
        second = self._advance(first.state, half, at(first.state), at, last)
        after, cost = second.state, first.cost + second.cost
        if not self.alone:
            whole = self._advance(state.coarse_run, cycles, contact_of_coarse_run(), at, last)
            after, cost = replace(after, coarse=whole.state), cost + whole.cost
        after = replace(after, order=self._order(contact))
        return WearStep(after, cycles, replace(cost, steps=2))

    def _assess(
        self,
        contact: Compared,
        control: ErrorControl,
        ends: tuple[State, State],
        cycles: float,
        left: float,
    ) -> tuple[bool, float]:
        """Return whether the error after a step is acceptable, and the factor of the next length.

        ``ends`` are the states before and after its ``cycles`` of the ``left`` ones. With that
        factor the next step uses the allowed error.
        """
        return assess(control, *ends, steps_to_come(*ends, cycles, left))


def first_cycles(contact: ComparedContact[Worn], state: Worn, total: float) -> float:
    """Return the length of the first automatic step of a run of ``total`` cycles."""
    return in_pairs(min(FIRST_STEP * contact.stable_cycles(state), FIRST_SHARE * total), total)


def in_pairs(longest: float, total: float) -> float:
    """Return the length of the next step if ``total`` is covered by the fewest pairs of steps.

    Steps are at most ``longest``. All pairs are equal but the last, which is shorter where that
    takes no further pair: its steps then have :data:`LAST_PAIR` times the length of the others, or
    what remains.
    """
    before = float(np.ceil(0.5 * total / longest * (1.0 - ROUNDING))) - 1.0
    return min(longest, 0.5 * total / (before + LAST_PAIR)) if before else 0.5 * total
