"""The one interface of all joint laws.

A joint connects two points, or a point and the ground; its displacement is that of the second
relative to the first, and its force is the one that resists: the joint pushes the second point with
``-force``. Work of the force on the displacement is what the joint stores and dissipates.

A law holds the parameters of ``n`` joints, as numbers or ``(n,)`` arrays, and no state. What it
remembers is a :data:`JointState`, an array ``(n, k)`` with one row per joint, whose columns the
law defines; a state is never changed, a new one is returned.
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

    ``force`` ``(n, d)`` [N] at its end, ``tangent`` ``(n, d, d)`` [N/mm] its derivative with
    respect to the displacement there, ``state`` ``(n, k)`` at its end, and ``dissipated`` ``(n,)``
    [N mm], never negative, the energy lost on the way.
    """

    force: Array
    tangent: Array
    state: JointState
    dissipated: Array


class JointLaw(Protocol):
    """A joint law with its parameters.

    Examples
    --------
    Laws that have it are ``Jenkins``, ``BoucWen``, ``UniformIwan``, ``FourParameterIwan`` and
    ``FrictionContact``. One of one's own, a spring:

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
        """Components of a joint's displacement: 1, or 3 (x, y tangential, z normal)."""
        ...

    def rest(self, joints: int) -> JointState:
        """State of ``joints`` joints that have never moved."""
        ...

    def respond(self, state: JointState, increment: Array) -> JointResponse:
        """Response to an increment of displacement ``(n, d)`` [mm] along a straight path."""
        ...


@dataclass(frozen=True)
class JointHistory:
    """A march of ``n`` joints through ``t`` displacements.

    ``force`` ``(t, n, d)`` [N] and ``dissipated`` ``(t, n)`` [N mm] of each increment; ``state`` at
    the end.
    """

    force: Array
    dissipated: Array
    state: JointState


def march_joints(
    law: JointLaw, state: JointState, start: Array, displacement: Array
) -> JointHistory:
    """March joints through ``displacement`` ``(t, n, d)`` [mm], from ``start`` ``(n, d)``.

    Raises InputError for arrays of other shapes, or whose numbers are missing or not finite.

    Examples
    --------
    Two joints to and fro, of which the second only sticks: it dissipates nothing.

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
