"""Compiled march of contacts in three dimensions over a period; see :mod:`wear.joints.periodic.march`.

What a contact remembers is the stretch s of its tangential spring, two numbers. Where periods go on
to change the stretch, they will by (1 - A)⁻¹ times the change of one, with A, the derivative of the
stretch after a period with respect to that before: Newton's step, of which few are needed where
slip is so little that the contact would take thousands of periods.

The derivative S of s with respect to the coefficients comes after that, along the period that
repeats and only if it is asked for: what a period makes of 0, and (1 - A)⁻¹ of that at its
beginning. So does the energy.

Increments take and give numbers: rows of arrays, handed to functions, take four times as long.
Arrays are written number by number, as in :mod:`wear.joints.periodic.sliders`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.friction_path import (
    Contact,
    ForcePath,
    ForceSlopes,
    advance_force,
    advance_slopes,
    contact_of,
    energy_lost,
    path_of,
    pressing,
)
from wear.joints.periodic.contact_slopes import (
    copy_gradient,
    project,
    project_normal,
    project_stuck,
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

# A force below the circle by no more than this share of it slips: rounding.
ON_CIRCLE = 1e-12
# What is left of a stretch, as a share, when it is forgotten: rounding of what came since.
FORGOTTEN = 1e-18
# What a contact does in its period; the first two as :func:`_state_of`.
STUCK, MARCHED, APART = 0.0, 1.0, 2.0


class Stretch(NamedTuple):
    """That of the tangential spring [mm]."""

    x: float
    y: float


class Kept(NamedTuple):
    """A, ``(2, 2)`` by rows: what a march makes of a small stretch."""

    xx: float
    xy: float
    yx: float
    yy: float


class ContactRecord(NamedTuple):
    """What is written of a contact in a period: ``force`` ``(t, 3)`` and ``states`` ``(t,)``."""

    force: Array
    states: np.ndarray


@compiled(nogil=True, error_model="numpy")
def _left_to_change(a: Kept) -> float:
    """Determinant of 1 - A; 0 where a period forgets nothing."""
    return (1.0 - a.xx) * (1.0 - a.yy) - a.xy * a.yx


@compiled(nogil=True, error_model="numpy")
def _to_the_limit(a: Kept) -> Kept:
    """1 + A + A² + ... = (1 - A)⁻¹; 1 where a period forgets nothing."""
    determinant = _left_to_change(a)
    if determinant < FORGETTING:
        return Kept(1.0, 0.0, 0.0, 1.0)
    return Kept(
        (1.0 - a.yy) / determinant,
        a.xy / determinant,
        a.yx / determinant,
        (1.0 - a.xx) / determinant,
    )


@compiled(nogil=True, error_model="numpy")
def sticks_throughout(of_x: ForceSlopes, of_y: ForceSlopes) -> bool:
    """Whether a contact keeps its stretch, and what is added to it."""
    off = of_x.force_y != 0.0 or of_y.force_x != 0.0
    return of_x.force_x == 1.0 and of_y.force_y == 1.0 and not off


@compiled(nogil=True, error_model="numpy")
def _chain(of_x: ForceSlopes, of_y: ForceSlopes, a: Kept) -> Kept:
    """A of a march and one increment more."""
    return Kept(
        of_x.force_x * a.xx + of_x.force_y * a.yx,
        of_x.force_x * a.xy + of_x.force_y * a.yy,
        of_y.force_x * a.xx + of_y.force_y * a.yx,
        of_y.force_x * a.xy + of_y.force_y * a.yy,
    )


@compiled(nogil=True, error_model="numpy")
def _state_of(contact: Contact, x: float, y: float, normal: float) -> int:
    """0 stick, 1 slip, 2 separated."""
    if normal <= 0.0:
        return 2
    limit = contact.friction * normal * (1.0 - ON_CIRCLE)
    return 1 if x * x + y * y >= limit * limit else 0


@compiled(nogil=True, error_model="numpy")
def increment_of(
    contact: Contact, stretch: Stretch, path: Array, start: int, end: int
) -> ForcePath:
    """The straight path between two points of a path ``(t, 3)``."""
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
def led_in(contact: Contact, before: Array) -> Stretch:
    """Stretch at the first sample, to which a contact is driven from rest."""
    stretch, points = Stretch(0.0, 0.0), rows_from_rest(before)
    for i in range(len(before)):
        x, y = advance_force(increment_of(contact, stretch, points, i, i + 1))
        stretch = Stretch(x / contact.stiffness, y / contact.stiffness)
    return stretch


@compiled(nogil=True, error_model="numpy")
def _plain_round(
    contact: Contact, stretch: Stretch, path: Array, record: ContactRecord, ended: Stretch
) -> Stretch:
    """One period: forces and states are written.

    A contact that does bit for bit what is written of the period before, which ``ended`` there,
    goes on as it did. Before the first period that is nothing: not a number.
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
def _chained_round(contact: Contact, stretch: Stretch, path: Array) -> Kept:
    """A of one period."""
    samples, kept = len(path), Kept(1.0, 0.0, 0.0, 1.0)
    for step in range(1, samples + 1):
        at = step if step < samples else 0
        x, y, of_x, of_y = advance_slopes(increment_of(contact, stretch, path, step - 1, at))
        stretch = Stretch(x / contact.stiffness, y / contact.stiffness)
        if not sticks_throughout(of_x, of_y):
            kept = _chain(of_x, of_y, kept)
    return kept


