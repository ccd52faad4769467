"""Linear systems of continuation: a Jacobian, alone or bordered by a column and a row.

A matrix is factorised. A Jacobian that is only known by what it does to a vector is solved with
GMRES, which needs few iterations where it is 1 and something compact, as in harmonic balance, and
fewer still where the inverse of one like it preconditions it; where it does not converge, the
Jacobian is assembled after all.
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

# Residual that GMRES leaves of its right-hand side, unless it is given another.
GMRES_TOLERANCE = 1e-6
# Krylov vectors of GMRES. If it needs more, the matrix is solved directly.
MAX_VECTORS = 150
# Preconditioned solutions of what earlier ones leave, at most, and the share of it that each may
# leave: more of them would not help.
MAX_REFINED, LOOSEST_REFINED = 4, 0.1
# Share of what is wanted that they are asked for: what is left is measured differently.
BELOW = 0.3


class LinearMap(Protocol):
    """A square matrix known by its products with vectors ``(n,)``."""

    def __matmul__(self, vector: Array, /) -> Array: ...
    def assembled(self) -> Array:
        """The matrix ``(n, n)``."""
        ...


@runtime_checkable
class Preconditioned(Protocol):
    """A matrix that is like another one, whose inverse is known by its products."""

    def precondition(self, vector: Array) -> Array:
        """The inverse of the other one times a vector ``(n,)``."""
        ...

    def preconditioned(self, vector: Array) -> Array:
        """That inverse times the matrix times a vector; cheaper than both, nearly the same."""
        ...


def solve_alone(
    jacobian: Array | LinearMap, rhs: Array, tolerance: float = GMRES_TOLERANCE
) -> Array:
    """x of J x = b, ``(n,)`` or ``(n, r)``; by products it leaves the share ``tolerance`` of b.

    A singular J has its smallest least squares. Raises ``numpy.linalg.LinAlgError`` where numbers
    are not finite.
    """
    if isinstance(jacobian, np.ndarray):
        return _Factors(jacobian).solve(rhs)
    if rhs.ndim == 2:
        return np.stack([solve_alone(jacobian, side, tolerance) for side in rhs.T], axis=1)
    alike = jacobian if isinstance(jacobian, Preconditioned) else None
    solution = _iteratively(jacobian, alike, rhs, tolerance)
    return _Factors(jacobian.assembled()).solve(rhs) if solution is None else solution


def solve_bordered(
    jacobian: Array | LinearMap, column: Array, row: Array, rhs: Array
) -> tuple[Array, int]:
    """x ``(n + 1, r)`` of [J column; row] x = b; the sign of the determinant, 0 if 0 or not known.

    As :func:`solve_alone`.
    """
    system = Bordered(jacobian, column, row)
    return np.array([system.solve(side) for side in rhs.T]).T, system.sign


class Bordered:
    """[J column; row] of ``inner`` J ``(n, n)``, known by products, and solved more than once.

    ``column`` ``(n,)``, ``row`` ``(n + 1,)``.
    """

    def __init__(self, inner: Array | LinearMap, column: Array, row: Array) -> None:
        self.inner, self._column, self._row = inner, column, row
        self._direct = isinstance(inner, np.ndarray)

    def __matmul__(self, vector: Array) -> Array:
        upper = self.inner @ vector[:-1] + self._column * vector[-1]
        return np.append(upper, self._row @ vector)

    def assembled(self) -> Array:
        """The matrix ``(n + 1, n + 1)``."""
        size = len(self._row)
        matrix = np.empty((size, size), order="F")
        inner = self.inner
        matrix[:-1, :-1] = inner if isinstance(inner, np.ndarray) else inner.assembled()
        matrix[:-1, -1], matrix[-1] = self._column, self._row
        return matrix

    def precondition(self, vector: Array) -> Array:
        """The inverse with that of a matrix like J, if one is known, or 1 for J, times a vector.

        The border is eliminated with it, and a pivot that is not 0.
        """
        return self._border_undone(self._inner_preconditioned(vector[:-1]), float(vector[-1]))

    def preconditioned(self, vector: Array) -> Array:
        """That inverse times the matrix times a vector."""
        inner = self.inner
        assert isinstance(inner, Preconditioned)
        upper = inner.preconditioned(vector[:-1]) + vector[-1] * self._preconditioned_column
        return self._border_undone(upper, float(self._row @ vector))

    def _border_undone(self, upper: Array, last: float) -> Array:
        last = (last - float(self._row[:-1] @ upper)) / self._pivot
        return np.append(upper - last * self._preconditioned_column, last)

    def solve(self, rhs: Array, tolerance: float = GMRES_TOLERANCE) -> Array:
        """x ``(n + 1,)`` of [J column; row] x = b; by products it leaves so large a share of b.

        As :func:`solve_alone`.
        """
        if not self._direct:
            alike = isinstance(self.inner, Preconditioned)
            solution = _iteratively(self, self if alike else None, rhs, tolerance)
            if solution is not None:
                return solution
            self._direct = True
        return self._factors.solve(rhs)

    @property
    def sign(self) -> int:
        """Of the determinant; 0 if not known."""
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
    """A matrix factorised.

    One that is singular, as where a body may stand anywhere, has its smallest least squares.
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
        """Of the determinant; 0 if it is singular."""
        if self._singular:
            return 0
        exchanged = np.count_nonzero(self._pivots != np.arange(len(self._pivots)))
        negative = np.count_nonzero(np.diagonal(self._factors) < 0.0)
        return -1 if (exchanged + negative) % 2 else 1


