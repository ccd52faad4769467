"""Compiled marches of joints along one direction over a period; see :mod:`wear.joints.periodic.march`.

Jenkins's and Bouc-Wen's joints remember one number, here the stretch z of a spring that gives the
force K z + kr u. Its derivative comes after that, along the period that repeats and only if it is
asked for, as that of contacts does. A joint of spread sliders remembers turning points, which are
samples: the derivatives of displacement and force there are kept in a stack beside the one of the
law itself.

Arrays are written number by number: a row or a sum of arrays that is assigned as a whole takes
hundreds of times as long to compile as the loop, and a first march takes seconds by that.
"""

from __future__ import annotations

from math import copysign, exp
from typing import NamedTuple

import numpy as np

from sa_solver.types import Array
from wear.joints.bouc_wen import NO_FRICTION, advance_bouc_wen, xi_rate
from wear.joints.compiled import compiled
from wear.joints.jenkins import advance_jenkins
from wear.joints.masing import DEPTH, DISPLACEMENT, POINTS, advance_masing, turns

JENKINS, BOUC_WEN = 0.0, 1.0
"""First parameter of a joint with one number of memory; K, kr, µN follow, of the latter n and
2 σ - 1."""

# Periods after which a joint that still changes is given up. Newton's steps on the memory double
# its digits in each: more mean that it has no attractor.
MAX_PERIODS = 40
# Memory repeats when it changes in a period by less than this share of the largest it can be: ten
# to a thousand times what rounding leaves of some thousand samples.
REPEATED = 1e-13
# Periods before the first Newton step: a joint that slips on its way in, and never again, stays
# where that has brought it.
PLAIN_PERIODS = 2
# Share of its memory that a period must forget for Newton's step to be more than rounding.
FORGETTING = 1e-9
# dη/ds below which sliding is complete: there the memory decays as exp(-n s).
COMPLETE = 1e-12
# A joint slips where less than this share of its stiffness K is left.
LEFT_IN_SLIP = 0.5
# Periods of a joint of spread sliders: its largest displacement wipes out what was before it.
CURVE_PERIODS = 2


class Period(NamedTuple):
    """Functions of time: ``basis`` ``(t, m)``, ``weights`` ``(m, t)`` and ``lead`` ``(p, m)``."""

    basis: Array
    weights: Array
    lead: Array

    @classmethod
    def of(cls, basis: Array, weights: Array, lead: Array) -> Period:
        """In rows, for which all is compiled."""
        return cls(*map(np.ascontiguousarray, (basis, weights, lead)))


class DrivenJoints(NamedTuple):
    """Joints driven through a period; the last two axes only where they have three directions.

    ``parameters`` ``(j, k)`` of the law, displacements ``path`` ``(j, t, d)`` in the period and
    ``before`` ``(j, p, d)`` on the way to it [mm], the last of which is the first of ``path``.
    The others are written: see :class:`wear.joints.periodic.march.SettledCycle`; ``settled`` ``(j,
    4)`` is what derivatives and energies need to go on.
    """

    parameters: Array
    path: Array
    before: Array
    force: Array
    states: np.ndarray
    jacobian: Array
    dissipated: Array
    change: Array
    settled: Array


@compiled(nogil=True, error_model="numpy")
def largest(values: Array) -> float:
    """The largest magnitude of some numbers ``(n,)``."""
    found = 0.0
    for value in values:
        found = max(found, abs(value))
    return found


@compiled(nogil=True, error_model="numpy")
def rows_from_rest(rows: Array) -> Array:
    """Rows ``(n, m)`` with one of zeros before them."""
    points = np.zeros((len(rows) + 1, rows.shape[1]))
    for i in range(len(rows)):
        _copy(rows[i], points[i + 1])
    return points


@compiled(nogil=True, error_model="numpy")
def _copy(row: Array, to: Array) -> None:
    for c in range(len(row)):
        to[c] = row[c]


class Slider(NamedTuple):
    """A row of parameters without its residual stiffness."""

    kind: float
    spring: float
    limit: float
    exponent: float
    gain: float


