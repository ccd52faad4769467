"""A point of a contact in three dimensions: unilateral normal spring, Coulomb's circular cone.

Along z the joint presses with ``f = max(N0 + kn (z - gap), 0)``: **z > 0 closes the contact**, it
is the approach of the second point to the first. Along x and y a spring kt ends on a slider that
holds while its force t stays within the circle ``|t| <= µ f``; where the circle shrinks onto the
force or the spring is pulled beyond it, the slider moves along t. Without pressure the circle is a
point: a joint that lifts off forgets where its slider was, and one that touches again starts
without tangential force at the point where it touches. The force contains the preload: a structure
at rest needs the load that balances it.

(The unilateral element with variable normal load along one direction: Petrov and Ewins 2003,
doi:10.1115/1.1539868; a slider on the circle: Sanliturk and Ewins 1996, J. Sound Vib. 193, 511.
The rules below are derived here.)

An increment is solved exactly for a straight path s = 0..1, on which the limit R(s) = µ f is linear
while the contact presses. With e = t/|t| and the pull k = kt du, the force that the increment would
add to the spring of a slider that holds:

- *Stick*: t = t0 + k s, until |t| = R: a quadratic.
- *Slip*: t = R e and R e' = k - (k·e) e. The angle ψ from k to e obeys R ψ' = -|k| sin ψ, so that
  tan(ψ/2) decays by exp(-L) with L = |k| ∫ ds / R, a logarithm of R1/R0; the slider moves by
  (k·e - R')/kt >= 0 per s.
- |ψ| only falls, so that slip once begun grows until the end of the straight path: the slider is
  caught (k·e < R') only where a new increment begins. A path is therefore, at most: apart, touch,
  stick, slip, apart; since f is linear it cannot both touch and lift off.

The derivative needs no derivative of the point where slip begins: shifting that point changes the
force by (k - R e' - R' e) ds, which is along e, where the circle fixes it.

The energy lost is ∫ R (k·e - R') ds / kt, elementary for constant R or for slip along the path,
otherwise a hypergeometric function, since cos ψ = tanh(constant + L): what the elementary part
leaves while the force turns is integrated by Gauss's rule to 1e-13.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil, exp, expm1, hypot, log, sqrt
from typing import NamedTuple

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.parameters import (
    CompiledLaw,
    JointError,
    Parameter,
    parameter_columns,
    require_not_negative,
    require_positive,
)

LONGEST = 300.0  # L: nothing is left of the angle long before, and exp(-2 L) is still a number
LAST = 1e-9  # of the limit at which a lift-off is taken to be over: its square is below rounding
CLOSE = 0.03  # of (b - a)/(b + a): below it the logarithmic mean is a series
TERMS = 5  # of this series: CLOSE**(2 TERMS) is below rounding
NEGLIGIBLE = 36.0  # exponent: exp(-36) is rounding
PANEL = 0.8  # of the exponent per panel: six points leave 1e-14 of tanh there
PANELS = 1000  # more than any finite path asks for: a diverged one must still come to an end
NODES, WEIGHTS = (0.5 * rule for rule in np.polynomial.legendre.leggauss(6))
NODES = NODES + 0.5


class ForcePath(NamedTuple):
    """A straight path in contact, in terms of forces [N].

    Force of the tangential spring at its start (within the circle there), ``pull`` that the path
    would add if the slider held, and the limit µ f at its two ends.
    """

    force_x: float
    force_y: float
    pull_x: float
    pull_y: float
    start: float
    end: float


class Slip(NamedTuple):
    """The part of a path on which the slider slips, after the fraction ``held``.

    ``limit`` and direction of the force where slip begins, size and direction of the pull;
    ``toward`` 1 + cos ψ, ``away`` 1 - cos ψ and ``sine`` sin ψ of the angle from pull to force
    there; ``rate`` dL/d|k|, ``length`` L over the slip and ``decay`` exp(-L).
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
def _held(path: ForcePath) -> float:
    """Fraction of a path on which the slider holds: first root of |t0 + k s| = R(s), or 1."""
    (x, y), (px, py), limit = path[:2], path[2:4], path.start
    change = path.end - limit
    pull, force = hypot(px, py), hypot(x, y)
    square = (pull - change) * (pull + change)
    half_slope = x * px + y * py - limit * change
    constant = min((force - limit) * (force + limit), 0.0)
    # half_slope² - square constant, without the products that cancel when the limit vanishes
    drift, cross = hypot(limit * px - change * x, limit * py - change * y), abs(x * py - y * px)
    root = sqrt(max((drift - cross) * (drift + cross), 0.0))
    if half_slope > 0.0:
        return min(-constant / (half_slope + root), 1.0)
    if square > 0.0:
        return min((root - half_slope) / square, 1.0)
    return 1.0  # the circle grows at least as fast as the force


