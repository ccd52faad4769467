"""The common interface of all joint laws.

A joint connects two points, or a point and the ground. Its displacement is that of the second point
relative to the first. Its force resists this: the joint pushes the second point with ``-force``.
The work of the force on the displacement is stored and dissipated by the joint.

A law holds the parameters of ``n`` joints, as numbers or ``(n,)`` arrays, and no state. The memory
of joints is a :data:`JointState`, an array ``(n, k)`` with one row per joint, whose columns the law
defines. A state is never changed in place; a new one is returned.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sa_solver import checks
from sa_solver.types import Array

JointState = Array


@dataclass(frozen=True)
class JointResponse:
    """Response of ``n`` joints of ``d`` directions to an increment of displacement.

    Parameters
    ----------
    force
        Force at the end of the increment ``(n, d)`` [N].
    tangent
        Derivative of that force with respect to the displacement ``(n, d, d)`` [N/mm].
    state
        State at the end of the increment ``(n, k)``.
    dissipated
        Energy lost in the increment ``(n,)`` [N mm], never negative.
    """

    force: Array
    tangent: Array
    state: JointState
    dissipated: Array


class JointLaw(Protocol):
    """Protocol of a joint law with its parameters.

    Examples
    --------
    ``Jenkins``, ``BoucWen``, ``UniformIwan``, ``FourParameterIwan`` and
    ``FrictionContact`` implement it. A user's own law, here a spring, needs no more than this:

    >>> import numpy as np
    >>> from wear.joints import march_joints
    >>> from wear.joints.law import JointResponse
    >>> class Spring:
    ...     directions = 1
    ...     def rest(self, joints):
    ...         return np.zeros((joints, 1))
    ...     def respond(self, state, increment):
    ...         stretch = state + increment
    ...         return JointResponse(
    ...             1e4 * stretch, np.full((len(state), 1, 1), 1e4), stretch, np.zeros(len(state))
    ...         )
    >>> law, path = Spring(), np.array([0.01, -0.01]).reshape(2, 1, 1)
    >>> print(march_joints(law, law.rest(1), np.zeros((1, 1)), path).force.ravel())
    [ 100. -100.]
    """

    @property
    def directions(self) -> int:
        """Number of components of a joint's displacement: 1, or 3 (x, y tangential, z normal)."""
        ...

    def rest(self, joints: int) -> JointState:
        """Return the state of ``joints`` joints that have never moved."""
        ...

    def respond(self, state: JointState, increment: Array) -> JointResponse:
        """Return the response to a straight increment of displacement ``(n, d)`` [mm]."""
        ...


@dataclass(frozen=True)
class JointHistory:
    """Result of a march of ``n`` joints through ``t`` displacements.

    ``force`` ``(t, n, d)`` [N] and ``dissipated`` ``(t, n)`` [N mm] are those of each increment;
    ``state`` is that at the end.
    """

    force: Array
    dissipated: Array
    state: JointState


def march_joints(
    law: JointLaw, state: JointState, start: Array, displacement: Array
) -> JointHistory:
    """March joints through a sequence of displacements.

    Parameters
    ----------
    law
        Law of the joints.
    state
        State of the joints at the start.
    start
        Displacements at the start ``(n, d)`` [mm].
    displacement
        Displacements to go through ``(t, n, d)`` [mm].

    Raises InputError for arrays of other shapes, or whose numbers are missing or not finite.

    Examples
    --------
    Two joints go through one cycle; the second only sticks and dissipates nothing:

    >>> import numpy as np
    >>> from wear.joints import Jenkins, march_joints
    >>> law = Jenkins(stiffness=1e4, friction=0.5, normal_load=np.array([100.0, 400.0]))
    >>> path = np.repeat([[[0.01]], [[-0.01]], [[0.01]]], 2, axis=1)
    >>> history = march_joints(law, law.rest(2), np.zeros((2, 1)), path)
    >>> print(history.dissipated[1:].sum(axis=0), "of", law.loop_energy(0.01))
    [1. 0.] of [1. 0.]
    """
    displacement = checks.array("displacements", displacement, (None, None, law.directions))
    start = checks.array("starts", start, displacement.shape[1:])
    forces, dissipated = np.empty(displacement.shape), np.empty(displacement.shape[:2])
    for step, increment in enumerate(np.diff(displacement, axis=0, prepend=start[None])):
        response = law.respond(state, increment)
        forces[step], dissipated[step], state = response.force, response.dissipated, response.state
    return JointHistory(forces, dissipated, state)
