"""Bouc-Wen joints for many increments at once: all branches are pieces of one curve.

The rate dη/ds = r(η) of :mod:`wear.joints.bouc_wen` depends neither on s nor on the stiffness or
the limit of the joint. The solution that begins at η = -1 (full sliding in the opposite direction)
rises through η = 0 to full sliding, with r > 0 in between. For each exponent n and each σ there is
therefore one curve η(s), and every increment of every joint is a piece of it,

    η(s₀ + s),   s₀ = s(η₀),   with the loss w(s₀ + s) - w(s₀).

The curve is integrated once, by the Runge-Kutta steps of a single joint, and stored. An increment
then costs one such step for its end and a few for s₀, however long it is. The result agrees with
that of a joint integrated alone to the error of the method.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sa_solver.types import Array
from wear.joints.bouc_wen import (
    NEAR_ZERO,
    NO_FRICTION,
    SATURATED,
    BoucWen,
    advance_bouc_wen,
    end_bouc_wen,
    longest_step,
    rule_step,
    xi_rate,
)
from wear.joints.compiled import compiled
from wear.joints.law import JointResponse, JointState
from wear.joints.parameters import require

CURVES = 8
"""Number of curves that are stored. A fit needs that of its last values and two nearby ones."""

NEWTON_STEPS = 3
"""Newton steps for s(η) within one step of the curve, over which r changes by about 2 %. The error
is 1 % after the first, 1e-6 after the second and 1e-14 after the third."""

CLOSED = (1.0, 2.0)
"""Exponents with solutions in closed form, which need no curve."""


@compiled()
def _march(exponent: float, gain: float) -> Array:
    """Return s, η and the loss ``(3, k)`` along the curve, from η = -1 to full sliding."""
    s, eta, lost = 0.0, -1.0, 0.0
    points = [(s, eta, lost)]
    while eta < SATURATED:
        step = longest_step(eta, exponent, gain)
        eta, more = rule_step(eta, step, exponent, gain)
        eta = 0.0 if -NEAR_ZERO < eta < 0.0 else eta
        s += step
        lost += more
        points.append((s, eta, lost))
    curve = np.empty((3, len(points)))
    for k in range(len(points)):
        curve[0, k], curve[1, k], curve[2, k] = points[k]
    return curve


@lru_cache(maxsize=CURVES)
def bouc_wen_curve(exponent: float, gain: float) -> Array:
    """Return s, η and the loss over (µN)²/K ``(3, k)`` along the curve, for 2σ - 1 = ``gain``."""
    curve: Array = _march(exponent, gain)
    curve.setflags(write=False)
    return curve


@compiled()
def _place(curve: Array, eta: float, exponent: float, gain: float) -> tuple[float, float]:
    """Return s and the loss at the point of the curve with the given η."""
    eta = min(eta, SATURATED)
    k = max(int(np.searchsorted(curve[1], eta, "right")) - 1, 0)
    begin = curve[1, k]
    step, end, lost = 0.0, begin, 0.0
    if begin < eta:
        for _ in range(NEWTON_STEPS):
            step += (eta - end) / xi_rate(end, exponent, gain)
            end, lost = rule_step(begin, step, exponent, gain)
    return curve[0, k] + step, curve[2, k] + lost


@compiled()
def _point(curve: Array, s: float, exponent: float, gain: float) -> tuple[float, float]:
    """Return η and the loss at the point of the curve with the given s."""
    k = int(np.searchsorted(curve[0], s, "right")) - 1
    step = s - curve[0, k]
    if k == curve.shape[1] - 1:
        return curve[1, k], curve[2, k] + step
    eta, lost = rule_step(curve[1, k], step, exponent, gain)
    return eta, curve[2, k] + lost


@compiled()
def _advance(
    curve: Array, joint: Array, displacement: float, xi: float, increment: float
) -> tuple[float, float, float, float, float]:
    """Return the same as :func:`wear.joints.bouc_wen.advance_bouc_wen`, from the curve."""
    stiffness, residual, limit = joint[0], joint[1], joint[2]
    exponent, gain = joint[3], joint[4]
    way = (stiffness - residual) * abs(increment)
    if way == 0.0 or limit <= NO_FRICTION * way:
        # Nothing is integrated where the joint does not move or carries no friction.
        return advance_bouc_wen(
            stiffness, residual, limit, exponent, gain, displacement, xi, increment
        )
    sign = np.copysign(1.0, increment)
    begin, before = _place(curve, sign * xi, exponent, gain)
    eta, after = _point(curve, begin + way / limit, exponent, gain)
    moved, lost = displacement + increment, after - before
    return end_bouc_wen(stiffness, residual, limit, exponent, gain, moved, sign, eta, lost)


@compiled()
def _respond_along(
    curve: Array, parameters: Array, state: JointState, increment: Array
) -> tuple[Array, Array, Array, Array]:
    joints = len(state)
    force, tangent = np.empty((joints, 1)), np.empty((joints, 1, 1))
    new, lost = np.empty((joints, 2)), np.empty(joints)
    for j in range(joints):
        joint = parameters[j % len(parameters)]
        force[j, 0], tangent[j, 0, 0], new[j, 0], new[j, 1], lost[j] = _advance(
            curve, joint, state[j, 0], state[j, 1], increment[j, 0]
        )
    return force, tangent, new, lost


@dataclass(frozen=True)
class TabulatedBoucWen(BoucWen):
    """Bouc-Wen joints with one σ and one exponent, for many increments at once.

    Responses agree with those of :class:`wear.joints.BoucWen` to the error of its integration, 2e-9
    of the limit. Raise :class:`wear.joints.parameters.JointError` for several σ or exponents.

    Examples
    --------
    A branch at a hundred displacements takes the curve and a few steps for each of them:

    >>> import numpy as np
    >>> from wear.joints.bouc_wen import BoucWen
    >>> from wear.joints.bouc_wen_curve import TabulatedBoucWen
    >>> given = dict(stiffness=1e4, friction=0.5, normal_load=100.0, exponent=3.0)
    >>> places = np.linspace(0.0, 0.02, 100)[:, None]
    >>> run_parallel, alone = [
    ...     law.respond(law.rest(100), places).force
    ...     for law in (TabulatedBoucWen(**given), BoucWen(**given))
    ... ]
    >>> bool(np.abs(run_parallel - alone).max() < 4e-9 * 50.0)
    True
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("sigma", "exponent"):
            value = getattr(self, name)
            require(name, value, np.array(np.ndim(value) == 0), "one number for all joints")

    def respond(self, state: JointState, increment: Array) -> JointResponse:
        """Return the response, as :meth:`wear.joints.law.JointLaw.respond`."""
        exponent, gain = float(self.exponent), 2.0 * float(self.sigma) - 1.0
        if exponent in CLOSED:
            return super().respond(state, increment)
        state, moved = self.fitting(state, increment)
        curve = bouc_wen_curve(exponent, gain)
        return JointResponse(*_respond_along(curve, self.parameters, state, moved))
