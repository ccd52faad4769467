"""Two bodies as in a user's mesh file: a pad on a block."""

import numpy as np
from skfem import MeshTet

from fe_models.geometry.imported import ImportedMesh
from fe_models.meshes.structure_mesh import Body
from tests.mirrored_blocks import along, mirrored, with_faces

BODIES = "lower", "upper"


def imported(lower, upper, points=None):
    bodies = {"lower": Body("lower", lower), "upper": Body("upper", upper)}
    numbers = {name: np.arange(body.mesh.nvertices) for name, body in bodies.items()}
    return ImportedMesh(bodies, numbers, {"lower": {}, "upper": {}} | (points or {}))


def block_and_pad(full, match):
    """Return a pad on a wider block, half of it (y > 0) or all; meshes may match on the face."""
    x, z = along((-2, -1, 1), (-1, 1, 4), (1, 2, 1)), along((-2, 0, 2))
    lower = MeshTet.init_tensor(x, along((0, 1, 2), (1, 2, 1)), z)
    across = along((-1, 1, 4)) if match else along((-1, 1, 3))
    deep = along((0, 1, 2)) if match else along((0, 1, 3))
    upper = MeshTet.init_tensor(across, deep, along((0, 1, 2)))
    if full:
        lower, upper = mirrored(lower, 1), mirrored(upper, 1)
    top = lower.facets_satisfying(
        lambda p: np.isclose(p[2], 0.0) & (np.abs(p[0]) < 1.0) & (np.abs(p[1]) < 1.0)
    )
    lower = with_faces(lower, {"base": (2, -2.0), "plane": (1, 0.0)}).with_boundaries({"top": top})
    upper = with_faces(upper, {"bottom": (2, 0.0), "lid": (2, 1.0), "plane": (1, 0.0)})
    return imported(lower, upper)
