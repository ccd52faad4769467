"""Linear systems of continuation: a Jacobian, alone or bordered by a column and a row.

A matrix is factorised. A Jacobian that is only known by what it does to a vector is solved with
GMRES, which needs few iterations where it is 1 and something compact, as in harmonic balance; where
it does not converge, the Jacobian is assembled after all.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.linalg.lapack import dgesv
from scipy.sparse.linalg import LinearOperator, gmres

from sa_solver.types import Array

# Residual that GMRES leaves of its right-hand side. Newton's method then gains at least as much in
# every iteration.
LEFT = 1e-6
# Vectors that GMRES keeps. If it needs more, the matrix is solved directly.
MAX_KEPT = 150


class LinearMap(Protocol):
    """A square matrix known by its products with vectors ``(n,)``."""

    def __matmul__(self, vector: Array, /) -> Array: ...
    def assembled(self) -> Array:
        """The matrix ``(n, n)``."""
        ...


def solve_alone(jacobian: Array | LinearMap, wanted: Array) -> Array:
    """x of J x = w, ``(n,)``. Raises ``numpy.linalg.LinAlgError`` if J is singular."""
    if isinstance(jacobian, np.ndarray):
        return _directly(jacobian, wanted)[0]
    found = _iteratively(lambda vector: jacobian @ vector, wanted)
    return _directly(jacobian.assembled(), wanted)[0] if found is None else found


def solve_bordered(
    jacobian: Array | LinearMap, column: Array, row: Array, wanted: Array
) -> tuple[Array, int]:
    """x ``(n + 1, r)`` of [J column; row] x = w, and the sign of the determinant, 0 if not known.

    Raises ``numpy.linalg.LinAlgError`` if the matrix is singular.
    """
    if not isinstance(jacobian, np.ndarray):

        def apply(vector: Array) -> Array:
            upper = jacobian @ vector[:-1] + column * vector[-1]
            return np.append(upper, row @ vector)

        found = [_iteratively(apply, own) for own in wanted.T]
        if all(own is not None for own in found):
            return np.array(found).T, 0
        jacobian = jacobian.assembled()
    size = len(column)
    bordered = np.empty((size + 1, size + 1))
    bordered[:-1, :-1], bordered[:-1, -1], bordered[-1] = jacobian, column, row
    return _directly(bordered, wanted)


def _directly(matrix: Array, wanted: Array) -> tuple[Array, int]:
    """Solution, and the sign of the determinant."""
    factors, pivots, solution, failed = dgesv(matrix, wanted)
    if failed:
        raise np.linalg.LinAlgError
    exchanged = np.count_nonzero(pivots != np.arange(len(pivots)))
    negative = np.count_nonzero(np.diagonal(factors) < 0.0)
    return solution, -1 if (exchanged + negative) % 2 else 1


def _iteratively(apply: Callable[[Array], Array], wanted: Array) -> Array | None:
    """Solution by GMRES, None if it does not converge."""
    size = len(wanted)
    operator = LinearOperator((size, size), matvec=apply, dtype=float)
    kept = min(MAX_KEPT, size)
    solution, failed = gmres(operator, wanted, rtol=LEFT, restart=kept, maxiter=1)
    return None if failed else np.asarray(solution)
