"""Small rigid motions of points: the motions of an unsupported body without strain."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import cg

from sa_solver.types import Array


def rigid_body_modes(
    nodes: Array, axes: tuple[int, ...] = (0, 1, 2), transformation: sp.csr_matrix | None = None
) -> Array:
    """Return translations and small rotations ``(d n, k)`` of ``nodes`` ``(n, 3)``.

    d is the number of ``axes``. Rotations are about the centre and of the size of the translations.
    With the ``transformation`` ``(d n, free)`` of constraints, u = T u_free, the result is the
    closest motions that the constraints allow, ``(free, k)``.
    """
    arms = nodes - nodes.mean(axis=0)
    modes = rigid_motions(arms / np.abs(arms).max(), axes)
    modes = modes[:, np.any(modes, axis=0)]
    if transformation is None:
        return modes
    t = transformation
    # T'T is nearly diagonal, so that a few iterations suffice.
    return np.stack([cg(t.T @ t, t.T @ mode, rtol=1e-12)[0] for mode in modes.T], axis=1)


def rigid_motions(arms: Array, axes: tuple[int, ...] = (0, 1, 2)) -> Array:
    """Return unit translations and rotations about the origin of points ``(n, 3)``, ``(d n, 6)``.

    They are given along the d global ``axes``; motions across a plane are zero in it.
    """
    rotations = np.cross(np.eye(3)[:, None, :], arms)
    translations = np.broadcast_to(np.eye(3)[:, None, :], rotations.shape)
    return np.concatenate([translations, rotations])[..., axes].reshape(6, -1).T