@compiled(error_model="numpy")
def _inverse_mean(a: float, b: float) -> float:
    """ln(b/a)/(b - a): the mean of 1/R over a limit that changes linearly from a to b."""
    x = (b - a) / (a + b)
    if abs(x) > CLOSE:
        return log(b / a) / (b - a)
    total = 0.0
    for j in range(TERMS, -1, -1):
        total = total * x * x + 1.0 / (2 * j + 1)
    return 2.0 * total / (a + b)


@compiled(error_model="numpy")
def _inverse_mean_slopes(a: float, b: float) -> tuple[float, float]:
    """Derivatives of :func:`_inverse_mean` with respect to a and b."""
    x, mean = (b - a) / (a + b), _inverse_mean(a, b)
    if abs(x) > CLOSE:
        return (mean - 1.0 / a) / (b - a), (1.0 / b - mean) / (b - a)
    slope = 0.0
    for j in range(TERMS, 0, -1):
        slope = slope * x * x + 2 * j / (2 * j + 1)
    slope *= 4.0 * x / (a + b) ** 3
    return -mean / (a + b) - b * slope, -mean / (a + b) + a * slope


@compiled(error_model="numpy")
def _slip(path: ForcePath, held: float) -> Slip:
    """Slip that begins at the fraction ``held`` of a path and lasts to its end."""
    limit = path.start + held * (path.end - path.start)
    x, y = path.force_x + held * path.pull_x, path.force_y + held * path.pull_y
    force, pull = hypot(x, y), hypot(path.pull_x, path.pull_y)
    # Without a pull the force keeps its direction; without a force it takes that of the pull.
    px, py = (path.pull_x / pull, path.pull_y / pull) if pull > 0.0 else (x / force, y / force)
    ex, ey = (x / force, y / force) if limit > 0.0 and force > 0.0 else (px, py)
    cosine, sine = ex * px + ey * py, px * ey - py * ex
    # From the sine where the cosine cancels: a force against the pull turns by this remainder.
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
    """Direction of the force at the end of a slip."""
    away = slip.away * slip.decay * slip.decay
    cosine = (slip.toward - away) / (slip.toward + away)
    sine = 2.0 * slip.sine * slip.decay / (slip.toward + away)
    x = cosine * slip.pull_x - sine * slip.pull_y
    y = cosine * slip.pull_y + sine * slip.pull_x
    return x, y


@compiled(error_model="numpy")
def _turning(path: ForcePath, slip: Slip) -> tuple[float, float, float, float, float, float]:
    """Derivative of the angle of the force at the end of a slip.

    With respect to the six numbers of the path, in the order force, limit at the start, pull,
    limit at the end. With ψ' ~ sin ψ, ∂ψ1/∂ψ0 = sin ψ1/sin ψ0 and ∂ψ1/∂L = -sin ψ1.
    """
    decay = slip.decay
    over = slip.toward + slip.away * decay * decay
    memory, sine = 2.0 * decay / over, 2.0 * slip.sine * decay / over
    # 1 - memory, per |k|: how far the force follows when the pull turns
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
    return (
        -memory * slip.force_y,
        memory * slip.force_x,
        -shorter * at_start * left,
        -memory * slip.held * slip.force_y - following * slip.pull_y - along * slip.pull_x,
        memory * slip.held * slip.force_x + following * slip.pull_x - along * slip.pull_y,
        -shorter * (at_start * slip.held + at_end),
    )


@compiled(error_model="numpy")
def _lost_in_slip(path: ForcePath, slip: Slip) -> float:
    """kt times the energy lost in a slip, ∫ R (k·e - R') ds [N²].

    As if the force had the direction of the pull, less ∫ R |k| (1 - cos ψ) ds, over the share η of
    L: then R = R0 (R1/R0)^η, and 1 - cos ψ is rational in exp(-2 L η).
    """
    left = 1.0 - slip.held
    straight = 0.5 * (slip.limit + path.end) * (slip.pull - path.end + path.start) * left
    if slip.away == 0.0 or slip.length == 0.0 or straight <= 0.0:
        return max(straight, 0.0)
    growth, decay = 2.0 * log(path.end / slip.limit), 2.0 * slip.length
    # What is left of the integral at η is at most R0² (1 - cos ψ0)/(1 + cos ψ0) exp((growth -
    # decay) η): it ends where that is negligible, for a force along the pull before it begins.
    most = slip.limit * slip.limit * slip.away / slip.toward
    exponent = NEGLIGIBLE + log(most / straight)
    if exponent <= 0.0:
        return straight
    share = exponent / (decay - growth)
    if not 0.0 < share < 1.0:
        share = 1.0
    asked = share * max(abs(growth), decay) / PANEL
    panels = ceil(asked) if asked < PANELS else PANELS
    width, turned = share / panels, 0.0
    for panel in range(panels):
        for node in range(NODES.size):
            at = (panel + NODES[node]) * width
            away = slip.away * exp(-decay * at)
            turned += WEIGHTS[node] * exp(growth * at) * 2.0 * away / (slip.toward + away)
    turned *= width * slip.length * slip.limit * slip.limit
    return max(straight - turned, 0.0)


