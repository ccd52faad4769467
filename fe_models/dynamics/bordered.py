"""Linear systems of continuation: a Jacobian, alone or bordered by a column and a row.

A matrix is factorised. A Jacobian that is only known by what it does to a vector is solved with
GMRES, which needs few iterations where it is 1 and something compact, as in harmonic balance, and
fewer still where the inverse of one like it is known; where it does not converge, the Jacobian is
assembled after all.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse.linalg import LinearOperator, gmres

from sa_solver.types import Array

# Residual that GMRES leaves of its right-hand side, unless told otherwise.
LEFT = 1e-6
# Vectors that GMRES keeps. If it needs more, the matrix is solved directly.
MAX_KEPT = 150


class LinearMap(Protocol):
    """A square matrix known by its products with vectors ``(n,)``."""

    def __matmul__(self, vector: Array, /) -> Array: ...
    def assembled(self) -> Array:
        """The matrix ``(n, n)``."""
        ...


@runtime_checkable
class NearlySolved(Protocol):
    """A matrix that is like another one, whose inverse is known by its products."""

    def nearly_solved(self, vector: Array) -> Array:
        """The inverse of the other one times a vector ``(n,)``."""
        ...


def solve_alone(jacobian: Array | LinearMap, wanted: Array, left: float = LEFT) -> Array:
    """x of J x = w, ``(n,)``; by products it leaves the share ``left`` of w.

    A singular J has its smallest least squares. Raises ``numpy.linalg.LinAlgError`` where numbers
    are not finite.
    """
    if isinstance(jacobian, np.ndarray):
        return _Factors(jacobian).solve(wanted)
    undone = jacobian.nearly_solved if isinstance(jacobian, NearlySolved) else None
    found = _iteratively(lambda vector: jacobian @ vector, undone, wanted, left)
    return _Factors(jacobian.assembled()).solve(wanted) if found is None else found


def solve_bordered(
    jacobian: Array | LinearMap, column: Array, row: Array, wanted: Array
) -> tuple[Array, int]:
    """x ``(n + 1, r)`` of [J column; row] x = w; the sign of the determinant, 0 if 0 or not known.

    As :func:`solve_alone`.
    """
    system = Bordered(jacobian, column, row)
    return np.array([system.solve(own) for own in wanted.T]).T, system.sign


class Bordered:
    """[J column; row], to be solved more than once."""

    def __init__(self, jacobian: Array | LinearMap, column: Array, row: Array) -> None:
        self._jacobian, self._column, self._row = jacobian, column, row
        self._direct = isinstance(jacobian, np.ndarray)

    def solve(self, wanted: Array, left: float = LEFT) -> Array:
        """x ``(n + 1,)`` of [J column; row] x = w; by products it leaves the share ``left`` of w.

        As :func:`solve_alone`.
        """
        if not self._direct:
            undone = self._nearly_solved if isinstance(self._jacobian, NearlySolved) else None
            found = _iteratively(self._times, undone, wanted, left)
            if found is not None:
                return found
            self._direct = True
        return self._factors.solve(wanted)

    @property
    def sign(self) -> int:
        """Of the determinant; 0 if not known."""
        return self._factors.sign if self._direct else 0

    @cached_property
    def _factors(self) -> _Factors:
        jacobian, size = self._jacobian, len(self._column)
        matrix = np.empty((size + 1, size + 1), order="F")
        matrix[:-1, :-1] = jacobian if isinstance(jacobian, np.ndarray) else jacobian.assembled()
        matrix[:-1, -1], matrix[-1] = self._column, self._row
        return _Factors(matrix)

    def _times(self, vector: Array) -> Array:
        upper = self._jacobian @ vector[:-1] + self._column * vector[-1]
        return np.append(upper, self._row @ vector)

    def _nearly_solved(self, vector: Array) -> Array:
        """The row is eliminated with the inverse that is known, and a pivot that is not 0."""
        assert isinstance(self._jacobian, NearlySolved)
        upper = self._jacobian.nearly_solved(vector[:-1])
        last = (vector[-1] - self._row[:-1] @ upper) / self._pivot
        return np.append(upper - last * self._near_column, last)

    @cached_property
    def _near_column(self) -> Array:
        assert isinstance(self._jacobian, NearlySolved)
        return self._jacobian.nearly_solved(self._column)

    @cached_property
    def _pivot(self) -> float:
        return float(self._row[-1] - self._row[:-1] @ self._near_column) or 1.0


class _Factors:
    """A matrix factorised.

    One that is singular, as where a body may stand anywhere, has its smallest least squares.
    """

    def __init__(self, matrix: Array) -> None:
        self._matrix = matrix
        self._factors, self._pivots, self._singular = dgetrf(matrix)

    def solve(self, wanted: Array) -> Array:
        if self._singular:
            return np.asarray(np.linalg.lstsq(self._matrix, wanted)[0])
        return np.asarray(dgetrs(self._factors, self._pivots, wanted)[0])

    @property
    def sign(self) -> int:
        """Of the determinant; 0 if it is singular."""
        if self._singular:
            return 0
        exchanged = np.count_nonzero(self._pivots != np.arange(len(self._pivots)))
        negative = np.count_nonzero(np.diagonal(self._factors) < 0.0)
        return -1 if (exchanged + negative) % 2 else 1


def _iteratively(
    times: Callable[[Array], Array],
    undone: Callable[[Array], Array] | None,
    wanted: Array,
    left: float,
) -> Array | None:
    """Solution by GMRES, None if it does not converge; ``undone`` nearly undoes ``times``.

    Where that loses too many digits, as of joints that stick for ones that slide near a resonance
    of either, products alone are tried.
    """
    if undone is not None:
        found = _by_products(lambda vector: times(undone(vector)), wanted, left)
        if found is not None:
            return undone(found)
    return _by_products(times, wanted, left)


def _by_products(times: Callable[[Array], Array], wanted: Array, left: float) -> Array | None:
    """Solution by GMRES, None if it does not converge."""
    size = len(wanted)
    operator = LinearOperator((size, size), matvec=times, dtype=float)
    kept = min(MAX_KEPT, size)
    solution, failed = gmres(operator, wanted, rtol=left, restart=kept, maxiter=1)
    return None if failed else np.asarray(solution)
