"""How long a wear step may be, and what to do when it was too long.

A stepper advances the surfaces of one interface by at most so many cycles, given a way to solve a
cycle on any surfaces. Explicit steps keep below their stability limit; implicit ones, and those of
second order, are as long as the caller says or as an error estimate allows.

An implicit step errs by ½ ΔN (r₁ - r₀), r being the depth per cycle at the pressures (and slips) of
its two ends. What came before and what it adds are both pressed away in part by wear itself, the
short waves first (:meth:`wear.stepping.WearingContact.lasting`; Shampine & Baca 1984,
doi:10.1007/BF01934907). So the estimated error of the depth is carried from step to step. On a
rounded flat under nine loads it came within 25 % of the true one, in root mean square, from runs
of 4 steps to runs of 140; without damping it was ten times too large. Steps of second order are
measured by the error of a first-order step between the same ends, which is more than their own.

Errors count by their root mean square over the worn cells: the few at a moving contact edge are
worn by jumps however short the steps, and say little about depth or volume.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from sa_solver.types import Array
from wear.stepping import WearingContact, WearState, WearStep

FIRST_STEP = 8.0
"""First automatic step over the explicit limit: short enough to be accepted at 1 %, if not always,
and steps may grow eightfold from one to the next."""

GROWTH, SHRINKAGE, SAFETY = 8.0, 0.2, 0.8
"""Bounds of one change of an automatic step, and the share of its room that it aims at."""

LEAST_ROOM = 0.1
"""Share of the tolerance that a step may always fill: errors carried along die out by themselves,
or more slowly than steps without length would ever show."""

ROUNDING = 1e-9
"""Steps that add up to the cycles asked for but for this share leave none over."""

ContactAt = Callable[[WearState], WearingContact]
"""The contact with the slips that belong to a state: solves its friction where there is one."""


class Stepper(Protocol):
    """A way to advance the surfaces of one interface."""

    def step(self, state: WearState, most: float, left: float, contact_at: ContactAt) -> WearStep:
        """Wear at most ``most`` cycles of the ``left`` ones of the whole run."""
        ...


@dataclass(frozen=True)
class Explicit:
    """Explicit Euler: steps of ``fraction`` times the stability limit, or as long as may be."""

    fraction: float | None = None

    def step(self, state: WearState, most: float, left: float, contact_at: ContactAt) -> WearStep:
        contact = contact_at(state)
        cycles = most
        if self.fraction is not None:
            cycles = min(most, self.fraction * contact.stable_cycles(state))
        return contact.explicit_step(state, cycles)


@dataclass(frozen=True)
class ErrorControl:
    """What error the depth may have: the smaller of those given.

    ``relative`` is a share of the depth at the end of the run, ``absolute`` a depth [mm]; both
    bound the root mean square over the worn cells, of both bodies together.
    """

    relative: float | None = None
    absolute: float | None = None

    def tolerance(self, depth: Array, expected: Array) -> float:
        """The bound for a contact worn to ``depth`` in a run that is ``expected`` to end deeper."""
        bounds = [np.inf]
        if self.relative is not None:
            bounds.append(self.relative * root_mean_square(expected, depth))
        if self.absolute is not None:
            bounds.append(self.absolute)
        return min(bounds)


def root_mean_square(field: Array, depth: Array) -> float:
    """Of a ``field`` over the cells that have lost some ``depth``, both ``(nx, ny)``."""
    worn = max(int(np.count_nonzero(depth)), 1)
    return float(np.sqrt(np.vdot(field, field) / worn))


@dataclass(frozen=True)
class Implicit:
    """Implicit Euler: as long as asked for, or as ``control`` lets it be."""

    control: ErrorControl | None = None

    def step(self, state: WearState, most: float, left: float, contact_at: ContactAt) -> WearStep:
        contact = contact_at(state)
        rate = contact.rate(state)

        def attempt(cycles: float) -> WearStep:
            return contact.implicit_step(state, cycles)

        def error(step: WearStep) -> Array:
            change = contact_at(step.state).rate(step.state) - rate
            return 0.5 * step.cycles * change

        return _estimated(_Attempts(contact, attempt, error), self.control, state, most, left)


@dataclass(frozen=True)
class SecondOrder:
    """Second order in the step, also where slip changes with wear: as long as asked for, or less.

    A contact whose slips come from the half-space is worn once with those of the start, and again
    with the mean of those and the ones found.
    """

    control: ErrorControl | None = None

    def step(self, state: WearState, most: float, left: float, contact_at: ContactAt) -> WearStep:
        contact = contact_at(state)

        def attempt(cycles: float) -> WearStep:
            predicted = contact.second_order_step(state, cycles)
            following = contact_at(predicted.state)
            if following is contact:
                return predicted
            step = contact.midway(following).second_order_step(state, cycles)
            return replace(
                step,
                contact_solves=predicted.contact_solves + step.contact_solves,
                convolutions=predicted.convolutions + step.convolutions,
            )

        def error(step: WearStep) -> Array:
            assert step.midway is not None
            ends = 0.5 * (state.surfaces.depth + step.state.surfaces.depth)
            return ends - step.midway

        return _estimated(_Attempts(contact, attempt, error), self.control, state, most, left)


@dataclass(frozen=True)
class _Attempts:
    """A way to try a step of so many cycles, and the error that it adds, undamped ``(nx, ny)``."""

    contact: WearingContact
    attempt: Callable[[float], WearStep]
    error: Callable[[WearStep], Array]


def _estimated(
    own: _Attempts, control: ErrorControl | None, state: WearState, most: float, left: float
) -> WearStep:
    """A step with the error of the depth after it, tried again shorter until ``control`` agrees.

    One below the explicit limit is not worth trying again.
    """
    shortest = own.contact.stable_cycles(state)
    cycles = most if control is None else min(most, state.next_cycles)
    solves = convolutions = 0
    while True:
        step = own.attempt(cycles)
        solves, convolutions = solves + step.contact_solves, convolutions + step.convolutions
        carried = own.contact.lasting(state.error, state, cycles)
        added = own.contact.lasting(own.error(step), state, cycles)
        proposed, fits = cycles, True
        if control is not None:
            depth = step.state.surfaces.depth
            expected = depth + (depth - state.surfaces.depth) * max(left / cycles - 1.0, 0.0)
            tolerance = control.tolerance(depth, expected)
            size, room = root_mean_square(added, depth), LEAST_ROOM * tolerance
            total = root_mean_square(carried + added, depth)
            fits = total <= tolerance or size <= room or cycles <= shortest
            # Errors of different steps lie in different places: their squares add up.
            free = tolerance**2 - root_mean_square(carried, depth) ** 2
            room = max(room, np.sqrt(max(free, 0.0)))
            change = np.sqrt(SAFETY * room / size) if size > 0.0 else GROWTH
            proposed = max(cycles * float(np.clip(change, SHRINKAGE, GROWTH)), shortest)
        if fits:
            after = replace(step.state, error=carried + added, next_cycles=proposed)
            return replace(step, state=after, contact_solves=solves, convolutions=convolutions)
        cycles = proposed


@dataclass(frozen=True)
class Advance:
    """So many cycles in as many steps as they took: see :class:`WearStep`."""

    state: WearState
    steps: int
    contact_solves: int
    convolutions: int


def advance(
    stepper: Stepper, state: WearState, cycles: float, left: float, contact_at: ContactAt
) -> Advance:
    """Wear ``cycles`` cycles of the ``left`` ones of the run, in as many steps as it takes."""
    done, steps, solves, convolutions = 0.0, 0, 0, 0
    while cycles - done > ROUNDING * cycles:
        step = stepper.step(state, cycles - done, left - done, contact_at)
        state, done, steps = step.state, done + step.cycles, steps + 1
        solves, convolutions = solves + step.contact_solves, convolutions + step.convolutions
    return Advance(state, steps, solves, convolutions)
