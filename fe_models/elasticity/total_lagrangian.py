"""Finite displacements of an elastic body in total Lagrangian form, St. Venant-Kirchhoff.

With the displacement gradient H, F = 1 + H, Green's strain E = (H + Hᵀ + HᵀH) / 2 and the second
Piola-Kirchhoff stress S = λ tr(E) 1 + 2 G E, the nodal forces are ∫ F S ∇φi and their tangent has
the blocks (Bonet & Wood 2008, ch. 9, doi:10.1017/CBO9780511755446)

    K_ab,ij = ∫ λ pi_a pj_b + G (pi_b pj_a + (F Fᵀ)_ab ∇φi·∇φj) + δ_ab ∇φi·S ∇φj,   pi = F ∇φi.

With F = 1 and the stress of the linear solution for S, these blocks are the stiffness of linear
elasticity and, in the last term, the stress stiffness of a body that is loaded but hardly
displaced.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp

from fe_models.elasticity.body import ElasticBody
from sa_solver.types import Array, Indices


class TotalLagrangian:
    """Nodal forces and stiffness of an elastic body at displacements ``(size,)`` [mm].

    Any strain is accepted, but St. Venant-Kirchhoff is a model of small strains with any rotation.
    In the plane E has no component across it (plane strain).
    """

    def __init__(self, elastic: ElasticBody) -> None:
        self._material = elastic.material
        self._dimension = elastic.dimension
        # F S ∇φ is of degree 4 (order - 1) in space, so every integral is exact where elements are
        # straight.
        basis = elastic.basis(max(1, 4 * (elastic.order - 1)))
        self._nodes = int(basis.N)
        self._element_nodes = basis.element_dofs.T
        self._weights = np.asarray(basis.dx)
        # (axes, elements, element nodes, points)
        self._gradients = np.stack(
            [np.asarray(function[0].grad) for function in basis.basis], axis=2
        )

    def internal_force(self, displacement: Array) -> Array:
        """Return the nodal forces ``(size,)`` that hold the body at the displacements [N]."""
        gradient = self._displacement_gradient(displacement)
        deformation = _identity(gradient) + gradient
        nominal = _product(deformation, self._stress(green_strain(gradient))) * self._weights
        forces = np.einsum("abeq,beiq->aei", nominal, self._gradients)
        nodes = self._element_nodes.ravel()
        total = np.stack(
            [np.bincount(nodes, force.ravel(), self._nodes) for force in forces], axis=1
        )
        return np.asarray(total, dtype=np.float64).ravel()

    def tangent(self, displacement: Array) -> sp.csr_matrix:
        """Return the derivative of the nodal forces, material and geometric, ``(size, size)``.

        It is in N/mm.
        """
        gradient = self._displacement_gradient(displacement)
        return self._stiffness(_identity(gradient) + gradient, self._stress(green_strain(gradient)))

    def stress_stiffened(self, displacement: Array) -> sp.csr_matrix:
        """Return the stiffness of the undisplaced body under the stress of ``displacement``.

        The stress σ is that of the linear solution, and the stiffness is K + ∫ ∇φi·σ ∇φj 1 [N/mm].
        It stiffens a pulled string and softens a pressed column until it buckles.
        """
        gradient = self._displacement_gradient(displacement)
        linear = 0.5 * (gradient + gradient.swapaxes(0, 1))
        return self._stiffness(_identity(gradient), self._stress(linear))

    def largest_strain(self, displacement: Array) -> float:
        """Return the largest absolute principal value of Green's strain, over all points."""
        strain = green_strain(self._displacement_gradient(displacement))
        return float(np.abs(np.linalg.eigvalsh(np.moveaxis(strain, (0, 1), (-2, -1)))).max())

    def largest_rotation(self, displacement: Array) -> float:
        """Return the largest rotation over all integration points [rad]."""
        gradient = self._displacement_gradient(displacement)
        deformation = np.moveaxis(_identity(gradient) + gradient, (0, 1), (-2, -1))
        left, _, right = np.linalg.svd(deformation)
        return float(rotation_angle(left @ right).max())

    def _displacement_gradient(self, displacement: Array) -> Array:
        """Return H, ``(d, d, elements, points)``, as ∂b u_a."""
        nodal = displacement.reshape(-1, self._dimension)[self._element_nodes]
        return np.einsum("eia,beiq->abeq", nodal, self._gradients)

    def _stress(self, strain: Array) -> Array:
        """Return λ tr(E) 1 + 2 G E of strains ``(d, d, ...)`` [MPa]."""
        volumetric = self._material.lame * np.trace(strain)
        return volumetric * _identity(strain) + 2.0 * self._material.shear_modulus * strain

    def _stiffness(self, deformation: Array, stress: Array) -> sp.csr_matrix:
        """Return the matrix of the blocks K_ab,ij for F and S ``(d, d, elements, points)``."""
        lame, shear = self._material.lame, self._material.shear_modulus
        pushed = np.einsum("abeq,beiq->aeiq", deformation, self._gradients)
        left = _product(deformation, deformation.swapaxes(0, 1))
        geometric = self._gradient_products(np.einsum("abeq,beiq->aeiq", stress, self._gradients))
        rows, columns, places = self._pattern
        blocks = np.empty((len(rows), self._dimension, self._dimension))
        for a in range(self._dimension):
            for b in range(a, self._dimension):
                pair = self._products(pushed[a], pushed[b])
                block = lame * pair + shear * pair.swapaxes(1, 2)
                block += shear * self._gradient_products(left[a, b][:, None] * self._gradients)
                if a == b:
                    block += geometric
                blocks[:, a, b] = np.bincount(places, block.ravel())
                blocks[:, b, a] = np.bincount(places, block.swapaxes(1, 2).ravel())
        starts = np.searchsorted(rows, np.arange(self._nodes + 1))
        size = self._dimension * self._nodes
        return sp.bsr_matrix((blocks, columns, starts), shape=(size, size)).tocsr()

    def _gradient_products(self, vectors: Array) -> Array:
        """Return ∫ v_i·∇φj of vectors ``(d, elements, element nodes, points)``, by element."""
        pairs = zip(vectors, self._gradients, strict=True)
        return np.sum([self._products(left, right) for left, right in pairs], axis=0)

    def _products(self, left: Array, right: Array) -> Array:
        """Return ∫ f_i g_j of functions ``(elements, element nodes, points)``, by element."""
        return (left * self._weights[:, None, :]) @ right.swapaxes(1, 2)

    @cached_property
    def _pattern(self) -> tuple[Indices, Indices, Indices]:
        """Rows and columns of the node pairs, and the pair's number for each pair in an element."""
        nodes = self._element_nodes.astype(np.int64)
        keys = nodes[:, :, None] * self._nodes + nodes[:, None, :]
        pairs, places = np.unique(keys.ravel(), return_inverse=True)
        return pairs // self._nodes, pairs % self._nodes, places


def green_strain(gradient: Array) -> Array:
    """Return E = (H + Hᵀ + HᵀH) / 2 of displacement gradients ``(d, d, ...)``."""
    transposed = gradient.swapaxes(0, 1)
    return 0.5 * (gradient + transposed + _product(transposed, gradient))


def rotation_angle(rotations: Array) -> Array:
    """Return the angles ``(...)`` [rad] of rotation matrices ``(..., d, d)`` with d = 2 or 3."""
    skew = rotations - rotations.swapaxes(-1, -2)
    sine = np.sqrt(np.sum(skew**2, axis=(-2, -1)) / 8.0)
    trace = np.trace(rotations, axis1=-2, axis2=-1)
    cosine = 0.5 * (trace - (rotations.shape[-1] - 2.0))
    return np.asarray(np.arctan2(sine, cosine))


def _identity(like: Array) -> Array:
    return np.eye(len(like)).reshape(len(like), -1, *(1,) * (like.ndim - 2))


def _product(left: Array, right: Array) -> Array:
    """Return the matrix product over the first two axes."""
    return np.einsum("ab...,bc...->ac...", left, right)
