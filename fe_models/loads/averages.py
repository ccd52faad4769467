"""Local displacements at all scales that do not change means over many nodes.

Eliminating one displacement for each mean would couple all others of the face in a dense matrix.
Instead the nodes are halved until few are left. In each group those combinations are kept that do
not change its means; the remaining ones, as many as there are means, are passed on to the group of
which it is a half. All combinations are orthonormal, and each group contributes about as many as
there are means, which gives m log m entries for m displacements (discrete multiwavelets: Alpert
1993, doi:10.1137/0524016).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.linalg import null_space

from sa_solver.types import Array, Indices

# Number of displacements in the smallest groups: a smaller number gives fewer entries, a larger
# one fewer groups.
GROUP = 24
# A mean that differs from combinations of others by less than this share is redundant.
SAME = 1e-9


def leaving_means(means: Array, points: Array) -> sp.csr_matrix:
    """Return orthonormal combinations ``(m, m - k)`` of displacements with zero ``means``.

    ``means`` ``(k, m)`` are the coefficients of the means, and ``points`` ``(m, 3)`` the positions
    of the displacements.
    """
    rows: list[Indices] = []
    blocks: list[Array] = []
    all_columns = np.arange(means.shape[1])
    rest = _halved(means, points, all_columns, rows, blocks)
    scale = np.linalg.norm(means, axis=1, keepdims=True)
    rows.append(all_columns)
    blocks.append(rest @ null_space((means / scale) @ rest, SAME))
    counts = [block.shape[1] for block in blocks]
    firsts = np.cumsum([0, *counts])
    places = [
        (np.repeat(own, count), np.tile(first + np.arange(count), len(own)))
        for own, count, first in zip(rows, counts, firsts, strict=False)
    ]
    values = np.concatenate([block.ravel() for block in blocks])
    at = tuple(np.concatenate(part) for part in zip(*places, strict=True))
    return sp.csr_matrix((values, at), shape=(len(all_columns), int(firsts[-1])))


def _halved(
    means: Array, points: Array, group: Indices, rows: list[Indices], blocks: list[Array]
) -> Array:
    """Return the combinations of a group that are left after those with zero means are split off.

    The result is ``(n, k)`` for the displacements ``group`` ``(n,)``. The combinations that were
    split off are appended to ``blocks``, and the numbers of their displacements to ``rows``.
    """
    if len(group) <= GROUP:
        basis = np.eye(len(group))
    else:
        axis = np.argmax(np.ptp(points[group], axis=0))
        order = np.argsort(points[group, axis], kind="stable")
        halves = np.split(order, [len(group) // 2])
        parts = [_halved(means, points, group[half], rows, blocks) for half in halves]
        basis = np.zeros((len(group), sum(part.shape[1] for part in parts)))
        first = 0
        for half, part in zip(halves, parts, strict=True):
            basis[half, first : first + part.shape[1]] = part
            first += part.shape[1]
    turned = basis @ np.linalg.qr((means[:, group] @ basis).T, mode="complete")[0]
    count = len(means)
    rows.append(group)
    blocks.append(turned[:, count:])
    return np.asarray(turned[:, :count])
