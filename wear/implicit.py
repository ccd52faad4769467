"""Wear steps that solve a half-space contact on the way: implicit Euler, and of second order.

Increments that wear one after the other leave most of what a step misses: each finds the surfaces
that the ones before it have worn, and the last one decides what they look like. So implicit steps
go over them in reverse order for half their length and back for the other half, which leaves only
what is of second order in it (Strang 1968, doi:10.1137/0705041), and of first order what implicit
Euler misses of each increment by itself, the less the more of them there are.

The companion that tells their error takes one step of twice the length meanwhile: the way out in
one step, the way back in the next one, at the price of half as many contact problems.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wear.steppers import (
    EARLY,
    GROWTH,
    ROUNDING,
    SAFETY,
    ComparingStepper,
    ErrorControl,
    root_mean_square,
)
from wear.stepping import WearingContact, WearState
from wear.worn import Spent, WearStep

ContactAt = Callable[[WearState], WearingContact]

TO_AND_FRO = 1.25
"""What the order of implicit steps over unlike increments comes to: between the second of what
these leave together and the first of each by itself."""

FOLLOWING = 1.75
"""The same where slips follow from wear: what steps leave of these is of second order."""

MOVING = 1.5
"""What the order of steps of second order comes to where surfaces move over each other: between the
second that they have at rest and the first of very short ones (:mod:`wear.stepping`)."""

HALF_WAY = 2.0
"""Share of the tolerance that the companion may be off by when it has gone but one way: five to ten
times as much as it is off by when it is back."""

SHORT = 0.25
"""A step that is shorter than so much of the one before it is none that the companion turns back
for: the two together would tell nothing of the longer one's error."""


@dataclass(frozen=True)
class ImplicitStepper(ComparingStepper[WearState, WearingContact]):
    """Implicit Euler to and fro, in steps that ``control`` chooses, or as long as asked for.

    These may go ``alone``: no companion tells their error then. The last step of an odd number is
    two of half the length. Where surfaces move over each other increments wear in turn only, and
    the last step is of second order: long ones of first order wear edges at which pressure peaks,
    up to twice as high as what is left of it by short ones.
    """

    def _advance(
        self, state: WearState, cycles: float, contact: WearingContact, at: ContactAt, last: bool
    ) -> WearStep[WearState]:
        if last and contact.sliding.passages is not None:
            return _second_order(state, cycles, contact, at)
        return contact.implicit_step(state, cycles)

    def _order(self, contact: WearingContact) -> float:
        return 1.0

    def _share(self, most: float, longest: float) -> float:
        """Steps of one length: the companion turns back after as many cycles as it has gone."""
        return most / max(1.0, float(np.ceil(most / longest * (1.0 - ROUNDING))))

    def _compared(
        self,
        state: WearState,
        cycles: float,
        contacts: tuple[WearingContact, Callable[[], WearingContact]],
        at: ContactAt,
        last: bool,
    ) -> WearStep[WearState]:
        contact, with_companion = contacts
        if contact.sliding.passages is not None:
            return super()._compared(state, cycles, contacts, at, last)
        if self.alone:
            return _to_and_fro(state, cycles, contact, at)[0]
        companion = state.companion
        if last and companion.coarse is None:
            half = 0.5 * cycles
            begun, middle = _to_and_fro(state, half, contact, at)
            done, _ = _to_and_fro(begun.state, half, at(begun.state), at)
            whole, _ = _to_and_fro(companion, cycles, with_companion(), at)
            done = replace(done, spent=begun.spent + done.spent)
        else:
            done, middle = _to_and_fro(state, cycles, contact, at)
            if companion.coarse is None:
                whole = _out(companion, cycles, with_companion())
            else:
                follows = middle is not contact
                whole = _back(companion, cycles, with_companion(), at, follows)
        order = 1.0
        if whole.state.coarse is None:
            order = _order_of(cycles, contact.comparable_cycles(state), middle is not contact)
        after = replace(done.state, order=order, coarse=whole.state)
        return WearStep(after, cycles, replace(done.spent + whole.spent, steps=2))

    def _judged(
        self,
        contact: WearingContact,
        control: ErrorControl,
        before: WearState,
        after: WearState,
        to_go: float,
    ) -> tuple[bool, float]:
        if contact.sliding.passages is not None:
            return super()._judged(contact, control, before, after, to_go)
        return _fits_to_and_fro(control, before, after, to_go)


def _order_of(cycles: float, comparable: float, follows: bool) -> float:
    """Of the error of steps of so many ``cycles``, as those of twice the length tell it.

    That of steps of w ΔN = x λ is about (x/(1 + x))^p (``comparable_cycles``): p = log2 of what it
    grows by falls as they get long. Increments that are all alike leave that of implicit Euler.
    """
    if not np.isfinite(comparable):
        return 1.0
    x = cycles / comparable
    order = FOLLOWING if follows else TO_AND_FRO
    return order * float(np.log2(2.0 * (1.0 + x) / (1.0 + 2.0 * x)))


