"""Compiled march of contacts in three dimensions over a period; see :mod:`wear.joints.periodic`.

What a contact remembers is the stretch s of its tangential spring, two numbers. Its derivative S
with respect to the coefficients is carried along, and with it A, the derivative of the stretch
after a period with respect to that before. Where periods go on to change the stretch, they will by
(1 - A)⁻¹ times the change of one: Newton's step, of which few are needed where slip is so little
that the contact would take thousands of periods.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.friction_contact import advance_contact
from wear.joints.periodic_sliders import (
    DERIVATIVE_REPEATED,
    FORGETTING,
    MAX_PERIODS,
    PLAIN_PERIODS,
    REPEATED,
    DrivenJoints,
    Period,
    PeriodRecord,
    relative_change,
)

# A force below the circle by no more than this share of it slips: rounding.
ON_CIRCLE = 1e-12


@compiled(nogil=True, error_model="numpy")
def _to_the_limit(a: Array) -> tuple[float, float, float, float]:
    """1 + A + A² + ... = (1 - A)⁻¹ by rows, A ``(2, 2)``; 1 where a period forgets nothing."""
    p, q, r, s = 1.0 - a[0, 0], -a[0, 1], -a[1, 0], 1.0 - a[1, 1]
    determinant = p * s - q * r
    if determinant < FORGETTING:
        return 1.0, 0.0, 0.0, 1.0
    return s / determinant, -q / determinant, -r / determinant, p / determinant


@compiled(nogil=True, error_model="numpy")
def _carry(slopes: Array, stiffness: float, start: Array, step: Array, derivative: Array) -> bool:
    """Carry the derivative ``(2, 3, m)`` of the stretch along one increment: whether it sticks.

    ``slopes`` ``(3, 6)`` are those of the forces by stretch, approach and increment; ``start`` and
    ``step`` ``(m,)`` the derivatives of a displacement before the increment and of its change.
    """
    scale = 1.0 / stiffness
    xx, xy, yx, yy = slopes[0, 0], slopes[0, 1], slopes[1, 0], slopes[1, 1]
    xx, xy, yx, yy = xx * scale, xy * scale, yx * scale, yy * scale
    if xx == 1.0 and yy == 1.0 and xy == 0.0 and yx == 0.0:
        # It sticks: by far the most frequent case.
        for c in range(step.size):
            derivative[0, 0, c] += step[c]
            derivative[1, 1, c] += step[c]
        return True
    for direction in range(3):
        x_follows, y_follows = slopes[0, 3 + direction] * scale, slopes[1, 3 + direction] * scale
        for c in range(step.size):
            x, y = derivative[0, direction, c], derivative[1, direction, c]
            derivative[0, direction, c] = xx * x + xy * y + x_follows * step[c]
            derivative[1, direction, c] = yx * x + yy * y + y_follows * step[c]
    x_follows, y_follows = slopes[0, 2] * scale, slopes[1, 2] * scale
    for c in range(step.size):
        derivative[0, 2, c] += x_follows * start[c]
        derivative[1, 2, c] += y_follows * start[c]
    return False


@compiled(nogil=True, error_model="numpy")
def _chain(slopes: Array, stiffness: float, total: Array) -> None:
    """Multiply the derivative ``(2, 2)`` of a stretch by that of one increment."""
    for c in range(2):
        x, y = total[0, c] / stiffness, total[1, c] / stiffness
        total[0, c] = slopes[0, 0] * x + slopes[0, 1] * y
        total[1, c] = slopes[1, 0] * x + slopes[1, 1] * y


@compiled(nogil=True, error_model="numpy")
def _state_of(joint: Array, force: Array) -> int:
    """0 stick, 1 slip, 2 separated."""
    if force[2] <= 0.0:
        return 2
    limit = joint[2] * force[2] * (1.0 - ON_CIRCLE)
    return 1 if force[0] ** 2 + force[1] ** 2 >= limit * limit else 0


class ContactMemory(NamedTuple):
    """A contact on its path, changed in place.

    ``state`` ``(3,)`` is that of the law, ``derivative`` ``(2, 3, m)`` that of its stretch; the
    others are room for an increment ``(3,)``, a force ``(3,)`` and slopes ``(3, 6)``.
    """

    state: Array
    derivative: Array
    increment: Array
    force: Array
    slopes: Array


@compiled(nogil=True, error_model="numpy")
def _move(joint: Array, memory: ContactMemory, start: Array, end: Array) -> float:
    """One increment between displacements ``(3,)``; return the energy lost."""
    for direction in range(2):
        memory.increment[direction] = end[direction] - start[direction]
    memory.increment[2] = end[2] - memory.state[2]
    lost: float = advance_contact(
        joint, memory.state, memory.increment, memory.force, memory.state, memory.slopes
    )
    memory.state[2] = end[2]
    return lost


@compiled(nogil=True, error_model="numpy")
def _lead_in(joint: Array, memory: ContactMemory, before: Array, lead: Array) -> None:
    """Drive a contact from rest to the first sample."""
    memory.state[:], memory.derivative[:] = 0.0, 0.0
    here, start, step = np.zeros(3), np.zeros(lead.shape[1]), np.empty(lead.shape[1])
    for i in range(len(lead)):
        _move(joint, memory, here, before[i])
        here = before[i]
        step[:] = lead[i] - start
        _carry(memory.slopes, joint[0], start, step, memory.derivative)
        start[:] = lead[i]


@compiled(nogil=True, error_model="numpy")
def _round(
    joint: Array,
    memory: ContactMemory,
    path: Array,
    period: Period,
    record: PeriodRecord,
    total: Array,
) -> tuple[float, bool]:
    """One period: energy lost, and whether it sticks throughout.

    ``total`` ``(2, 2)`` becomes the derivative of the stretch at its end by that at its start.
    """
    basis, steps = period.basis, period.steps
    samples = len(basis)
    total[0, 0] = total[1, 1] = 1.0
    total[0, 1] = total[1, 0] = 0.0
    lost, sticks = 0.0, True
    for step in range(1, samples + 1):
        at = step if step < samples else 0
        lost += _move(joint, memory, path[step - 1], path[at])
        if not _carry(memory.slopes, joint[0], basis[step - 1], steps[at], memory.derivative):
            sticks = False
            _chain(memory.slopes, joint[0], total)
        record.gradient[at] = memory.derivative
        record.force[at] = memory.force
        record.states[at] = _state_of(joint, memory.force)
    return lost, sticks


@compiled(nogil=True, error_model="numpy")
def _unchanging(joint: Array, memory: ContactMemory, path: Array) -> int:
    """State in which a contact is all period long, 0 or 2 as :func:`_state_of`; -1 where it slips
    or changes it.

    Between samples that hold it holds: the force goes straight, within a limit that is linear.
    """
    stiffness, normal_stiffness, preload, gap = joint[0], joint[1], joint[3], joint[4]
    state = 0 if preload + normal_stiffness * (path[0, 2] - gap) > 0.0 else 2
    for t in range(len(path)):
        normal = preload + normal_stiffness * (path[t, 2] - gap)
        if state == 2:
            if normal > 0.0:
                return -1
            continue
        x = stiffness * (memory.state[0] + (path[t, 0] - path[0, 0]))
        y = stiffness * (memory.state[1] + (path[t, 1] - path[0, 1]))
        limit = joint[2] * normal * (1.0 - ON_CIRCLE)
        if normal <= 0.0 or x * x + y * y >= limit * limit:
            return -1
    return state


@compiled(nogil=True, error_model="numpy")
def _write_unchanging(
    joint: Array, memory: ContactMemory, path: Array, state: int, record: PeriodRecord
) -> None:
    """What a contact does that sticks or is apart all period long."""
    record.states[:] = state
    if state == 2:
        record.force[:] = 0.0
        return
    record.gradient[0] = memory.derivative
    for t in range(len(path)):
        for direction in range(2):
            moved = path[t, direction] - path[0, direction]
            record.force[t, direction] = joint[0] * (memory.state[direction] + moved)
        record.force[t, 2] = joint[3] + joint[1] * (path[t, 2] - joint[4])


@compiled(nogil=True, error_model="numpy")
def _settle_contact(
    joint: Array, memory: ContactMemory, path: Array, period: Period, record: PeriodRecord
) -> tuple[float, float, bool]:
    """March until stretch and derivative repeat: energy lost, change of force, all stuck."""
    total, stretch, derivative = np.empty((2, 2)), np.empty(2), np.empty_like(memory.derivative)
    span = max(np.max(np.abs(path[:, 0])), np.max(np.abs(path[:, 1])))
    lost, change, sticks = 0.0, 0.0, True
    for number in range(MAX_PERIODS):
        stretch[:], derivative[:] = memory.state[:2], memory.derivative
        lost, sticks = _round(joint, memory, path, period, record, total)
        x, y = memory.state[0] - stretch[0], memory.state[1] - stretch[1]
        change = max(abs(x), abs(y))
        turned = np.max(np.abs(memory.derivative - derivative))
        if change <= REPEATED * span and turned <= DERIVATIVE_REPEATED:
            break
        if number < PLAIN_PERIODS:
            continue
        g, h, k, m = _to_the_limit(total)
        memory.state[0], memory.state[1] = stretch[0] + g * x + h * y, stretch[1] + k * x + m * y
        change_x, change_y = memory.derivative - derivative
        memory.derivative[0] = derivative[0] + (g * change_x + h * change_y)
        memory.derivative[1] = derivative[1] + (k * change_x + m * change_y)
    return lost, joint[0] * change, sticks


@compiled(nogil=True, error_model="numpy")
def _project_stuck(
    stiffness: float, period: Period, shares: Array, record: PeriodRecord, jacobian: Array
) -> None:
    """Tangential part of the derivative where all samples stick.

    The stretch at a sample is that at the first one and the displacement since.
    """
    basis, weights = period.basis, period.weights
    size = basis.shape[1]
    first = record.gradient[0]
    for row in range(size):
        weight = np.sum(weights[row])
        for direction in range(2):
            for by in range(3):
                for c in range(size):
                    slope = weight * first[direction, by, c]
                    if by == direction:
                        slope += shares[row, c] - weight * basis[0, c]
                    jacobian[row, direction, c, by] = stiffness * slope


@compiled(nogil=True, error_model="numpy")
def _project(stiffness: float, weights: Array, record: PeriodRecord, jacobian: Array) -> None:
    """Tangential part of the derivative."""
    size = weights.shape[0]
    flat = record.gradient.reshape(len(record.gradient), 6 * size)
    slopes = np.dot(weights, flat).reshape(size, 2, 3, size)
    jacobian[:, :2] = stiffness * slopes.transpose(0, 1, 3, 2)


@compiled(nogil=True, error_model="numpy")
def _project_normal(
    stiffness: float, period: Period, shares: Array, states: Array, jacobian: Array
) -> None:
    """Normal part of the derivative: kn as long as there is contact."""
    pressed = shares
    if np.any(states == 2):
        touching = period.basis.copy()
        touching[states == 2] = 0.0
        pressed = np.dot(period.weights, touching)
    jacobian[:, 2] = 0.0
    jacobian[:, 2, :, 2] = stiffness * pressed


@compiled(nogil=True, error_model="numpy")
def settle_contacts(period: Period, joints: DrivenJoints) -> None:
    """Settle contacts; parameters are those of the law."""
    samples, size = period.basis.shape
    gradient, shares = np.empty((samples, 2, 3, size)), np.dot(period.weights, period.basis)
    memory = ContactMemory(
        np.empty(3), np.empty((2, 3, size)), np.empty(3), np.empty(3), np.empty((3, 6))
    )
    for j in range(len(joints.parameters)):
        joint, jacobian = joints.parameters[j], joints.jacobian[j]
        record = PeriodRecord(joints.force[j], joints.states[j], gradient)
        _lead_in(joint, memory, joints.before[j], period.lead)
        path = joints.path[j]
        # Most contacts of a pad: in closed form.
        state = _unchanging(joint, memory, path)
        if state >= 0:
            _write_unchanging(joint, memory, path, state, record)
            joints.dissipated[j], missing, sticks = 0.0, 0.0, True
        else:
            joints.dissipated[j], missing, sticks = _settle_contact(
                joint, memory, path, period, record
            )
        joints.change[j] = relative_change(missing, record.force)
        if state == 2:
            jacobian[:] = 0.0
            continue
        if sticks:
            _project_stuck(joint[0], period, shares, record, jacobian)
        else:
            _project(joint[0], period.weights, record, jacobian)
        _project_normal(joint[1], period, shares, record.states, jacobian)
