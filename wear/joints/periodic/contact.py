"""Compiled march of contacts in three dimensions over a period.

:mod:`wear.joints.periodic.march` calls it.

The memory of a contact is the stretch s of its tangential spring, two numbers. If further periods
go on changing the stretch, the total change is (1 - A)⁻¹ times that of one period, where A is the
derivative of the stretch after a period by that before. This is Newton's step. Few are needed where
the slip is so small that the contact would take thousands of periods.

The derivative S of s with respect to the coefficients is computed afterwards, along the repeating
period and only if it is asked for: it is the change over a period that begins with S = 0, and
(1 - A)⁻¹ times that at its beginning. So is the energy.

Increments take and return numbers: passing rows of arrays takes four times as long. Arrays are
written element by element, as in :mod:`wear.joints.periodic.sliders`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.periodic.contact_slopes import (
    copy_gradient,
    project,
    project_normal,
    project_stuck,
)
from wear.joints.periodic.friction_path import (
    ContactLaw,
    ForcePath,
    ForceSlopes,
    advance_force,
    advance_slopes,
    contact_of,
    energy_lost,
    path_of,
    pressing,
)
from wear.joints.periodic.sliders import (
    FORGETTING,
    MAX_PERIODS,
    PLAIN_PERIODS,
    REPEATED,
    DrivenJoints,
    Period,
    largest,
    relative_change,
    rows_from_rest,
)

# A force below the circle by no more than this share of it counts as slipping: it is rounding.
ON_CIRCLE = 1e-12
# Remaining share of a stretch at which it is forgotten, far below the rounding of later ones.
FORGOTTEN = 1e-18
# Behaviour of a contact over its period, which is either the same state throughout, or marched.
STUCK, MARCHED, APART = 0.0, 1.0, 2.0


class Stretch(NamedTuple):
    """Stretch of the tangential spring [mm]."""

    x: float
    y: float


class Transition(NamedTuple):
    """A ``(2, 2)`` by rows: the derivative of the stretch after a march by that before."""

    xx: float
    xy: float
    yx: float
    yy: float


class ContactRecord(NamedTuple):
    """Arrays written for a contact in a period: ``force`` ``(t, 3)`` and ``states`` ``(t,)``."""

    force: Array
    states: np.ndarray


@compiled(nogil=True, error_model="numpy")
def _determinant(a: Transition) -> float:
    """Return the determinant of 1 - A; 0 where a period forgets nothing."""
    return (1.0 - a.xx) * (1.0 - a.yy) - a.xy * a.yx


@compiled(nogil=True, error_model="numpy")
def _geometric_sum(a: Transition) -> Transition:
    """Return 1 + A + A² + ... = (1 - A)⁻¹; 1 where a period forgets nothing."""
    determinant = _determinant(a)
    if determinant < FORGETTING:
        return Transition(1.0, 0.0, 0.0, 1.0)
    return Transition(
        (1.0 - a.yy) / determinant,
        a.xy / determinant,
        a.yx / determinant,
        (1.0 - a.xx) / determinant,
    )


@compiled(nogil=True, error_model="numpy")
def sticks_throughout(of_x: ForceSlopes, of_y: ForceSlopes) -> bool:
    """Return whether a contact sticks for all of an increment, so that it keeps its stretch."""
    off = of_x.force_y != 0.0 or of_y.force_x != 0.0
    return of_x.force_x == 1.0 and of_y.force_y == 1.0 and not off


@compiled(nogil=True, error_model="numpy")
def _chain(of_x: ForceSlopes, of_y: ForceSlopes, a: Transition) -> Transition:
    """Return A of a march and one further increment."""
    return Transition(
        of_x.force_x * a.xx + of_x.force_y * a.yx,
        of_x.force_x * a.xy + of_x.force_y * a.yy,
        of_y.force_x * a.xx + of_y.force_y * a.yx,
        of_y.force_x * a.xy + of_y.force_y * a.yy,
    )


@compiled(nogil=True, error_model="numpy")
def _state_of(contact: ContactLaw, x: float, y: float, normal: float) -> int:
    """Return 0 for stick, 1 for slip and 2 for separation."""
    if normal <= 0.0:
        return 2
    limit = contact.friction * normal * (1.0 - ON_CIRCLE)
    return 1 if x * x + y * y >= limit * limit else 0


@compiled(nogil=True, error_model="numpy")
def increment_of(
    contact: ContactLaw, stretch: Stretch, path: Array, start: int, end: int
) -> ForcePath:
    """Return the straight path between two points of a path ``(t, 3)``."""
    return path_of(
        contact,
        stretch.x,
        stretch.y,
        path[end, 0] - path[start, 0],
        path[end, 1] - path[start, 1],
        path[start, 2],
        path[end, 2],
    )


@compiled(nogil=True, error_model="numpy")
def lead_in(contact: ContactLaw, before: Array) -> Stretch:
    """Return the stretch at the first sample, to which a contact is driven from rest."""
    stretch, points = Stretch(0.0, 0.0), rows_from_rest(before)
    for i in range(len(before)):
        x, y = advance_force(increment_of(contact, stretch, points, i, i + 1))
        stretch = Stretch(x / contact.stiffness, y / contact.stiffness)
    return stretch


@compiled(nogil=True, error_model="numpy")
def _one_period(
    contact: ContactLaw, stretch: Stretch, path: Array, record: ContactRecord, ended: Stretch
) -> Stretch:
    """March one period, write forces and states, and return the stretch at its end.

    A contact whose force at a sample is bit for bit that of the period before, which ended with
    ``ended``, continues as it did then. Before the first period the forces are NaN.
    """
    samples, force, states = len(path), record.force, record.states
    for step in range(1, samples + 1):
        at = step if step < samples else 0
        x, y = advance_force(increment_of(contact, stretch, path, step - 1, at))
        if x == force[at, 0] and y == force[at, 1]:
            return ended
        stretch = Stretch(x / contact.stiffness, y / contact.stiffness)
        normal = max(pressing(contact, path[at, 2]), 0.0)
        force[at, 0], force[at, 1], force[at, 2] = x, y, normal
        states[at] = _state_of(contact, x, y, normal)
    return stretch


@compiled(nogil=True, error_model="numpy")
def _period_transition(contact: ContactLaw, stretch: Stretch, path: Array) -> Transition:
    """Return A of one period."""
    samples, kept = len(path), Transition(1.0, 0.0, 0.0, 1.0)
    for step in range(1, samples + 1):
        at = step if step < samples else 0
        x, y, of_x, of_y = advance_slopes(increment_of(contact, stretch, path, step - 1, at))
        stretch = Stretch(x / contact.stiffness, y / contact.stiffness)
        if not sticks_throughout(of_x, of_y):
            kept = _chain(of_x, of_y, kept)
    return kept


@compiled(nogil=True, error_model="numpy")
def _unchanging(contact: ContactLaw, stretch: Stretch, path: Array) -> int:
    """Return the state that a contact keeps over the whole period, 0 or 2 as :func:`_state_of`.

    It is -1 if the contact slips or changes its state. A contact that sticks at two samples also
    sticks between them: the force moves on a straight line, and the limit is linear.
    """
    stiffness = contact.stiffness
    state = 0 if pressing(contact, path[0, 2]) > 0.0 else 2
    for t in range(len(path)):
        normal = pressing(contact, path[t, 2])
        if state == 2:
            if normal > 0.0:
                return -1
            continue
        x = stiffness * (stretch.x + (path[t, 0] - path[0, 0]))
        y = stiffness * (stretch.y + (path[t, 1] - path[0, 1]))
        if _state_of(contact, x, y, normal) != 0:
            return -1
    return state


@compiled(nogil=True, error_model="numpy")
def _write_unchanging(
    contact: ContactLaw, stretch: Stretch, path: Array, state: int, record: ContactRecord
) -> None:
    """Write forces and states of a contact that sticks or is apart over the whole period."""
    record.states[:] = state
    if state == 2:
        record.force[:] = 0.0
        return
    for t in range(len(path)):
        record.force[t, 0] = contact.stiffness * (stretch.x + (path[t, 0] - path[0, 0]))
        record.force[t, 1] = contact.stiffness * (stretch.y + (path[t, 1] - path[0, 1]))
        record.force[t, 2] = pressing(contact, path[t, 2])


@compiled(nogil=True, error_model="numpy")
def _settle_contact(
    contact: ContactLaw, stretch: Stretch, path: Array, settled: Array, record: ContactRecord
) -> float:
    """March until the stretch repeats, and return the last change of force.

    The stretch ``(2,)`` at the start of the last period and the number of periods are written to
    ``settled``.
    """
    span = max(largest(path[:, 0]), largest(path[:, 1]))
    change, end = 0.0, stretch
    record.force[:] = np.nan
    for number in range(MAX_PERIODS):
        settled[0], settled[1], settled[2] = stretch.x, stretch.y, number + 1.0
        end = _one_period(contact, stretch, path, record, end)
        x, y = end.x - stretch.x, end.y - stretch.y
        change = max(abs(x), abs(y))
        if change <= REPEATED * span:
            break
        if number < PLAIN_PERIODS:
            stretch = end
            continue
        share = _geometric_sum(_period_transition(contact, stretch, path))
        stretch = Stretch(
            stretch.x + share.xx * x + share.xy * y, stretch.y + share.yx * x + share.yy * y
        )
    missing: float = contact.stiffness * change
    return missing


class Derivatives(NamedTuple):
    """Derivatives of the stretch of a contact on its way through ``n`` points.

    ``functions`` ``(n, m)`` are those of time at the points, and ``steps`` ``(n - 1, m)`` their
    differences. Written are the ``gradient`` ``(n, 2, 3, m)``, from that at the first point on, and
    ``kept`` ``(n, 4)``, A from the first point to each point as in :class:`Transition`.
    """

    functions: Array
    steps: Array
    gradient: Array
    kept: Array


@compiled(nogil=True, error_model="numpy")
def _derivatives_for(functions: Array) -> Derivatives:
    """Return room for derivatives through points with these functions of time."""
    points, size = functions.shape
    steps = np.empty((points - 1, size))
    for t in range(points - 1):
        for c in range(size):
            steps[t, c] = functions[t + 1, c] - functions[t, c]
    return Derivatives(functions, steps, np.zeros((points, 2, 3, size)), np.empty((points, 4)))


@compiled(nogil=True, error_model="numpy")
def _round_trip(points: Array) -> Array:
    """Return samples ``(t, n)`` with the first of them again at the end."""
    samples, size = points.shape
    closed = np.empty((samples + 1, size))
    for t in range(samples + 1):
        for c in range(size):
            closed[t, c] = points[t % samples, c]
    return closed


@compiled(nogil=True, error_model="numpy")
def _carry(
    of_x: ForceSlopes, of_y: ForceSlopes, limit_slope: float, derivatives: Derivatives, to: int
) -> None:
    """Carry the gradient along one increment to point ``to``.

    ``limit_slope`` is µ kn/kt. An approach before the increment changes both limits.
    """
    functions, steps, gradient, _ = derivatives
    x_by_start, y_by_start = of_x.start + of_x.end, of_y.start + of_y.end
    for c in range(functions.shape[1]):
        start, step = limit_slope * functions[to - 1, c], steps[to - 1, c]
        pressed = limit_slope * step
        x, y = gradient[to - 1, 0, 0, c], gradient[to - 1, 1, 0, c]
        gradient[to, 0, 0, c] = of_x.force_x * x + of_x.force_y * y + of_x.pull_x * step
        gradient[to, 1, 0, c] = of_y.force_x * x + of_y.force_y * y + of_y.pull_x * step
        x, y = gradient[to - 1, 0, 1, c], gradient[to - 1, 1, 1, c]
        gradient[to, 0, 1, c] = of_x.force_x * x + of_x.force_y * y + of_x.pull_y * step
        gradient[to, 1, 1, c] = of_y.force_x * x + of_y.force_y * y + of_y.pull_y * step
        x, y = gradient[to - 1, 0, 2, c], gradient[to - 1, 1, 2, c]
        pressed_x, pressed_y = x_by_start * start, y_by_start * start
        pressed_x, pressed_y = pressed_x + of_x.end * pressed, pressed_y + of_y.end * pressed
        gradient[to, 0, 2, c] = of_x.force_x * x + of_x.force_y * y + pressed_x
        gradient[to, 1, 2, c] = of_y.force_x * x + of_y.force_y * y + pressed_y


@compiled(nogil=True, error_model="numpy")
def _carry_through(
    contact: ContactLaw, stretch: Stretch, points: Array, derivatives: Derivatives
) -> tuple[Stretch, bool]:
    """Drive a contact through points and carry the derivatives; also return whether it sticks."""
    sticks, kept = True, Transition(1.0, 0.0, 0.0, 1.0)
    limit_slope = contact.friction * contact.normal_stiffness / contact.stiffness
    for to in range(1, len(points)):
        x, y, of_x, of_y = advance_slopes(increment_of(contact, stretch, points, to - 1, to))
        stretch = Stretch(x / contact.stiffness, y / contact.stiffness)
        _carry(of_x, of_y, limit_slope, derivatives, to)
        if not sticks_throughout(of_x, of_y):
            sticks = False
            kept = _chain(of_x, of_y, kept)
        for entry, value in enumerate(kept):
            derivatives.kept[to, entry] = value
    return stretch, sticks


@compiled(nogil=True, error_model="numpy")
def _make_periodic(derivatives: Derivatives) -> bool:
    """Turn the gradient of a period from 0 into that of a repeating period.

    Return whether the period forgets enough for that.
    """
    gradient, kept = derivatives.gradient, derivatives.kept
    xx, xy, yx, yy = kept[-1, 0], kept[-1, 1], kept[-1, 2], kept[-1, 3]
    a = Transition(xx, xy, yx, yy)
    if _determinant(a) < FORGETTING:
        return False
    share, first, last = _geometric_sum(a), gradient[0], gradient[-1]
    for direction in range(3):
        for c in range(first.shape[2]):
            x, y = last[0, direction, c], last[1, direction, c]
            first[0, direction, c] = share.xx * x + share.xy * y
            first[1, direction, c] = share.yx * x + share.yy * y
    for t in range(1, len(gradient)):
        xx, xy, yx, yy = kept[t, 0], kept[t, 1], kept[t, 2], kept[t, 3]
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
    contact: ContactLaw,
    driven: tuple[Array, Array, Array],
    lead_derivatives: Derivatives,
    derivatives: Derivatives,
) -> bool:
    """Write the gradient of the stretch in the repeating period; return whether it sticks.

    ``driven`` are the path, the way to it, and the settled data. The derivative of a contact that
    forgets too little of its beginning is carried on from there.
    """
    path, before, settled = driven
    points, gradient = _round_trip(path), derivatives.gradient
    gradient[0] = 0.0
    _, sticks = _carry_through(contact, Stretch(settled[0], settled[1]), points, derivatives)
    if _make_periodic(derivatives):
        return sticks
    stretch, _ = _carry_through(
        contact, Stretch(0.0, 0.0), rows_from_rest(before), lead_derivatives
    )
    copy_gradient(lead_derivatives.gradient[-1], gradient[-1])
    for _ in range(int(settled[2])):
        copy_gradient(gradient[-1], gradient[0])
        stretch, sticks = _carry_through(contact, stretch, points, derivatives)
    copy_gradient(gradient[-1], gradient[0])
    return sticks


@compiled(nogil=True, error_model="numpy")
def _largest_of(force: Array) -> float:
    """Return the largest component of forces ``(t, 3)``."""
    return max(largest(force[:, 0]), largest(force[:, 1]), largest(force[:, 2]))


@compiled(nogil=True, error_model="numpy")
def settle_contacts(period: Period, joints: DrivenJoints) -> None:
    """Settle contacts; parameters are those of the law.

    Neither derivatives nor energies are written. ``settled`` holds the data for them: the stretch
    at the first sample, the number of periods, and the behaviour of the contact.
    """
    for j in range(len(joints.parameters)):
        contact, path, settled = contact_of(joints.parameters[j]), joints.path[j], joints.settled[j]
        record = ContactRecord(joints.force[j], joints.states[j])
        stretch = lead_in(contact, joints.before[j])
        # Most contacts of a pad keep their state, which has a closed form.
        state = _unchanging(contact, stretch, path)
        missing = 0.0
        if state >= 0:
            settled[3] = state
            _write_unchanging(contact, stretch, path, state, record)
        else:
            settled[3] = MARCHED
            missing = _settle_contact(contact, stretch, path, settled, record)
        joints.change[j] = relative_change(missing, _largest_of(record.force))


@compiled(nogil=True, error_model="numpy")
def differentiate_contacts(period: Period, joints: DrivenJoints) -> None:
    """Write the derivatives of settled contacts."""
    shares = np.dot(period.weights, period.basis)
    lead_derivatives, derivatives = (
        _derivatives_for(rows_from_rest(period.lead)),
        _derivatives_for(_round_trip(period.basis)),
    )
    for j in range(len(joints.parameters)):
        contact, settled = contact_of(joints.parameters[j]), joints.settled[j]
        jacobian = joints.jacobian[j]
        if settled[3] == APART:
            jacobian[:] = 0.0
            continue
        before, first, sticks = joints.before[j], derivatives.gradient[0], True
        if settled[3] == STUCK:
            _carry_through(contact, Stretch(0.0, 0.0), rows_from_rest(before), lead_derivatives)
            copy_gradient(lead_derivatives.gradient[-1], first)
        else:
            driven = joints.path[j], before, settled
            sticks = _differentiate(contact, driven, lead_derivatives, derivatives)
        if sticks:
            project_stuck(contact.stiffness, period, shares, first, jacobian)
        else:
            project(contact.stiffness, period.weights, derivatives.gradient, jacobian)
        project_normal(contact.normal_stiffness, period, shares, joints.states[j], jacobian)


@compiled(nogil=True, error_model="numpy")
def energies_of_contacts(period: Period, joints: DrivenJoints) -> None:
    """Write the energies that settled contacts dissipate."""
    for j in range(len(joints.parameters)):
        contact, path, settled = contact_of(joints.parameters[j]), joints.path[j], joints.settled[j]
        lost, stretch = 0.0, Stretch(settled[0], settled[1])
        if settled[3] == MARCHED:
            for step in range(len(path)):
                at = (step + 1) % len(path)
                increment = increment_of(contact, stretch, path, step, at)
                x, y = advance_force(increment)
                lost += energy_lost(increment) / contact.stiffness
                stretch = Stretch(x / contact.stiffness, y / contact.stiffness)
        joints.dissipated[j] = lost