@compiled(nogil=True, error_model="numpy")
def slider_of(joint: Array) -> Slider:
    """The joint of a row of parameters, without its residual stiffness."""
    exponent, gain = (0.0, 0.0) if joint[0] == JENKINS else (joint[4], joint[5])
    return Slider(joint[0], joint[1], joint[3], exponent, gain)


@compiled(nogil=True, error_model="numpy")
def move_slider(
    joint: Slider, stretch: float, increment: float
) -> tuple[float, float, float, float]:
    """One increment: stretch at its end, derivatives by stretch and increment, energy lost."""
    spring, limit = joint.spring, joint.limit
    if joint.kind == JENKINS:
        _, slope, _, end, lost = advance_jenkins(spring, 0.0, limit, 0.0, stretch, increment)
        held = 1.0 if slope > 0.0 else 0.0
        return end, held, held, lost
    exponent, gain, pull = joint.exponent, joint.gain, spring * abs(increment)
    if limit <= NO_FRICTION * pull:
        return 0.0, 0.0, 0.0, 0.0
    xi = spring * stretch / limit
    _, slope, _, end, lost = advance_bouc_wen(
        spring, 0.0, limit, exponent, gain, 0.0, xi, increment
    )
    kept = 1.0
    if increment != 0.0:
        # dη/ds does not contain s: two paths keep their distance in s.
        rate = xi_rate(copysign(xi, xi * increment), exponent, gain)
        kept = slope / (spring * rate) if rate > COMPLETE else exp(-exponent * pull / limit)
    return end * limit / spring, kept, slope / spring, lost


@compiled(nogil=True, error_model="numpy")
def _lead_in(joint: Slider, before: Array) -> float:
    """Stretch at the first sample, to which it is driven from rest."""
    stretch, here = 0.0, 0.0
    for there in before:
        stretch, _, _, _ = move_slider(joint, stretch, there - here)
        here = there
    return stretch


@compiled(nogil=True, error_model="numpy")
def _round(
    joint: Slider, stretch: float, path: Array, force: Array, states: np.ndarray
) -> tuple[float, float, float]:
    """One period: stretch at its end, its derivative by that at the start, energy lost.

    Forces that are written are K z.
    """
    samples, total, lost = len(path), 1.0, 0.0
    for step in range(1, samples + 1):
        at = step if step < samples else 0
        stretch, kept, follows, loss = move_slider(joint, stretch, path[at] - path[step - 1])
        total *= kept
        lost += loss
        force[at] = joint.spring * stretch
        states[at] = 1 if follows < LEFT_IN_SLIP else 0
    return stretch, total, lost


@compiled(nogil=True, error_model="numpy")
def _settle_slider(
    joint: Slider, stretch: float, path: Array, force: Array, states: np.ndarray
) -> tuple[float, int, float, float]:
    """March until the stretch repeats: that at the start of the last period, the number of it,
    energy lost, and last change of the stretch."""
    repeated = REPEATED * min(joint.limit / joint.spring, largest(path))
    start, period, lost, change = stretch, 0, 0.0, 0.0
    while period < MAX_PERIODS:
        start, period = stretch, period + 1
        end, total, lost = _round(joint, stretch, path, force, states)
        change = end - start
        if abs(change) <= repeated:
            break
        part = 1.0
        if period > PLAIN_PERIODS and 1.0 - total > FORGETTING:
            part = 1.0 / (1.0 - total)
        stretch += part * change
    return start, period, lost, change


@compiled(nogil=True, error_model="numpy")
def relative_change(change: float, largest_force: float) -> float:
    """A change of force over the largest force."""
    return abs(change) / largest_force if largest_force > 0.0 else 0.0


