"""Wear steps of pads that vibrate: Heun's method, as long as its error and stability allow.

The depth per cycle r of the shape before and of the shape that it would lead to are both known:

    h' = h + ΔN r(h),    h + ΔN (r(h) + r(h'))/2.

The step taken is the second, of second order; the first, of first order, errs by about half the
difference of both rates, and that is what the length of a step is found by. Energies are averaged
like depths, so that volume and energy agree exactly. On the 121 nodes of a curved pad steps whose
first-order error was 10 % left an error of 1 % in the depth at first, and of 5e-5 in the worn form.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sa_solver.types import Array
from wear.steppers import GROWTH, ROUNDING, SAFETY, SHORTEST, SHRINKAGE, root_mean_square
from workflow.analyses.vibration_wear.pads import RubbedPads, WearingPads


@dataclass(frozen=True)
class PadState:
    """Pads after so many ``cycles``.

    They have lost the ``depth`` ``(j,)`` [mm] and dissipated an ``energy`` [N mm] in so many
    ``steps``, of whose errors ``worst`` was the largest; ``rubbed`` is how they move now, and
    ``next_cycles`` how far the next step may go.
    """

    cycles: float
    depth: Array
    energy: float
    rubbed: RubbedPads
    steps: int = 0
    next_cycles: float = np.inf
    worst: float = 0.0

    @classmethod
    def new(cls, pads: WearingPads) -> PadState:
        """Before the first cycle."""
        depth = np.zeros(pads.unworn.rig.joints)
        return cls(0.0, depth, 0.0, pads.at(depth))


@dataclass(frozen=True)
class Step:
    """A step of so many ``cycles``: the ``depth`` ``(j,)`` [mm] and ``energy`` [N mm] it adds.

    ``error`` is that of a first-order step, relative to what the step wears, both in root mean
    square; ``following`` the pads that such a step leads to.
    """

    cycles: float
    depth: Array
    energy: float
    error: float
    following: RubbedPads


def heun(pads: WearingPads, state: PadState, cycles: float) -> Step:
    """A step, its end not yet looked at. Raises what ``pads.at`` raises."""
    before = state.rubbed
    following = pads.at(state.depth + cycles * before.rate, before.motion)
    depth = 0.5 * cycles * (before.rate + following.rate)
    missed = 0.5 * cycles * (following.rate - before.rate)
    worn = root_mean_square(depth, depth)
    error = root_mean_square(missed, depth) / worn if worn > 0.0 else 0.0
    energy = 0.5 * cycles * float((before.energy + following.energy).sum())
    return Step(cycles, depth, energy, error, following)


def taken(pads: WearingPads, state: PadState, step: Step) -> PadState:
    """The pads after a step."""
    depth = state.depth + step.depth
    return replace(
        state,
        cycles=state.cycles + step.cycles,
        depth=depth,
        energy=state.energy + step.energy,
        rubbed=pads.at(depth, step.following.motion),
        steps=state.steps + 1,
        worst=max(state.worst, step.error),
    )


def worn_until(pads: WearingPads, state: PadState, cycles: float, tolerance: float) -> PadState:
    """The pads after so many ``cycles`` in all, the ``error`` of each step within ``tolerance``.

    Steps of a small share of the stable length are not tried again: something else is wrong then,
    which ``worst`` tells.
    """
    while cycles - state.cycles > ROUNDING * cycles:
        longest = state.rubbed.longest_step
        first = min(cycles - state.cycles, state.next_cycles, longest)
        step = heun(pads, state, first)
        while step.error > tolerance and step.cycles > SHORTEST * longest:
            step = heun(pads, state, step.cycles * _change(step, tolerance))
        further = step.cycles * _change(step, tolerance)
        if step.cycles == first:
            # It may have been cut short, by the end or by stability, not by its error.
            further = max(further, state.next_cycles if first < state.next_cycles else 0.0)
        state = replace(taken(pads, state, step), next_cycles=further)
    return state


def _change(step: Step, tolerance: float) -> float:
    """Of the length of a step, so that its error fills the tolerance."""
    if step.error == 0.0:
        return GROWTH
    return float(np.clip(SAFETY * tolerance / step.error, SHRINKAGE, GROWTH))
