"""Interface displacements of a supported body in the frames of its interfaces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from sa_solver.types import Array, Indices

# Angle [rad] below which a direction counts as an axis of the interface frame: mesh files store
# six digits, and normals are computed from differences of them.
ALONG_AXIS = 1e-3
TIED = (
    "a support or a tied load couples nodes of a contact face to other nodes, as a mean over a "
    "boundary that meets the face does; choose a boundary away from the contact face"
)


def interface_displacements(
    rows: sp.csr_matrix, frames: Array
) -> tuple[NDArray[np.bool_], Indices, Sequence[Array] | Array]:
    """Return which interface displacements are held, and the free displacements of the others.

    ``rows`` are the rows of T for the interface nodes. The displacements of a node that are not
    held are a square matrix times as many free displacements. The result is the flags of the held
    ones, these free displacements one node after the other, and these matrices. Raises ValueError
    if an interface node has a displacement that is neither free nor zero.
    """
    d = frames.shape[1]
    counts = np.diff(rows.indptr).reshape(-1, d)
    if np.all(counts == 1) and np.all(rows.data == 1.0):
        numbers = rows.indices.astype(np.int64)
        if len(np.unique(numbers)) == len(numbers) and np.all(np.diff(numbers.reshape(-1, d)) > 0):
            # No node is held or tied, as on most faces.
            return np.zeros(len(numbers), bool), numbers, frames
    held, used, blocks = [], [], []
    for node, frame in enumerate(frames):
        entries = slice(rows.indptr[d * node], rows.indptr[d * (node + 1)])
        columns, place = np.unique(rows.indices[entries], return_inverse=True)
        local = np.zeros((d, len(columns)))
        local[np.repeat(np.arange(d), counts[node]), place] = rows.data[entries]
        local = frame @ local
        zero = np.linalg.norm(local, axis=1) <= ALONG_AXIS
        if len(columns) > np.sum(~zero):
            raise ValueError(TIED)
        if len(columns) < np.sum(~zero):
            raise ValueError(
                "nodes of a contact face are held along a direction that is no axis of the "
                "contact's frame; turn its x along or across that direction"
            )
        held.append(zero)
        used.append(columns)
        blocks.append(local[~zero])
    interface = np.concatenate(used).astype(np.int64)
    if len(np.unique(interface)) < len(interface):
        raise ValueError(TIED)
    return np.concatenate(held), interface, blocks


def frame_rotation(size: int, interface: Indices, blocks: Sequence[Array] | Array) -> sp.csr_matrix:
    """Return the matrix from displacements in the interface frames to free displacements.

    At each node the displacements in the frame are ``blocks`` ``(k, k)`` times the free ones, whose
    numbers ``interface`` lists one node after the other.
    """
    others = np.setdiff1d(np.arange(size), interface)
    if isinstance(blocks, np.ndarray):
        # All blocks have the same size and are inverted together.
        by_node = interface.reshape(len(blocks), -1)
        rows = [np.repeat(by_node, by_node.shape[1], axis=1).ravel()]
        columns = [np.tile(by_node, by_node.shape[1]).ravel()]
        inverses = [np.linalg.inv(blocks).ravel()]
    else:
        nodes = np.split(interface, np.cumsum([len(block) for block in blocks])[:-1])
        rows = [np.repeat(dofs, len(dofs)) for dofs in nodes]
        columns = [np.tile(dofs, len(dofs)) for dofs in nodes]
        inverses = [np.linalg.inv(block).ravel() for block in blocks]
    values = np.concatenate([*inverses, np.ones(len(others))])
    places = np.concatenate([*rows, others]), np.concatenate([*columns, others])
    return sp.csr_matrix((values, places), shape=(size, size))
