"""One compiled increment of a friction contact: forces, derivatives and energy.

:mod:`wear.joints.friction_contact` describes the problem and its solution.
"""

from __future__ import annotations

from math import ceil, exp, expm1, log, sqrt
from typing import NamedTuple

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled

LONGEST = 300.0  # Largest L: the angle has vanished long before, and exp(-2 L) does not underflow.
LAST = 1e-9  # Share of the limit at which a lift-off is over: its square is below rounding.
CLOSE = 0.03  # Value of (b - a)/(b + a) below which the logarithmic mean is summed as a series.
TERMS = 5  # Terms of this series: CLOSE**(2 TERMS) is below rounding.
MEAN_SERIES = tuple(1.0 / (2 * j + 1) for j in range(TERMS, -1, -1))
SLOPE_SERIES = tuple(2 * j / (2 * j + 1) for j in range(TERMS, 0, -1))
NEGLIGIBLE = 1e-16  # Share of an energy that is rounding.
FADING = 1.0  # Exponent above which powers of exp(-2 L η) do not cancel in their difference.
TURNED = 0.1  # Value of tan²(ψ/2) below which 1 - cos ψ is summed as a series of its powers.
POWERS, POWER_BELOW = 16, 1e-16  # Most powers of this series, and the power that is rounding.
ROUNDING = 1e-16  # Fraction of an increment that is rounding.
PANEL = 0.8  # Exponent per panel of the quadrature: the error of six points is then 1e-14.
PANELS = 1000  # More panels than any finite path needs, so that a diverged path ends too.
NODES, WEIGHTS = (0.5 * rule for rule in np.polynomial.legendre.leggauss(6))
NODES = NODES + 0.5


class ForcePath(NamedTuple):
    """A straight path in contact, in terms of forces [N].

    ``force_x`` and ``force_y`` are the force of the tangential spring at its start, within the
    circle there. ``pull_x`` and ``pull_y`` are the force that the path would add if the slider
    held. ``start`` and ``end`` are the limit µ f at both ends.
    """

    force_x: float
    force_y: float
    pull_x: float
    pull_y: float
    start: float
    end: float


class ForceSlopes(NamedTuple):
    """Derivatives of a force or an angle at the end of a path with respect to the path's fields."""

    force_x: float
    force_y: float
    pull_x: float
    pull_y: float
    start: float
    end: float