@compiled(nogil=True, error_model="numpy")
def settle_sliders(period: Period, joints: DrivenJoints) -> None:
    """Settle Jenkins's and Bouc-Wen's joints; parameters begin with their kind.

    Derivatives are not written. ``settled`` is what is needed for these: stretch at the first
    sample and number of periods.
    """
    for j in range(len(joints.parameters)):
        slider, path, force = slider_of(joints.parameters[j]), joints.path[j], joints.force[j]
        stretch, periods, lost, missing = _settle_slider(
            slider, _lead_in(slider, joints.before[j]), path, force, joints.states[j]
        )
        joints.settled[j, 0], joints.settled[j, 1], joints.dissipated[j] = stretch, periods, lost
        joints.change[j] = relative_change(slider.spring * missing, largest(force))
        residual = joints.parameters[j, 2]
        for t in range(len(path)):
            force[t] += residual * path[t]


@compiled(nogil=True, error_model="numpy")
def _carried(
    joint: Slider, stretch: float, path: Array, functions: Array, gradient: Array, kept: Array
) -> float:
    """Drive a slider through ``n`` points: its stretch at the last.

    The ``gradient`` ``(n, m)`` of the stretch is written from that at the first point on, and
    ``kept`` ``(n,)``, its derivative by the stretch there. ``functions`` of time are given for all
    points, as the path is, or for all but the last, which then is the first again.
    """
    kept[0] = 1.0
    for to in range(1, len(gradient)):
        at = to if to < len(path) else 0
        stretch, left, follows, _ = move_slider(joint, stretch, path[at] - path[to - 1])
        kept[to] = left * kept[to - 1]
        for c in range(functions.shape[1]):
            step = functions[at, c] - functions[to - 1, c]
            gradient[to, c] = left * gradient[to - 1, c] + follows * step
    return stretch


@compiled(nogil=True, error_model="numpy")
def _from_rest(numbers: Array) -> Array:
    """Numbers ``(n,)`` with 0 before them."""
    points = np.zeros(len(numbers) + 1)
    for i in range(len(numbers)):
        points[i + 1] = numbers[i]
    return points


@compiled(nogil=True, error_model="numpy")
def _repeat(gradient: Array, kept: Array) -> bool:
    """Make the gradient of 0 that of a period that repeats; whether it forgets enough for that."""
    if 1.0 - kept[-1] <= FORGETTING:
        return False
    first = np.empty(gradient.shape[1])
    for c in range(len(first)):
        first[c] = gradient[-1, c] / (1.0 - kept[-1])
    for t in range(len(kept)):
        if kept[t] == 0.0:
            break
        for c in range(len(first)):
            gradient[t, c] += kept[t] * first[c]
    return True


@compiled(nogil=True, error_model="numpy")
def _move_up(gradient: Array, weights: Array, taken: Array) -> int:
    """Move rows of a gradient ``(n, m)`` that are not 0 to its beginning: how many there are.

    Their ``weights``, columns of ``(m, n)``, are ``taken`` ``(n, m)``. A joint that slips follows
    nothing: of one that slides most of the time little is left to be summed.
    """
    count = 0
    for t in range(len(gradient)):
        if not np.any(gradient[t]):
            continue
        for c in range(gradient.shape[1]):
            gradient[count, c] = gradient[t, c]
            taken[count, c] = weights[c, t]
        count += 1
    return count


@compiled(nogil=True, error_model="numpy")
def differentiate_sliders(period: Period, joints: DrivenJoints) -> None:
    """Write the derivatives of joints that have settled.

    A joint that forgets too little of how it began carries the derivative from there.
    """
    samples, size = period.basis.shape
    way_in = rows_from_rest(period.lead)
    gradient, kept = np.empty((samples + 1, size)), np.empty(samples + 1)
    entering, forgotten = np.zeros((len(way_in), size)), np.empty(len(way_in))
    weights = np.empty((samples, size))
    # Needed for residual stiffness only: for one joint as much work as all the rest.
    beside = largest(joints.parameters[:, 2]) > 0.0
    shares = np.dot(period.weights, period.basis) if beside else np.zeros((size, size))
    for j in range(len(joints.parameters)):
        joint, slider, path = joints.parameters[j], slider_of(joints.parameters[j]), joints.path[j]
        gradient[0] = 0.0
        _carried(slider, joints.settled[j, 0], path, period.basis, gradient, kept)
        if not _repeat(gradient, kept):
            before = _from_rest(joints.before[j])
            stretch = _carried(slider, 0.0, before, way_in, entering, forgotten)
            _copy(entering[-1], gradient[-1])
            for _ in range(int(joints.settled[j, 1])):
                _copy(gradient[-1], gradient[0])
                stretch = _carried(slider, stretch, path, period.basis, gradient, kept)
        _copy(gradient[-1], gradient[0])
        following = _move_up(gradient[:-1], period.weights, weights)
        slopes = np.dot(weights[:following].T, gradient[:following])
        for row in range(size):
            for c in range(size):
                joints.jacobian[j, row, c] = slider.spring * slopes[row, c]
                if beside:
                    joints.jacobian[j, row, c] += joint[2] * shares[row, c]


