"""Conjugate gradients with smoothed aggregation (pyamg), which needs little memory and no factors.

The motions with almost no energy, the six rigid ones of an elastic body, must be represented
exactly on the coarse grids. Then the number of iterations hardly grows with the mesh. Sources:
Vaněk, Mandel and Brezina 1996, doi:10.1007/BF02238511; Bell, Olson and Schroder 2022,
doi:10.21105/joss.04142.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.linalg import cg

from sa_solver.types import Array

# Interpolation of least energy. Jacobi's needs a third more iterations, whose number grows with the
# mesh.
INTERPOLATION = ("energy", {"degree": 2})
# Number of unknowns of the coarsest grid, which is inverted as a dense matrix.
COARSEST = 200
# Conjugate gradients update their residual; the true one may exceed it by this factor at the end.
DRIFT = 10.0


@dataclass(frozen=True)
class Iterated:
    """Solution ``(n,)`` of an iterative solver, with its convergence.

    ``residual`` is |f - K u| / |f|; ``converged`` tells whether it is within the tolerance.
    """

    solution: Array
    iterations: int
    residual: float
    converged: bool


def softness(matrix: sp.csr_matrix, modes: Array) -> float:
    """Return the least energy u'Ku / u'u among ``modes`` ``(n, k)``, over the largest entry.

    It is of the size of rounding errors for a body that is not held.
    """
    basis = scipy.linalg.orth(modes)
    energies = np.linalg.eigvalsh(basis.T @ (matrix @ basis))
    return float(energies[0] / np.abs(matrix).max())


class MultigridSolver:
    """Coarse grids of a symmetric positive definite matrix, ready for right-hand sides.

    ``near_nullspace`` ``(n, k)`` are motions of little energy, by default the constants.
    """

    def __init__(self, matrix: sp.csr_matrix, near_nullspace: Array | None = None) -> None:
        from pyamg import smoothed_aggregation_solver

        self._matrix = matrix.sorted_indices()
        with _repeatable():
            grids = smoothed_aggregation_solver(
                self._matrix, B=near_nullspace, smooth=INTERPOLATION, max_coarse=COARSEST
            )
            self._preconditioner = grids.aspreconditioner()

    def solve(self, rhs: Array, tolerance: float, cap: int) -> Iterated:
        """Iterate until |f - K u| ≤ ``tolerance`` |f|, or until ``cap`` iterations are done."""
        count = 0

        def counted(_: Array) -> None:
            nonlocal count
            count += 1

        solution, _ = cg(
            self._matrix, rhs, rtol=tolerance, maxiter=cap, M=self._preconditioner, callback=counted
        )
        load = float(np.linalg.norm(rhs))
        error = float(np.linalg.norm(rhs - self._matrix @ solution))
        met = error <= DRIFT * tolerance * load
        return Iterated(solution, count, error / load if load > 0.0 else error, met)


@contextmanager
def _repeatable() -> Iterator[None]:
    """Seed NumPy's global generator, from which pyamg draws, so that results are repeatable."""
    before = np.random.get_state()  # noqa: NPY002
    np.random.seed(0)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(before)  # noqa: NPY002
