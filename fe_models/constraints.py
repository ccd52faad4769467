"""Linear constraints on displacements, imposed by elimination: u = T u_free, no penalty."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from sa_solver.types import Array

Indices = NDArray[np.int64]

# An equation whose coefficients shrink to this share, once others are put in, says nothing new.
ALREADY_MET = 1e-9


class Constraints:
    """Collects constraints on ``3 n`` displacements, numbered ``3 node + component``.

    Where supports meet, each adds what the earlier ones leave free: a node that slides on two
    planes moves along their edge, one that is held stays held. Only displacements that nothing
    constrains yet can be averaged: tie nodes last.
    """

    def __init__(self, nodes: int) -> None:
        self._size = 3 * nodes
        self._eliminated: dict[int, tuple[Indices, Array]] = {}

    def hold(self, nodes: Indices) -> None:
        """Set all displacements of the nodes to zero."""
        for dof in (3 * nodes[:, None] + np.arange(3)).ravel():
            self._eliminate(int(dof), np.empty(0, np.int64), np.empty(0))

    def slide(self, nodes: Indices, normals: Array) -> None:
        """Let nodes move only across ``normals`` ``(n, 3)``: u·n = 0."""
        for node, normal in zip(nodes, normals, strict=True):
            self._equation(3 * int(node) + np.arange(3), normal)

    def zero_mean(self, nodes: Indices, weights: Array, direction: Array) -> None:
        """Hold the weighted mean displacement of the nodes along a unit ``direction``."""
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        self._equation(dofs, (weights[:, None] * direction).ravel())

    def average(self, nodes: Indices, parents: Indices) -> None:
        """Tie each node to the mean of its parents ``(n, k)``: a linear trace."""
        share = np.full(parents.shape[1], 1.0 / parents.shape[1])
        for node, row in zip(nodes, parents, strict=True):
            for component in range(3):
                self._eliminate(3 * int(node) + component, 3 * row + component, share)

    def _equation(self, dofs: Indices, coefficients: Array) -> None:
        """Impose Σ c u = 0 by the free displacement that counts most in it, if there is one."""
        free, shares = self._in_free(dofs, coefficients)
        if np.abs(shares).max(initial=0.0) <= ALREADY_MET * np.abs(coefficients).max():
            return
        pivot = int(np.argmax(np.abs(shares)))
        others = np.flatnonzero(shares)
        others = others[others != pivot]
        self._eliminate(int(free[pivot]), free[others], -shares[others] / shares[pivot])

    def _in_free(self, dofs: Indices, coefficients: Array) -> tuple[Indices, Array]:
        """Σ c u in the displacements that are not constrained yet: so no chain is ever closed."""
        terms: dict[int, float] = {}
        pending = list(zip(dofs.tolist(), coefficients.tolist(), strict=True))
        while pending:
            dof, share = pending.pop()
            if dof in self._eliminated:
                masters, factors = self._eliminated[dof]
                pending += zip(masters.tolist(), (share * factors).tolist(), strict=True)
            else:
                terms[dof] = terms.get(dof, 0.0) + share
        order = sorted(terms)
        return np.array(order, dtype=np.int64), np.array([terms[dof] for dof in order])

    def _eliminate(self, dof: int, masters: Indices, coefficients: Array) -> None:
        self._eliminated.setdefault(dof, (masters, coefficients))

    def transformation(self) -> sp.csr_matrix:
        """T, ``(3 n, free)``; masters that are themselves eliminated are followed to the end."""
        slaves = np.array(sorted(self._eliminated), dtype=np.int64)
        entries = [self._eliminated[dof] for dof in slaves.tolist()]
        counts = [len(masters) for masters, _ in entries]
        columns = np.concatenate([m for m, _ in entries]) if entries else np.empty(0, np.int64)
        values = np.concatenate([c for _, c in entries]) if entries else np.empty(0)
        shape = (self._size, self._size)
        relation = sp.csr_matrix((values, (np.repeat(slaves, counts), columns)), shape=shape)
        kept = np.ones(self._size)
        kept[slaves] = 0.0
        step = sp.diags(kept) + relation
        transformation = step
        while len(transformation[:, slaves].data):
            transformation = (transformation @ step).tocsr()
            transformation.eliminate_zeros()
        return transformation[:, np.flatnonzero(kept)].tocsr()