@compiled(nogil=True, error_model="numpy")
def _unchanging(contact: Contact, stretch: Stretch, path: Array) -> int:
    """State in which a contact is all period long, 0 or 2 as :func:`_state_of`; -1 where it slips
    or changes it.

    Between samples that hold it holds: the force goes straight, within a limit that is linear.
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
    contact: Contact, stretch: Stretch, path: Array, state: int, record: ContactRecord
) -> None:
    """What a contact does that sticks or is apart all period long."""
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
    contact: Contact, stretch: Stretch, path: Array, settled: Array, record: ContactRecord
) -> float:
    """March until the stretch repeats: change of force.

    ``settled`` becomes the stretch ``(2,)`` at the start of the last period, and the number of it.
    """
    span = max(largest(path[:, 0]), largest(path[:, 1]))
    change, end = 0.0, stretch
    record.force[:] = np.nan
    for number in range(MAX_PERIODS):
        settled[0], settled[1], settled[2] = stretch.x, stretch.y, number + 1.0
        end = _plain_round(contact, stretch, path, record, end)
        x, y = end.x - stretch.x, end.y - stretch.y
        change = max(abs(x), abs(y))
        if change <= REPEATED * span:
            break
        if number < PLAIN_PERIODS:
            stretch = end
            continue
        share = _to_the_limit(_chained_round(contact, stretch, path))
        stretch = Stretch(
            stretch.x + share.xx * x + share.xy * y, stretch.y + share.yx * x + share.yy * y
        )
    missing: float = contact.stiffness * change
    return missing


class Derivatives(NamedTuple):
    """Derivatives of the stretch of a contact on its way through ``n`` points.

    ``functions`` ``(n, m)`` of time there, and their ``steps`` ``(n - 1, m)``; written are the
    ``gradient`` ``(n, 2, 3, m)``, from that at the first point on, and what the way to each point
    makes of a stretch at the first, ``kept`` ``(n, 4)`` as :class:`Kept`.
    """

    functions: Array
    steps: Array
    gradient: Array
    kept: Array


@compiled(nogil=True, error_model="numpy")
def _along(functions: Array) -> Derivatives:
    """Room for derivatives through points with these functions of time."""
    points, size = functions.shape
    steps = np.empty((points - 1, size))
    for t in range(points - 1):
        for c in range(size):
            steps[t, c] = functions[t + 1, c] - functions[t, c]
    return Derivatives(functions, steps, np.zeros((points, 2, 3, size)), np.empty((points, 4)))


@compiled(nogil=True, error_model="numpy")
def _round_trip(points: Array) -> Array:
    """Samples ``(t, n)`` and the first of them again."""
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
    """Carry the gradient along one increment, to a point from the one before.

    ``limit_slope`` is µ kn/kt. An approach before the increment moves both limits.
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
def _carried(
    contact: Contact, stretch: Stretch, points: Array, derivatives: Derivatives
) -> tuple[Stretch, bool]:
    """Drive a contact through points with the derivatives carried along; whether it sticks."""
    sticks, kept = True, Kept(1.0, 0.0, 0.0, 1.0)
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
def _repeat(derivatives: Derivatives) -> bool:
    """Make the gradient of 0 that of a period that repeats; whether it forgets enough for that."""
    gradient, kept = derivatives.gradient, derivatives.kept
    xx, xy, yx, yy = kept[-1, 0], kept[-1, 1], kept[-1, 2], kept[-1, 3]
    a = Kept(xx, xy, yx, yy)
    if _left_to_change(a) < FORGETTING:
        return False
    share, first, last = _to_the_limit(a), gradient[0], gradient[-1]
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
    contact: Contact,
    driven: tuple[Array, Array, Array],
    way_in: Derivatives,
    derivatives: Derivatives,
) -> bool:
    """Gradient of the stretch in the period that repeats: whether it sticks throughout.

    ``driven`` are path, way to it, and where it has settled. A contact that forgets too little of
    how it began carries the derivative from there.
    """
    path, before, settled = driven
    points, gradient = _round_trip(path), derivatives.gradient
    gradient[0] = 0.0
    _, sticks = _carried(contact, Stretch(settled[0], settled[1]), points, derivatives)
    if _repeat(derivatives):
        return sticks
    stretch, _ = _carried(contact, Stretch(0.0, 0.0), rows_from_rest(before), way_in)
    copy_gradient(way_in.gradient[-1], gradient[-1])
    for _ in range(int(settled[2])):
        copy_gradient(gradient[-1], gradient[0])
        stretch, sticks = _carried(contact, stretch, points, derivatives)
    copy_gradient(gradient[-1], gradient[0])
    return sticks