class OpenLoops(NamedTuple):
    """The ``memory`` of a law, and the derivatives ``(depth, m)`` of displacement, ``places``, and
    ``forces`` at its turning points."""

    memory: Array
    places: Array
    forces: Array


@compiled(nogil=True, error_model="numpy")
def _follow_curve(
    joint: Array, loops: OpenLoops, here: Array, there: Array, end: float, gradient: Array
) -> tuple[float, float, float]:
    """Drive a joint of spread sliders to ``end``: force, share of stiffness left, energy lost.

    ``here`` and ``there`` ``(m,)`` are the derivatives of displacement at both ends; ``gradient``
    that of the force, read and written.
    """
    memory, places, forces = loops
    increment = end - memory[DISPLACEMENT]
    depth = int(memory[DEPTH])
    if increment != 0.0 and turns(memory, depth, memory[DISPLACEMENT] + increment):
        _copy(here, places[depth])
        _copy(gradient, forces[depth])
    force, slope, lost = advance_masing(
        (joint[0], joint[2], joint[3], joint[4]), 0.0, memory, increment
    )
    # Set anew: sums of increments round, and a period must return to the same numbers.
    memory[DISPLACEMENT] = end
    depth = int(memory[DEPTH])
    for c in range(there.size):
        gradient[c] = slope * there[c]
        if depth > 0:
            gradient[c] += forces[depth - 1, c] - slope * places[depth - 1, c]
    return force, slope / joint[0], lost


@compiled(nogil=True, error_model="numpy")
def settle_curves(period: Period, joints: DrivenJoints) -> None:
    """Settle joints of spread sliders; parameters are K, kr, µN, c and m."""
    basis, lead = period.basis, period.lead
    samples, size = basis.shape
    # Turning points that may be open at once: those of the way in, and of a period and its first
    # samples again.
    depth = len(lead) + 2 * samples
    memory = np.empty(POINTS + 2 * depth)
    loops = OpenLoops(memory, np.empty((depth, size)), np.empty((depth, size)))
    gradients, gradient, nowhere = np.empty((samples, size)), np.empty(size), np.zeros(size)
    shares = np.dot(period.weights, basis)
    for j in range(len(joints.parameters)):
        joint, path, force = joints.parameters[j], joints.path[j], joints.force[j]
        memory[:], gradient[:], here = 0.0, 0.0, nowhere
        for i in range(len(lead)):
            force[0], _, _ = _follow_curve(
                joint, loops, here, lead[i], joints.before[j, i], gradient
            )
            here = lead[i]
        for _ in range(CURVE_PERIODS):
            start, joints.dissipated[j] = force[0], 0.0
            for step in range(1, samples + 1):
                at = step if step < samples else 0
                here, there = basis[step - 1], basis[at]
                force[at], left, lost = _follow_curve(joint, loops, here, there, path[at], gradient)
                _copy(gradient, gradients[at])
                joints.dissipated[j] += lost
                joints.states[j, at] = 1 if left < LEFT_IN_SLIP else 0
            joints.change[j] = relative_change(force[0] - start, largest(force))
        for t in range(samples):
            force[t] += joint[1] * path[t]
        slopes = np.dot(period.weights, gradients)
        for row in range(size):
            for c in range(size):
                joints.jacobian[j, row, c] = slopes[row, c] + joint[1] * shares[row, c]
