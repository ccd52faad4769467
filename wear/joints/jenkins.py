"""Jenkins's element: a spring in series with a Coulomb slider, and a residual slope beside both."""

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
    """One joint by one increment: force, tangent, displacement, stretch and energy lost."""
    reach = limit / stiffness
    lost = 0.0
    if abs(stretch) > reach:
        # The limit has shrunk since: the slider slips, and what the spring held beyond is lost.
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
    """Jenkins's element.

    ``stiffness`` kt [N/mm] of the spring, ``friction`` µ and ``normal_load`` N [N], whose product
    is the slider's limit, and ``residual_stiffness`` kr [N/mm], which is left when it slides: all
    numbers or ``(n,)``. Raises :class:`wear.joints.parameters.JointError`.

    A state's columns are displacement and stretch of the spring [mm], displacement less the
    position of the slider. Both outlive a change of the parameters: with a smaller limit the slider
    slips at the beginning of the next increment, and the energy that frees is dissipated in it.
    At the limit the tangent is that of sliding on.

    Examples
    --------
    Once to and fro the closed form of its loop is what a march dissipates:

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
        """Energy lost in a cycle between ± ``amplitude`` [mm]: 4 µN (A - µN/kt) [N mm] or 0."""
        limit, reach = self.limit, self.limit / self.stiffness
        energy: Array = 4.0 * limit * np.maximum(np.subtract(amplitudes(amplitude), reach), 0.0)
        return energy

    def first_harmonic(self, amplitude: Parameter) -> tuple[Array, Array]:
        """Force of the settled cycle A cos θ, to first order: a cos θ + b sin θ [N].

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
