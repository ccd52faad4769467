"""Compiled marches of joints along one direction over a period; see :mod:`wear.joints.periodic`.

Jenkins's and Bouc-Wen's joints remember one number, here the stretch z of a spring that gives the
force K z + kr u, and carry its derivative with it. A joint of spread sliders remembers turning
points, which are samples: the derivatives of displacement and force there are kept in a stack
beside the one of the law itself.
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
# Memory repeats when it changes in a period by less than this share of the largest it can be, and
# its derivative, which is of the order of 1, when it changes by less than this: ten to a thousand
# times what rounding leaves of some thousand samples.
REPEATED, DERIVATIVE_REPEATED = 1e-13, 1e-10
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
    """Functions of time: ``basis`` ``(t, m)``, ``weights`` ``(m, t)`` and ``lead`` ``(p, m)``.

    ``steps`` ``(t, m)`` are the :func:`differences` of the basis.
    """

    basis: Array
    weights: Array
    lead: Array
    steps: Array


class PeriodRecord(NamedTuple):
    """What is written of a joint in a period: ``gradient`` ``(t, ..., m)`` of the stretch, and the
    rest."""

    force: Array
    states: np.ndarray
    gradient: Array


class DrivenJoints(NamedTuple):
    """Joints driven through a period; the last two axes only where they have three directions.

    ``parameters`` ``(j, k)`` of the law, displacements ``path`` ``(j, t, d)`` in the period and
    ``before`` ``(j, p, d)`` on the way to it [mm], the last of which is the first of ``path``.
    The others are written: see :class:`wear.joints.periodic.SettledCycle`; ``settled`` ``(j, 4)``
    is what contacts in three dimensions need to go on.
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
def _move(joint: Array, stretch: float, increment: float) -> tuple[float, float, float, float]:
    """One increment: stretch at its end, derivatives by stretch and increment, energy lost."""
    spring, limit = joint[1], joint[3]
    if joint[0] == JENKINS:
        _, slope, _, end, lost = advance_jenkins(spring, 0.0, limit, 0.0, stretch, increment)
        held = 1.0 if slope > 0.0 else 0.0
        return end, held, held, lost
    exponent, gain, pull = joint[4], joint[5], spring * abs(increment)
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
def _lead_in(joint: Array, before: Array, lead: Array, derivative: Array) -> float:
    """Stretch at the first sample, to which it is driven from rest; ``derivative`` is written."""
    stretch, here = 0.0, 0.0
    derivative[:] = 0.0
    for i in range(len(lead)):
        there = before[i]
        stretch, kept, follows, _ = _move(joint, stretch, there - here)
        for c in range(derivative.size):
            change = lead[i, c] - (lead[i - 1, c] if i > 0 else 0.0)
            derivative[c] = kept * derivative[c] + follows * change
        here = there
    return stretch


@compiled(nogil=True, error_model="numpy")
def _round(
    joint: Array, stretch: float, path: Array, steps: Array, derivative: Array, record: PeriodRecord
) -> tuple[float, float, float]:
    """One period: stretch at its end, its derivative by that at the start, energy lost.

    ``steps`` ``(t, m)`` are the differences of the basis from the sample before; forces that are
    written are K z.
    """
    force, states, gradient = record
    samples, size = steps.shape
    total, lost = 1.0, 0.0
    for step in range(1, samples + 1):
        at = step if step < samples else 0
        stretch, kept, follows, loss = _move(joint, stretch, path[at] - path[step - 1])
        total *= kept
        lost += loss
        for c in range(size):
            derivative[c] = kept * derivative[c] + follows * steps[at, c]
            gradient[at, c] = derivative[c]
        force[at] = joint[1] * stretch
        states[at] = 1 if follows < LEFT_IN_SLIP else 0
    return stretch, total, lost


@compiled(nogil=True, error_model="numpy")
def _settle_slider(
    joint: Array, stretch: float, path: Array, steps: Array, derivative: Array, record: PeriodRecord
) -> tuple[float, float]:
    """March until stretch and derivative repeat: energy lost, last change of the stretch."""
    before = np.empty_like(derivative)
    repeated = REPEATED * min(joint[3] / joint[1], np.max(np.abs(path)))
    lost, change = 0.0, 0.0
    for period in range(MAX_PERIODS):
        before[:] = derivative
        end, total, lost = _round(joint, stretch, path, steps, derivative, record)
        change = end - stretch
        turned = np.max(np.abs(derivative - before))
        if abs(change) <= repeated and turned <= DERIVATIVE_REPEATED:
            break
        part = 1.0
        if period >= PLAIN_PERIODS and 1.0 - total > FORGETTING:
            part = 1.0 / (1.0 - total)
        stretch += part * change
        derivative[:] = before + part * (derivative - before)
    return lost, change


@compiled(nogil=True, error_model="numpy")
def relative_change(change: float, force: Array) -> float:
    """A change of force over the largest force."""
    largest = np.max(np.abs(force))
    return abs(change) / largest if largest > 0.0 else 0.0


@compiled(nogil=True, error_model="numpy")
def differences(basis: Array) -> Array:
    """Differences ``(t, m)`` of a basis from the sample before, round the period."""
    steps = np.empty_like(basis)
    steps[0], steps[1:] = basis[0] - basis[-1], basis[1:] - basis[:-1]
    return steps


@compiled(nogil=True, error_model="numpy")
def settle_sliders(period: Period, joints: DrivenJoints) -> None:
    """Settle Jenkins's and Bouc-Wen's joints; parameters begin with their kind."""
    samples, size = period.basis.shape
    gradient, derivative = np.empty((samples, size)), np.empty(size)
    # Needed for residual stiffness only: for one joint as much work as all the rest.
    beside = np.any(joints.parameters[:, 2] != 0.0)
    shares = np.dot(period.weights, period.basis) if beside else np.zeros((size, size))
    for j in range(len(joints.parameters)):
        joint, path, force = joints.parameters[j], joints.path[j], joints.force[j]
        record = PeriodRecord(force, joints.states[j], gradient)
        stretch = _lead_in(joint, joints.before[j], period.lead, derivative)
        joints.dissipated[j], missing = _settle_slider(
            joint, stretch, path, period.steps, derivative, record
        )
        joints.change[j] = relative_change(joint[1] * missing, force)
        force += joint[2] * path
        slopes = np.dot(period.weights, gradient)
        joints.jacobian[j] = joint[1] * slopes + joint[2] * shares


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
        places[depth], forces[depth] = here, gradient
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
                gradients[at] = gradient
                joints.dissipated[j] += lost
                joints.states[j, at] = 1 if left < LEFT_IN_SLIP else 0
            joints.change[j] = relative_change(force[0] - start, force)
        force += joint[1] * path
        joints.jacobian[j] = np.dot(period.weights, gradients) + joint[1] * shares
