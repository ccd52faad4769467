"""Elastic joints along one direction: a spring whose force is a polynomial, and a stop at a gap.

They store all they take and remember nothing: a state is the displacement alone.
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
"""First parameter of a joint: the coefficients of u, u², ... u⁵ follow; or stiffness, gap and how
many sides."""
POWERS = 5
# State of a stop at a sample, as those of contacts: pressed, or apart.
PRESSED, APART = 0, 2


@compiled(nogil=True, error_model="numpy")
def elastic_force(joint: Array, displacement: float) -> tuple[float, float, int]:
    """Force, its derivative, and state of a joint with such a row of parameters."""
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
    """Forces and states of elastic joints in a period, and the derivative: nothing to settle."""
    basis, weights = period.basis, period.weights
    slopes = np.empty(basis.shape)
    for j in range(len(joints.parameters)):
        for t in range(len(basis)):
            force, slope, state = elastic_force(joints.parameters[j], joints.path[j, t])
            joints.force[j, t], joints.states[j, t] = force, state
            for c in range(basis.shape[1]):
                slopes[t, c] = slope * basis[t, c]
        # As a whole it would take far longer to compile.
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
    """A joint along one direction that stores all it takes."""

    directions = columns = 1
    kernel = staticmethod(_respond)


@dataclass(frozen=True)
class PolynomialSpring(ElasticLaw):
    """A spring of the force k1 u + k2 u² + k3 u³ + k4 u⁴ + k5 u⁵.

    ``stiffness`` k1 [N/mm], ``quadratic`` k2 [N/mm²], ``cubic`` k3 [N/mm³], ``quartic`` k4 and
    ``quintic`` k5, of either sign: all numbers or ``(n,)``. Raises
    :class:`wear.joints.parameters.JointError`. Terms of even power move the mean of a vibration:
    harmonic balance then needs harmonic 0.

    Examples
    --------
    A spring that hardens, of Duffing's kind:

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
    """A spring that is met where a gap is closed: its force is k (u - gap) beyond it.

    ``stiffness`` k [N/mm] and ``gap`` [mm], numbers or ``(n,)``; with ``two_sided`` there is
    another one at -gap. Raises :class:`wear.joints.parameters.JointError`. One alone moves the mean
    of a vibration: harmonic balance then needs harmonic 0.

    Examples
    --------
    Met 0.02 mm before the end of its way, on one side only:

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
        # As wide as a row of the polynomial spring: one compiled march for both.
        return parameter_columns(STOP, self.stiffness, self.gap, sides, 0.0, 0.0)
