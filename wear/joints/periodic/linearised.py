"""Linearised increments of joints around a periodic motion.

A joint has a memory s ``(p,)``. In an increment of a known motion, small deviations δs of the
memory and δu of its displacement at the beginning and the end evolve linearly,

    δs_end = A δs + E δu + D δu_end,        δF_end = S δs_end + T δu_end,

exactly, whatever happens within the increment. From these matrices a time integration of the
structure determines whether deviations grow. The memory is part of the state: a slipping slider
forgets all of it, a sticking one keeps it.

The memory of sliders and contacts is the stretch of the spring. That of joints of distributed
sliders is the force, and displacement and force of each open turning point. Elastic joints have
none.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign
from typing import NamedTuple

import numpy as np

from sa_solver.types import Array, Indices
from wear.joints.compiled import compiled
from wear.joints.elastic import STOP, elastic_force
from wear.joints.masing import DEPTH, DISPLACEMENT, POINTS, advance_masing, turns
from wear.joints.periodic.contact import (
    MARCHED,
    Stretch,
    increment_of,
    lead_in,
    sticks_throughout,
)
from wear.joints.periodic.friction_path import advance_slopes, contact_of, pressing
from wear.joints.periodic.sliders import (
    CURVE_PERIODS,
    JENKINS,
    DrivenJoints,
    move_slider,
    slider_of,
)

# Regimes of a joint in an increment. Where the regime changes, the matrices are discontinuous.
STICKS, SLIPS, SLIPS_BACK, IS_APART, TOUCHES = 0, 1, 2, 3, 4


@dataclass(frozen=True)
class LinearisedMarch:
    """Matrices of ``t`` increments of ``j`` joints of ``d`` directions with memory of size ``p``.

    The first increment leads from the first sample to the second, the last one back to the first.
    The matrices are those of the module.

    Parameters
    ----------
    kept
        A ``(t, j, p, p)``.
    by_start, by_end
        E and D ``(t, j, p, d)``.
    pull
        S ``(j, d, p)``.
    tangent
        T ``(t, j, d, d)``.
    regimes
        Whole numbers ``(t, j)`` that change from one increment to the next where the joint changes
        its regime.
    force
        Force of the motion itself at each sample ``(t, j, d)`` [N].
    remembered
        Size of the memory of each joint ``(j,)``. Numbers beyond it have no effect and do not
        change.
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
        """Return the matrices of joints that all have the same size of memory."""
        joints, _, memory = maps.pull.shape
        return cls(*maps, np.full(joints, memory))


class Maps(NamedTuple):
    """Fields of :class:`LinearisedMarch` as compiled functions write them."""

    kept: Array
    by_start: Array
    by_end: Array
    pull: Array
    tangent: Array
    regimes: np.ndarray
    force: Array

    @classmethod
    def room(cls, samples: int, joints: int, memory: int, directions: int) -> Maps:
        """Return zeros for so many increments, joints, numbers of memory and directions."""
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
    """Write the matrices of settled Jenkins and Bouc-Wen joints."""
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
    """Write the matrices of elastic joints, which have no memory."""
    for j in range(len(joints.parameters)):
        joint, path = joints.parameters[j], joints.path[j]
        for step in range(len(path)):
            after = (step + 1) % len(path)
            at = path[after]
            force, slope, state = elastic_force(joint, at)
            maps.force[after, j, 0], maps.tangent[step, j, 0, 0] = force, slope
            # The two sides of a stop are different regimes.
            if joint[0] == STOP:
                maps.regimes[step, j] = IS_APART if state else int(copysign(1.0, at))


@compiled(nogil=True, error_model="numpy")
def linearise_contacts(joints: DrivenJoints, maps: Maps) -> None:
    """Write the matrices of settled contacts."""
    for j in range(len(joints.parameters)):
        contact, path = contact_of(joints.parameters[j]), joints.path[j]
        stretch = Stretch(joints.settled[j, 0], joints.settled[j, 1])
        if joints.settled[j, 3] != MARCHED:
            stretch = lead_in(contact, joints.before[j])
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
    """Write the matrices of joints of distributed sliders, and return the open turning points.

    The return value is the largest number of turning points that are open at once. ``lead`` is the
    number of points before the period. If there is room for fewer turning points, the matrices are
    incomplete.
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
    """Write one increment of a joint of distributed sliders.

    ``change`` holds the number of the turning point that is added (-1: none), the number of turning
    points left, and the slope. The force is the first number of the memory.
    """
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
