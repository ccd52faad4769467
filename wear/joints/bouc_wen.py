"""Bouc-Wen joint, normalised: a smooth transition from sticking to sliding, without turning points.

    F = kp x + µN ξ,   ξ' = K/(µN) (1 - (σ sgn(x' ξ) + 1 - σ) |ξ|^n) x',   K = kt - kp

(Bouc 1967, Wen 1976; in this form Fantetti 2019, eq. 7). With η = ξ sgn(x') and s = K |Δx| / µN

    dη/ds = 1 - η^n   where η > 0 (loading),   1 + (2σ - 1) |η|^n   where η < 0 (unloading),

which is solved in closed form for n = 1 and 2, and for σ = 1/2 on every unloading branch, which is
then straight; otherwise by the classical fourth-order Runge-Kutta method in short steps. The energy
stored by ξ is (µN ξ)²/2K. The rest of the work is lost, (µN)²/K ∫ η (1 - dη/ds) ds, which is never
negative as σ >= 1/2 (the limit of Erlicher and Point, C. R. Mécanique 332, 2004).

The single number ξ cannot remember open loops. Unloaded and loaded again by a little, the joint
takes another way back: small loops do not close, and under a steady force with small ripples it
creeps without end. Where partial unloading matters, use an Iwan joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import atan, copysign, exp, expm1, log1p, sqrt, tan, tanh

import numpy as np
from numba import vectorize

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.law import JointState
from wear.joints.parameters import (
    JointError,
    Parameter,
    UniaxialLaw,
    amplitudes,
    parameter_columns,
    require,
)

# Largest step n s of the Runge-Kutta method, the largest as a share of |ξ|, and the largest next to
# ξ = 0, where |ξ|^n has few derivatives. ξ and the loss of a branch are then accurate to 2e-9.
SUBSTEP, GRADING, FIRST_SUBSTEP = 0.02, 0.25, 1e-5
# Values of |ξ| at which the method stops, at full sliding and at ξ = 0: the rest is rounding.
SATURATED, NEAR_ZERO = 1.0 - 1e-14, 1e-14
# Ratio of the reach µN/K to the increment below which there is no friction; its inverse is finite.
NO_FRICTION = 1e-300
# Below this z, z²/2 - z + ln(1 + z) is summed as a series, with a relative error below 1e-10.
SERIES_BELOW = 1e-2


@compiled()
def xi_rate(eta: float, exponent: float, gain: float) -> float:
    """Return dη/ds."""
    power: float = abs(eta) ** exponent
    return 1.0 - power if eta > 0.0 else 1.0 + gain * power


@compiled()
def _load(eta: float, s: float, exponent: float) -> tuple[float, float]:
    """Load from η >= 0 over s, for n = 1 or 2: return η there, and the loss over (µN)²/K."""
    if exponent == 1.0:
        end = eta - (1.0 - eta) * expm1(-s)
        work = s + (1.0 - eta) * expm1(-s)
    else:
        step = tanh(s)
        end = (eta + step) / (1.0 + eta * step)
        work = s + log1p(0.5 * (1.0 - eta) * expm1(-2.0 * s))
    return min(end, 1.0), work - 0.5 * (end * end - eta * eta)


@compiled()
def _excess(z: float) -> float:
    """Return z²/2 - z + ln(1 + z)."""
    if z < SERIES_BELOW:
        return z**3 * (1.0 / 3.0 - z * (0.25 - z * (0.2 - z * (1.0 / 6.0 - z / 7.0))))
    return 0.5 * z * z - z + log1p(z)


@compiled()
def _unload(u: float, s: float, exponent: float, gain: float) -> tuple[float, float, float]:
    """Unload from η = -u over s, or to ξ = 0: return u, the rest of s and the loss.

    The closed forms hold for n = 1 and 2, and without gain.
    """
    if gain == 0.0:
        return max(u - s, 0.0), max(s - u, 0.0), 0.0
    if exponent == 1.0:
        to_zero = log1p(gain * u) / gain
        end = 0.0 if s >= to_zero else u * exp(-gain * s) + expm1(-gain * s) / gain
        lost = (_excess(gain * u) - _excess(gain * end)) / gain**2
    else:
        root = sqrt(gain)
        to_zero = atan(root * u) / root
        end = 0.0 if s >= to_zero else tan(root * (to_zero - s)) / root
        lost = 0.5 * (u * u - end * end - (log1p(gain * u * u) - log1p(gain * end * end)) / gain)
    return end, max(s - to_zero, 0.0), lost


@compiled()
def rule_step(eta: float, step: float, exponent: float, gain: float) -> tuple[float, float]:
    """From η by one step of the fourth-order rule: η there, and the loss."""
    rate = xi_rate(eta, exponent, gain)
    second = xi_rate(eta + 0.5 * step * rate, exponent, gain)
    third = xi_rate(eta + 0.5 * step * second, exponent, gain)
    fourth = xi_rate(eta + step * third, exponent, gain)
    end = eta + step * (rate + 2.0 * second + 2.0 * third + fourth) / 6.0
    middle = 0.5 * (eta + end) + step * (rate - xi_rate(end, exponent, gain)) / 8.0
    # Simpson's rule on η, at the middle of Hermite's cubic.
    lost = step * (eta + 4.0 * middle + end) / 6.0 - 0.5 * (end * end - eta * eta)
    return end, lost


@compiled()
def longest_step(eta: float, exponent: float, gain: float) -> float:
    """Step that the rule takes from η where the way does not end before."""
    step = min(SUBSTEP / exponent, max(GRADING * abs(eta), FIRST_SUBSTEP))
    if eta < 0.0:
        # Falls short of ξ = 0, where the rate has a corner, by ever less.
        step = min(step, -eta / xi_rate(eta, exponent, gain))
    return step


@compiled()
def _step_finely(eta: float, s: float, exponent: float, gain: float) -> tuple[float, float]:
    """Go from η over s by the Runge-Kutta method: return η there, and the loss."""
    lost = 0.0
    while s > 0.0 and eta < SATURATED:
        step = min(s, longest_step(eta, exponent, gain))
        eta, more = rule_step(eta, step, exponent, gain)
        lost += more
        s -= step
        eta = 0.0 if -NEAR_ZERO < eta < 0.0 else eta
    return eta, lost + max(s, 0.0)


@compiled()
def travel(eta: float, s: float, exponent: float, gain: float) -> tuple[float, float]:
    """Go from η over s >= 0 in the direction of motion: return η, and the loss over (µN)²/K."""
    lost = 0.0
    closed = exponent == 1.0 or exponent == 2.0
    if eta < 0.0 and (closed or gain == 0.0):
        u, s, lost = _unload(-eta, s, exponent, gain)
        if u > 0.0:
            return -u, lost
        eta = 0.0
    eta, more = _load(eta, s, exponent) if closed else _step_finely(eta, s, exponent, gain)
    return eta, lost + more


@compiled()
def end_bouc_wen(
    stiffness: float,
    residual: float,
    limit: float,
    exponent: float,
    gain: float,
    displacement: float,
    sign: float,
    eta: float,
    lost: float,
) -> tuple[float, float, float, float, float]:
    """Return what :func:`advance_bouc_wen` does for a joint that has moved by ``sign`` to η."""
    spring = stiffness - residual
    tangent = residual + spring * xi_rate(eta, exponent, gain)
    force = limit * sign * eta + residual * displacement
    return force, tangent, displacement, sign * eta, limit * (limit / spring) * max(lost, 0.0)


@compiled()
def advance_bouc_wen(
    stiffness: float,
    residual: float,
    limit: float,
    exponent: float,
    gain: float,
    displacement: float,
    xi: float,
    increment: float,
) -> tuple[float, float, float, float, float]:
    """Advance one joint by one increment: force, tangent, displacement, ξ and energy lost."""
    spring = stiffness - residual
    displacement += increment
    if limit <= NO_FRICTION * spring * abs(increment):
        if increment != 0.0:
            xi = copysign(1.0, increment)
        return residual * displacement, residual, displacement, xi, 0.0
    if increment == 0.0:
        slope = 1.0 - 0.5 * (1.0 - gain) * abs(xi) ** exponent
        force = limit * xi + residual * displacement
        return force, residual + spring * slope, displacement, xi, 0.0
    sign = copysign(1.0, increment)
    eta, lost = travel(sign * xi, spring * abs(increment) / limit, exponent, gain)
    return end_bouc_wen(stiffness, residual, limit, exponent, gain, displacement, sign, eta, lost)


@compiled()
def _respond(
    parameters: Array, state: JointState, increment: Array
) -> tuple[Array, Array, Array, Array]:
    joints = len(state)
    force, tangent = np.empty((joints, 1)), np.empty((joints, 1, 1))
    new, lost = np.empty((joints, 2)), np.empty(joints)
    for j in range(joints):
        joint = parameters[j % len(parameters)]
        stiffness, residual, limit = joint[0], joint[1], joint[2]
        exponent, gain = joint[3], joint[4]
        force[j, 0], tangent[j, 0, 0], new[j, 0], new[j, 1], lost[j] = advance_bouc_wen(
            stiffness, residual, limit, exponent, gain, state[j, 0], state[j, 1], increment[j, 0]
        )
    return force, tangent, new, lost


@vectorize(cache=True)  # type: ignore[no-untyped-call]
def _loop_energy(
    amplitude: float,
    stiffness: float,
    residual: float,
    limit: float,
    exponent: float,
    gain: float,
) -> float:
    spring = stiffness - residual
    if limit <= NO_FRICTION * spring * amplitude:
        return 0.0
    # The settled loop goes from -ξ to ξ. The end of its half that begins at -ξ, less ξ, falls as ξ
    # grows, so that bisection finds ξ.
    distance = 2.0 * spring * amplitude / limit
    least, most = 0.0, 1.0
    while True:
        xi = 0.5 * (least + most)
        if xi in (least, most):
            return 2.0 * limit * (limit / spring) * travel(-xi, distance, exponent, gain)[1]
        if travel(-xi, distance, exponent, gain)[0] > xi:
            least = xi
        else:
            most = xi


@dataclass(frozen=True)
class BoucWen(UniaxialLaw):
    """Bouc-Wen joint with a macroslip slope.

    All parameters are numbers or ``(n,)``.

    The columns of a state are the displacement [mm] and ξ. If parameters change, the force follows
    at the same ξ, and the energy that this releases is not counted as dissipated. An increment of
    zero has the mean of the tangents forward and backward.

    Parameters
    ----------
    stiffness
        Total initial stiffness kt [N/mm].
    friction
        Coefficient of friction µ.
    normal_load
        Normal load N [N].
    residual_stiffness
        Macroslip slope kp < kt [N/mm].
    sigma
        Shape σ of unloading, from 1/2 to 1.
    exponent
        Exponent n >= 1.

    Raises
    ------
    JointError
        If a parameter is not in its range.

    Examples
    --------
    With σ = 1/2 and n = 2 the force on first loading is µN tanh(kt x / µN):

    >>> import numpy as np
    >>> from wear.joints import BoucWen, march_joints
    >>> law = BoucWen(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> history = march_joints(law, law.rest(1), np.zeros((1, 1)), np.full((1, 1, 1), 0.005))
    >>> print(f"{history.force[0, 0, 0]:.3f} N of {50.0 * np.tanh(1.0):.3f}")
    38.080 N of 38.080
    """

    columns = 2
    kernel = staticmethod(_respond)

    sigma: Parameter = 0.5
    exponent: Parameter = 2.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not np.all(np.less(self.residual_stiffness, self.stiffness)):
            raise JointError(
                f"residual_stiffness of a Bouc-Wen joint is {self.residual_stiffness}: it must be "
                f"below its stiffness {self.stiffness}, which is the whole initial slope"
            )
        sigma, exponent = np.asarray(self.sigma), np.asarray(self.exponent)
        range_text = "from 0.5 (below, unloading would create energy) to 1"
        require("sigma", sigma, (sigma >= 0.5) & (sigma <= 1.0), range_text)
        proper = (exponent >= 1.0) & (exponent < np.inf)
        require("exponent", exponent, proper, "finite, 1 or more")

    @cached_property
    def _constants(self) -> tuple[Parameter, ...]:
        gain = np.multiply(2.0, self.sigma) - 1.0
        return self.stiffness, self.residual_stiffness, self.limit, self.exponent, gain

    @cached_property
    def parameters(self) -> Array:
        return parameter_columns(*self._constants)

    def loop_energy(self, amplitude: Parameter) -> Array:
        """Return the energy of a settled cycle between ± ``amplitude`` [mm] in N mm.

        For n = 2 and σ = 1/2 it is -(µN)²/K (ξ² + ln(1 - ξ²)), where ξ + artanh ξ = 2 K A/µN.
        """
        energy: Array = _loop_energy(amplitudes(amplitude), *self._constants)
        return energy
