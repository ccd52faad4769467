"""What small deviations from a periodic motion do to joints, increment by increment.

A joint remembers numbers s ``(p,)``. Along an increment of a known motion small deviations of what
it remembers, δs, and of its displacement at the beginning and the end, δu, go on linearly,

    δs_end = A δs + E δu + D δu_end,        δF_end = S δs_end + T δu_end,

exactly, with whatever happens within the increment. From these maps whoever integrates the
structure knows whether deviations grow: the memory is part of the state, of which a slider that
slips keeps nothing, and one that sticks everything.

What is remembered is the stretch of the spring, of sliders and contacts; of joints of spread
sliders the force, and displacement and force of each turning point that is open; of elastic joints
nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign
from typing import NamedTuple

import numpy as np

from sa_solver.types import Array, Indices
from wear.joints.compiled import compiled
from wear.joints.elastic import STOP, elastic_force
from wear.joints.friction_path import advance_slopes, contact_of, pressing
from wear.joints.masing import DEPTH, DISPLACEMENT, POINTS, advance_masing, turns
from wear.joints.periodic.contact import (
    MARCHED,
    Stretch,
    increment_of,
    led_in,
    sticks_throughout,
)
from wear.joints.periodic.sliders import (
    CURVE_PERIODS,
    JENKINS,
    DrivenJoints,
    move_slider,
    slider_of,
)

# What a joint does in an increment; where it changes, so does what follows from a deviation.
STICKS, SLIPS, SLIPS_BACK, IS_APART, TOUCHES = 0, 1, 2, 3, 4


@dataclass(frozen=True)
class LinearisedMarch:
    """The maps of ``t`` increments of ``j`` joints of ``d`` directions that remember ``p`` numbers.

    The first increment leads from the first sample to the second, the last to the first again.
    ``kept`` A ``(t, j, p, p)``, ``by_start`` E and ``by_end`` D ``(t, j, p, d)``, ``pull`` S
    ``(j, d, p)`` and ``tangent`` T ``(t, j, d, d)`` as in the module; ``regimes`` ``(t, j)`` are
    whole numbers that change from an increment to the next where the joint does something else.
    ``force`` ``(t, j, d)`` [N] is that of the motion itself, at each sample.
    A joint that remembers less than others has ``remembered`` ``(j,)`` numbers: the further ones
    have no part in it, and stay as they are.
    """

    kept: Array
    by_start: Array
    by_end: Array
    pull: Array
    tangent: Array
    regimes: np.ndarray
    force: Array
    remembered: Indices

    @classmethod
    def of(cls, maps: Maps) -> LinearisedMarch:
        """Of joints that remember equally many numbers."""
        joints, _, memory = maps.pull.shape
        return cls(*maps, np.full(joints, memory))


class Maps(NamedTuple):
    """:class:`LinearisedMarch` as compiled functions write it."""

    kept: Array
    by_start: Array
    by_end: Array
    pull: Array
    tangent: Array
    regimes: np.ndarray
    force: Array

    @classmethod
    def room(cls, samples: int, joints: int, memory: int, directions: int) -> Maps:
        """Zeros for so many increments, joints, numbers of memory and directions."""
        of_memory = (samples, joints, memory)
        return cls(
            np.zeros((*of_memory, memory)),
            np.zeros((*of_memory, directions)),
            np.zeros((*of_memory, directions)),
            np.zeros((joints, directions, memory)),
            np.zeros((samples, joints, directions, directions)),
            np.zeros((samples, joints), np.int32),
            np.zeros((samples, joints, directions)),
        )


@compiled(nogil=True, error_model="numpy")
def linearise_sliders(joints: DrivenJoints, maps: Maps) -> None:
    """Of Jenkins's and Bouc-Wen's joints that have settled."""
    for j in range(len(joints.parameters)):
        joint, path = joints.parameters[j], joints.path[j]
        slider, stretch = slider_of(joint), joints.settled[j, 0]
        maps.pull[j, 0, 0] = slider.spring
        for step in range(len(path)):
            at = (step + 1) % len(path)
            increment = path[at] - path[step]
            stretch, kept, follows, _ = move_slider(slider, stretch, increment)
            maps.force[at, j, 0] = slider.spring * stretch + joint[2] * path[at]
            maps.kept[step, j, 0, 0] = kept
            maps.by_start[step, j, 0, 0], maps.by_end[step, j, 0, 0] = -follows, follows
            maps.tangent[step, j, 0, 0] = joint[2]
            sticks = joint[0] == JENKINS and follows > 0.0
            way = SLIPS if increment > 0.0 else SLIPS_BACK
            maps.regimes[step, j] = STICKS if sticks else way


@compiled(nogil=True, error_model="numpy")
def linearise_elastic(joints: DrivenJoints, maps: Maps) -> None:
    """Of joints that remember nothing."""
    for j in range(len(joints.parameters)):
        joint, path = joints.parameters[j], joints.path[j]
        for step in range(len(path)):
            after = (step + 1) % len(path)
            at = path[after]
            force, slope, state = elastic_force(joint, at)
            maps.force[after, j, 0], maps.tangent[step, j, 0, 0] = force, slope
            # Of a stop, which of two sides is pressed counts too.
            if joint[0] == STOP:
                maps.regimes[step, j] = IS_APART if state else int(copysign(1.0, at))


@compiled(nogil=True, error_model="numpy")
def linearise_contacts(joints: DrivenJoints, maps: Maps) -> None:
    """Of contacts that have settled."""
    for j in range(len(joints.parameters)):
        contact, path = contact_of(joints.parameters[j]), joints.path[j]
        stretch = Stretch(joints.settled[j, 0], joints.settled[j, 1])
        if joints.settled[j, 3] != MARCHED:
            stretch = led_in(contact, joints.before[j])
        limit_slope = contact.friction * contact.normal_stiffness / contact.stiffness
        maps.pull[j, 0, 0] = maps.pull[j, 1, 1] = contact.stiffness
        for step in range(len(path)):
            at = (step + 1) % len(path)
            way = increment_of(contact, stretch, path, step, at)
            x, y, of_x, of_y = advance_slopes(way)
            stretch = Stretch(x / contact.stiffness, y / contact.stiffness)
            maps.force[at, j, 0], maps.force[at, j, 1] = x, y
            maps.force[at, j, 2] = max(pressing(contact, path[at, 2]), 0.0)
            for row, of in enumerate((of_x, of_y)):
                maps.kept[step, j, row, 0] = of.force_x
                maps.kept[step, j, row, 1] = of.force_y
                maps.by_start[step, j, row, 0], maps.by_end[step, j, row, 0] = -of.pull_x, of.pull_x
                maps.by_start[step, j, row, 1], maps.by_end[step, j, row, 1] = -of.pull_y, of.pull_y
                maps.by_start[step, j, row, 2] = limit_slope * of.start
                maps.by_end[step, j, row, 2] = limit_slope * of.end
            if pressing(contact, path[at, 2]) <= 0.0:
                maps.regimes[step, j] = IS_APART
                continue
            maps.tangent[step, j, 2, 2] = contact.normal_stiffness
            if pressing(contact, path[step, 2]) <= 0.0:
                maps.regimes[step, j] = TOUCHES
            else:
                maps.regimes[step, j] = STICKS if sticks_throughout(of_x, of_y) else SLIPS


@compiled(nogil=True, error_model="numpy")
def linearise_curves(lead: int, joints: DrivenJoints, maps: Maps) -> int:
    """Of joints of spread sliders, led in through so many points: turning points open at once.

    With room for fewer turning points than that nothing else is written.
    """
    samples = joints.path.shape[1]
    memory = np.empty(POINTS + 2 * (lead + 2 * samples))
    most = 0
    for j in range(len(joints.parameters)):
        joint, path = joints.parameters[j], joints.path[j]
        curve = (joint[0], joint[2], joint[3], joint[4])
        memory[:] = 0.0
        for i in range(lead):
            advance_masing(curve, 0.0, memory, joints.before[j, i] - memory[DISPLACEMENT])
            memory[DISPLACEMENT] = joints.before[j, i]
        for period in range(CURVE_PERIODS + 1):
            for step in range(samples):
                end = path[(step + 1) % samples]
                increment = end - memory[DISPLACEMENT]
                depth = int(memory[DEPTH])
                turned = increment != 0.0 and turns(memory, depth, end)
                force, slope, _ = advance_masing(curve, 0.0, memory, increment)
                memory[DISPLACEMENT] = end
                left = int(memory[DEPTH])
                if period < CURVE_PERIODS:
                    continue
                most = max(most, depth + 1, left)
                if 2 * most >= maps.kept.shape[2]:
                    continue
                maps.tangent[step, j, 0, 0], maps.pull[j, 0, 0] = joint[1], 1.0
                maps.force[(step + 1) % samples, j, 0] = force + joint[1] * end
                maps.regimes[step, j] = 2 * left + (increment > 0.0)
                _write_curve(maps, step, j, (depth if turned else -1, left, slope))
    return most


@compiled(nogil=True, error_model="numpy")
def _write_curve(maps: Maps, step: int, j: int, change: tuple[int, int, float]) -> None:
    """One increment, in which a turning point of this number is added (-1: none), so many are left
    and the slope is this. The force is the first of what is remembered."""
    added, left, slope = change
    kept, by_start = maps.kept[step, j], maps.by_start[step, j]
    for point in range(left):
        place, force = 1 + 2 * point, 2 + 2 * point
        if point == added:
            by_start[place, 0], kept[force, 0] = 1.0, 1.0
        else:
            kept[place, place], kept[force, force] = 1.0, 1.0
    maps.by_end[step, j, 0, 0] = slope
    last = left - 1
    if last == added and left > 0:
        kept[0, 0], by_start[0, 0] = 1.0, -slope
    elif left > 0:
        kept[0, 2 + 2 * last], kept[0, 1 + 2 * last] = 1.0, -slope
