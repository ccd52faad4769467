"""Compiled march of contacts in three dimensions over a period; see :mod:`wear.joints.periodic`.

What a contact remembers is the stretch s of its tangential spring, two numbers. Where periods go on
to change the stretch, they will by (1 - A)⁻¹ times the change of one, with A, the derivative of the
stretch after a period with respect to that before: Newton's step, of which few are needed where
slip is so little that the contact would take thousands of periods.

The derivative S of s with respect to the coefficients comes after that, along the period that
repeats and only if it is asked for: what a period makes of 0, and (1 - A)⁻¹ of that at its
beginning. So does the energy.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.friction_path import (
    ENERGY,
    SLOPES,
    ForcePath,
    advance_contact,
    advance_force,
)
from wear.joints.periodic_sliders import (
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
# What is left of a stretch, as a share, when it is forgotten: rounding of what came since.
FORGOTTEN = 1e-18
# What a contact does in its period; the first two as :func:`_state_of`.
STUCK, MARCHED, APART = 0.0, 1.0, 2.0


@compiled(nogil=True, error_model="numpy")
def _to_the_limit(a: Array) -> tuple[float, float, float, float]:
    """1 + A + A² + ... = (1 - A)⁻¹ by rows, A ``(2, 2)``; 1 where a period forgets nothing."""
    p, q, r, s = 1.0 - a[0, 0], -a[0, 1], -a[1, 0], 1.0 - a[1, 1]
    determinant = p * s - q * r
    if determinant < FORGETTING:
        return 1.0, 0.0, 0.0, 1.0
    return s / determinant, -q / determinant, -r / determinant, p / determinant


@compiled(nogil=True, error_model="numpy")
def _sticks(slopes: Array, stiffness: float) -> bool:
    """Whether a contact keeps its stretch, and what is added to it."""
    off = slopes[0, 1] != 0.0 or slopes[1, 0] != 0.0
    return slopes[0, 0] == stiffness and slopes[1, 1] == stiffness and not off


@compiled(nogil=True, error_model="numpy")
def _carry(
    slopes: Array, scale: float, start: Array, step: Array, before: Array, after: Array
) -> None:
    """Carry the derivative ``(2, 3, m)`` of the stretch along one increment.

    ``slopes`` ``(3, 6)`` are those of the forces by stretch, approach and increment, and ``scale``
    1/kt; ``start`` and ``step`` ``(m,)`` the derivatives of a displacement before the increment and
    of its change. ``after`` may be ``before``.
    """
    xx, xy, yx, yy = slopes[0, 0], slopes[0, 1], slopes[1, 0], slopes[1, 1]
    xx, xy, yx, yy = xx * scale, xy * scale, yx * scale, yy * scale
    for direction in range(3):
        x_follows, y_follows = slopes[0, 3 + direction] * scale, slopes[1, 3 + direction] * scale
        for c in range(step.size):
            x, y = before[0, direction, c], before[1, direction, c]
            after[0, direction, c] = xx * x + xy * y + x_follows * step[c]
            after[1, direction, c] = yx * x + yy * y + y_follows * step[c]
    x_follows, y_follows = slopes[0, 2] * scale, slopes[1, 2] * scale
    for c in range(step.size):
        after[0, 2, c] += x_follows * start[c]
        after[1, 2, c] += y_follows * start[c]


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

    ``state`` ``(3,)`` is that of the law; the others are room for an increment ``(3,)``, a force
    ``(3,)`` and slopes ``(3, 6)``.
    """

    state: Array
    increment: Array
    force: Array
    slopes: Array


@compiled(nogil=True, error_model="numpy")
def _new_memory() -> ContactMemory:
    return ContactMemory(np.empty(3), np.empty(3), np.empty(3), np.empty((3, 6)))


