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
    """A joint law with its parameters."""

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
    """March joints through ``displacement`` ``(t, n, d)`` [mm], from ``start`` ``(n, d)``."""
    forces, dissipated = np.empty(displacement.shape), np.empty(displacement.shape[:2])
    for step, increment in enumerate(np.diff(displacement, axis=0, prepend=start[None])):
        response = law.respond(state, increment)
        forces[step], dissipated[step], state = response.force, response.dissipated, response.state
    return JointHistory(forces, dissipated, state)
