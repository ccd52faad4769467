"""How long a wear step may be, and what to do when it was too long.

A stepper advances the surfaces of one interface by at most so many cycles, given a way to solve a
cycle on any surfaces. Explicit steps keep below their stability limit; implicit ones, and those of
second order, are as long as the caller says or as an error estimate allows.

An implicit step errs by what it wears more than ½ ΔN (r₀ + r₁), r being the depth per cycle at the
pressures (and slips) of its two ends. What came before and what it adds are both pressed away in
part by wear itself, the short waves first: see
:meth:`wear.stepping.WearingContact.damped_errors` and Shampine & Baca 1984,
doi:10.1007/BF01934907. So the estimated error of the depth is carried from
step to step. In root mean square it came within 50 % of the true one where that was 0.3 % or more
of the depth, on two rounded flats under three and nine loads (without damping it was ten times too
large); in long runs of short steps it was up to three times too small, six where flanks carry
unevenly, since edges that are pressed part of the time are damped less. Steps of second order are
measured by a quarter of the error of a first-order step between the same ends, and by what their
second pass with other slips has changed.

Errors count by their root mean square over the worn cells: the few at a moving contact edge are
worn by jumps however short the steps, and say little about depth or volume. The volume counts for
itself, undamped: where slip follows from wear, as in partial slip, no pressure corrects it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from sa_solver.types import Array
from wear.stepping import WearingContact, WearState, WearStep

FIRST_STEP, FIRST_SHARE = 8.0, 0.1
"""First automatic step over the explicit limit, and its largest share of the run: short enough to
be accepted at 1 %, if not always, and steps may grow eightfold from one to the next."""

GROWTH, SHRINKAGE, SAFETY = 8.0, 0.2, 0.8
"""Bounds of one change of an automatic step, and the share of its room that it aims at."""

SHORTEST = 0.01
"""Steps so short, over the explicit limit, are not tried again: something other than their length
is wrong."""

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
            while cycles > self.fraction * contact.stable_cycles(state, cycles):
                cycles *= 0.5
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
        """The bound for a contact worn to ``depth``, as a share of the one ``expected`` to come."""
        scale = root_mean_square(expected, depth)
        bounds = [np.inf if self.relative is None else self.relative]
        if self.absolute is not None and scale > 0.0:
            bounds.append(self.absolute / scale)
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
            ends = 0.5 * (rate + contact_at(step.state).rate(step.state))
            return step.state.surfaces.depth - state.surfaces.depth - step.cycles * ends

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
                drift=step.state.surfaces.depth - predicted.state.surfaces.depth,
                contact_solves=predicted.contact_solves + step.contact_solves,
                convolutions=predicted.convolutions + step.convolutions,
            )

        def error(step: WearStep) -> Array:
            assert step.midway is not None
            ends = 0.5 * (state.surfaces.depth + step.state.surfaces.depth)
            return ends - step.midway + (0.0 if step.drift is None else step.drift)

        return _estimated(_Attempts(contact, attempt, error), self.control, state, most, left)


@dataclass(frozen=True)
class _Attempts:
    """A way to try a step of so many cycles, and the error that it adds, undamped ``(nx, ny)``."""

    contact: WearingContact
    attempt: Callable[[float], WearStep]
    error: Callable[[WearStep], Array]


def _estimated(
    attempts: _Attempts, control: ErrorControl | None, state: WearState, most: float, left: float
) -> WearStep:
    """A step with the error of the depth after it, tried again shorter until ``control`` agrees."""
    cycles = most if control is None else min(most, state.next_cycles)
    solves = convolutions = 0
    while True:
        step = attempts.attempt(cycles)
        solves, convolutions = solves + step.contact_solves, convolutions + step.convolutions
        # Nothing wears, and any length is stable, until an energy threshold is passed.
        stable = min(attempts.contact.stable_cycles(ends) for ends in (state, step.state))
        shortest = SHORTEST * stable if np.isfinite(stable) else 0.0
        raw = attempts.error(step)
        carried, added = attempts.contact.damped_errors([state.error, raw], state, cycles)
        fits, proposed = True, cycles
        if control is not None:
            fits, change = _judged(control, state, step, left, carried, added, raw)
            proposed = max(cycles * float(np.clip(change, SHRINKAGE, GROWTH)), shortest)
        if fits or cycles <= shortest:
            area = attempts.contact.grid.cell_area
            volume_error = state.volume_error + abs(float(raw.sum())) * area
            after = replace(
                step.state,
                error=carried + added,
                volume_error=volume_error,
                next_cycles=proposed,
            )
            return replace(step, state=after, contact_solves=solves, convolutions=convolutions)
        cycles = max(min(proposed, 0.5 * cycles), shortest)


def _judged(
    control: ErrorControl,
    state: WearState,
    step: WearStep,
    left: float,
    carried: Array,
    added: Array,
    raw: Array,
) -> tuple[bool, float]:
    """Whether a step's error will do, and the change of length that fills what it may be.

    ``carried`` and ``added`` are what is left of the error before and of the step's own ``raw``
    one. Wear presses no error of the volume away: of that each step gets its share.
    """
    depth = step.state.surfaces.depth
    worn = depth - state.surfaces.depth
    expected = depth + worn * max(left / step.cycles - 1.0, 0.0)
    tolerance = control.tolerance(depth, expected)
    bound = tolerance * root_mean_square(expected, depth)
    before, size, total = (root_mean_square(e, depth) for e in (carried, added, carried + added))
    volume, volume_room = abs(float(raw.sum())), tolerance * float(worn.sum())
    fits = (total <= bound or size <= LEAST_ROOM * bound) and volume <= volume_room
    # Errors of different steps lie in different places: their squares add up.
    taken = total if fits else before
    room = max(LEAST_ROOM * bound, np.sqrt(max(bound**2 - taken**2, 0.0)))
    changes = [GROWTH]
    if size > 0.0:
        changes.append(np.sqrt(SAFETY * room / size))
    if volume > 0.0:
        changes.append(SAFETY * volume_room / volume)
    return fits, min(changes)


def first_cycles(contact: WearingContact, state: WearState, total: float) -> float:
    """How far the first automatic step of a run of ``total`` cycles goes."""
    return min(FIRST_STEP * contact.stable_cycles(state), FIRST_SHARE * total)


@dataclass(frozen=True)
class Advance:
    """So many cycles in as many steps as they took: see :class:`WearStep`."""

    state: WearState
    steps: int
    contact_solves: int
    convolutions: int


def advance_cycles(
    stepper: Stepper, state: WearState, cycles: float, left: float, contact_at: ContactAt
) -> Advance:
    """Wear ``cycles`` cycles of the ``left`` ones of the run, in as many steps as it takes."""
    done, steps, solves, convolutions = 0.0, 0, 0, 0
    while cycles - done > ROUNDING * cycles:
        step = stepper.step(state, cycles - done, left - done, contact_at)
        state, done, steps = step.state, done + step.cycles, steps + 1
        solves, convolutions = solves + step.contact_solves, convolutions + step.convolutions
    return Advance(state, steps, solves, convolutions)
