"""Bodies with the same section all along a straight line, of second order in and along the section.

Displacements are Σ u_ik φ_i(x, z) ψ_k(y), with the functions φ of the section's elements and
quadratics ψ between levels y. Tetrahedra of the same nodes lack the products of quadratics in the
section and terms in y, by which the stress in a fillet varies along the slot. All matrices are sums
of Kronecker products of those of the section and of the line.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from skfem import Basis, BilinearForm

from fe_models.elasticity.body import ElasticBody, components, tensors
from fe_models.elasticity.recovery import StressRecovery
from fe_models.joints.face_traction import DEGREE, FaceTraction
from sa_solver.types import Array, Indices

# Integrals over an element from 0 to 1 of its quadratic functions: ψ_k ψ_l, ψ_k' ψ_l and ψ_k' ψ_l'.
PRODUCTS = np.array([[4.0, 2.0, -1.0], [2.0, 16.0, 2.0], [-1.0, 2.0, 4.0]]) / 30.0
MIXED = np.array([[-3.0, -4.0, 1.0], [4.0, 0.0, -4.0], [-1.0, 4.0, 3.0]]) / 6.0
SLOPES = np.array([[7.0, -8.0, 1.0], [-8.0, 16.0, -8.0], [1.0, -8.0, 7.0]]) / 3.0
# Derivatives of the functions at the nodes of an element, with the nodes in rows.
AT_NODES = np.array([[-3.0, 4.0, -1.0], [-1.0, 0.0, 1.0], [1.0, -4.0, 3.0]])
# Integration points of an element for tractions, which are linear on pieces of it.
GAUSS = 24


@dataclass(frozen=True)
class ExtrudedBody:
    """Elastic body whose plane ``section`` is extruded along Y.

    The section has elements of second order; those along Y have the ``ends`` ``(m + 1,)`` [mm].
    Displacements are ``(nodes of the section, 3, levels)``, flattened.

    Examples
    --------
    A bar of 1 mm² and 4 mm length is stretched by ε along Y, and free in the section.

    >>> import numpy as np
    >>> from skfem import MeshTri
    >>> from fe_models import Body, ElasticBody
    >>> from fe_models.elasticity.extruded import ExtrudedBody
    >>> from sa_solver import Material
    >>> steel = Material(210e3, 0.3)
    >>> section = ElasticBody(Body("bar", MeshTri().refined(1)), steel, 2)
    >>> bar = ExtrudedBody(section, np.linspace(0.0, 4.0, 3))
    >>> x, y, z = bar.nodes
    >>> moved = 1e-3 * np.stack([-0.3 * x, y, -0.3 * z], axis=1).ravel()
    >>> forces = (bar.stiffness @ moved).reshape(-1, 3, len(bar.levels))
    >>> print(forces[:, 1, -1].sum().round(6), "N of", 210e3 * 1e-3)
    210.0 N of 210.0
    """

    section: ElasticBody
    ends: Array

    @cached_property
    def levels(self) -> Array:
        """Levels along Y of the nodes ``(l,)`` [mm]: ends and middles of the elements."""
        return np.interp(
            np.arange(2 * len(self.ends) - 1) / 2.0, np.arange(len(self.ends)), self.ends
        )

    @property
    def nodes(self) -> Array:
        """Positions X, Y, Z of the nodes ``(3, nodes of the section, l)`` [mm]."""
        x, z = self.section.nodes[:, [0, 2]].T
        return np.array(np.broadcast_arrays(x[:, None], self.levels, z[:, None]))

    @property
    def size(self) -> int:
        """Number of displacements."""
        return 3 * len(self.section.nodes) * len(self.levels)

    @property
    def rigid_motions(self) -> Array:
        """Displacements ``(size, 6)`` of shifts along and turns about the axes."""
        x, y, z = (axis - axis.mean() for axis in self.nodes)
        one, no = np.ones_like(x), np.zeros_like(x)
        motions = [
            (one, no, no), (no, one, no), (no, no, one), (no, -z, y), (z, no, -x), (-y, x, no)
        ]  # fmt: skip
        return np.stack([np.stack(motion, axis=1).ravel() for motion in motions], axis=1)

    @cached_property
    def stiffness(self) -> sp.csr_matrix:
        """Stiffness matrix ``(size, size)`` [N/mm], as that of :class:`ElasticBody`."""
        lengths = np.diff(self.ends)
        products, mixed, slopes = (
            self._line(lengths**power, form)
            for power, form in ((1.0, PRODUCTS), (0.0, MIXED), (-1.0, SLOPES))
        )
        # The forms are those of derivatives along a and b; those along Y are taken on the line.
        lines = {(0, 0): products, (1, 0): mixed, (0, 1): mixed.T, (1, 1): slopes}
        basis = self.section.basis()
        lame, shear = self.section.material.lame, self.section.material.shear_modulus
        sections = dict.fromkeys(lines, sp.csr_matrix((3 * len(self.section.nodes),) * 2))
        for a, b in np.ndindex(3, 3):
            axes = lame * _unit(a, b) + shear * _unit(b, a)
            if a == b:
                axes = axes + shear * sp.identity(3)
            on_line = int(a == 1), int(b == 1)
            sections[on_line] = sections[on_line] + sp.kron(self._section_form(basis, a, b), axes)
        parts = [sp.kron(of, lines[on_line], format="csr") for on_line, of in sections.items()]
        return (parts[0] + parts[1] + parts[2] + parts[3]).tocsr()

    def along(self, forces: Array) -> Array:
        """Return nodal forces ``(size, k)`` of plane ones per length ``(2 nodes, k)``, along Y."""
        lengths = self._line(np.diff(self.ends), PRODUCTS).sum(axis=1)
        spatial = np.zeros((len(self.section.nodes), 3, forces.shape[1]))
        spatial[:, [0, 2]] = forces.reshape(len(self.section.nodes), 2, -1)
        return np.einsum("nck,l->nclk", spatial, np.asarray(lengths).ravel()).reshape(self.size, -1)

    def traction_load(self, traction: FaceTraction, number: int, whole: bool) -> Array:
        """Return nodal forces ``(size, k)`` of the traction on body ``number``, 1 or 2.

        For ``whole`` see :meth:`fe_models.joints.face_traction.FaceTraction.load`.
        """
        points, areas, weights = self.section.facet_rule(traction.interface.name, DEGREE)
        inner, shares = np.polynomial.legendre.leggauss(GAUSS)
        lengths = np.diff(self.ends)
        share = 0.5 * (1.0 + inner)
        y = (self.ends[:-1, None] + lengths[:, None] * share).ravel()
        size = (0.5 * lengths[:, None] * shares).ravel()
        values = np.array(
            [(1 - share) * (1 - 2 * share), 4 * share * (1 - share), share * (2 * share - 1)]
        )
        elements = np.repeat(np.arange(len(lengths)), GAUSS)
        rows = (2 * elements + np.arange(3)[:, None]).ravel()
        columns = np.tile(np.arange(len(y)), 3)
        of_line = np.tile(values, len(lengths)).ravel() * np.tile(size, 3)
        line = sp.csr_matrix((of_line, (rows, columns)), shape=(len(self.levels), len(y)))
        places = np.stack(
            [
                np.repeat(points[0], len(y)),
                np.tile(y, points.shape[1]),
                np.repeat(points[2], len(y)),
            ]
        )
        found = traction.on_points(places, np.outer(areas, size).ravel(), number, whole)
        found = found.reshape(len(found), 3, len(areas), len(y))
        loads = [
            np.stack([weights @ of_axis @ line.T for of_axis in of_state], axis=1)
            for of_state in found
        ]
        return np.stack(loads, axis=-1).reshape(self.size, -1)

    def stress(self, displacement: Array, vertices: Indices, recovery: StressRecovery) -> Array:
        """Return the stress ``(6, n, l)`` [MPa] at ``vertices`` of the section on all levels.

        ``recovery`` is that of the section; its free surface has no tractions.
        """
        nodal = displacement.reshape(len(self.section.nodes), -1)
        slopes = recovery.slopes(nodal, vertices).reshape(3, len(self.levels), 2, -1)
        at = nodal.reshape(-1, 3, len(self.levels))[vertices]
        gradient = np.empty((3, 3, len(vertices), len(self.levels)))
        gradient[:, [0, 2]] = slopes.transpose(0, 2, 3, 1)
        gradient[:, 1] = np.einsum("ncl,kl->cnk", at, self._derivative)
        flat = gradient.reshape(3, 3, -1)
        along = np.repeat(recovery.along_surface(vertices), len(self.levels), axis=0)
        tensor = np.moveaxis(tensors(self.section.cauchy(flat)), -1, 0)
        # The two ends are free as well.
        at_end = np.zeros((len(vertices), len(self.levels)), bool)
        at_end[:, [0, -1]] = True
        along[at_end.ravel(), 1, 1] = 0.0
        found = components(np.moveaxis(along @ tensor @ along, 0, -1))
        return found.reshape(6, len(vertices), -1)

    @cached_property
    def _derivative(self) -> Array:
        """Derivatives at the levels from nodal values ``(l, l)``; means at the ends of elements."""
        matrix, count = np.zeros((len(self.levels),) * 2), np.zeros(len(self.levels))
        for element, length in enumerate(np.diff(self.ends)):
            nodes = 2 * element + np.arange(3)
            matrix[np.ix_(nodes, nodes)] += AT_NODES / length
            count[nodes] += 1.0
        return matrix / count[:, None]

    def _line(self, factors: Array, form: Array) -> sp.csr_matrix:
        """Return a matrix ``(l, l)`` of the line: ``form`` times a factor in each element."""
        nodes = 2 * np.arange(len(factors))[:, None] + np.arange(3)
        values = factors[:, None, None] * form
        rows = np.broadcast_to(nodes[:, :, None], values.shape).ravel()
        columns = np.broadcast_to(nodes[:, None, :], values.shape).ravel()
        return sp.csr_matrix((values.ravel(), (rows, columns)), shape=(len(self.levels),) * 2)

    def _section_form(self, basis: Basis, a: int, b: int) -> sp.csr_matrix:
        """Return ∫ ∂a φ_i ∂b φ_j dA of the section; derivatives along Y are left out."""
        place = {0: 0, 2: 1}

        def form(u: Any, v: Any, w: Any) -> Any:
            one = v if a == 1 else v.grad[place[a]]
            other = u if b == 1 else u.grad[place[b]]
            return one * other

        return BilinearForm(form).assemble(basis).tocsr()


def _unit(a: int, b: int) -> sp.csr_matrix:
    """Return the 3 x 3 matrix with a one in row a and column b."""
    return sp.csr_matrix(([1.0], ([a], [b])), shape=(3, 3))