@compiled(nogil=True, error_model="numpy")
def _largest_of(force: Array) -> float:
    """The largest component of forces ``(t, 3)``."""
    return max(largest(force[:, 0]), largest(force[:, 1]), largest(force[:, 2]))


@compiled(nogil=True, error_model="numpy")
def settle_contacts(period: Period, joints: DrivenJoints) -> None:
    """Settle contacts; parameters are those of the law.

    Neither derivatives nor energies are written. ``settled`` is what is needed for these: stretch
    at the first sample, number of periods, and what the contact does in them.
    """
    for j in range(len(joints.parameters)):
        contact, path, settled = contact_of(joints.parameters[j]), joints.path[j], joints.settled[j]
        record = ContactRecord(joints.force[j], joints.states[j])
        stretch = led_in(contact, joints.before[j])
        # Most contacts of a pad: in closed form.
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
    """Write the derivatives of contacts that have settled."""
    shares = np.dot(period.weights, period.basis)
    way_in, derivatives = _along(rows_from_rest(period.lead)), _along(_round_trip(period.basis))
    for j in range(len(joints.parameters)):
        contact, settled = contact_of(joints.parameters[j]), joints.settled[j]
        jacobian = joints.jacobian[j]
        if settled[3] == APART:
            jacobian[:] = 0.0
            continue
        before, first, sticks = joints.before[j], derivatives.gradient[0], True
        if settled[3] == STUCK:
            _carried(contact, Stretch(0.0, 0.0), rows_from_rest(before), way_in)
            copy_gradient(way_in.gradient[-1], first)
        else:
            driven = joints.path[j], before, settled
            sticks = _differentiate(contact, driven, way_in, derivatives)
        if sticks:
            project_stuck(contact.stiffness, period, shares, first, jacobian)
        else:
            project(contact.stiffness, period.weights, derivatives.gradient, jacobian)
        project_normal(contact.normal_stiffness, period, shares, joints.states[j], jacobian)


@compiled(nogil=True, error_model="numpy")
def energies_of_contacts(period: Period, joints: DrivenJoints) -> None:
    """Write the energies that contacts dissipate which have settled."""
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
