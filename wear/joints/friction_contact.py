"""Contact point in three dimensions: unilateral normal spring and Coulomb's circular cone.

Along z the joint presses with ``f = max(N0 + kn (z - gap), 0)``: **z > 0 closes the contact**, it
is the approach of the second point to the first. Along x and y a spring kt is in series with a
slider, which holds while the force t of the spring stays within the circle ``|t| <= µ f``. Where
the circle shrinks below the force, or the spring is pulled beyond it, the slider moves along t.
Without pressure the circle is a point: a joint that lifts off forgets where its slider was, and a
joint that touches again starts without tangential force where it touches. The force contains the
preload: a structure at rest needs the load that balances it.

(The unilateral element with variable normal load along one direction: Petrov and Ewins 2003,
doi:10.1115/1.1539868; a slider on the circle: Sanliturk and Ewins 1996, J. Sound Vib. 193, 511.
The rules below are derived here.)

An increment is solved exactly for a straight path s = 0..1, on which the limit R(s) = µ f is linear
while the contact presses. With e = t/|t| and the pull k = kt du, the force that the increment would
add to the spring if the slider held:

- *Stick*: t = t0 + k s, until |t| = R: a quadratic.
- *Slip*: t = R e and R e' = k - (k·e) e. The angle ψ from k to e obeys R ψ' = -|k| sin ψ, so that
  tan(ψ/2) decays by exp(-L) with L = |k| ∫ ds / R, a logarithm of R1/R0; the slider moves by
  (k·e - R')/kt >= 0 per s.
- |ψ| only falls, so that slip, once begun, continues to the end of the straight path. The slider
  can only stick again (k·e < R') at the beginning of a new increment. A path is therefore, at most:
  apart, touch, stick, slip, apart; since f is linear it cannot both touch and lift off.

The derivative does not contain that of the point where slip begins: shifting that point changes the
force by (k - R e' - R' e) ds, which is along e, where the circle determines it.

The energy lost is ∫ R (k·e - R') ds / kt. It is elementary for constant R or for slip along the
path, and otherwise a hypergeometric function, since cos ψ = tanh(constant + L): the part that is
not elementary, while the force turns, is integrated by Gauss's rule to 1e-13.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled
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
from wear.joints.periodic.friction_path import advance_contact


@compiled()
def _respond(
    parameters: Array, state: Array, increment: Array
) -> tuple[Array, Array, Array, Array]:
    """Call :func:`advance_contact` for every joint: forces, tangents, states and energies lost."""
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
    """Contact point in three dimensions with friction.

    All parameters are numbers or ``(n,)``. A joint has a normal load or a gap: a load is equivalent
    to a gap of -N0/kn. Without normal stiffness the load is constant, and a joint with a gap never
    touches. The displacement is (x, y, z), and z > 0 closes the contact; see the module.

    The columns of a state are the stretch of the tangential spring along x and y, which is the
    displacement less the position of the slider, and the approach z [mm]. They remain when the
    parameters change: with a smaller limit the slider slips at the beginning of the next increment,
    and the energy released is dissipated in it. An increment of zero has the tangent of sticking.

    Parameters
    ----------
    stiffness, normal_stiffness
        Tangential and normal stiffness kt and kn [N/mm].
    friction
        Coulomb's coefficient of friction µ.
    normal_load
        Normal load N0 at zero displacement [N].
    gap
        Gap at zero displacement [mm].

    Raises
    ------
    JointError
        If a parameter is not in its range.

    Examples
    --------
    A contact closes by 5 µm and is then pulled sideways: it slides along the pull, at µ kn 5 µm.

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
        """Parameters of :func:`advance_contact` ``(n, 5)``, or ``(1, 5)`` if all are numbers."""
        return parameter_columns(
            self.stiffness, self.normal_stiffness, self.friction, self.normal_load, self.gap
        )

    @property
    def clearance(self) -> Parameter:
        """Distance of the points at zero displacement [mm]; negative where a load has closed it."""
        return self.gap - self.normal_load / self.normal_stiffness

    def worn(self, depth: Parameter) -> FrictionContact:
        """Return the law after the surfaces have lost a ``depth`` together.

        ``depth`` is a number or ``(n,)`` [mm]. The load falls by kn times the depth; any depth
        beyond that opens a gap. Raise :class:`wear.joints.parameters.JointError` without normal
        stiffness: such a load does not change with wear.

        Examples
        --------
        A load of 100 N on 20 kN/mm is lost after 5 µm:

        >>> import numpy as np
        >>> from wear.joints import FrictionContact
        >>> law = FrictionContact(1e4, normal_stiffness=2e4, friction=0.5, normal_load=100.0)
        >>> worn = law.worn(np.array([0.002, 0.006]))
        >>> print(worn.normal_load.round(9), worn.gap.round(9))
        [60.  0.] [0.    0.001]
        """
        if np.any(np.asarray(self.normal_stiffness) == 0.0):
            raise JointError(
                "a contact with a normal stiffness of 0 keeps its load whatever is worn: give a "
                "stiffness above 0"
            )
        apart = self.clearance + joint_values("depth", depth)
        require("clearance", apart, np.isfinite(apart), "finite")
        load = self.normal_stiffness * np.maximum(-apart, 0.0)
        return replace(self, normal_load=load, gap=np.maximum(apart, 0.0))
