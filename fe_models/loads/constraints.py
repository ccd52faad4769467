"""Linear constraints on displacements, imposed by elimination: u = T u_free, no penalty."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.linalg import null_space, orth

from fe_models.loads.averages import leaving_means
from sa_solver import checks
from sa_solver.ties import first_largest
from sa_solver.types import Array, Indices

# An equation is redundant if substituting the others shrinks its coefficients to this share.
ALREADY_MET = 1e-9
# Constraints leave a motion free if the part of it that they hold is less than this share.
NULL = 1e-9


class Constraints:
    """Collection of constraints on displacements, numbered ``dimension node + component``.

    Where supports meet, each adds what the earlier ones leave free: a node that slides on two
    planes moves along their edge, and a node that is held stays held. Only displacements that are
    not constrained yet can be averaged, so tie nodes last.

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
        # Displacements and the combinations that replace them, numbered after those of all nodes.
        self._combined: list[tuple[Indices, sp.csr_matrix]] = []
        # Displacements that follow motions, the numbers of their combinations, and these.
        self._following: list[tuple[Indices, Indices, Array]] = []

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
        """Tie each node to the mean of its parents ``(n, k)``, as on a linear trace."""
        share = np.full(parents.shape[1], 1.0 / parents.shape[1])
        for node, row in zip(nodes, parents, strict=True):
            for dof, masters in zip(
                self._dofs(node), self._dofs(row).reshape(-1, self._dimension).T, strict=True
            ):
                self._eliminated.setdefault(int(dof), (masters, share))

    def no_work(self, forces: Array, points: Array) -> None:
        """Allow only displacements on which none of the ``forces`` ``(k, size)`` does work.

        The displacements under the forces are replaced by local combinations on which the forces do
        no work (:mod:`fe_models.loads.averages`). The nodes' ``points`` ``(n, 3)`` determine which
        nodes are near each other.
        """
        found = [self._in_free(np.flatnonzero(row), row[row != 0.0]) for row in forces]
        dofs = np.unique(np.concatenate([numbers for numbers, _ in found]))
        means = np.zeros((len(found), len(dofs)))
        for row, (numbers, shares) in zip(means, found, strict=True):
            row[np.searchsorted(dofs, numbers)] = shares
        means = means[np.linalg.norm(means, axis=1) > ALREADY_MET * np.linalg.norm(forces, axis=1)]
        if not len(means):
            return
        nodes = np.where(dofs < self._size, dofs // self._dimension, 0)
        basis = leaving_means(means, points[nodes])
        added = self._combine(dofs, basis)
        for dof, first, last in zip(dofs.tolist(), basis.indptr, basis.indptr[1:], strict=False):
            entries = slice(first, last)
            self._eliminated[dof] = added[basis.indices[entries]], basis.data[entries]

    def values(self, displacements: Array) -> Array:
        """Return the free displacements ``(free, ...)`` of ``displacements`` ``(size, ...)``."""
        extended = np.asarray(displacements)
        for dofs, basis in self._combined:
            extended = np.concatenate([extended, basis.T @ extended[dofs]])
        return extended[self.free]

    @property
    def rigid(self) -> Indices:
        """Nodes that follow motions, as those of rigid faces."""
        parts = [dofs // self._dimension for dofs, *_ in self._following]
        return np.unique(np.concatenate(parts)) if parts else np.empty(0, np.int64)

    @property
    def _total(self) -> int:
        """Number of displacements of nodes and of combinations of them."""
        return self._size + sum(basis.shape[1] for _, basis in self._combined)

    def follow(self, nodes: Indices, motions: Array) -> None:
        """Let nodes move only by combinations of ``motions`` ``(dimension n, k)``.

        The motions are restricted to those that earlier constraints allow. They become free
        displacements that replace those of the nodes.
        """
        dofs = self._dofs(nodes)
        for same, added, basis in self._following:
            if np.array_equal(same, dofs):
                self._follow_too(added, basis, motions)
                return
        place = {dof: row for row, dof in enumerate(dofs.tolist())}
        entries = {d: self._in_free(np.array([d]), np.ones(1)) for d in place if d in self}
        inner = {d: e for d, e in entries.items() if all(m in place for m in e[0].tolist())}
        forbidden = np.zeros((len(inner), motions.shape[1]))
        for row, (dof, (masters, shares)) in enumerate(inner.items()):
            rows = [place[master] for master in masters.tolist()]
            forbidden[row] = motions[place[dof]] - shares @ motions[rows]
        left = motions @ null_space(forbidden, NULL) if motions.size else motions
        basis = orth(left, NULL) if left.size else left
        added = self._combine(dofs, sp.csr_matrix(basis))
        self._following.append((dofs, added, basis))
        for dof, row in zip(place, basis, strict=True):
            if dof not in entries:
                self._eliminated[dof] = added, row
        # Displacements that earlier constraints tie to other nodes move these with them.
        for dof in entries.keys() - inner.keys():
            self._equation(np.append(added, dof), np.append(-basis[place[dof]], 1.0))

    def _follow_too(self, added: Indices, basis: Array, motions: Array) -> None:
        """Restrict motions that nodes already follow to those that are also among ``motions``."""
        also = orth(motions, NULL) if motions.size else motions
        lost = basis - also @ (also.T @ basis)
        _, sizes, shapes = np.linalg.svd(lost, full_matrices=False)
        for shape in shapes[sizes > NULL]:
            self._equation(added, shape)

    def _combine(self, dofs: Indices, basis: sp.csr_matrix) -> Indices:
        """Assign numbers after all others to the combinations of displacements ``dofs``."""
        added = self._total + np.arange(basis.shape[1])
        self._combined.append((dofs, basis))
        return added

    def __contains__(self, dof: int) -> bool:
        """Return whether a displacement is constrained."""
        return dof in self._eliminated

    def tie(self, nodes: Indices, parents: Indices, shares: sp.csr_matrix, turn: Array) -> None:
        """Let nodes move as their parents do, rotated: u = R Σ s u_parent, as far as they are free.

        A node may be its own parent; then it is restricted to the displacements that the rotation
        does not change.

        Parameters
        ----------
        nodes
            Nodes ``(n,)`` that are tied.
        parents
            Nodes ``(m,)`` that they follow.
        shares
            Coefficients s ``(n, m)``.
        turn
            Rotation R ``(dimension, dimension)``.
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
        """Return the displacement numbers of nodes, one node after the other."""
        nodes = checks.places("nodes", nodes, self._size // self._dimension).reshape(-1, 1)
        dofs: Indices = (self._dimension * nodes + np.arange(self._dimension)).ravel()
        return dofs

    def _equation(self, dofs: Indices, coefficients: Array) -> None:
        """Impose Σ c u = 0 by eliminating the free displacement with the largest coefficient.

        A redundant equation is ignored.
        """
        free, shares = self._in_free(dofs, coefficients)
        if np.abs(shares).max(initial=0.0) <= ALREADY_MET * np.abs(coefficients).max():
            return
        pivot = first_largest(np.abs(shares))
        others = np.flatnonzero(shares)
        others = others[others != pivot]
        entry = free[others], -shares[others] / shares[pivot]
        self._eliminated.setdefault(int(free[pivot]), entry)

    def _in_free(self, dofs: Indices, coefficients: Array) -> tuple[Indices, Array]:
        """Return Σ c u in displacements that are not constrained yet, which prevents cycles."""
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
        """Displacements that are not eliminated, ascending: the columns of T.

        Those of nodes, below ``size``, are followed by combinations of them (:meth:`no_work`,
        :meth:`follow`).
        """
        kept = np.ones(self._total, bool)
        kept[list(self._eliminated)] = False
        return np.flatnonzero(kept)

    @property
    def supported(self) -> Indices:
        """Nodes ``(n,)`` whose displacements are held or averaged by more than :meth:`tie`."""
        entries = [
            np.append(masters, dof)
            for dof, (masters, _) in self._eliminated.items()
            if dof not in self._by_ties
        ]
        dofs = np.concatenate(entries) if entries else np.empty(0, np.int64)
        return np.unique(dofs[dofs < self._size] // self._dimension)

    def places(self, nodes: Indices) -> Indices:
        """Return the positions of the displacements of unconstrained nodes in :attr:`free`."""
        return np.searchsorted(self.free, self._dofs(nodes))

    def transformation(self) -> sp.csr_matrix:
        """Return T, ``(displacements, free)``, with chains of eliminated displacements resolved."""
        free, slaves = self.free, np.array(sorted(self._eliminated), np.int64)
        entries = [self._eliminated[dof] for dof in slaves.tolist()]
        counts = [len(masters) for masters, _ in entries]
        columns = np.concatenate([m for m, _ in entries]) if entries else np.empty(0, np.int64)
        values = np.concatenate([c for _, c in entries]) if entries else np.empty(0)
        shape = (self._total, self._total)
        relation = sp.csr_matrix((values, (np.repeat(slaves, counts), columns)), shape=shape)
        kept = np.zeros(self._total)
        kept[free] = 1.0
        step = sp.diags(kept) + relation
        transformation = step
        while len(transformation[:, slaves].data):
            transformation = (transformation @ step).tocsr()
            transformation.eliminate_zeros()
        return transformation[: self._size, free].tocsr()