@compiled(nogil=True, error_model="numpy")
def _move(joint: Array, memory: ContactMemory, start: Array, end: Array, wanted: int) -> float:
    """One increment between displacements ``(3,)``; return the energy lost."""
    for direction in range(2):
        memory.increment[direction] = end[direction] - start[direction]
    memory.increment[2] = end[2] - memory.state[2]
    lost: float = advance_contact(
        joint, memory.state, memory.increment, memory.force, memory.state, memory.slopes, wanted
    )
    memory.state[2] = end[2]
    return lost


@compiled(nogil=True, error_model="numpy")
def _pulled(joint: Array, stretch: Array, start: Array, end: Array) -> None:
    """:func:`_move` without derivatives and energy: the stretch ``(2,)``."""
    stiffness, preload, gap = joint[0], joint[3], joint[4]
    path = ForcePath(
        stiffness * stretch[0],
        stiffness * stretch[1],
        stiffness * (end[0] - start[0]),
        stiffness * (end[1] - start[1]),
        joint[2] * (preload + joint[1] * (start[2] - gap)),
        joint[2] * (preload + joint[1] * (end[2] - gap)),
    )
    x, y = advance_force(path)
    stretch[0], stretch[1] = x / stiffness, y / stiffness


@compiled(nogil=True, error_model="numpy")
def _lead_in(joint: Array, memory: ContactMemory, before: Array) -> None:
    """Drive a contact from rest to the first sample."""
    memory.state[:] = 0.0
    here = np.zeros(3)
    for i in range(len(before)):
        _pulled(joint, memory.state, here, before[i])
        here = before[i]
    memory.state[2] = here[2]


@compiled(nogil=True, error_model="numpy")
def _carried_lead_in(
    joint: Array, memory: ContactMemory, before: Array, lead: Array, derivative: Array
) -> None:
    """:func:`_lead_in` with the derivative ``(2, 3, m)`` of the stretch, which is written."""
    memory.state[:], derivative[:] = 0.0, 0.0
    here, start, step = np.zeros(3), np.zeros(lead.shape[1]), np.empty(lead.shape[1])
    for i in range(len(lead)):
        _move(joint, memory, here, before[i], SLOPES)
        here = before[i]
        step[:] = lead[i] - start
        _carry(memory.slopes, 1.0 / joint[0], start, step, derivative, derivative)
        start[:] = lead[i]


@compiled(nogil=True, error_model="numpy")
def _plain_round(joint: Array, memory: ContactMemory, path: Array, record: PeriodRecord) -> None:
    """One period: forces and states."""
    samples, force = len(path), memory.force
    for step in range(1, samples + 1):
        at = step if step < samples else 0
        _pulled(joint, memory.state, path[step - 1], path[at])
        force[0], force[1] = joint[0] * memory.state[0], joint[0] * memory.state[1]
        force[2] = max(joint[3] + joint[1] * (path[at, 2] - joint[4]), 0.0)
        _record(joint, memory, at, record)
    memory.state[2] = path[0, 2]


@compiled(nogil=True, error_model="numpy")
def _chained_round(
    joint: Array, memory: ContactMemory, path: Array, record: PeriodRecord, total: Array
) -> None:
    """:func:`_plain_round`; ``total`` ``(2, 2)`` becomes A."""
    samples = len(path)
    total[0, 0] = total[1, 1] = 1.0
    total[0, 1] = total[1, 0] = 0.0
    for step in range(1, samples + 1):
        at = step if step < samples else 0
        _move(joint, memory, path[step - 1], path[at], SLOPES)
        if not _sticks(memory.slopes, joint[0]):
            _chain(memory.slopes, joint[0], total)
        _record(joint, memory, at, record)


@compiled(nogil=True, error_model="numpy")
def _record(joint: Array, memory: ContactMemory, at: int, record: PeriodRecord) -> None:
    """Write what a contact does at a sample."""
    for direction in range(3):
        record.force[at, direction] = memory.force[direction]
    record.states[at] = _state_of(joint, memory.force)


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
    for t in range(len(path)):
        for direction in range(2):
            moved = path[t, direction] - path[0, direction]
            record.force[t, direction] = joint[0] * (memory.state[direction] + moved)
        record.force[t, 2] = joint[3] + joint[1] * (path[t, 2] - joint[4])


