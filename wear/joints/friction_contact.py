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

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.friction_path import advance_contact
from wear.joints.parameters import (
    CompiledLaw,
    JointError,
    Parameter,
    joint_values,
    parameter_columns,
    require,
    require_not_negative,
    require_positive,
    settle_parameters,
)


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
        settle_parameters(self, [parameter.name for parameter in fields(self)])
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

    @property
    def clearance(self) -> Parameter:
        """How far points are apart at zero displacement [mm]; below 0 what a load has closed."""
        return self.gap - self.normal_load / self.normal_stiffness

    def worn(self, depth: Parameter) -> FrictionContact:
        """The law of surfaces that have lost a ``depth`` between them, a number or ``(n,)`` [mm].

        They lose kn of load per depth, and are apart by what goes beyond it. Raises
        :class:`wear.joints.parameters.JointError` without normal stiffness: such a load stays
        whatever is worn.

        Examples
        --------
        100 N on 20 kN/mm are gone after 5 µm:

        >>> import numpy as np
        >>> from wear.joints import FrictionContact
        >>> law = FrictionContact(1e4, normal_stiffness=2e4, friction=0.5, normal_load=100.0)
        >>> worn = law.worn(np.array([0.002, 0.006]))
        >>> print(worn.normal_load.round(9), worn.gap.round(9))
        [60.  0.] [0.    0.001]
        """
        if np.any(np.asarray(self.normal_stiffness) == 0.0):
            raise JointError("a normal stiffness of 0 keeps its load whatever is worn: give more")
        apart = self.clearance + joint_values("depth", depth)
        require("clearance", apart, np.isfinite(apart), "finite")
        load = self.normal_stiffness * np.maximum(-apart, 0.0)
        return replace(self, normal_load=load, gap=np.maximum(apart, 0.0))
