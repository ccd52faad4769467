"""Base excitation: a structure whose ground moves, and its inertia forces.

Let everything that holds a structure move by x_g(t) along one direction, and let r be the rigid
translation along it. Then the displacements x relative to the ground are the response to the forces
-M r x_g'', and the absolute displacements are x + r x_g. Springs, dampers and joints to the ground
see x alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.dynamics.rig import RigError
from fe_models.joints.reduction import ReducedModel
from sa_solver.types import Array

# Largest force due to a rigid translation of a free body, over the largest stiffness: rounding.
FREE = 1e-6


@dataclass(frozen=True)
class Translation:
    """Rigid translation along one direction.

    ``rigid`` ``(n,)`` holds the displacements r in a unit translation, and ``inertia`` ``(n,)`` the
    masses M r [t] that it moves.
    """

    rigid: Array
    inertia: Array


def along(names: tuple[str, ...], axis: str) -> Array:
    """Return 1 for every displacement in ``names`` ``(n,)`` along an axis, and 0 for all others."""
    return np.array([float(name.endswith(f" {axis}")) for name in names])


def translation_of(body: ReducedModel, axis: str) -> Array:
    """Return the coordinates ``(c + m,)`` of a reduced body in a unit translation along an axis.

    The modes of the body have no part in it.

    Raises
    ------
    RigError
        If the body has no names or keeps no displacement along the axis, or if the translation
        strains it. In the last case the ground holds it at points that are not among its kept
        displacements.
    """
    if body.names is None:
        raise RigError("the reduced model has no names: reduce the body with names")
    rigid = np.zeros(len(body.stiffness))
    rigid[: len(body.kept)] = along(body.names, axis)
    if not rigid.any():
        raise RigError(f"the reduced body keeps no displacement along {axis}: keep some")
    largest_force = np.abs(body.stiffness @ rigid).max()
    if largest_force > FREE * np.abs(body.stiffness).max():
        raise RigError(
            "the reduced body is held inside, and does not move with the ground as a whole: keep "
            "the points at which it is held"
        )
    return rigid
