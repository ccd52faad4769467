"""(Ω² + iD + iωC - ω²)⁻¹ on the modes of a structure, by how its damping mixes them.

Modes that are not mixed are divided by their stiffnesses s. Mixed by a few dashpots alone,
C = diag(c) + GᵀG with the rows G ``(r, n)`` of these, only r forces are solved for (Woodbury 1950,
*Inverting modified matrices*; Hager 1989, doi:10.1137/1031049):

    (s + iω GᵀG)⁻¹ = h - h Gᵀ iω (1 + iω G h Gᵀ)⁻¹ G h,   h = 1/s.

Where more mixes the modes, the matrix of each frequency is factorised, once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit
from scipy.linalg.lapack import zgetrf, zgetrs

from fe_models.dynamics.periodic.harmonics import ComplexArray
from sa_solver.types import Array

# Products of frequencies, directions of joints and modes up to which calls cost more than loops.
FEW = 4000


class ModalInverse(Protocol):
    """The inverse at frequencies ``(k,)``."""

    def times(self, force: ComplexArray) -> ComplexArray:
        """Displacements of modes ``(k, n)`` by forces on them."""
        ...

    def turned(self, weights: ComplexArray) -> ComplexArray:
        """wᵀ (...)⁻¹ ``(k, n)`` of ``weights`` w on the displacements of modes ``(k, n)``."""
        ...

    def between(self, at_joints: Array, between: ComplexArray) -> None:
        """Write B (...)⁻¹ Bᴴ ``(k, m, m)`` for displacements B ``(m, n)`` of joints."""
        ...


@dataclass(frozen=True)
class UnmixedModes:
    """Modes of the ``flexibility`` h ``(k, n)``."""

    flexibility: ComplexArray

    def times(self, force: ComplexArray) -> ComplexArray:
        return np.asarray(force * self.flexibility)

    def turned(self, weights: ComplexArray) -> ComplexArray:
        return self.times(weights)

    def between(self, at_joints: Array, between: ComplexArray) -> None:
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
    """The same mixed by ``dashpots`` G ``(r, n)``, at frequencies ``angular`` ``(k,)`` [rad/s]."""

    def __init__(self, flexibility: ComplexArray, angular: Array, dashpots: Array) -> None:
        self._without, self._dashpots = UnmixedModes(flexibility), dashpots
        turning = 1j * angular[:, None, None]
        moved = (dashpots * flexibility[:, None, :]) @ dashpots.T
        self._pulled = turning * np.linalg.inv(np.eye(len(dashpots)) + turning * moved)

    def times(self, force: ComplexArray) -> ComplexArray:
        without = self._without.times(force)
        pulled = self._pulled @ (without @ self._dashpots.T)[..., None]
        return np.asarray(without - self._without.times(pulled[..., 0] @ self._dashpots))

    def turned(self, weights: ComplexArray) -> ComplexArray:
        return self.times(weights)

    def between(self, at_joints: Array, between: ComplexArray) -> None:
        self._without.between(at_joints, between)
        flexibility = self._without.flexibility[:, None, :]
        stretched = (at_joints * flexibility) @ self._dashpots.T
        between -= stretched @ self._pulled @ stretched.transpose(0, 2, 1)


class MixedModes:
    """Modes of the stiffness matrices Ω² + iD + iωC - ω² at frequencies ``angular`` ``(k,)``."""

    def __init__(self, squares: Array, damping: Array, loss: Array, angular: Array) -> None:
        # Factors of the transposed: by columns, as LAPACK has them.
        self._factors = [
            _factors(matrix.T) for matrix in _stiffnesses(angular, squares, damping, loss)
        ]

    def times(self, force: ComplexArray) -> ComplexArray:
        response = np.empty(force.shape, dtype=complex)
        for factors, side, at in zip(self._factors, force, response, strict=True):
            at[:] = _solved(factors, side)
        return response

    def turned(self, weights: ComplexArray) -> ComplexArray:
        sides = zip(self._factors, weights, strict=True)
        return np.array([zgetrs(*factors, side)[0] for factors, side in sides])

    def between(self, at_joints: Array, between: ComplexArray) -> None:
        for factors, at in zip(self._factors, between, strict=True):
            at[:] = at_joints @ _solved(factors, at_joints.conj().T)


Factors = tuple[ComplexArray, np.ndarray]


def _factors(matrix: ComplexArray) -> Factors:
    """Triangles and exchanged rows. Raises ``numpy.linalg.LinAlgError`` for a singular matrix."""
    factors, exchanged, singular = zgetrf(matrix, overwrite_a=True)
    if singular:
        raise np.linalg.LinAlgError("a mode without damping at its natural frequency")
    return factors, exchanged


def _solved(factors: Factors, force: ComplexArray | Array) -> ComplexArray:
    """What the transposed of a factorised matrix makes of forces ``(n,)`` or ``(n, m)``."""
    return np.asarray(zgetrs(*factors, force, trans=1)[0])


@njit(cache=True)
def flexibilities(angular: Array, squares: Array, damping: Array, loss: Array) -> ComplexArray:
    """1 / (ω_n² - ω² + i (ω c_n + d_n)) ``(k, n)``."""
    flexibilities = np.empty((len(angular), len(squares)), np.complex128)
    for k in range(len(angular)):
        for n in range(len(squares)):
            lagging = angular[k] * damping[n] + loss[n]
            stiffness = complex(squares[n] - angular[k] * angular[k], lagging)
            # None without damping at a natural frequency: whoever solves with it sees that.
            flexibilities[k, n] = 1.0 / stiffness if stiffness != 0.0 else complex(np.inf, 0.0)
    return flexibilities


@njit(cache=True)
def _stiffnesses(angular: Array, squares: Array, damping: Array, loss: Array) -> ComplexArray:
    """Ω² + iD + iωC - ω² ``(k, n, n)``; without temporary ones, which take longer."""
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
    """Write what so many frequencies ``(k, n)`` make between joints ``(k, j d, j d)``."""
    for k in range(len(flexibility)):
        for to in range(len(at_joints)):
            for by in range(len(at_joints)):
                response = 0.0j
                for n in range(at_joints.shape[1]):
                    response += flexibility[k, n] * (at_joints[to, n] * np.conj(at_joints[by, n]))
                between[k, to, by] = response
