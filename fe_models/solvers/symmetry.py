"""Systems with a mirror symmetry, solved as two of half the size.

A symmetric matrix K that is invariant under a mirror does not couple symmetric displacements with
antisymmetric ones. With an orthonormal basis Q₊ of the first and Q₋ of the second

    K = Q₊ K₊ Q₊ᵀ + Q₋ K₋ Q₋ᵀ,   K± = Q±ᵀ K Q±,

and the same holds for its inverse and its Schur complements, for any loads. A factorisation takes
half the work or less, a dense product half the memory. The mirror is the simplest symmetry group.
Source: Zingoni 2005, Finite Elements in Analysis and Design 41, 615.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg.blas import dsymv, ssymv
from scipy.spatial import cKDTree

from sa_solver.types import Array, Indices

# Dense matrix of double or single precision.
Matrix = NDArray[np.float64] | NDArray[np.float32]

# Distance, as a share of the body's size, up to which a node is a mirror image: meshes that are
# built as mirror images are so up to rounding.
SAME_PLACE = 1e-9
# Decimals to which entries of a mirror in rotated frames are rounded: if it is a mirror, they are
# 0, 1 or -1.
ROUNDED = 9
# Coupling of the two parts that is ignored, relative to the largest entry; rounding errors of the
# assembly are 1e-15.
UNCOUPLED = 1e-12


@dataclass(frozen=True, eq=False)
class Mirror:
    """Mirror of unknowns: entry ``i`` of the image is ``sign[i]`` times entry ``partner[i]``.

    ``partner`` ``(n,)`` is a permutation that is its own inverse.
    """

    partner: Indices
    sign: Array

    @classmethod
    def of(cls, matrix: sp.csr_matrix) -> Mirror | None:
        """Return the mirror that a matrix ``(n, n)`` describes, or None if it describes none."""
        permutation = matrix.tocsr()
        permutation.data = np.round(permutation.data, ROUNDED)
        permutation.eliminate_zeros()
        rows = np.arange(permutation.shape[0])
        if np.any(np.diff(permutation.indptr) != 1) or np.any(np.abs(permutation.data) != 1.0):
            return None
        partner = permutation.indices.astype(np.int64)
        return cls(partner, permutation.data) if np.array_equal(partner[partner], rows) else None

    def matrix(self) -> sp.csr_matrix:
        """Return the matrix ``(n, n)`` that maps unknowns to their image."""
        rows = np.arange(len(self.partner))
        return sp.csr_matrix((self.sign, (rows, self.partner)), (len(rows), len(rows)))

    @cached_property
    def bases(self) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Orthonormal bases of symmetric ``(n, n₊)`` and of antisymmetric unknowns ``(n, n₋)``."""
        return self._basis(1.0), self._basis(-1.0)

    @cached_property
    def basis(self) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Both bases side by side ``(n, n)``, and the transpose."""
        both = sp.hstack(self.bases, format="csr")
        return both, both.T.tocsr()

    @classmethod
    def beside(cls, mirrors: Sequence[Mirror]) -> Mirror:
        """Return the mirror of the unknowns of several mirrors, one after the other."""
        starts = np.cumsum([0, *(len(mirror.partner) for mirror in mirrors)])
        partners = [start + m.partner for start, m in zip(starts, mirrors, strict=False)]
        return cls(np.concatenate(partners), np.concatenate([m.sign for m in mirrors]))

    def restricted(self, unknowns: Indices) -> Mirror | None:
        """Return the mirror of some unknowns, in their order, or None if it maps any elsewhere."""
        place = np.full(len(self.partner), -1)
        place[unknowns] = np.arange(len(unknowns))
        partner = place[self.partner[unknowns]]
        return None if np.any(partner < 0) else Mirror(partner, self.sign[unknowns])

    def _basis(self, parity: float) -> sp.csr_matrix:
        numbers = np.arange(len(self.partner))
        pairs = np.flatnonzero(numbers < self.partner)
        alone = np.flatnonzero((numbers == self.partner) & (self.sign == parity))
        columns = np.arange(len(pairs) + len(alone))
        rows = np.concatenate([pairs, alone, self.partner[pairs]])
        half = np.full(len(pairs), np.sqrt(0.5))
        values = np.concatenate([half, np.ones(len(alone)), parity * self.sign[pairs] * half])
        shape = (len(numbers), len(columns))
        return sp.csr_matrix((values, (rows, np.append(columns, columns[: len(pairs)]))), shape)

    def __eq__(self, other: object) -> bool:
        # The method of a dataclass cannot compare arrays.
        return (
            isinstance(other, Mirror)
            and np.array_equal(self.partner, other.partner)
            and np.array_equal(self.sign, other.sign)
        )


@dataclass(frozen=True, eq=False)
class SplitMatrix:
    """Symmetric matrix ``(n, n)`` Q₊ A₊ Q₊ᵀ + Q₋ A₋ Q₋ᵀ with dense ``blocks`` A₊ and A₋."""

    mirror: Mirror
    blocks: tuple[Matrix, Matrix]

    def __len__(self) -> int:
        return len(self.mirror.partner)

    def __matmul__(self, vectors: Array) -> Array:
        basis, transposed = self.mirror.basis
        parts, symmetric = transposed @ vectors, len(self.blocks[0])
        pairs = zip(self.blocks, (parts[:symmetric], parts[symmetric:]), strict=True)
        images = [symmetric_product(*pair) for pair in pairs]
        return np.asarray(basis @ np.concatenate(images))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.asarray(self @ np.eye(len(self)), dtype)

    def in_single_precision(self) -> SplitMatrix:
        """Return the matrix with its blocks in single precision, which takes half the memory."""
        symmetric, antisymmetric = (block.astype(np.float32) for block in self.blocks)
        return SplitMatrix(self.mirror, (symmetric, antisymmetric))


def symmetric_product(matrix: Matrix, vectors: Array) -> Array:
    """Return a symmetric ``matrix`` ``(n, n)`` times ``vectors`` ``(n,)`` or ``(n, m)``.

    A product with a large matrix is limited by memory, so for one vector only half of the matrix is
    read. The product has the precision of the matrix for one vector.
    """
    if vectors.ndim == 2:
        return np.asarray(matrix @ vectors)
    by_columns = matrix if matrix.flags.f_contiguous else matrix.T
    product = ssymv if matrix.dtype == np.float32 else dsymv
    return np.asarray(product(1.0, by_columns, vectors))


def mirror_of_nodes(nodes: Array, axes: tuple[int, ...], axis: int) -> Mirror | None:
    """Return the mirror of displacements along ``axes`` ``(d,)`` of ``nodes`` ``(n, 3)``.

    The displacements are numbered node by node. The plane of the mirror is normal to the global
    ``axis``, in the middle of the nodes. The result is None unless every node has an image.
    """
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    images = nodes.copy()
    images[:, axis] = low[axis] + high[axis] - nodes[:, axis]
    distance, partner = cKDTree(nodes).query(images)
    if distance.max() > SAME_PLACE * np.linalg.norm(high - low):
        return None
    if not np.array_equal(partner[partner], np.arange(len(nodes))):
        return None
    d = len(axes)
    signs = np.where(np.array(axes) == axis, -1.0, 1.0)
    return Mirror((d * partner[:, None] + np.arange(d)).ravel(), np.tile(signs, len(nodes)))


def halves(matrix: sp.csr_matrix, mirror: Mirror) -> tuple[sp.csr_matrix, ...] | None:
    """Return K₊ and K₋ of a symmetric sparse matrix, or None if the mirror changes it."""
    if not _is_mirrored(matrix, mirror):
        return None
    return tuple(_half(matrix, mirror, basis) for basis in mirror.bases)


def _is_mirrored(matrix: sp.csr_matrix, mirror: Mirror) -> bool:
    """Return whether the mirror leaves the matrix unchanged.

    This is tested with a random displacement: the forces of its image must be the image of its
    forces.
    """
    displacement = np.random.default_rng(0).standard_normal(matrix.shape[0])
    image = mirror.matrix()
    apart = np.abs(matrix @ (image @ displacement) - image @ (matrix @ displacement))
    most = np.abs(matrix.data).max(initial=0.0) * np.abs(displacement).max()
    return bool(apart.max(initial=0.0) <= UNCOUPLED * most)


def _half(matrix: sp.csr_matrix, mirror: Mirror, basis: sp.csr_matrix) -> sp.csr_matrix:
    """Return QᵀKQ from the rows of K of one unknown of each pair.

    The rows of its image contain the same information.
    """
    columns = basis.tocsc()
    first = columns.indices[columns.indptr[:-1]]
    alone = np.diff(columns.indptr) == 1
    half = (matrix[first] @ basis).tocsr()
    # For a pair q = (e ± e')/√2 the row of e, times √2, is that of q in the half; an unknown
    # without a partner has its own row.
    half.data *= np.repeat(np.where(alone, 1.0, np.sqrt(2.0)), np.diff(half.indptr))
    return half
