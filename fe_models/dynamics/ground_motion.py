"""A ground that moves: rigid translations of a structure, and what they ask of its mass.

Let everything that holds a structure move by x_g(t) along one direction, and r be the rigid
translation along it. With displacements x relative to that, the structure answers as to the forces
-M r x_g'', and its absolute displacements are x + r x_g: springs, dampers and joints to the ground
feel x alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.dynamics.rig import RigError
from fe_models.joints.reduction import ReducedModel
from sa_solver.types import Array

# Of the largest force that a unit of each displacement makes: what a translation of a free body may
# leave, which is rounding.
FREE = 1e-6


@dataclass(frozen=True)
class Translation:
    """Along one direction: the displacements ``rigid`` ``(n,)`` of a unit, and the masses M r [t],
    ``inertia`` ``(n,)``, that it moves."""

    rigid: Array
    inertia: Array


def along(names: tuple[str, ...], axis: str) -> Array:
    """1 for the displacements ``names`` ``(n,)`` along an axis, 0 for the others and for modes."""
    return np.array([float(name.endswith(f" {axis}")) for name in names])


def translation_of(body: ReducedModel, axis: str) -> Array:
    """Coordinates ``(c + m,)`` of a body that moves by a unit along an axis, without modes.

    Raises :class:`fe_models.dynamics.rig.RigError` for a body without names or displacements along
    it, and for one that strains: something holds it that its kept displacements do not show.
    """
    if body.names is None:
        raise RigError("the reduced model has no names: reduce the body with them")
    rigid = np.zeros(len(body.stiffness))
    rigid[: len(body.kept)] = along(body.names, axis)
    if not rigid.any():
        raise RigError(f"the reduced body keeps no displacement along {axis}")
    strained = np.abs(body.stiffness @ rigid).max()
    if strained > FREE * np.abs(body.stiffness).max():
        raise RigError(
            "the reduced body is held inside, and does not move with the ground as a whole: reduce "
            "it with what holds it among its kept points"
        )
    return rigid