@compiled(nogil=True, error_model="numpy")
def _settle_contact(
    joint: Array, memory: ContactMemory, path: Array, settled: Array, record: PeriodRecord
) -> float:
    """March until the stretch repeats: change of force.

    ``settled`` becomes the stretch ``(2,)`` at the start of the last period, and the number of it.
    """
    span = max(np.max(np.abs(path[:, 0])), np.max(np.abs(path[:, 1])))
    total, change = np.empty((2, 2)), 0.0
    for number in range(MAX_PERIODS):
        settled[0], settled[1], settled[2] = memory.state[0], memory.state[1], number + 1.0
        plain = number < PLAIN_PERIODS
        if plain:
            _plain_round(joint, memory, path, record)
        else:
            _chained_round(joint, memory, path, record, total)
        x, y = memory.state[0] - settled[0], memory.state[1] - settled[1]
        change = max(abs(x), abs(y))
        if change <= REPEATED * span:
            break
        if plain:
            continue
        g, h, k, m = _to_the_limit(total)
        memory.state[0], memory.state[1] = settled[0] + g * x + h * y, settled[1] + k * x + m * y
    missing: float = joint[0] * change
    return missing


class Derivatives(NamedTuple):
    """Room for derivatives of the stretch of a contact.

    ``first`` ``(2, 3, m)`` at the beginning of a period; at all samples what it makes of these,
    ``gradient`` ``(t, 2, 3, m)``, and of a stretch there, ``kept`` ``(t, 2, 2)``.
    """

    first: Array
    gradient: Array
    kept: Array


@compiled(nogil=True, error_model="numpy")
def _carried_round(
    joint: Array, memory: ContactMemory, path: Array, period: Period, derivatives: Derivatives
) -> bool:
    """One period with the derivatives carried along: whether it sticks throughout."""
    basis, steps = period.basis, period.steps
    samples = len(basis)
    before, total, sticks = derivatives.first, np.eye(2), True
    for step in range(1, samples + 1):
        at = step if step < samples else 0
        _move(joint, memory, path[step - 1], path[at], SLOPES)
        after = derivatives.gradient[at]
        _carry(memory.slopes, 1.0 / joint[0], basis[step - 1], steps[at], before, after)
        if not _sticks(memory.slopes, joint[0]):
            sticks = False
            _chain(memory.slopes, joint[0], total)
        derivatives.kept[at] = total
        before = after
    return sticks


@compiled(nogil=True, error_model="numpy")
def _repeat(derivatives: Derivatives) -> bool:
    """Make the gradient of 0 that of a period that repeats; whether it forgets enough for that."""
    first, gradient, kept = derivatives
    a = kept[0]
    if (1.0 - a[0, 0]) * (1.0 - a[1, 1]) - a[0, 1] * a[1, 0] < FORGETTING:
        return False
    g, h, k, m = _to_the_limit(a)
    first[0] = g * gradient[0, 0] + h * gradient[0, 1]
    first[1] = k * gradient[0, 0] + m * gradient[0, 1]
    for t in range(len(gradient)):
        xx, xy, yx, yy = kept[t, 0, 0], kept[t, 0, 1], kept[t, 1, 0], kept[t, 1, 1]
        if max(abs(xx), abs(xy), abs(yx), abs(yy)) < FORGOTTEN:
            continue
        for direction in range(3):
            for c in range(first.shape[2]):
                x, y = first[0, direction, c], first[1, direction, c]
                gradient[t, 0, direction, c] += xx * x + xy * y
                gradient[t, 1, direction, c] += yx * x + yy * y
    return True


