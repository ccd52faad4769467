"""Elastic joints along one direction: a polynomial spring, and a stop with a gap.

They dissipate no energy, and their state is the displacement alone.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.parameters import (
    CompiledLaw,
    JointError,
    Parameter,
    parameter_columns,
    require,
    require_not_negative,
    require_positive,
    settle_parameters,
)
from wear.joints.periodic.sliders import DrivenJoints, Period

POLYNOMIAL, STOP = 0.0, 1.0
"""First parameter of a joint. For a polynomial the coefficients of u, u², ... u⁵ follow; for a stop
its stiffness, its gap and the number of its sides.
"""
POWERS = 5
# States of a stop at a sample, with the numbers of a contact's sticking and separated states.
PRESSED, APART = 0, 2


@compiled(nogil=True, error_model="numpy")
def elastic_force(joint: Array, displacement: float) -> tuple[float, float, int]:
    """Return force, derivative and state of a joint with this row of parameters."""
    if joint[0] == POLYNOMIAL:
        force, slope = 0.0, 0.0
        for power in range(POWERS, 0, -1):
            force = (force + joint[power]) * displacement
            slope = slope * displacement + power * joint[power]
        return force, slope, PRESSED
    stiffness, gap, sides = joint[1], joint[2], joint[3]
    if displacement > gap:
        return stiffness * (displacement - gap), stiffness, PRESSED
    if sides == 2.0 and displacement < -gap:
        return stiffness * (displacement + gap), stiffness, PRESSED
    return 0.0, 0.0, APART


@compiled(nogil=True, error_model="numpy")
def settle_elastic(period: Period, joints: DrivenJoints) -> None:
    """Write forces, states and derivatives of elastic joints, which need no settling."""
    basis, weights = period.basis, period.weights
    slopes = np.empty(basis.shape)
    for j in range(len(joints.parameters)):
        for t in range(len(basis)):
            force, slope, state = elastic_force(joints.parameters[j], joints.path[j, t])
            joints.force[j, t], joints.states[j, t] = force, state
            for c in range(basis.shape[1]):
                slopes[t, c] = slope * basis[t, c]
        # The assignment of a whole array would take far longer to compile.
        jacobian = np.dot(weights, slopes)
        for row in range(len(jacobian)):
            for c in range(len(jacobian)):
                joints.jacobian[j, row, c] = jacobian[row, c]
        joints.dissipated[j], joints.change[j] = 0.0, 0.0


@compiled()
def _respond(
    parameters: Array, state: Array, increment: Array
) -> tuple[Array, Array, Array, Array]:
    joints = len(state)
    force, tangent = np.empty((joints, 1)), np.empty((joints, 1, 1))
    new, lost = np.empty((joints, 1)), np.zeros(joints)
    for j in range(joints):
        new[j, 0] = state[j, 0] + increment[j, 0]
        force[j, 0], tangent[j, 0, 0], _ = elastic_force(parameters[j % len(parameters)], new[j, 0])
    return force, tangent, new, lost


class ElasticLaw(CompiledLaw):
    """Base class of joints along one direction that dissipate nothing."""

    directions = columns = 1
    kernel = staticmethod(_respond)


@dataclass(frozen=True)
class PolynomialSpring(ElasticLaw):
    """Spring with the force k1 u + k2 u² + k3 u³ + k4 u⁴ + k5 u⁵.

    All coefficients are numbers or ``(n,)``, of either sign. Terms of even power shift the mean of
    a vibration: harmonic balance then needs harmonic 0.

    Parameters
    ----------
    stiffness
        Coefficient k1 [N/mm].
    quadratic, cubic, quartic, quintic
        Coefficients k2 [N/mm²], k3 [N/mm³], k4 [N/mm⁴] and k5 [N/mm⁵].

    Raises
    ------
    JointError
        If a coefficient is not finite.

    Examples
    --------
    A hardening spring of Duffing's kind:

    >>> import numpy as np
    >>> from wear.joints import PolynomialSpring, march_joints
    >>> law = PolynomialSpring(stiffness=1e3, cubic=1e5)
    >>> path = np.array([0.1, -0.1]).reshape(2, 1, 1)
    >>> print(march_joints(law, law.rest(1), np.zeros((1, 1)), path).force.ravel().round(9))
    [ 200. -200.]
    """

    stiffness: Parameter
    quadratic: Parameter = 0.0
    cubic: Parameter = 0.0
    quartic: Parameter = 0.0
    quintic: Parameter = 0.0

    def __post_init__(self) -> None:
        settle_parameters(self, [parameter.name for parameter in fields(self)])
        for value in self._coefficients:
            require("a coefficient", value, np.isfinite(value), "finite")

    @property
    def _coefficients(self) -> tuple[Parameter, ...]:
        return self.stiffness, self.quadratic, self.cubic, self.quartic, self.quintic

    @cached_property
    def parameters(self) -> Array:
        return parameter_columns(POLYNOMIAL, *self._coefficients)


@dataclass(frozen=True)
class ElasticStop(ElasticLaw):
    """Spring behind a gap: its force is k (u - gap) beyond the gap.

    Parameters are numbers or ``(n,)``. A one-sided stop shifts the mean of a vibration: harmonic
    balance then needs harmonic 0.

    Parameters
    ----------
    stiffness
        Stiffness k [N/mm].
    gap
        Gap [mm].
    two_sided
        Whether there is another stop at -gap.

    Raises
    ------
    JointError
        If a parameter is not in its range.

    Examples
    --------
    A one-sided stop is reached 0.02 mm before the end of the motion:

    >>> import numpy as np
    >>> from wear.joints import ElasticStop, march_joints
    >>> law = ElasticStop(stiffness=1e4, gap=0.08)
    >>> path = np.array([0.1, -0.1]).reshape(2, 1, 1)
    >>> print(march_joints(law, law.rest(1), np.zeros((1, 1)), path).force.ravel().round(9))
    [200.   0.]
    """

    stiffness: Parameter
    gap: Parameter = 0.0
    two_sided: bool = False

    def __post_init__(self) -> None:
        settle_parameters(self, ("stiffness", "gap"))
        require_positive(stiffness=self.stiffness)
        require_not_negative(gap=self.gap)
        if not isinstance(self.two_sided, bool | np.bool_):
            raise JointError(f"two_sided of a stop is {self.two_sided}: it must be True or False")

    @cached_property
    def parameters(self) -> Array:
        sides = 2.0 if self.two_sided else 1.0
        # The rows are as wide as those of the polynomial spring, so that both share one march.
        return parameter_columns(STOP, self.stiffness, self.gap, sides, 0.0, 0.0)
