"""Jenkins element: a spring in series with a Coulomb slider, in parallel with a residual spring."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import copysign

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.law import JointState
from wear.joints.parameters import Parameter, UniaxialLaw, amplitudes, parameter_columns


@compiled()
def advance_jenkins(
    stiffness: float,
    residual: float,
    limit: float,
    displacement: float,
    stretch: float,
    increment: float,
) -> tuple[float, float, float, float, float]:
    """Advance one joint by one increment: force, tangent, displacement, stretch and energy lost."""
    reach = limit / stiffness
    lost = 0.0
    if abs(stretch) > reach:
        # The limit has fallen since: the slider slips, and the excess energy of the spring is lost.
        lost = 0.5 * stiffness * (stretch * stretch - reach * reach)
        stretch = copysign(reach, stretch)
    displacement += increment
    stretch += increment
    slope = residual
    if abs(stretch) < reach:
        slope += stiffness
    else:
        lost += limit * (abs(stretch) - reach)
        stretch = copysign(reach, stretch)
    return stiffness * stretch + residual * displacement, slope, displacement, stretch, lost


@compiled()
def _respond(
    parameters: Array, state: JointState, increment: Array
) -> tuple[Array, Array, Array, Array]:
    joints = len(state)
    force, tangent = np.empty((joints, 1)), np.empty((joints, 1, 1))
    new, lost = np.empty((joints, 2)), np.empty(joints)
    for j in range(joints):
        joint = parameters[j % len(parameters)]
        force[j, 0], tangent[j, 0, 0], new[j, 0], new[j, 1], lost[j] = advance_jenkins(
            joint[0], joint[1], joint[2], state[j, 0], state[j, 1], increment[j, 0]
        )
    return force, tangent, new, lost


@dataclass(frozen=True)
class Jenkins(UniaxialLaw):
    """Jenkins element.

    All parameters are numbers or ``(n,)``.

    The columns of a state are the displacement and the stretch of the spring [mm], which is the
    displacement less the position of the slider. Both remain when the parameters change: with a
    smaller limit the slider slips at the beginning of the next increment, and the energy released
    is dissipated in it. At the limit the tangent is that of further sliding.

    Parameters
    ----------
    stiffness
        Stiffness kt of the spring [N/mm].
    friction
        Coefficient of friction µ.
    normal_load
        Normal load N [N]; µN is the limit of the slider.
    residual_stiffness
        Stiffness kr that remains when the slider slides [N/mm].

    Raises
    ------
    JointError
        If a parameter is not in its range.

    Examples
    --------
    One cycle of a march dissipates the energy of the closed form:

    >>> import numpy as np
    >>> from wear.joints import Jenkins, march_joints
    >>> law = Jenkins(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> path = np.array([0.01, -0.01, 0.01]).reshape(3, 1, 1)
    >>> history = march_joints(law, law.rest(1), np.zeros((1, 1)), path)
    >>> print(f"{history.dissipated[1:].sum():.3f} N mm of {law.loop_energy(0.01):.3f}")
    1.000 N mm of 1.000
    """

    columns = 2
    kernel = staticmethod(_respond)

    @cached_property
    def parameters(self) -> Array:
        return parameter_columns(self.stiffness, self.residual_stiffness, self.limit)

    def loop_energy(self, amplitude: Parameter) -> Array:
        """Return the energy of a cycle between ± ``amplitude`` [mm]: 4 µN (A - µN/kt) or 0.

        It is in N mm.
        """
        limit, reach = self.limit, self.limit / self.stiffness
        energy: Array = 4.0 * limit * np.maximum(np.subtract(amplitudes(amplitude), reach), 0.0)
        return energy

    def first_harmonic(self, amplitude: Parameter) -> tuple[Array, Array]:
        """Return the first harmonic of the force in a settled cycle A cos θ: a cos θ + b sin θ [N].

        With cos θs = 1 - 2 µN/(kt A) where the slider slips, a = A kr + A kt (θs - sin θs cos θs)/π
        and b = -4 µN (1 - µN/(kt A))/π, which is minus the energy of the loop over π A.
        """
        amplitude = np.asarray(amplitudes(amplitude))
        reach = self.limit / self.stiffness
        moving = np.where(amplitude > 0.0, amplitude, 1.0)
        sticking = np.arccos(1.0 - 2.0 * np.minimum(reach / moving, 1.0))
        share = (sticking - np.sin(sticking) * np.cos(sticking)) / np.pi
        cosine: Array = amplitude * (self.residual_stiffness + self.stiffness * share)
        sine: Array = -self.loop_energy(amplitude) / (np.pi * moving)
        return cosine, sine