@compiled(nogil=True, error_model="numpy")
def _differentiate(
    joint: Array,
    memory: ContactMemory,
    driven: tuple[Array, Array, Array],
    period: Period,
    derivatives: Derivatives,
) -> bool:
    """Gradient of the stretch in the period that repeats: whether it sticks throughout.

    ``driven`` are path, way to it, and where it has settled. A contact that forgets too little of
    how it began carries the derivative from there.
    """
    path, before, settled = driven
    memory.state[0], memory.state[1], memory.state[2] = settled[0], settled[1], path[0, 2]
    derivatives.first[:] = 0.0
    sticks = _carried_round(joint, memory, path, period, derivatives)
    if _repeat(derivatives):
        return sticks
    _carried_lead_in(joint, memory, before, period.lead, derivatives.first)
    for _ in range(int(settled[2])):
        sticks = _carried_round(joint, memory, path, period, derivatives)
        derivatives.first[:] = derivatives.gradient[0]
    return sticks


@compiled(nogil=True, error_model="numpy")
def _project_stuck(
    stiffness: float, period: Period, shares: Array, first: Array, jacobian: Array
) -> None:
    """Tangential part of the derivative where all samples stick.

    The stretch at a sample is that at the first one and the displacement since; ``first``
    ``(2, 3, m)`` is its derivative there.
    """
    basis, weights = period.basis, period.weights
    size = basis.shape[1]
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
def _project(stiffness: float, weights: Array, gradient: Array, jacobian: Array) -> None:
    """Tangential part of the derivative."""
    size = weights.shape[0]
    flat = gradient.reshape(len(gradient), 6 * size)
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
    """Settle contacts; parameters are those of the law.

    Neither derivatives nor energies are written. ``settled`` is what is needed for these: stretch
    at the first sample, number of periods, and what the contact does in them.
    """
    memory, gradient = _new_memory(), np.empty((0, 2, 3, 0))
    for j in range(len(joints.parameters)):
        joint, path, settled = joints.parameters[j], joints.path[j], joints.settled[j]
        record = PeriodRecord(joints.force[j], joints.states[j], gradient)
        _lead_in(joint, memory, joints.before[j])
        # Most contacts of a pad: in closed form.
        state = _unchanging(joint, memory, path)
        missing = 0.0
        if state >= 0:
            settled[3] = state
            _write_unchanging(joint, memory, path, state, record)
        else:
            settled[3] = MARCHED
            missing = _settle_contact(joint, memory, path, settled, record)
        joints.change[j] = relative_change(missing, record.force)


@compiled(nogil=True, error_model="numpy")
def differentiate_contacts(period: Period, joints: DrivenJoints) -> None:
    """Write the derivatives of contacts that have settled."""
    samples, size = period.basis.shape
    shares, memory = np.dot(period.weights, period.basis), _new_memory()
    derivatives = Derivatives(
        np.empty((2, 3, size)), np.empty((samples, 2, 3, size)), np.empty((samples, 2, 2))
    )
    for j in range(len(joints.parameters)):
        joint, jacobian, settled = joints.parameters[j], joints.jacobian[j], joints.settled[j]
        if settled[3] == APART:
            jacobian[:] = 0.0
            continue
        before, first, sticks = joints.before[j], derivatives.gradient[0], True
        if settled[3] == STUCK:
            _carried_lead_in(joint, memory, before, period.lead, derivatives.first)
            first = derivatives.first
        else:
            driven = joints.path[j], before, settled
            sticks = _differentiate(joint, memory, driven, period, derivatives)
        if sticks:
            _project_stuck(joint[0], period, shares, first, jacobian)
        else:
            _project(joint[0], period.weights, derivatives.gradient, jacobian)
        _project_normal(joint[1], period, shares, joints.states[j], jacobian)


@compiled(nogil=True, error_model="numpy")
def energies_of_contacts(period: Period, joints: DrivenJoints) -> None:
    """Write the energies that contacts dissipate which have settled."""
    memory = _new_memory()
    for j in range(len(joints.parameters)):
        joint, path, settled = joints.parameters[j], joints.path[j], joints.settled[j]
        lost = 0.0
        if settled[3] == MARCHED:
            memory.state[0], memory.state[1] = settled[0], settled[1]
            memory.state[2] = path[0, 2]
            for step in range(len(path)):
                at = (step + 1) % len(path)
                lost += _move(joint, memory, path[step], path[at], ENERGY)
        joints.dissipated[j] = lost