# Derivatives of both components for a slider that holds, and for a separated contact.
HELD_X = ForceSlopes(1.0, 0.0, 1.0, 0.0, 0.0, 0.0)
HELD_Y = ForceSlopes(0.0, 1.0, 0.0, 1.0, 0.0, 0.0)
SEPARATED = ForceSlopes(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Slip(NamedTuple):
    """The part of a path on which the slider slips, after the fraction ``held``.

    ``limit`` and ``force_x``, ``force_y`` are the limit and the direction of the force where slip
    begins, ``pull`` and ``pull_x``, ``pull_y`` the size and direction of the pull. With ψ the angle
    from pull to force there, ``toward`` is 1 + cos ψ, ``away`` 1 - cos ψ and ``sine`` sin ψ.
    ``rate`` is dL/d|k|, ``length`` is L over the slip and ``decay`` exp(-L).
    """

    held: float
    limit: float
    force_x: float
    force_y: float
    pull: float
    pull_x: float
    pull_y: float
    toward: float
    away: float
    sine: float
    rate: float
    length: float
    decay: float


@compiled(error_model="numpy")
def _length(x: float, y: float) -> float:
    """Return the length of a vector.

    hypot takes several times as long, and only differs for numbers whose squares overflow or
    underflow.
    """
    return sqrt(x * x + y * y)


@compiled(error_model="numpy")
def _held(path: ForcePath) -> float:
    """Return the fraction of a path on which the slider holds: the first root of |t0 + k s| = R(s).

    It is 1 if there is no such root on the path.
    """
    (x, y), (px, py), limit = path[:2], path[2:4], path.start
    if (x + px) ** 2 + (y + py) ** 2 < path.end * path.end:
        return 1.0  # By far the most frequent case: a chord within a cone stays there.
    change = path.end - limit
    pull, force = _length(px, py), _length(x, y)
    square = (pull - change) * (pull + change)
    half_slope = x * px + y * py - limit * change
    constant = min((force - limit) * (force + limit), 0.0)
    if -constant < ROUNDING * half_slope:
        return 0.0  # The slider slips already.
    # The discriminant half_slope² - square constant, without products that cancel at a small limit.
    drift, cross = _length(limit * px - change * x, limit * py - change * y), abs(x * py - y * px)
    root = sqrt(max((drift - cross) * (drift + cross), 0.0))
    if half_slope > 0.0:
        return min(-constant / (half_slope + root), 1.0)
    if square > 0.0:
        return min((root - half_slope) / square, 1.0)
    return 1.0  # The circle grows at least as fast as the force.


@compiled(error_model="numpy")
def _inverse_mean(a: float, b: float) -> float:
    """Return ln(b/a)/(b - a): the mean of 1/R over a limit that changes linearly from a to b."""
    x = (b - a) / (a + b)
    if abs(x) > CLOSE:
        return log(b / a) / (b - a)
    square, total = x * x, 0.0
    for coefficient in MEAN_SERIES:
        total = total * square + coefficient
    return 2.0 * total / (a + b)


@compiled(error_model="numpy")
def _inverse_mean_slopes(a: float, b: float) -> tuple[float, float]:
    """Return the derivatives of :func:`_inverse_mean` with respect to a and b."""
    x, mean = (b - a) / (a + b), _inverse_mean(a, b)
    if abs(x) > CLOSE:
        return (mean - 1.0 / a) / (b - a), (1.0 / b - mean) / (b - a)
    square, slope = x * x, 0.0
    for coefficient in SLOPE_SERIES:
        slope = slope * square + coefficient
    slope *= 4.0 * x / (a + b) ** 3
    return -mean / (a + b) - b * slope, -mean / (a + b) + a * slope


@compiled(error_model="numpy")
def _slip(path: ForcePath, held: float) -> Slip:
    """Return the slip that begins at the fraction ``held`` of a path and lasts to its end."""
    limit = path.start + held * (path.end - path.start)
    x, y = path.force_x + held * path.pull_x, path.force_y + held * path.pull_y
    force, pull = _length(x, y), _length(path.pull_x, path.pull_y)
    # Without a pull the force keeps its direction; without a force it takes the pull's direction.
    px, py = (path.pull_x / pull, path.pull_y / pull) if pull > 0.0 else (x / force, y / force)
    ex, ey = (x / force, y / force) if limit > 0.0 and force > 0.0 else (px, py)
    cosine, sine = ex * px + ey * py, px * ey - py * ex
    # Use the sine where the cosine cancels: it decides how a force against the pull turns.
    if cosine > 0.0:
        toward = 1.0 + cosine
        away = sine * sine / toward
    else:
        away = 1.0 - cosine
        toward = sine * sine / away
    rate, length = 0.0, LONGEST
    if limit > 0.0:
        rate = (1.0 - held) * _inverse_mean(limit, path.end)
        length = pull * rate
    decay = exp(-min(length, LONGEST))
    return Slip(held, limit, ex, ey, pull, px, py, toward, away, sine, rate, length, decay)


@compiled(error_model="numpy")
def _direction(slip: Slip) -> tuple[float, float]:
    """Return the direction of the force at the end of a slip."""
    away = slip.away * slip.decay * slip.decay
    cosine = (slip.toward - away) / (slip.toward + away)
    sine = 2.0 * slip.sine * slip.decay / (slip.toward + away)
    x = cosine * slip.pull_x - sine * slip.pull_y
    y = cosine * slip.pull_y + sine * slip.pull_x
    return x, y


@compiled(error_model="numpy")
def _turning(path: ForcePath, slip: Slip) -> ForceSlopes:
    """Return the derivatives of the angle of the force at the end of a slip.

    With ψ' ~ sin ψ, ∂ψ1/∂ψ0 = sin ψ1/sin ψ0 and ∂ψ1/∂L = -sin ψ1.
    """
    decay = slip.decay
    over = slip.toward + slip.away * decay * decay
    memory, sine = 2.0 * decay / over, 2.0 * slip.sine * decay / over
    # The angle by which the force follows when the pull turns, 1 - memory, per |k|.
    following = -expm1(-slip.length) / slip.pull if slip.pull > 0.0 else slip.rate
    following *= (slip.toward - slip.away * decay) / over
    along = sine * slip.rate
    if slip.limit > 0.0:
        memory /= slip.limit
        at_start, at_end = _inverse_mean_slopes(slip.limit, path.end)
    else:
        memory, at_start, at_end = 0.0, 0.0, 0.0
    left = 1.0 - slip.held
    shorter = sine * slip.pull * left
    return ForceSlopes(
        -memory * slip.force_y,
        memory * slip.force_x,
        -memory * slip.held * slip.force_y - following * slip.pull_y - along * slip.pull_x,
        memory * slip.held * slip.force_x + following * slip.pull_x - along * slip.pull_y,
        -shorter * at_start * left,
        -shorter * (at_start * slip.held + at_end),
    )


@compiled(error_model="numpy")
def _lost_in_slip(path: ForcePath, slip: Slip) -> float:
    """Return kt times the energy lost in a slip, ∫ R (k·e - R') ds [N²].

    It is the loss of a force along the pull, less ∫ R |k| (1 - cos ψ) ds. The latter is integrated
    over the share η of L: then R = R0 (R1/R0)^η, and 1 - cos ψ is rational in exp(-2 L η).
    """
    left = 1.0 - slip.held
    straight = 0.5 * (slip.limit + path.end) * (slip.pull - path.end + path.start) * left
    if slip.away == 0.0 or slip.length == 0.0 or straight <= 0.0:
        return max(straight, 0.0)
    square, ratio = slip.limit * slip.limit, slip.away / slip.toward
    if square * ratio <= NEGLIGIBLE * straight:
        return straight
    growth, decay = 2.0 * log(path.end / slip.limit), 2.0 * slip.length
    # Integrate by quadrature while the force turns, then by the powers of exp(-2 L η).
    turning = 1.0
    if decay - growth > FADING:
        turning = min(max(log(ratio / TURNED) / decay, 0.0), 1.0)
    turned = 0.0
    if turning > 0.0:
        turned = _turning_by_rule(slip, growth, decay, turning)
    if turning < 1.0:
        turned += _turning_by_powers(ratio, growth, decay, turning)
    return max(straight - turned * slip.length * square, 0.0)


@compiled(error_model="numpy")
def _turning_by_rule(slip: Slip, growth: float, decay: float, share: float) -> float:
    """Return ∫ exp(growth η) (1 - cos ψ) dη from 0 to a share, by Gauss's rule.

    tan²(ψ/2) decays by exp(-decay η).
    """
    asked = share * max(abs(growth), decay) / PANEL
    panels = ceil(asked) if asked < PANELS else PANELS
    width, turned = share / panels, 0.0
    for panel in range(panels):
        for node in range(NODES.size):
            at = (panel + NODES[node]) * width
            away = slip.away * exp(-decay * at)
            turned += WEIGHTS[node] * exp(growth * at) * 2.0 * away / (slip.toward + away)
    return turned * width


@compiled(error_model="numpy")
def _turning_by_powers(ratio: float, growth: float, decay: float, share: float) -> float:
    """Return the same integral from a share to 1, where tan²(ψ/2) is below ``TURNED``.

    ``ratio`` is tan²(ψ/2) at the beginning.
    """
    start, end = exp(growth * share), exp(growth)
    power_start, power_end = ratio * exp(-decay * share), ratio * exp(-decay)
    step_start, step_end = power_start, power_end
    turned, sign = 0.0, 2.0
    for order in range(1, POWERS + 1):
        turned += sign * (start * power_start - end * power_end) / (order * decay - growth)
        if power_start < POWER_BELOW:
            break
        power_start, power_end, sign = power_start * step_start, power_end * step_end, -sign
    return turned


@compiled(error_model="numpy")
def _lost_in_lift_off(path: ForcePath, contact: float) -> float:
    """Return kt times the energy lost on a path that lifts off after the fraction ``contact``."""
    share = contact * (1.0 - LAST)
    last = ForcePath(
        path.force_x,
        path.force_y,
        share * path.pull_x,
        share * path.pull_y,
        path.start,
        LAST * path.start,
    )
    held = _held(last)
    return _lost_in_slip(last, _slip(last, held)) if held < 1.0 else 0.0


@compiled(error_model="numpy")
def _force_in_contact(path: ForcePath) -> tuple[float, float, ForceSlopes, ForceSlopes]:
    """Return the tangential force at the end of a path in contact, and its derivatives."""
    held = _held(path)
    if held == 1.0:
        x, y = path.force_x + path.pull_x, path.force_y + path.pull_y
        return x, y, HELD_X, HELD_Y
    slip = _slip(path, held)
    x, y = _direction(slip)
    turning = _turning(path, slip)
    of_x, of_y = _scaled(turning, -path.end * y, x), _scaled(turning, path.end * x, y)
    return path.end * x, path.end * y, of_x, of_y


@compiled(error_model="numpy")
def _scaled(slopes: ForceSlopes, factor: float, added: float) -> ForceSlopes:
    """Return slopes times a factor, with ``added`` for the limit at the end."""
    return ForceSlopes(
        factor * slopes.force_x,
        factor * slopes.force_y,
        factor * slopes.pull_x,
        factor * slopes.pull_y,
        factor * slopes.start,
        factor * slopes.end + added,
    )


@compiled(error_model="numpy")
def _chain_return(x: float, y: float, limit: float, slopes: ForceSlopes) -> ForceSlopes:
    """Chain the derivatives with those of the return of a force (x, y) onto the circle."""
    force = _length(x, y)
    x, y, shrink = x / force, y / force, limit / force
    radial = slopes.force_x * x + slopes.force_y * y
    across = shrink * (slopes.force_y * x - slopes.force_x * y)
    return ForceSlopes(
        -across * y, across * x, slopes.pull_x, slopes.pull_y, slopes.start + radial, slopes.end
    )


@compiled(error_model="numpy")
def _chain_touch(path: ForcePath, slopes: ForceSlopes) -> ForceSlopes:
    """Chain the derivatives with those of the touch on a path whose limit is negative at its start.

    The force forgets its earlier value.
    """
    change = path.end - path.start
    entry = path.start / (path.start - path.end)
    missed = (slopes.pull_x * path.pull_x + slopes.pull_y * path.pull_y) / change
    left = 1.0 - entry
    return ForceSlopes(
        0.0,
        0.0,
        slopes.pull_x * left,
        slopes.pull_y * left,
        missed * left,
        slopes.end + missed * entry,
    )


@compiled(error_model="numpy")
def _part_in_contact(path: ForcePath) -> ForcePath:
    """Return the part of a path that is in contact at its end, from a force within the circle.

    The limit may be negative at its start: no contact there. A force outside the circle (the limit
    has fallen since) slips back onto it.
    """
    start, x, y = max(path.start, 0.0), path.force_x, path.force_y
    force = _length(x, y)
    if force > start:
        x, y = x * start / force, y * start / force
    entry = 0.0 if path.start > 0.0 else path.start / (path.start - path.end)
    left = 1.0 - entry
    return ForcePath(x, y, left * path.pull_x, left * path.pull_y, start, path.end)


@compiled(error_model="numpy")
def advance_force(path: ForcePath) -> tuple[float, float]:
    """Return the tangential force at the end of an increment, without derivatives or energy."""
    if path.end <= 0.0:
        return 0.0, 0.0
    contact = _part_in_contact(path)
    held = _held(contact)
    if held == 1.0:
        return contact.force_x + contact.pull_x, contact.force_y + contact.pull_y
    x, y = _direction(_slip(contact, held))
    return path.end * x, path.end * y


@compiled(error_model="numpy")
def advance_slopes(path: ForcePath) -> tuple[float, float, ForceSlopes, ForceSlopes]:
    """Return the force of :func:`advance_force` with the derivatives of its two components."""
    if path.end <= 0.0:
        return 0.0, 0.0, SEPARATED, SEPARATED
    x, y, of_x, of_y = _force_in_contact(_part_in_contact(path))
    if path.start <= 0.0:
        return x, y, _chain_touch(path, of_x), _chain_touch(path, of_y)
    before_x, before_y, start = path.force_x, path.force_y, path.start
    if _length(before_x, before_y) > start:
        of_x = _chain_return(before_x, before_y, start, of_x)
        of_y = _chain_return(before_x, before_y, start, of_y)
    return x, y, of_x, of_y


@compiled(error_model="numpy")
def energy_lost(path: ForcePath) -> float:
    """Return kt times the energy lost in an increment; limits may be negative: no contact."""
    start = max(path.start, 0.0)
    force = _length(path.force_x, path.force_y)
    lost = 0.5 * (force - start) * (force + start) if force > start else 0.0
    if path.end <= 0.0:
        if start > 0.0:
            lost += _lost_in_lift_off(_part_in_contact(path), start / (start - path.end))
        return lost
    contact = _part_in_contact(path)
    held = _held(contact)
    return lost + _lost_in_slip(contact, _slip(contact, held)) if held < 1.0 else lost


class ContactLaw(NamedTuple):
    """The parameters of one joint of :class:`wear.joints.friction_contact.FrictionContact`."""

    stiffness: float
    normal_stiffness: float
    friction: float
    preload: float
    gap: float


@compiled(error_model="numpy")
def contact_of(parameters: Array) -> ContactLaw:
    """Return the contact of a row of parameters ``(5,)``."""
    return ContactLaw(parameters[0], parameters[1], parameters[2], parameters[3], parameters[4])


@compiled(error_model="numpy")
def pressing(contact: ContactLaw, approach: float) -> float:
    """Return the normal force, which is negative where the contact is apart."""
    return contact.preload + contact.normal_stiffness * (approach - contact.gap)


@compiled(error_model="numpy")
def path_of(
    contact: ContactLaw, x: float, y: float, step_x: float, step_y: float, start: float, end: float
) -> ForcePath:
    """Return the path of a contact with the stretch (x, y) [mm] between two approaches."""
    stiffness, friction = contact.stiffness, contact.friction
    return ForcePath(
        stiffness * x,
        stiffness * y,
        stiffness * step_x,
        stiffness * step_y,
        friction * pressing(contact, start),
        friction * pressing(contact, end),
    )


@compiled(error_model="numpy")
def advance_contact(
    parameters: Array, start: Array, increment: Array, force: Array, end: Array, jacobian: Array
) -> float:
    """Advance one joint by an increment of displacement ``(3,)``; return the energy it loses.

    It is made for compiled loops and allocates nothing.

    Parameters
    ----------
    parameters
        A row of those of :class:`wear.joints.friction_contact.FrictionContact` ``(5,)``.
    start
        State at the beginning ``(3,)``.
    increment
        Increment of displacement ``(3,)`` [mm].
    force
        Written: force at the end of the increment ``(3,)``.
    end
        Written: state at the end of the increment ``(3,)``; may be ``start``.
    jacobian
        Written: derivative of the force with respect to the state at the start (first three
        columns) and the increment (the others) ``(3, 6)``. The state follows the force: its
        derivatives are those of the tangential force divided by kt, and of z + dz.
    """
    contact = contact_of(parameters)
    approach = start[2] + increment[2]
    path = path_of(contact, start[0], start[1], increment[0], increment[1], start[2], approach)
    x, y, of_x, of_y = advance_slopes(path)
    energy: float = energy_lost(path) / contact.stiffness
    after = pressing(contact, approach)
    _in_displacements(contact, of_x, jacobian[0])
    _in_displacements(contact, of_y, jacobian[1])
    jacobian[2] = 0.0
    if after > 0.0:
        jacobian[2, 2] = jacobian[2, 5] = contact.normal_stiffness
    force[0], force[1], force[2] = x, y, max(after, 0.0)
    end[0], end[1], end[2] = x / contact.stiffness, y / contact.stiffness, approach
    return energy


@compiled(error_model="numpy")
def _in_displacements(contact: ContactLaw, slopes: ForceSlopes, row: Array) -> None:
    """Write the derivatives ``(6,)`` by stretch, approach and increment."""
    limit_slope = contact.friction * contact.normal_stiffness
    row[0], row[1] = contact.stiffness * slopes.force_x, contact.stiffness * slopes.force_y
    row[3], row[4] = contact.stiffness * slopes.pull_x, contact.stiffness * slopes.pull_y
    row[2], row[5] = limit_slope * (slopes.start + slopes.end), limit_slope * slopes.end
