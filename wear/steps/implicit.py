"""Wear steps that solve a half-space contact within the step: implicit Euler and second order.

Increments that wear one after the other cause most of the error of a step: each finds the surfaces
worn by those before it, and the last one determines the final shape. An implicit step therefore
takes the increments in reverse order over half its length, and in forward order over the other half
(Strang splitting, 1968, doi:10.1137/0705041). This leaves an error of second order from the
interaction of increments, and one of first order from implicit Euler in each single increment,
which is the smaller the more increments there are.

The coarse companion that shows this error takes one step of twice the length in the same time: the
reverse half during one step, the forward half during the next. It costs half as many contact
problems.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wear.steps.step_errors import (
    EARLY_SHARE,
    SAFETY,
    ErrorControl,
    root_mean_square,
    steps_to_come,
)
from wear.steps.steppers import ROUNDING, ComparingStepper, in_pairs
from wear.steps.stepping import WearingContact, WearState
from wear.worn import Cost, WearStep

ContactAt = Callable[[WearState], WearingContact]

STRANG_ORDER = 1.25
"""Effective order of implicit steps over dissimilar increments: between second order of their
interaction and first order of each increment by itself.
"""

FOLLOWING_ORDER = 1.75
"""Effective order where slips follow from wear: the error of the slips is of second order."""

MOVING_ORDER = 1.5
"""Effective order of second-order steps where surfaces move over each other: between the second
order at rest and the first order of very short steps (:mod:`wear.steps.stepping`).
"""

PAIRED_GROWTH, PAIRED_SHRINKAGE = 4.0, 0.5
"""Bounds of the change of length from one step of the companion to the next. Steps that were too
long are not repeated, and a sudden change to much shorter steps would not help: the error would
remain until later wear presses it away.
"""

SHORT_STEP = 0.25
"""A step shorter than this share of the one before does not complete a step of the companion. Two
such unequal steps would not show the error of the longer one.
"""


@dataclass(frozen=True)
class ImplicitStepper(ComparingStepper[WearState, WearingContact]):
    """Implicit Euler with Strang splitting, in steps of chosen or given length.

    The steps have the length that ``control`` chooses, or that the caller asks for. With ``alone``
    there is no coarse companion, so that the error is unknown. The last step of an odd number is
    taken as two of half the length. Increments that are all the same, and those of surfaces that
    move over each other, wear in forward order only. On surfaces that move over each other the last
    step is of second order: long steps of first order wear edges at which the pressure peaks, up to
    twice as high as the peaks that short steps leave.
    """

    def _advance(
        self, state: WearState, cycles: float, contact: WearingContact, at: ContactAt, last: bool
    ) -> WearStep[WearState]:
        if last and contact.sliding.passages is not None:
            return _second_order(state, cycles, contact, at)
        return contact.implicit_step(state, cycles)

    def _order(self, contact: WearingContact) -> float:
        return 1.0

    def _length(self, most: float, longest: float) -> float:
        """Return equal lengths: the companion's two halves have the same number of cycles."""
        return most / max(1.0, float(np.ceil(most / longest * (1.0 - ROUNDING))))

    def _next_length(
        self, contact: WearingContact, after: WearState, proposed: float, left: float
    ) -> float:
        """Return a length that gives an even number of steps; an odd last one costs double."""
        if after.half_way or not left > 0.0 or _forward_only(contact, after):
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
        contact, contact_of_coarse_run = contacts
        coarse_run = state.coarse_run
        if _forward_only(contact, state):
            if state.half_way:
                # The half done is a complete step in forward order: continue from its state.
                state = replace(state, coarse=replace(coarse_run, coarse=None))
            return super()._compared(state, cycles, contacts, at, last)
        if self.alone:
            return _strang_step(state, cycles, contact, at)[0]
        length = cycles
        if last and coarse_run.coarse is None:
            length = 0.5 * cycles
            begun, middle = _strang_step(state, length, contact, at)
            done, _ = _strang_step(begun.state, length, at(begun.state), at)
            whole, _ = _strang_step(coarse_run, cycles, contact, at)
            done = replace(done, cost=begun.cost + done.cost)
        else:
            done, middle = _strang_step(state, cycles, contact, at)
            if coarse_run.coarse is None:
                whole = _first_half(coarse_run, cycles, contact, begun=state)
            else:
                half_way = contact_of_coarse_run()
                whole = _second_half(
                    coarse_run, cycles, half_way, at, half_way is not contact, last
                )
        follows = middle is not contact
        order = FOLLOWING_ORDER if follows else 1.0
        if whole.state.coarse is None:
            order = _apparent_order(length, contact.comparable_cycles(state), follows)
        after = replace(done.state, order=order, coarse=whole.state)
        cost = replace(done.cost + whole.cost, steps=done.cost.steps)
        return WearStep(after, cycles, cost)

    def _assess(
        self,
        contact: WearingContact,
        control: ErrorControl,
        ends: tuple[WearState, WearState],
        cycles: float,
        left: float,
    ) -> tuple[bool, float]:
        before, after = ends
        if _forward_only(contact, before):
            return super()._assess(contact, control, ends, cycles, left)
        to_go, begun = steps_to_come(before, after, cycles, left), before.coarse_run.coarse
        if after.half_way:
            room = _error_margin_half_way(control, before, after, to_go)
            if room < 1.0:
                return False, SAFETY * room
            return True, after.coarse_run.next_cycles / cycles
        room = _error_margin(control, before, after, to_go)
        change = (SAFETY * room) ** (1.0 / STRANG_ORDER)
        if begun is None:
            return room >= 1.0, change
        # The two steps that make up the companion's step are not repeated.
        least = 1.0 if _error_fell(begun, after) else PAIRED_SHRINKAGE
        whole = before.coarse_run.next_cycles + cycles
        return True, 0.5 * whole / cycles * min(max(change, least), PAIRED_GROWTH)


