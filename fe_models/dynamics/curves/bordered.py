"""Linear systems of continuation: a Jacobian, alone or bordered by a column and a row.

A matrix is factorised. A Jacobian that is known only by its products with vectors is solved with
GMRES. GMRES needs few iterations if the Jacobian is 1 plus a compact operator, as in harmonic
balance, and fewer still with the inverse of a similar matrix as preconditioner. If GMRES does not
converge, the Jacobian is assembled and factorised.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from math import hypot, inf
from typing import Protocol, runtime_checkable

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dgetrf, dgetrs

from fe_models.dynamics.curves.sizes import norm
from sa_solver.types import Array

# Default relative residual of GMRES.
GMRES_TOLERANCE = 1e-6
# Largest number of Krylov vectors of GMRES. If it needs more, the matrix is solved directly.
MAX_VECTORS = 150
# Largest number of preconditioned solutions for the remaining residual, and largest relative
# residual of each: more or looser ones would not help.
MAX_REFINEMENTS, LOOSEST_REFINEMENT = 4, 0.1
# Tolerance of a preconditioned solution over the wanted one, since it measures the residual
# differently.
REFINEMENT_MARGIN = 0.3


class LinearMap(Protocol):
    """Protocol of a square matrix known by its products with vectors ``(n,)``."""

    def __matmul__(self, vector: Array, /) -> Array: ...
    def assembled(self) -> Array:
        """Return the matrix ``(n, n)``."""
        ...


@runtime_checkable
class Preconditioned(Protocol):
    """Protocol of a matrix with a preconditioner: products with the inverse of a similar matrix."""

    def precondition(self, vector: Array) -> Array:
        """Return the inverse of the similar matrix times a vector ``(n,)``."""
        ...

    def preconditioned(self, vector: Array) -> Array:
        """Return that inverse times this matrix times a vector.

        One call is cheaper than two separate products, and the result is nearly the same.
        """
        ...


def solve_alone(
    jacobian: Array | LinearMap, rhs: Array, tolerance: float = GMRES_TOLERANCE
) -> Array:
    """Solve J x = b for x, ``(n,)`` or ``(n, r)``.

    A singular matrix J gives the least-squares solution of smallest norm.

    Parameters
    ----------
    jacobian
        J, a matrix ``(n, n)`` or a linear map.
    rhs
        b, ``(n,)`` or ``(n, r)``.
    tolerance
        Relative residual if J is a linear map.

    Raises
    ------
    numpy.linalg.LinAlgError
        If numbers are not finite.
    """
    if isinstance(jacobian, np.ndarray):
        return _Factors(jacobian).solve(rhs)
    if rhs.ndim == 2:
        return np.stack([solve_alone(jacobian, side, tolerance) for side in rhs.T], axis=1)
    preconditioner = jacobian if isinstance(jacobian, Preconditioned) else None
    solution = _solve_iteratively(jacobian, preconditioner, rhs, tolerance)
    return _Factors(jacobian.assembled()).solve(rhs) if solution is None else solution


def solve_bordered(
    jacobian: Array | LinearMap, column: Array, row: Array, rhs: Array
) -> tuple[Array, int]:
    """Solve [J column; row] x = b for x ``(n + 1, r)``; also return the sign of the determinant.

    The sign is 0 if the determinant is 0 or not known. Otherwise as :func:`solve_alone`.

    Parameters
    ----------
    jacobian
        J, a matrix ``(n, n)`` or a linear map.
    column, row
        Border, ``(n,)`` and ``(n + 1,)``.
    rhs
        b ``(n + 1, r)``.
    """
    system = Bordered(jacobian, column, row)
    return np.array([system.solve(side) for side in rhs.T]).T, system.sign


class Bordered:
    """Bordered matrix [J column; row] for several solutions.

    Parameters
    ----------
    inner
        J, a matrix ``(n, n)`` or a linear map.
    column, row
        Border, ``(n,)`` and ``(n + 1,)``.
    """

    def __init__(self, inner: Array | LinearMap, column: Array, row: Array) -> None:
        self.inner, self._column, self._row = inner, column, row
        self._direct = isinstance(inner, np.ndarray)

    def __matmul__(self, vector: Array) -> Array:
        upper = self.inner @ vector[:-1] + self._column * vector[-1]
        return np.append(upper, self._row @ vector)

    def assembled(self) -> Array:
        """Return the matrix ``(n + 1, n + 1)``."""
        size = len(self._row)
        matrix = np.empty((size, size), order="F")
        inner = self.inner
        matrix[:-1, :-1] = inner if isinstance(inner, np.ndarray) else inner.assembled()
        matrix[:-1, -1], matrix[-1] = self._column, self._row
        return matrix

    def precondition(self, vector: Array) -> Array:
        """Return the inverse of the bordered preconditioner of J times a vector.

        The preconditioner is 1 if J has none. The border is eliminated with a pivot that is not 0.
        """
        return self._eliminate_border(self._inner_preconditioned(vector[:-1]), float(vector[-1]))

    def preconditioned(self, vector: Array) -> Array:
        """Return that inverse times the bordered matrix times a vector."""
        inner = self.inner
        assert isinstance(inner, Preconditioned)
        upper = inner.preconditioned(vector[:-1]) + vector[-1] * self._preconditioned_column
        return self._eliminate_border(upper, float(self._row @ vector))

    def _eliminate_border(self, upper: Array, last: float) -> Array:
        last = (last - float(self._row[:-1] @ upper)) / self._pivot
        return np.append(upper - last * self._preconditioned_column, last)

    def solve(self, rhs: Array, tolerance: float = GMRES_TOLERANCE) -> Array:
        """Solve [J column; row] x = b for x ``(n + 1,)``, as :func:`solve_alone` does.

        ``tolerance`` is the relative residual if J is a linear map.
        """
        if not self._direct:
            preconditioned = isinstance(self.inner, Preconditioned)
            solution = _solve_iteratively(self, self if preconditioned else None, rhs, tolerance)
            if solution is not None:
                return solution
            self._direct = True
        return self._factors.solve(rhs)

    @property
    def sign(self) -> int:
        """Sign of the determinant; 0 if it is not known."""
        return self._factors.sign if self._direct else 0

    @cached_property
    def _factors(self) -> _Factors:
        return _Factors(self.assembled())

    def _inner_preconditioned(self, vector: Array) -> Array:
        inner = self.inner
        return inner.precondition(vector) if isinstance(inner, Preconditioned) else vector

    @cached_property
    def _preconditioned_column(self) -> Array:
        return self._inner_preconditioned(self._column)

    @cached_property
    def _pivot(self) -> float:
        return float(self._row[-1] - self._row[:-1] @ self._preconditioned_column) or 1.0


class _Factors:
    """Factors of a matrix.

    For a singular matrix, as where a body is not held, solutions are least-squares solutions of
    smallest norm.
    """

    def __init__(self, matrix: Array) -> None:
        self._matrix = matrix
        self._factors, self._pivots, self._singular = dgetrf(matrix)

    def solve(self, rhs: Array) -> Array:
        if self._singular:
            return np.asarray(np.linalg.lstsq(self._matrix, rhs)[0])
        return np.asarray(dgetrs(self._factors, self._pivots, rhs)[0])

    @property
    def sign(self) -> int:
        """Sign of the determinant; 0 if the matrix is singular."""
        if self._singular:
            return 0
        row_exchanges = np.count_nonzero(self._pivots != np.arange(len(self._pivots)))
        negative = np.count_nonzero(np.diagonal(self._factors) < 0.0)
        return -1 if (row_exchanges + negative) % 2 else 1


def _solve_iteratively(
    matrix: LinearMap, preconditioner: Preconditioned | None, rhs: Array, tolerance: float
) -> Array | None:
    """Return the solution by GMRES, left-preconditioned if possible; None if it does not converge.

    The true residual of a preconditioned solution is computed, and solved for again. Where
    preconditioning loses too many digits, as near a resonance of the preconditioner or the matrix,
    GMRES without preconditioning is tried.
    """
    if preconditioner is not None:
        solution, residual = np.zeros_like(rhs), rhs
        allowed = tolerance * norm(rhs)
        for _ in range(MAX_REFINEMENTS):
            share = min(REFINEMENT_MARGIN * allowed / (norm(residual) or 1.0), LOOSEST_REFINEMENT)
            correction = _gmres(
                preconditioner.preconditioned, preconditioner.precondition(residual), share
            )
            if correction is None:
                break
            solution = solution + correction
            residual = rhs - matrix @ solution
            if norm(residual) <= allowed:
                return solution
    return _gmres(lambda vector: matrix @ vector, rhs, tolerance)


def _gmres(multiply: Callable[[Array], Array], rhs: Array, tolerance: float) -> Array | None:
    """Return the solution by GMRES, or None if it does not converge.

    Saad and Schultz 1986, doi:10.1137/0907058. Each vector is orthogonalised against all others at
    once, and twice, which takes a third of the time of scipy's one-by-one orthogonalisation.
    """
    max_vectors, rhs_norm = min(MAX_VECTORS, len(rhs)), norm(rhs)
    if rhs_norm == 0.0:
        return np.zeros_like(rhs)
    basis, triangle = np.empty((max_vectors + 1, len(rhs))), np.zeros((max_vectors, max_vectors))
    residual, rotations = np.zeros(max_vectors + 1), np.empty((max_vectors, 2))
    basis[0], residual[0] = rhs / rhs_norm, rhs_norm
    for count in range(max_vectors):
        previous, vector = basis[: count + 1], multiply(basis[count])
        column = previous @ vector
        vector = vector - column @ previous
        correction = previous @ vector
        vector -= correction @ previous
        column += correction
        for i, (cosine, sine) in enumerate(rotations[:count].tolist()):
            upper, lower = column[i], column[i + 1]
            column[i], column[i + 1] = cosine * upper + sine * lower, cosine * lower - sine * upper
        new_length = norm(vector)
        pivot = hypot(column[count], new_length)
        if not 0.0 < pivot < inf:
            return None
        cosine, sine = column[count] / pivot, new_length / pivot
        column[count], rotations[count] = pivot, (cosine, sine)
        triangle[: count + 1, count] = column
        residual[count], residual[count + 1] = cosine * residual[count], -sine * residual[count]
        if abs(residual[count + 1]) <= tolerance * rhs_norm:
            used = slice(count + 1)
            return np.asarray(solve_triangular(triangle[used, used], residual[used]) @ basis[used])
        basis[count + 1] = vector / new_length
    return None
