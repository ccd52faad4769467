"""Linear trace of contact faces whose elements are of second order.

Contact tractions t = Σ t_k φ_k are linear between the vertices of a face. They do work only on the
means of its displacement under each φ_i,

    m_i = ∫ φ_i u dA / ∫ φ_i dA = (B u)_i.

A linear field with nodal values w has the means G w. With m = G w, w is the linear field closest to
u (least squares), and the forces that do work on it are f_i = ∫ φ_i t dA. The sums and moments of
these forces at the vertices are those of the tractions, and rigid motions and linear fields are
their own trace.

The vertices may be those of the facets, or of their halves and quarters: then every node of the
elements is in contact (:func:`fe_models.meshes.halving.halved`). A pressure that changes within an
element is off in opposite directions at the corners of elements and in the middle of their edges.

The alternative, to keep a face linear by holding midside nodes between their vertices, makes the
elements behind the face no better than those of first order: under a Hertzian pressure on ten of
them the deflection of the face has an error of 1.7 %, with this trace 0.1 % (under a uniform
pressure 2.9 and 0.2 %).

Each mean is attached to a spring of stiffness κ in every direction, whose far end e is an unknown
of the body and carries the contact force F = G⁻ᵀf. Bodies without support stay free, and systems
positive definite. The springs are in series with the body, so they are removed exactly afterwards:
with Z the body condensed onto the ends, m = e - F/κ and

    S = κ (C⁻¹ - 1),   C = 1 - Z/κ,   r = C⁻¹ r_Z.

Mixed methods of second-order displacements and first-order tractions: Puso, Laursen & Solberg 2008,
doi:10.1016/j.cma.2007.08.009.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from fe_models.elasticity.body import ElasticBody
from sa_solver.types import Array, Indices

# Ratio of the stiffness of permanent springs to that of the nodes they are attached to: softer ones
# add compliance, stiffer ones rounding errors.
TIED = 1e3


@dataclass(frozen=True)
class LinearTrace:
    """Integrals of the linear functions φ of the vertices of contact faces.

    ``products`` are ∫ φ_i φ_k dA ``(n, n)``, and ``moments`` ∫ φ_i N_j dA ``(n, nodes)`` with the
    functions N of all nodes of the body [mm²]; in the plane they are per length [mm].
    """

    products: sp.csr_matrix
    moments: sp.csr_matrix

    @classmethod
    def of(cls, elastic: ElasticBody, faces: Mapping[str, Indices]) -> LinearTrace | None:
        """Return the trace of boundaries, whose vertices ``faces`` gives in the interfaces' order.

        The result is None for elements of first order, whose faces are linear themselves.
        """
        if elastic.order == 1:
            return None
        products, moments = [], []
        for boundary, vertices in faces.items():
            # If the face extends beyond the other body, integrate between these vertices only:
            # means over parts outside the contact would constrain rigid motions.
            of_vertices, of_nodes = elastic.linear_moments(boundary, vertices)
            products.append(of_vertices[vertices][:, vertices])
            moments.append(of_nodes[vertices])
        return cls(sp.block_diag(products, format="csr"), sp.vstack(moments, format="csr"))

    def springs(self, elastic: ElasticBody, frames: Array, free: Indices) -> TraceSprings:
        """Return springs on the means along ``frames`` ``(n, d, d)``, only for those ``free``.

        ``free`` ``(k,)`` are the numbers of the displacements that are not held.
        """
        areas = sp.diags(1.0 / np.asarray(self.products.sum(axis=1)).ravel())
        d = elastic.dimension
        means = sp.kron(areas @ self.moments, sp.identity(d), format="csr")
        averages = sp.kron(areas @ self.products, sp.identity(d), format="csr")
        along = sp.block_diag(list(frames), format="csr")
        # Any stiffness is admissible; one close to the body's has the smallest rounding errors.
        stiffness = float(np.median(elastic.stiffness.diagonal()))
        return TraceSprings(
            (along @ means)[free].tocsr(), averages[free][:, free].tocsc(), stiffness
        )


@dataclass(frozen=True)
class TraceSprings:
    """Springs between the ``k`` means of a face's displacement and their ends.

    Attributes
    ----------
    means
        B ``(k, size)``, means of all displacements, in the frames of the interface.
    averages
        G ``(k, k)``, means of nodal values.
    stiffness
        κ [N/mm], in the plane per length.
    """

    means: sp.csr_matrix
    averages: sp.csc_matrix
    stiffness: float

    def tied(self, stiffness: sp.csr_matrix, transformation: sp.csr_matrix) -> sp.csr_matrix:
        """Return the stiffness with permanent springs, whose ends are nodal values.

        They are ``TIED`` times as stiff as those of :meth:`joined`. This is for reduced models,
        from which springs cannot be removed again.
        """
        return self._with_springs(stiffness, transformation, self.averages, TIED * self.stiffness)

    def joined(self, stiffness: sp.csr_matrix, transformation: sp.csr_matrix) -> sp.csr_matrix:
        """Return the stiffness of a body's free displacements ``(m, m)`` followed by the ends."""
        return self._with_springs(stiffness, transformation, sp.identity(len(self)), self.stiffness)

    def removed(
        self, condensed: Array, loads: Array, basis: sp.csr_matrix | None = None
    ) -> tuple[Array, Array]:
        """Return stiffness and loads on the nodal values, from those ``condensed`` onto the ends.

        Both may be in an orthonormal ``basis`` ``(k, l)`` of a mirror.
        """
        averages = self.averages if basis is None else basis.T @ self.averages @ basis
        left = -condensed / self.stiffness
        left[np.diag_indices_from(left)] += 1.0
        factor = sl.cho_factor(left, lower=True, overwrite_a=True)
        moved = averages.T @ sl.cho_solve(factor, loads)
        # Three times as fast as solving for the columns of the identity.
        bare, _ = sl.lapack.dpotri(factor[0], lower=True, overwrite_c=True)
        bare *= self.stiffness
        bare[np.diag_indices_from(bare)] -= self.stiffness
        bare = np.tril(bare) + np.tril(bare, -1).T
        nodal = averages.T @ (averages.T @ bare).T
        return 0.5 * (nodal + nodal.T), moved

    def ends(self, nodal: Array, forces: Array) -> Array:
        """Return the ends ``(k, ...)`` [mm] for ``nodal`` displacements under ``forces`` [N]."""
        return np.asarray(self.averages @ nodal + self.on_ends(forces) / self.stiffness)

    def nodal(self, ends: Array, forces: Array) -> Array:
        """Return nodal displacements ``(k, ...)`` for ``ends``, the inverse of :meth:`ends`."""
        return self._solve(ends - self.on_ends(forces) / self.stiffness)

    def on_ends(self, forces: Array) -> Array:
        """Return the forces ``(k, ...)`` on the ends for those of the nodes [N]."""
        return self._solve(forces, "T")

    def of(self, displacement: Array) -> Array:
        """Return nodal values ``(k,)`` of the linear field closest to a displacement."""
        return self._solve(self.means @ displacement)

    def _with_springs(
        self,
        stiffness: sp.csr_matrix,
        transformation: sp.csr_matrix,
        of_ends: sp.spmatrix,
        spring: float,
    ) -> sp.csr_matrix:
        """Return the stiffness of free displacements and ends, whose means are ``of_ends``."""
        stretch = sp.hstack([self.means @ transformation, -of_ends], format="csr")
        body = sp.block_diag([stiffness, sp.csr_matrix((len(self),) * 2)], format="csr")
        return (body + spring * (stretch.T @ stretch)).tocsr()

    def __len__(self) -> int:
        return int(self.averages.shape[0])

    @cached_property
    def _factors(self) -> Any:
        return splu(self.averages)

    def _solve(self, values: Array, transposed: str = "N") -> Array:
        return np.asarray(self._factors.solve(np.ascontiguousarray(values), transposed))
