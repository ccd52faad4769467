"""Pad on a wider block, whole or cut by one or two planes of symmetry through their contact."""

from collections.abc import Sequence

import numpy as np
from skfem import MeshTet, MeshTri

from fe_models.meshes.structure_mesh import Body

Mesh = MeshTet | MeshTri


def along(*counts: tuple[float, float, int]) -> np.ndarray:
    """Return the node coordinates of consecutive pieces ``(from, to, elements)``."""
    return np.unique(np.concatenate([np.linspace(a, b, n + 1) for a, b, n in counts]))


def with_faces(mesh: Mesh, faces: dict[str, tuple[int, float]]) -> Mesh:
    """Name boundaries by the axis and value of their planes."""
    return mesh.with_boundaries(
        {
            name: (lambda x, axis=axis, value=value: np.isclose(x[axis], value))
            for name, (axis, value) in faces.items()
        }
    )


def mirrored(mesh: Mesh, axis: int) -> Mesh:
    """Return the mesh with its mirror image at coordinate 0, where they share nodes."""
    points, count = mesh.p, mesh.p.shape[1]
    image = points.copy()
    image[axis] *= -1.0
    place = np.arange(count) + count
    plane = np.isclose(points[axis], 0.0)
    place[plane] = np.flatnonzero(plane)
    kept, numbers = np.unique(np.concatenate([mesh.t, place[mesh.t]], axis=1), return_inverse=True)
    return type(mesh)(np.hstack([points, image])[:, kept], numbers.reshape(mesh.t.shape[0], -1))


def pad_on_block(planes: Sequence[int] = (), match: bool = True) -> tuple[Body, Body]:
    """Return both bodies, cut across the axes ``planes``.

    The pad of 2 x 2 x 1 mm consists of mirror images. If the bodies do not ``match`` node to node,
    the pad has different nodes. The boundary ``top`` of the block is the part that the pad covers,
    and the pad's ends across x are its ``rims``.
    """
    x, y = along((0, 1, 4), (1, 2, 2)), along((0, 1, 3), (1, 2, 2))
    block: Mesh = MeshTet.init_tensor(x, y, along((-2, -0.5, 2), (-0.5, 0, 2)))
    counts = (4, 3) if match else (3, 4)
    over = (along((0, 1, count)) for count in counts)
    pad: Mesh = MeshTet.init_tensor(*over, along((0, 0.5, 2), (0.5, 1, 1)))
    for axis in {0, 1} - set(planes):
        block, pad = mirrored(block, axis), mirrored(pad, axis)
    top = block.facets_satisfying(
        lambda p: np.isclose(p[2], 0.0) & (np.abs(p[0]) < 1.0) & (np.abs(p[1]) < 1.0)
    )
    cuts = {f"cut_{'xy'[axis]}": (axis, 0.0) for axis in planes}
    block = with_faces(block, {"base": (2, -2.0), **cuts}).with_boundaries({"top": top})
    rims = pad.facets_satisfying(lambda p: np.isclose(np.abs(p[0]), 1.0))
    pad = with_faces(pad, {"bottom": (2, 0.0), "lid": (2, 1.0), **cuts})
    pad = pad.with_boundaries({"rims": rims})
    return Body("block", block), Body("pad", pad)