@compiled(error_model="numpy")
def _follow(path: ForcePath, jacobian: Array) -> tuple[float, float, float]:
    """Tangential force at the end of a path in contact, and kt times the energy lost.

    Its derivative is written into ``jacobian[:2]``, in the order of :func:`_turning`.
    """
    held = _held(path)
    if held == 1.0:
        jacobian[0, 0] = jacobian[0, 3] = jacobian[1, 1] = jacobian[1, 4] = 1.0
        return path.force_x + path.pull_x, path.force_y + path.pull_y, 0.0
    slip = _slip(path, held)
    x, y = _direction(slip)
    for column, turning in enumerate(_turning(path, slip)):
        jacobian[0, column] = -path.end * y * turning
        jacobian[1, column] = path.end * x * turning
    jacobian[0, 5] += x
    jacobian[1, 5] += y
    return path.end * x, path.end * y, _lost_in_slip(path, slip)


@compiled(error_model="numpy")
def _lost_in_lift_off(path: ForcePath, contact: float) -> float:
    """kt times the energy lost on a path that lifts off after the fraction ``contact``."""
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
def _pulled_back(x: float, y: float, limit: float, jacobian: Array) -> None:
    """Chain the derivative with that of the return of a force (x, y) onto the circle."""
    force = hypot(x, y)
    x, y, shrink = x / force, y / force, limit / force
    for row in range(2):
        radial = jacobian[row, 0] * x + jacobian[row, 1] * y
        across = shrink * (jacobian[row, 1] * x - jacobian[row, 0] * y)
        jacobian[row, 0], jacobian[row, 1] = -across * y, across * x
        jacobian[row, 2] += radial


@compiled(error_model="numpy")
def _in_displacements(stiffness: float, limit_slope: float, jacobian: Array) -> None:
    """Chain the derivative from forces and limits to elongation, approach and increment."""
    for row in range(2):
        for column in (0, 1, 3, 4):
            jacobian[row, column] *= stiffness
        jacobian[row, 2] = limit_slope * (jacobian[row, 2] + jacobian[row, 5])
        jacobian[row, 5] *= limit_slope


@compiled(error_model="numpy")
def _touching(entry: float, pull_x: float, pull_y: float, change: float, jacobian: Array) -> None:
    """Chain the derivative with that of the touch after the fraction ``entry`` of an increment.

    The pull is that of the whole increment, ``change`` that of the limit µ f, negative before the
    touch. The force forgets what it was before.
    """
    for row in range(2):
        missed = (jacobian[row, 3] * pull_x + jacobian[row, 4] * pull_y) / change
        jacobian[row, 0] = jacobian[row, 1] = 0.0
        jacobian[row, 2] = missed * (1.0 - entry)
        jacobian[row, 3] *= 1.0 - entry
        jacobian[row, 4] *= 1.0 - entry
        jacobian[row, 5] += missed * entry


@compiled(error_model="numpy")
def _tangential(path: ForcePath, jacobian: Array) -> tuple[float, float, float]:
    """Tangential force at the end of an increment, and kt times the energy lost.

    The limits of ``path`` may be negative here: no contact. A force outside the circle at the start
    (the limit has shrunk since) slips back onto it.
    """
    start = max(path.start, 0.0)
    force = hypot(path.force_x, path.force_y)
    lost, x, y = 0.0, path.force_x, path.force_y
    if force > start:
        lost = 0.5 * (force - start) * (force + start)
        x, y = x * start / force, y * start / force
    if path.end <= 0.0:
        if start > 0.0:
            leaving = ForcePath(x, y, path.pull_x, path.pull_y, start, path.end)
            lost += _lost_in_lift_off(leaving, start / (start - path.end))
        return 0.0, 0.0, lost
    entry = 0.0 if path.start > 0.0 else path.start / (path.start - path.end)
    pull_x, pull_y = (1.0 - entry) * path.pull_x, (1.0 - entry) * path.pull_y
    end_x, end_y, slipped = _follow(ForcePath(x, y, pull_x, pull_y, start, path.end), jacobian)
    if path.start <= 0.0:
        _touching(entry, path.pull_x, path.pull_y, path.end - path.start, jacobian)
    elif force > start:
        _pulled_back(path.force_x, path.force_y, start, jacobian)
    return end_x, end_y, lost + slipped