def _fits_to_and_fro(
    control: ErrorControl, before: WearState, after: WearState, to_go: float
) -> tuple[bool, float]:
    """What :func:`wear.steppers.judged` says, of all that steps have left so far.

    Half-way the companion has gone but one way: what it says is too much (:data:`HALF_WAY`), and
    the next step is as long. That one is not taken again, as it was the first that was too long;
    only the next two are shorter.
    """
    begun, half_way = (state.companion.coarse is not None for state in (before, after))
    changes = [GROWTH]
    columns = (after.surfaces.depths, before.surfaces.depths, after.errors)
    for depth, depth_before, error in zip(*columns, strict=True):
        if not depth.any():
            continue
        expected = depth + (depth - depth_before) * (to_go - 1.0)
        tolerance = control.tolerance(depth, expected)
        ahead, so_far, left = (root_mean_square(field, depth) for field in (expected, depth, error))
        volume, missed = float(depth.sum()), abs(float(error.sum()))
        if half_way:
            bounds = (HALF_WAY * ahead, left), (HALF_WAY * float(expected.sum()), missed)
        else:
            bounds = (EARLY * ahead + (1.0 - EARLY) * so_far, left), (volume, missed)
        for most, is_left in bounds:
            if is_left > 0.0:
                changes.append(tolerance * most / is_left)
    room = min(changes)
    if half_way:
        return begun or room >= 1.0, 1.0 if room >= 1.0 else SAFETY * room
    return begun or room >= 1.0, (SAFETY * room) ** (1.0 / TO_AND_FRO)


def _to_and_fro(
    state: WearState, cycles: float, contact: WearingContact, at: ContactAt
) -> tuple[WearStep[WearState], WearingContact]:
    """A step over all increments and back, and the contact half-way.

    It is another one where slips follow from what wears, and holds for all of the step then.
    """
    half = 0.5 * cycles
    out = contact.implicit_step(state, half, back=True)
    middle, spent = at(out.state), out.spent
    if middle is not contact:
        out = middle.implicit_step(replace(state, starts=out.state.starts), half, back=True)
        spent += out.spent
    back = middle.implicit_step(out.state, half)
    return WearStep(back.state, cycles, replace(spent + back.spent, steps=2)), middle


def _out(companion: WearState, cycles: float, contact: WearingContact) -> WearStep[WearState]:
    """The way out of a step of the companion's, over as many ``cycles``.

    It remembers where it has begun, as its own ``coarse``, and how far it has gone, as
    ``next_cycles``.
    """
    out = contact.implicit_step(companion, cycles, back=True)
    begun = replace(companion, coarse=None)
    return replace(out, state=replace(out.state, coarse=begun, next_cycles=cycles))


def _back(
    companion: WearState, cycles: float, contact: WearingContact, at: ContactAt, follows: bool
) -> WearStep[WearState]:
    """The way back of such a step, ``contact`` being that where the way out has ended.

    The way out is gone again with the slips found there if these follow from what wears, and where
    that was not half of the way.
    """
    assert companion.coarse is not None
    gone, begun = companion.next_cycles, replace(companion.coarse, starts=companion.starts)
    if cycles < SHORT * gone:
        return _out(begun, gone + cycles, contact)
    unequal, half, spent = abs(cycles - gone) > ROUNDING * gone, 0.5 * (gone + cycles), Spent()
    if unequal and follows:
        return _to_and_fro(begun, gone + cycles, at(begun), at)[0]
    if unequal or follows:
        out = contact.implicit_step(begun, half, back=True)
        companion, spent = out.state, out.spent
    back = contact.implicit_step(replace(companion, coarse=None), half)
    return replace(back, spent=spent + back.spent)


@dataclass(frozen=True)
class SecondOrderStepper(ComparingStepper[WearState, WearingContact]):
    """Second order, also where slip changes with wear; fields as in :class:`ImplicitStepper`."""

    def _advance(
        self, state: WearState, cycles: float, contact: WearingContact, at: ContactAt, last: bool
    ) -> WearStep[WearState]:
        return _second_order(state, cycles, contact, at)

    def _order(self, contact: WearingContact) -> float:
        return 2.0 if contact.sliding.passages is None else MOVING


def _second_order(
    state: WearState, cycles: float, contact: WearingContact, contact_at: ContactAt
) -> WearStep[WearState]:
    """So many cycles by a step of second order, also where slip changes with wear.

    A contact whose slips come from the half-space is worn once with those of the start, and again
    with the mean of those and the ones at its end.
    """
    step = contact.second_order_step(state, cycles)
    following = contact_at(step.state)
    if following is contact:
        return step
    predicted, step = step, contact.midway(following).second_order_step(state, cycles)
    return replace(step, spent=predicted.spent + step.spent)
