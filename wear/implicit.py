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
    SAFETY,
    ComparingStepper,
    ErrorControl,
    root_mean_square,
)
from wear.stepping import WearingContact, WearState
from wear.worn import Spent, WearStep

ContactAt = Callable[[WearState], WearingContact]

TO_AND_FRO = 1.5
"""What the order of implicit steps over unlike increments comes to: between the second of what
these leave together and the first of each by itself."""

MOVING = 1.5
"""What the order of steps of second order comes to where surfaces move over each other: between the
second that they have at rest and the first of very short ones (:mod:`wear.stepping`)."""

SHORT = 0.25
"""A step that is shorter than so much of the one before it is none that the companion turns back
for: the two together would tell nothing of the longer one's error."""

SAME = 1e-9
"""Lengths that differ by so much of themselves are equal."""


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

    def _compared(
        self,
        state: WearState,
        cycles: float,
        contacts: tuple[WearingContact, WearingContact],
        at: ContactAt,
        last: bool,
    ) -> WearStep[WearState]:
        contact, with_companion = contacts
        if contact.sliding.passages is not None:
            return super()._compared(state, cycles, contacts, at, last)
        if self.alone:
            return _to_and_fro(state, cycles, contact, at)[0]
        order = TO_AND_FRO if np.isfinite(contact.comparable_cycles(state)) else 1.0
        companion = state.companion
        if last and companion.coarse is None:
            half = 0.5 * cycles
            begun, _ = _to_and_fro(state, half, contact, at)
            done, _ = _to_and_fro(begun.state, half, at(begun.state), at)
            whole, _ = _to_and_fro(companion, cycles, with_companion, at)
            done = replace(done, spent=begun.spent + done.spent)
        else:
            done, follows = _to_and_fro(state, cycles, contact, at)
            whole = _half_of_twice(companion, cycles, with_companion, follows)
            order = order if whole.state.coarse is None else 1.0
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


def _fits_to_and_fro(
    control: ErrorControl, before: WearState, after: WearState, to_go: float
) -> tuple[bool, float]:
    """What :func:`wear.steppers.judged` says, of all that steps have left so far.

    Half-way the companion is what a single way of twice the length makes of it, and says up to five
    times too much: it may be all that the tolerance allows, and the next step is as long.
    """
    half_way, changes, order = after.companion.coarse is not None, [GROWTH], after.order
    early = 1.0 if half_way else EARLY
    columns = (after.surfaces.depths, before.surfaces.depths, after.errors)
    for depth, depth_before, error in zip(*columns, strict=True):
        if not depth.any():
            continue
        expected = depth + (depth - depth_before) * (to_go - 1.0)
        tolerance = control.tolerance(depth, expected)
        ahead, so_far, left = (root_mean_square(field, depth) for field in (expected, depth, error))
        allowed = tolerance * (early * ahead + (1.0 - early) * so_far)
        for most, is_left in (
            (allowed, left),
            (tolerance * float(depth.sum()), abs(float(error.sum()))),
        ):
            if is_left > 0.0:
                changes.append(most / is_left)
    room = min(changes)
    if half_way:
        return room >= 1.0, 1.0 if room >= 1.0 else SAFETY * room
    return room >= 1.0, (SAFETY * room) ** (1.0 / order)


def _to_and_fro(
    state: WearState, cycles: float, contact: WearingContact, at: ContactAt
) -> tuple[WearStep[WearState], bool]:
    """A step over all increments and back, and whether slips follow from what it wears.

    Those half-way hold for all of it then.
    """
    half = 0.5 * cycles
    out = contact.implicit_step(state, half, back=True)
    middle, spent = at(out.state), out.spent
    follows = middle is not contact
    if follows:
        out = middle.implicit_step(replace(state, starts=out.state.starts), half, back=True)
        spent += out.spent
    back = middle.implicit_step(out.state, half)
    return WearStep(back.state, cycles, replace(spent + back.spent, steps=2)), follows


def _half_of_twice(
    companion: WearState, cycles: float, contact: WearingContact, follows: bool
) -> WearStep[WearState]:
    """Half of a step of the companion's, over as many ``cycles``: the way out, or that back.

    On its way it remembers where it has begun, as its own ``coarse``, and how far it has gone, as
    ``next_cycles``. The way out is gone again, as far as the way back, where the two lengths differ
    or slips follow from what it wears.
    """
    begun = companion.coarse
    if begun is None:
        out = contact.implicit_step(companion, cycles, back=True)
        return replace(out, state=replace(out.state, coarse=companion, next_cycles=cycles))
    gone = companion.next_cycles
    warm = replace(begun, starts=companion.starts)
    if cycles < SHORT * gone:
        out = contact.implicit_step(warm, gone + cycles, back=True)
        return replace(out, state=replace(out.state, coarse=begun, next_cycles=gone + cycles))
    half, spent = 0.5 * (gone + cycles), Spent()
    if follows or abs(cycles - gone) > SAME * gone:
        out = contact.implicit_step(warm, half, back=True)
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
