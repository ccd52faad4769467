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

from wear.steps.step_errors import EARLY, SAFETY, ErrorControl, root_mean_square, steps_to_come
from wear.steps.steppers import ROUNDING, ComparingStepper, in_pairs
from wear.steps.stepping import WearingContact, WearState
from wear.worn import Spent, WearStep

ContactAt = Callable[[WearState], WearingContact]

TO_AND_FRO = 1.25
"""What the order of implicit steps over unlike increments comes to: between the second of what
these leave together and the first of each by itself."""

FOLLOWING = 1.75
"""The same where slips follow from wear: what steps leave of these is of second order."""

MOVING = 1.5
"""What the order of steps of second order comes to where surfaces move over each other: between the
second that they have at rest and the first of very short ones (:mod:`wear.steps.stepping`)."""

PAIRED_GROWTH, PAIRED_SHRINKAGE = 4.0, 0.5
"""Bounds of the change of length from one step of the companion's to the next. Steps that were too
long are not taken again: after steps much shorter their error would still be there, until what
follows has pressed it away."""

SHORT = 0.25
"""A step that is shorter than so much of the one before it is none that the companion turns back
for: the two together would tell nothing of the longer one's error."""


@dataclass(frozen=True)
class ImplicitStepper(ComparingStepper[WearState, WearingContact]):
    """Implicit Euler to and fro, in steps that ``control`` chooses, or as long as asked for.

    These may go ``alone``: no companion tells their error then. The last step of an odd number is
    two of half the length. Increments that are all alike wear in turn only, and so do those of
    surfaces that move over each other. There the last step is of second order: long ones of first
    order wear edges at which pressure peaks, up to twice as high as what is left of it by short
    ones.
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

    def _following(
        self, contact: WearingContact, after: WearState, proposed: float, left: float
    ) -> float:
        """An even number of them: the last of an odd one costs as much as two."""
        if after.half_way or not left > 0.0 or _in_turn(contact, after):
            return proposed
        return in_pairs(proposed, left)

    def _compared(
        self,
        state: WearState,
        cycles: float,
        contacts: tuple[WearingContact, Callable[[], WearingContact]],
        at: ContactAt,
        last: bool,
    ) -> WearStep[WearState]:
        contact, with_companion = contacts
        companion = state.companion
        if _in_turn(contact, state):
            if state.half_way:
                # It has worn as long as the others, and goes on from where it is.
                state = replace(state, coarse=replace(companion, coarse=None))
            return super()._compared(state, cycles, contacts, at, last)
        if self.alone:
            return _to_and_fro(state, cycles, contact, at)[0]
        length = cycles
        if last and companion.coarse is None:
            length = 0.5 * cycles
            begun, middle = _to_and_fro(state, length, contact, at)
            done, _ = _to_and_fro(begun.state, length, at(begun.state), at)
            whole, _ = _to_and_fro(companion, cycles, contact, at)
            done = replace(done, spent=begun.spent + done.spent)
        else:
            done, middle = _to_and_fro(state, cycles, contact, at)
            if companion.coarse is None:
                whole = _out(companion, cycles, contact, begun=state)
            else:
                half_way = with_companion()
                whole = _back(companion, cycles, half_way, at, half_way is not contact, last)
        follows = middle is not contact
        order = FOLLOWING if follows else 1.0
        if whole.state.coarse is None:
            order = _order_of(length, contact.comparable_cycles(state), follows)
        after = replace(done.state, order=order, coarse=whole.state)
        spent = replace(done.spent + whole.spent, steps=done.spent.steps)
        return WearStep(after, cycles, spent)

    def _judged(
        self,
        contact: WearingContact,
        control: ErrorControl,
        ends: tuple[WearState, WearState],
        cycles: float,
        left: float,
    ) -> tuple[bool, float]:
        before, after = ends
        if _in_turn(contact, before):
            return super()._judged(contact, control, ends, cycles, left)
        to_go, begun = steps_to_come(before, after, cycles, left), before.companion.coarse
        if after.half_way:
            room = _room_half_way(control, before, after, to_go)
            if room < 1.0:
                return False, SAFETY * room
            return True, after.companion.next_cycles / cycles
        room = _room(control, before, after, to_go)
        change = (SAFETY * room) ** (1.0 / TO_AND_FRO)
        if begun is None:
            return room >= 1.0, change
        # The two steps that have made the companion's are not taken again.
        least = 1.0 if _less_wrong(begun, after) else PAIRED_SHRINKAGE
        whole = before.companion.next_cycles + cycles
        return True, 0.5 * whole / cycles * min(max(change, least), PAIRED_GROWTH)


def _in_turn(contact: WearingContact, state: WearState) -> bool:
    """Whether increments wear in turn only: on surfaces that move over each other, or all alike."""
    alike = not np.isfinite(contact.comparable_cycles(state))
    return alike or contact.sliding.passages is not None


def _order_of(cycles: float, comparable: float, follows: bool) -> float:
    """Of the error of steps of so many ``cycles``, as those of twice the length tell it.

    That of steps of w ΔN = x λ is about (x/(1 + x))^p (``comparable_cycles``): p = log2 of what it
    grows by falls as they get long.
    """
    x = cycles / comparable
    order = FOLLOWING if follows else TO_AND_FRO
    return order * float(np.log2(2.0 * (1.0 + x) / (1.0 + 2.0 * x)))


def _less_wrong(before: WearState, after: WearState) -> bool:
    """Whether what wear has pressed away of errors is more than what has come to them."""
    sizes = ([root_mean_square(e, e) for e in state.errors] for state in (before, after))
    return all(now <= then for then, now in zip(*sizes, strict=True))


def _room(control: ErrorControl, before: WearState, after: WearState, to_go: float) -> float:
    """How many times its error a state may have: of depth :data:`EARLY` more than its share.

    ``to_go`` are the steps like this one that are to come, this one included.
    """
    room = np.inf
    columns = (after.surfaces.depths, before.surfaces.depths, after.errors)
    for depth, depth_before, error in zip(*columns, strict=True):
        expected = depth + (depth - depth_before) * (to_go - 1.0)
        ahead, so_far, left = (root_mean_square(field, depth) for field in (expected, depth, error))
        most, volume = EARLY * ahead + (1.0 - EARLY) * so_far, float(depth.sum())
        tolerance = control.tolerance(depth, expected)
        room = min(room, tolerance * _ratio(most, left), tolerance * _ratio(volume, error.sum()))
    return room


def _room_half_way(
    control: ErrorControl, before: WearState, after: WearState, to_go: float
) -> float:
    """The same after a step whose companion has gone but one way, of what that step adds to it.

    That may be the tolerance: of what increments miss each by itself it is half of that when the
    companion is back, and of what they miss together several times as much.
    """
    room = np.inf
    columns = (after.surfaces.depths, before.surfaces.depths, after.errors, before.errors)
    for depth, depth_before, error, error_before in zip(*columns, strict=True):
        expected = depth + (depth - depth_before) * (to_go - 1.0)
        missed, tolerance = error - error_before, control.tolerance(depth, expected)
        ahead, added = (root_mean_square(field, depth) for field in (expected, missed))
        volume = _ratio(float(expected.sum()), missed.sum())
        room = min(room, tolerance * _ratio(ahead, added), tolerance * volume)
    return room


def _ratio(size: float, error: float) -> float:
    return size / abs(error) if error else np.inf


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


def _out(
    companion: WearState, cycles: float, contact: WearingContact, begun: WearState
) -> WearStep[WearState]:
    """The way out of a step of the companion's, over as many ``cycles``.

    It remembers the state that both have ``begun`` from, with its companion, as its own ``coarse``,
    and how far it has gone, as ``next_cycles``.
    """
    out = contact.implicit_step(companion, cycles, back=True)
    from_there = replace(begun, starts={})
    if begun.coarse is not None:
        from_there = replace(from_there, coarse=replace(begun.coarse, starts={}))
    return replace(out, state=replace(out.state, coarse=from_there, next_cycles=cycles))


def _back(
    companion: WearState,
    cycles: float,
    contact: WearingContact,
    at: ContactAt,
    follows: bool,
    last: bool,
) -> WearStep[WearState]:
    """The way back of such a step, ``contact`` being that where the way out has ended.

    The way out is gone again with the slips found there if these follow from what wears, and where
    that was not half of the way.
    """
    both, gone = companion.coarse, companion.next_cycles
    assert both is not None
    begun = replace(both.companion, starts=companion.starts, coarse=None)
    if cycles < SHORT * gone and not last:
        return _out(begun, gone + cycles, contact, both)
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
    """Second order, also where slip changes with wear; fields as in :class:`ImplicitStepper`.

    Where increments are all alike, on surfaces at rest, the last step is implicit Euler. The first
    stage of one of second order wears a contact that has hardly grown, and leaves a rim to the
    second at which pressure peaks, on a cylinder worn to conformity up to twice as high as it is.
    One step of first order leaves an error of second order in all.
    """

    def _advance(
        self, state: WearState, cycles: float, contact: WearingContact, at: ContactAt, last: bool
    ) -> WearStep[WearState]:
        if last and contact.sliding.passages is None and _in_turn(contact, state):
            return contact.implicit_step(state, cycles)
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
