"""Places on a face, by their coordinates."""

from __future__ import annotations

import numpy as np

from fe_models.meshes.structure_mesh import MeshError
from sa_solver import checks
from sa_solver.types import Array


def places(x: object, y: object) -> tuple[Array, Array]:
    """Return coordinates of places, both of the shape that they have together.

    Raises :class:`MeshError` for what is missing, is no number, or has no shape together.
    """
    along, across = (checks.array("places", one, None, error=MeshError) for one in (x, y))
    try:
        shape = np.broadcast_shapes(along.shape, across.shape)
    except ValueError as problem:
        raise MeshError(f"places of shapes {along.shape} and {across.shape}: give one") from problem
    return np.broadcast_to(along, shape), np.broadcast_to(across, shape)