def _forward_only(contact: WearingContact, state: WearState) -> bool:
    """Return whether increments wear in forward order only.

    They do on surfaces that move over each other, and where all increments are the same.
    """
    alike = not np.isfinite(contact.comparable_cycles(state))
    return alike or contact.sliding.passages is not None


def _apparent_order(cycles: float, comparable: float, follows: bool) -> float:
    """Return the apparent order of the error of steps of ``cycles``, as the companion shows it.

    The error of steps with w ΔN = x λ is about (x/(1 + x))^p (``comparable_cycles``). The log2 of
    its growth over a doubled step is the apparent order, which falls as steps get long.
    """
    x = cycles / comparable
    order = FOLLOWING_ORDER if follows else STRANG_ORDER
    return order * float(np.log2(2.0 * (1.0 + x) / (1.0 + 2.0 * x)))


def _error_fell(before: WearState, after: WearState) -> bool:
    """Return whether wear has pressed away more of the errors than the step has added."""
    sizes = ([root_mean_square(e, e) for e in state.errors] for state in (before, after))
    return all(now <= then for then, now in zip(*sizes, strict=True))


def _error_margin(
    control: ErrorControl, before: WearState, after: WearState, to_go: float
) -> float:
    """Return the allowed error of a state over its estimated error.

    Of the depth's error the share :data:`EARLY_SHARE` is allowed at once, the rest as the depth
    grows; ``to_go`` is the number of such steps that are left, this one included.
    """
    room = np.inf
    columns = (after.surfaces.depths, before.surfaces.depths, after.errors)
    for depth, depth_before, error in zip(*columns, strict=True):
        expected = depth + (depth - depth_before) * (to_go - 1.0)
        ahead, so_far, left = (root_mean_square(field, depth) for field in (expected, depth, error))
        most, volume = EARLY_SHARE * ahead + (1.0 - EARLY_SHARE) * so_far, float(depth.sum())
        tolerance = control.tolerance(depth, expected)
        room = min(room, tolerance * _ratio(most, left), tolerance * _ratio(volume, error.sum()))
    return room


