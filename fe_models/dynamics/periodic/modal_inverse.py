"""Inverse of Ω² + iD + iωC - ω² on the modes of a structure, by how damping couples them.

If damping does not couple the modes, forces are divided by modal stiffnesses s. If only a few
dashpots couple them, C = diag(c) + GᵀG with their rows G ``(r, n)``, and a system of r forces is
solved (Woodbury 1950, *Inverting modified matrices*; Hager 1989, doi:10.1137/1031049):

    (s + iω GᵀG)⁻¹ = h - h Gᵀ iω (1 + iω G h Gᵀ)⁻¹ G h,   h = 1/s.

In all other cases the matrix of each frequency is factorised once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit
from scipy.linalg.lapack import zgetrf, zgetrs

from fe_models.dynamics.periodic.harmonics import ComplexArray
from sa_solver.types import Array

# Number of frequencies times directions of joints times modes up to which compiled loops are faster
# than calls of BLAS.
FEW = 4000


class ModalInverse(Protocol):
    """Protocol of the inverse of the modal dynamic stiffness at frequencies ``(k,)``."""

    def apply(self, force: ComplexArray) -> ComplexArray:
        """Return modal displacements ``(k, n)`` for modal forces."""
        ...

    def apply_transposed(self, weights: ComplexArray) -> ComplexArray:
        """Return wᵀ (...)⁻¹ ``(k, n)`` for weights w ``(k, n)`` of modal displacements."""
        ...

    def write_between_joints(self, at_joints: Array, between: ComplexArray) -> None:
        """Write B (...)⁻¹ Bᴴ ``(k, m, m)`` for modal displacements B ``(m, n)`` of joints."""
        ...


@dataclass(frozen=True)
class UnmixedModes:
    """Inverse for modes that damping does not couple; ``flexibility`` h ``(k, n)``."""

    flexibility: ComplexArray

    def apply(self, force: ComplexArray) -> ComplexArray:
        return np.asarray(force * self.flexibility)

    def apply_transposed(self, weights: ComplexArray) -> ComplexArray:
        return self.apply(weights)

    def write_between_joints(self, at_joints: Array, between: ComplexArray) -> None:
        if len(self.flexibility) * at_joints.size <= FEW:
            _few_between_joints(self.flexibility, at_joints, between)
            return
        inverse = self.flexibility[:, None, :]
        if np.iscomplexobj(at_joints):
            between[:] = (at_joints * inverse) @ at_joints.conj().T
            return
        # Two real products cost half of a complex one.
        between.real = (at_joints * inverse.real) @ at_joints.T
        between.imag = (at_joints * inverse.imag) @ at_joints.T


class ModesWithDashpots:
    """Inverse for modes that only a few dashpots couple.

    Parameters
    ----------
    flexibility
        Flexibility h ``(k, n)`` of the modes without dashpots.
    angular
        Frequencies ``(k,)`` [rad/s].
    dashpots
        Rows G ``(r, n)`` of the dashpots.
    """

    def __init__(self, flexibility: ComplexArray, angular: Array, dashpots: Array) -> None:
        self._without, self._dashpots = UnmixedModes(flexibility), dashpots
        turning = 1j * angular[:, None, None]
        moved = (dashpots * flexibility[:, None, :]) @ dashpots.T
        self._pulled = turning * np.linalg.inv(np.eye(len(dashpots)) + turning * moved)

    def apply(self, force: ComplexArray) -> ComplexArray:
        without = self._without.apply(force)
        pulled = self._pulled @ (without @ self._dashpots.T)[..., None]
        return np.asarray(without - self._without.apply(pulled[..., 0] @ self._dashpots))

    def apply_transposed(self, weights: ComplexArray) -> ComplexArray:
        return self.apply(weights)

    def write_between_joints(self, at_joints: Array, between: ComplexArray) -> None:
        self._without.write_between_joints(at_joints, between)
        flexibility = self._without.flexibility[:, None, :]
        stretched = (at_joints * flexibility) @ self._dashpots.T
        between -= stretched @ self._pulled @ stretched.transpose(0, 2, 1)


class MixedModes:
    """Inverse for modes that damping couples: factors of Ω² + iD + iωC - ω².

    Parameters
    ----------
    squares
        Squared natural frequencies ``(n,)`` [rad²/s²].
    damping, loss
        Modal viscous and structural damping ``(n, n)``.
    angular
        Frequencies ``(k,)`` [rad/s].
    """

    def __init__(self, squares: Array, damping: Array, loss: Array, angular: Array) -> None:
        # Factors of the transposed matrix, because LAPACK stores matrices by columns.
        self._factors = [
            _factors(matrix.T) for matrix in _stiffnesses(angular, squares, damping, loss)
        ]

    def apply(self, force: ComplexArray) -> ComplexArray:
        response = np.empty(force.shape, dtype=complex)
        for factors, side, at in zip(self._factors, force, response, strict=True):
            at[:] = _solve_transposed(factors, side)
        return response

    def apply_transposed(self, weights: ComplexArray) -> ComplexArray:
        sides = zip(self._factors, weights, strict=True)
        return np.array([zgetrs(*factors, side)[0] for factors, side in sides])

    def write_between_joints(self, at_joints: Array, between: ComplexArray) -> None:
        for factors, at in zip(self._factors, between, strict=True):
            at[:] = at_joints @ _solve_transposed(factors, at_joints.conj().T)


Factors = tuple[ComplexArray, np.ndarray]


def _factors(matrix: ComplexArray) -> Factors:
    """Return triangular factors and pivots; raise ``numpy.linalg.LinAlgError`` if singular."""
    factors, pivots, singular = zgetrf(matrix, overwrite_a=True)
    if singular:
        raise np.linalg.LinAlgError("a mode without damping at its natural frequency")
    return factors, pivots


def _solve_transposed(factors: Factors, force: ComplexArray | Array) -> ComplexArray:
    """Solve the transpose of a factorised matrix for forces ``(n,)`` or ``(n, m)``."""
    return np.asarray(zgetrs(*factors, force, trans=1)[0])


@njit(cache=True)
def flexibilities(angular: Array, squares: Array, damping: Array, loss: Array) -> ComplexArray:
    """Return 1 / (ω_n² - ω² + i (ω c_n + d_n)) ``(k, n)``."""
    flexibilities = np.empty((len(angular), len(squares)), np.complex128)
    for k in range(len(angular)):
        for n in range(len(squares)):
            lagging = angular[k] * damping[n] + loss[n]
            stiffness = complex(squares[n] - angular[k] * angular[k], lagging)
            # Infinite without damping at a natural frequency, which the caller notices.
            flexibilities[k, n] = 1.0 / stiffness if stiffness != 0.0 else complex(np.inf, 0.0)
    return flexibilities


@njit(cache=True)
def _stiffnesses(angular: Array, squares: Array, damping: Array, loss: Array) -> ComplexArray:
    """Return Ω² + iD + iωC - ω² ``(k, n, n)``, without temporary arrays, which are slow."""
    modes = len(squares)
    stiffnesses = np.empty((len(angular), modes, modes), np.complex128)
    for k in range(len(angular)):
        for row in range(modes):
            for column in range(modes):
                lagging = angular[k] * damping[row, column] + loss[row, column]
                stiffnesses[k, row, column] = 1j * lagging
            stiffnesses[k, row, row] += squares[row] - angular[k] * angular[k]
    return stiffnesses


@njit(cache=True)
def _few_between_joints(flexibility: ComplexArray, at_joints: Array, between: ComplexArray) -> None:
    """Write receptances between joints ``(k, j d, j d)`` for modal flexibilities ``(k, n)``."""
    for k in range(len(flexibility)):
        for to in range(len(at_joints)):
            for by in range(len(at_joints)):
                response = 0.0j
                for n in range(at_joints.shape[1]):
                    response += flexibility[k, n] * (at_joints[to, n] * np.conj(at_joints[by, n]))
                between[k, to, by] = response