def _iteratively(
    matrix: LinearMap, alike: Preconditioned | None, rhs: Array, tolerance: float
) -> Array | None:
    """Solution by GMRES, preconditioned from the left if it can be; None if it does not converge.

    What a preconditioned solution leaves is seen with the matrix itself, and solved for again.
    Where preconditioning loses too many digits, as of joints that stick for ones that slide near a
    resonance of either, products alone are tried.
    """
    if alike is not None:
        solution, left = np.zeros_like(rhs), rhs
        enough = tolerance * norm(rhs)
        for _ in range(MAX_REFINED):
            share = min(BELOW * enough / (norm(left) or 1.0), LOOSEST_REFINED)
            part = _gmres(alike.preconditioned, alike.precondition(left), share)
            if part is None:
                break
            solution = solution + part
            left = rhs - matrix @ solution
            if norm(left) <= enough:
                return solution
    return _gmres(lambda vector: matrix @ vector, rhs, tolerance)


def _gmres(times: Callable[[Array], Array], rhs: Array, tolerance: float) -> Array | None:
    """Solution by GMRES, None if it does not converge.

    Saad and Schultz 1986, doi:10.1137/0907058; vectors are made orthogonal all at once, and twice,
    which takes a third of scipy's time, one at a time.
    """
    vectors, length = min(MAX_VECTORS, len(rhs)), norm(rhs)
    if length == 0.0:
        return np.zeros_like(rhs)
    basis, triangle = np.empty((vectors + 1, len(rhs))), np.zeros((vectors, vectors))
    left, turns = np.zeros(vectors + 1), np.empty((vectors, 2))
    basis[0], left[0] = rhs / length, length
    for count in range(vectors):
        before, vector = basis[: count + 1], times(basis[count])
        column = before @ vector
        vector = vector - column @ before
        again = before @ vector
        vector -= again @ before
        column += again
        for i, (cosine, sine) in enumerate(turns[:count].tolist()):
            upper, lower = column[i], column[i + 1]
            column[i], column[i + 1] = cosine * upper + sine * lower, cosine * lower - sine * upper
        beyond = norm(vector)
        pivot = hypot(column[count], beyond)
        if not 0.0 < pivot < inf:
            return None
        cosine, sine = column[count] / pivot, beyond / pivot
        column[count], turns[count] = pivot, (cosine, sine)
        triangle[: count + 1, count] = column
        left[count], left[count + 1] = cosine * left[count], -sine * left[count]
        if abs(left[count + 1]) <= tolerance * length:
            used = slice(count + 1)
            return np.asarray(solve_triangular(triangle[used, used], left[used]) @ basis[used])
        basis[count + 1] = vector / beyond
    return None