@compiled(error_model="numpy")
def advance_contact(
    parameters: Array, start: Array, increment: Array, force: Array, end: Array, jacobian: Array
) -> float:
    """Advance one joint by an increment of displacement ``(3,)``; return the energy it loses.

    For compiled loops: allocates nothing. ``parameters`` ``(5,)`` is a row of
    :attr:`FrictionContact.parameters`, ``start`` ``(3,)`` a state. Written are the
    ``force`` ``(3,)`` and state ``end`` ``(3,)``, which may be ``start``, at the end of the
    increment, and ``jacobian`` ``(3, 6)``, the derivative of that force with respect to the state
    at the start (the first three columns) and to the increment (the others). The state follows the
    force: its derivative is that of the tangential force divided by kt, and of z + dz.
    """
    stiffness, normal_stiffness, friction = parameters[0], parameters[1], parameters[2]
    before = parameters[3] + normal_stiffness * (start[2] - parameters[4])
    approach = start[2] + increment[2]
    after = parameters[3] + normal_stiffness * (approach - parameters[4])
    path = ForcePath(
        stiffness * start[0],
        stiffness * start[1],
        stiffness * increment[0],
        stiffness * increment[1],
        friction * before,
        friction * after,
    )
    jacobian[:] = 0.0
    force[0], force[1], lost = _tangential(path, jacobian)
    _in_displacements(stiffness, friction * normal_stiffness, jacobian)
    force[2] = max(after, 0.0)
    if after > 0.0:
        jacobian[2, 2] = jacobian[2, 5] = normal_stiffness
    end[0], end[1], end[2] = force[0] / stiffness, force[1] / stiffness, approach
    energy: float = lost / stiffness
    return energy


@compiled()
def _respond(
    parameters: Array, state: Array, increment: Array
) -> tuple[Array, Array, Array, Array]:
    """:func:`advance_contact` for every joint: forces, tangents, states and energies lost."""
    joints = len(state)
    force, end, jacobian = np.empty((joints, 3)), np.empty((joints, 3)), np.empty((joints, 3, 6))
    dissipated = np.empty(joints)
    for j in range(joints):
        joint = parameters[j % len(parameters)]
        dissipated[j] = advance_contact(
            joint, state[j], increment[j], force[j], end[j], jacobian[j]
        )
    return force, jacobian[:, :, 3:], end, dissipated


@dataclass(frozen=True)
class FrictionContact(CompiledLaw):
    """Three-dimensional friction contact.

    Tangential ``stiffness`` kt and ``normal_stiffness`` kn [N/mm], Coulomb's ``friction`` µ,
    ``normal_load`` N0 [N] at zero displacement, and ``gap`` [mm] there: all numbers or ``(n,)``. A
    joint has a normal load or a gap: a load is what a gap of -N0/kn presses. Without normal
    stiffness the load is constant, and a joint with a gap never touches. Displacement is (x, y, z),
    z > 0 closing the contact; see the module. Raises :class:`wear.joints.parameters.JointError`.

    A state's columns are the stretch of the tangential spring along x and y, displacement less the
    position of the slider, and the approach z [mm]. They outlive a change of the parameters: with a
    smaller limit the slider slips at the beginning of the next increment, and the energy that frees
    is dissipated in it. An increment of zero has the tangent of sticking.

    Examples
    --------
    A contact that closes by 5 µm and is then pulled aside: it slides along the pull, at µ kn 5 µm.

    >>> import numpy as np
    >>> from wear.joints import FrictionContact, march_joints
    >>> law = FrictionContact(stiffness=1e4, normal_stiffness=2e4, friction=0.5, gap=0.001)
    >>> path = np.array([[[0.0, 0.0, 0.006]], [[0.03, 0.04, 0.006]]])
    >>> history = march_joints(law, law.rest(1), np.zeros((1, 3)), path)
    >>> print(history.force[:, 0].round(9))
    [[  0.   0. 100.]
     [ 30.  40. 100.]]
    """

    directions = columns = 3
    kernel = staticmethod(_respond)

    stiffness: Parameter
    normal_stiffness: Parameter
    friction: Parameter
    normal_load: Parameter = 0.0
    gap: Parameter = 0.0

    def __post_init__(self) -> None:
        require_positive(stiffness=self.stiffness)
        require_not_negative(
            normal_stiffness=self.normal_stiffness,
            friction=self.friction,
            normal_load=self.normal_load,
            gap=self.gap,
        )
        if np.any(np.multiply(self.normal_load, self.gap) != 0.0):
            raise JointError(
                f"a joint has a normal load {self.normal_load} and a gap {self.gap}:"
                " one of them must be 0"
            )

    @cached_property
    def parameters(self) -> Array:
        """What :func:`advance_contact` takes, ``(n, 5)``, or ``(1, 5)`` where all are numbers."""
        return parameter_columns(
            self.stiffness, self.normal_stiffness, self.friction, self.normal_load, self.gap
        )
