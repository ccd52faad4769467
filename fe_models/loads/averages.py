"""Displacements that leave means over many nodes as they are: local ones, at all scales.

Eliminating one displacement for each mean would make every other one of the face hang together, a
dense matrix. Instead the nodes are halved until few are left, and of each group those combinations
are taken that change none of its means; the rest, as many as there are means, goes on to the group
that it is a half of. All combinations are orthonormal, and a group of n has as many as there are
means: m log m entries for m displacements (discrete multiwavelets: Alpert 1993,
doi:10.1137/0524016).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.linalg import null_space

from sa_solver.types import Array, Indices

# Displacements of the smallest groups: few for few entries, many for few groups.
GROUP = 24
# Means that differ from others by less than this share of themselves say nothing new.
SAME = 1e-9


def leaving_means(means: Array, points: Array) -> sp.csr_matrix:
    """Orthonormal combinations ``(m, m - k)`` that ``means`` ``(k, m)`` know nothing of.

    ``points`` ``(m, 3)`` are where the displacements are.
    """
    rows: list[Indices] = []
    blocks: list[Array] = []
    every = np.arange(means.shape[1])
    left = _halved(means, points, every, rows, blocks)
    scale = np.linalg.norm(means, axis=1, keepdims=True)
    rows.append(every)
    blocks.append(left @ null_space((means / scale) @ left, SAME))
    counts = [block.shape[1] for block in blocks]
    firsts = np.cumsum([0, *counts])
    places = [
        (np.repeat(own, count), np.tile(first + np.arange(count), len(own)))
        for own, count, first in zip(rows, counts, firsts, strict=False)
    ]
    values = np.concatenate([block.ravel() for block in blocks])
    at = tuple(np.concatenate(part) for part in zip(*places, strict=True))
    return sp.csr_matrix((values, at), shape=(len(every), int(firsts[-1])))


def _halved(
    means: Array, points: Array, own: Indices, rows: list[Indices], blocks: list[Array]
) -> Array:
    """What is left of the displacements ``own`` ``(n,)``, ``(n, k)``, after their combinations.

    These go into ``blocks``, and which displacements they are of into ``rows``.
    """
    if len(own) <= GROUP:
        basis = np.eye(len(own))
    else:
        axis = np.argmax(np.ptp(points[own], axis=0))
        order = np.argsort(points[own, axis], kind="stable")
        halves = np.split(order, [len(own) // 2])
        parts = [_halved(means, points, own[half], rows, blocks) for half in halves]
        basis = np.zeros((len(own), sum(part.shape[1] for part in parts)))
        first = 0
        for half, part in zip(halves, parts, strict=True):
            basis[half, first : first + part.shape[1]] = part
            first += part.shape[1]
    turned = basis @ np.linalg.qr((means[:, own] @ basis).T, mode="complete")[0]
    count = len(means)
    rows.append(own)
    blocks.append(turned[:, count:])
    return np.asarray(turned[:, :count])
