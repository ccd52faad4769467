"""Linear constraints on displacements, imposed by elimination: u = T u_free, no penalty."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.linalg import null_space, qr

from sa_solver.ties import first_largest
from sa_solver.types import Array, Indices

# An equation whose coefficients shrink to this share, once others are put in, says nothing new.
ALREADY_MET = 1e-9
# Motions whose share of what constraints hold is less are left free by them.
NULL = 1e-9


class Constraints:
    """Collects constraints on displacements, numbered ``dimension node + component``.

    Where supports meet, each adds what the earlier ones leave free: a node that slides on two
    planes moves along their edge, one that is held stays held. Only displacements that nothing
    constrains yet can be averaged: tie nodes last.

    Examples
    --------
    Node 0 is held, node 1 slides on a plane at 45°, and node 2 is the mean of both:

    >>> import numpy as np
    >>> from fe_models import Constraints
    >>> constraints = Constraints(3, dimension=2)
    >>> constraints.hold(np.array([0]))
    >>> constraints.slide(np.array([1]), np.array([[1.0, 1.0]]))
    >>> constraints.average(np.array([2]), np.array([[0, 1]]))
    >>> print(constraints.transformation().toarray().ravel())
    [ 0.   0.  -1.   1.  -0.5  0.5]
    """

    def __init__(self, nodes: int, dimension: int = 3) -> None:
        self._dimension = dimension
        self._size = dimension * nodes
        self._eliminated: dict[int, tuple[Indices, Array]] = {}
        self._by_ties: set[int] = set()

    def hold(self, nodes: Indices) -> None:
        """Set all displacements of the nodes to zero."""
        for dof in self._dofs(nodes):
            self._eliminated.setdefault(int(dof), (np.empty(0, np.int64), np.empty(0)))

    def slide(self, nodes: Indices, normals: Array) -> None:
        """Let nodes move only across ``normals`` ``(n, dimension)``: u·n = 0."""
        for dofs, normal in zip(self._dofs(nodes).reshape(normals.shape), normals, strict=True):
            self._equation(dofs, normal)

    def zero_mean(self, nodes: Indices, weights: Array, direction: Array) -> None:
        """Hold the weighted mean displacement of the nodes along a unit ``direction``."""
        self._equation(self._dofs(nodes), (weights[:, None] * direction).ravel())

    def average(self, nodes: Indices, parents: Indices) -> None:
        """Tie each node to the mean of its parents ``(n, k)``: a linear trace."""
        share = np.full(parents.shape[1], 1.0 / parents.shape[1])
        for node, row in zip(nodes, parents, strict=True):
            for dof, masters in zip(
                self._dofs(node), self._dofs(row).reshape(-1, self._dimension).T, strict=True
            ):
                self._eliminated.setdefault(int(dof), (masters, share))

    def no_work(self, forces: Array) -> None:
        """Hold the displacement on which ``forces`` ``(size,)`` would do work: Σ f u = 0."""
        dofs = np.flatnonzero(forces)
        self._equation(dofs, forces[dofs])

    def follow(self, nodes: Indices, motions: Array) -> None:
        """Let nodes move by combinations of ``motions`` ``(dimension n, k)``, and by no others.

        By those that earlier constraints leave.
        """
        dofs = self._dofs(nodes)
        place = {dof: row for row, dof in enumerate(dofs.tolist())}
        entries = {d: self._in_free(np.array([d]), np.ones(1)) for d in place if d in self}
        inner = {d: e for d, e in entries.items() if all(m in place for m in e[0].tolist())}
        forbidden = np.zeros((len(inner), motions.shape[1]))
        for row, (dof, (masters, shares)) in enumerate(inner.items()):
            rows = [place[master] for master in masters.tolist()]
            forbidden[row] = motions[place[dof]] - shares @ motions[rows]
        left = motions @ null_space(forbidden, NULL) if motions.size else motions
        free = np.array([dof not in entries for dof in place])
        alone = left[free]
        chosen = _independent(alone)
        by_chosen, leading = np.linalg.pinv(alone[chosen]), dofs[free][chosen]
        for row in np.setdiff1d(np.arange(len(alone)), chosen).tolist():
            shares = alone[row] @ by_chosen
            some = np.abs(shares) > ALREADY_MET
            self._eliminated[int(dofs[free][row])] = leading[some], shares[some]
        # Those that earlier constraints tie to other nodes take these along.
        for dof in entries.keys() - inner.keys():
            shares = left[place[dof]] @ by_chosen
            self._equation(np.append(leading, dof), np.append(-shares, 1.0))

    def __contains__(self, dof: int) -> bool:
        """Whether a displacement is constrained."""
        return dof in self._eliminated

    def tie(self, nodes: Indices, parents: Indices, shares: sp.csr_matrix, turn: Array) -> None:
        """Let nodes do what parents do, turned: u = R Σ s u_parent, as far as nothing holds them.

        ``shares`` ``(n, m)`` are s of the ``parents`` ``(m,)``, ``turn`` ``(dimension, dimension)``
        is R. A node may be its own parent: then it keeps what the turn leaves as it is.
        """
        shares = shares.tocsr()
        for row, own in enumerate(self._dofs(nodes).reshape(-1, self._dimension)):
            of_row = slice(shares.indptr[row], shares.indptr[row + 1])
            masters, share = self._dofs(parents[shares.indices[of_row]]), shares.data[of_row]
            for dof, along in zip(own, turn, strict=True):
                weights = np.outer(share, along).ravel()
                kept = np.flatnonzero(weights)
                before = len(self._eliminated)
                self._equation(np.append(dof, masters[kept]), np.append(1.0, -weights[kept]))
                if len(self._eliminated) > before:
                    self._by_ties.add(next(reversed(self._eliminated)))

    def _dofs(self, nodes: Indices) -> Indices:
        """Displacements of nodes, one node after the other."""
        return (self._dimension * np.reshape(nodes, (-1, 1)) + np.arange(self._dimension)).ravel()

    def _equation(self, dofs: Indices, coefficients: Array) -> None:
        """Impose Σ c u = 0 by the free displacement that counts most in it, if there is one."""
        free, shares = self._in_free(dofs, coefficients)
        if np.abs(shares).max(initial=0.0) <= ALREADY_MET * np.abs(coefficients).max():
            return
        pivot = first_largest(np.abs(shares))
        others = np.flatnonzero(shares)
        others = others[others != pivot]
        entry = free[others], -shares[others] / shares[pivot]
        self._eliminated.setdefault(int(free[pivot]), entry)

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

    @property
    def free(self) -> Indices:
        """The displacements that nothing eliminates, ascending: the columns of T."""
        return np.setdiff1d(np.arange(self._size), np.fromiter(self._eliminated, np.int64))

    @property
    def supported(self) -> Indices:
        """Nodes ``(n,)`` whose displacements are held or averaged, by more than :meth:`tie`."""
        entries = [
            np.append(masters, dof)
            for dof, (masters, _) in self._eliminated.items()
            if dof not in self._by_ties
        ]
        dofs = np.concatenate(entries) if entries else np.empty(0, np.int64)
        return np.unique(dofs // self._dimension)

    def places(self, nodes: Indices) -> Indices:
        """Where the displacements of unconstrained nodes are among :attr:`free`."""
        return np.searchsorted(self.free, self._dofs(nodes))

    def transformation(self) -> sp.csr_matrix:
        """T, ``(displacements, free)``; eliminated masters are followed to the end."""
        slaves = np.setdiff1d(np.arange(self._size), self.free)
        entries = [self._eliminated[dof] for dof in slaves.tolist()]
        counts = [len(masters) for masters, _ in entries]
        columns = np.concatenate([m for m, _ in entries]) if entries else np.empty(0, np.int64)
        values = np.concatenate([c for _, c in entries]) if entries else np.empty(0)
        shape = (self._size, self._size)
        relation = sp.csr_matrix((values, (np.repeat(slaves, counts), columns)), shape=shape)
        kept = np.zeros(self._size)
        kept[self.free] = 1.0
        step = sp.diags(kept) + relation
        transformation = step
        while len(transformation[:, slaves].data):
            transformation = (transformation @ step).tocsr()
            transformation.eliminate_zeros()
        return transformation[:, self.free].tocsr()


def _independent(motions: Array) -> Indices:
    """As many displacements as there are ``motions`` ``(n, k)`` of them, far from dependent."""
    if not motions.size:
        return np.empty(0, np.int64)
    _, upper, order = qr(motions.T, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(upper))
    return np.asarray(order[: np.sum(sizes > ALREADY_MET * sizes.max())])