def _error_margin_half_way(
    control: ErrorControl, before: WearState, after: WearState, to_go: float
) -> float:
    """Return the allowed over the added error of a step after which the companion is half-way.

    The error that the step adds may be the whole tolerance. For the error of single increments, the
    estimate at this point is half of that after the companion's complete step; for the error of
    their interaction it is several times that.
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


def _strang_step(
    state: WearState, cycles: float, contact: WearingContact, at: ContactAt
) -> tuple[WearStep[WearState], WearingContact]:
    """Take a step in reverse and in forward order; also return the contact in the middle.

    That contact is another one where slips follow from wear. It is then used for the whole step.
    """
    half = 0.5 * cycles
    out = contact.implicit_step(state, half, back=True)
    middle, cost = at(out.state), out.cost
    if middle is not contact:
        out = middle.implicit_step(replace(state, starts=out.state.starts), half, back=True)
        cost += out.cost
    back = middle.implicit_step(out.state, half)
    return WearStep(back.state, cycles, replace(cost + back.cost, steps=2)), middle


def _first_half(
    coarse_run: WearState, cycles: float, contact: WearingContact, begun: WearState
) -> WearStep[WearState]:
    """Take the first half of a step of the companion, over ``cycles``.

    The result stores in ``coarse`` the state from which both have ``begun``, with its companion,
    and in ``next_cycles`` its own length.
    """
    out = contact.implicit_step(coarse_run, cycles, back=True)
    from_there = replace(begun, starts={})
    if begun.coarse is not None:
        from_there = replace(from_there, coarse=replace(begun.coarse, starts={}))
    return replace(out, state=replace(out.state, coarse=from_there, next_cycles=cycles))


def _second_half(
    coarse_run: WearState,
    cycles: float,
    contact: WearingContact,
    at: ContactAt,
    follows: bool,
    last: bool,
) -> WearStep[WearState]:
    """Take the second half of such a step; ``contact`` is that at the end of the first half.

    The first half is repeated with the slips found there if these follow from wear, and with
    another length if both halves were unequal.
    """
    both, gone = coarse_run.coarse, coarse_run.next_cycles
    assert both is not None
    begun = replace(both.coarse_run, starts=coarse_run.starts, coarse=None)
    if cycles < SHORT_STEP * gone and not last:
        return _first_half(begun, gone + cycles, contact, both)
    unequal, half, cost = abs(cycles - gone) > ROUNDING * gone, 0.5 * (gone + cycles), Cost()
    if unequal and follows:
        return _strang_step(begun, gone + cycles, at(begun), at)[0]
    if unequal or follows:
        out = contact.implicit_step(begun, half, back=True)
        coarse_run, cost = out.state, out.cost
    back = contact.implicit_step(replace(coarse_run, coarse=None), half)
    return replace(back, cost=cost + back.cost)


@dataclass(frozen=True)
class SecondOrderStepper(ComparingStepper[WearState, WearingContact]):
    """Steps of second order, also where slip changes with wear.

    The fields are those of :class:`ImplicitStepper`. Where increments are all the same, on surfaces
    at rest, the last step is implicit Euler. The first stage of a second-order step wears a contact
    that has hardly grown, and leaves to the second stage a rim at which the pressure peaks: on a
    cylinder worn to conformity up to twice as high as it should be. A single step of first order
    adds an error of second order to the run.
    """

    def _advance(
        self, state: WearState, cycles: float, contact: WearingContact, at: ContactAt, last: bool
    ) -> WearStep[WearState]:
        if last and contact.sliding.passages is None and _forward_only(contact, state):
            return contact.implicit_step(state, cycles)
        return _second_order(state, cycles, contact, at)

    def _order(self, contact: WearingContact) -> float:
        return 2.0 if contact.sliding.passages is None else MOVING_ORDER


def _second_order(
    state: WearState, cycles: float, contact: WearingContact, contact_at: ContactAt
) -> WearStep[WearState]:
    """Take a step of second order, also where slip changes with wear.

    A contact whose slips come from the half-space is worn once with the slips at the start, and
    again with their mean with the slips at the end.
    """
    step = contact.second_order_step(state, cycles)
    following = contact_at(step.state)
    if following is contact:
        return step
    predicted, step = step, contact.midway(following).second_order_step(state, cycles)
    return replace(step, cost=predicted.cost + step.cost)
