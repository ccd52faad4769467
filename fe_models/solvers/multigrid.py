"""Conjugate gradients with smoothed aggregation (pyamg): little memory, no factors.

The motions that take next to no energy, an elastic body's six rigid ones, must be on the coarse
grids exactly. Then the iterations hardly grow with the mesh. Sources: Vaněk, Mandel and Brezina
1996, doi:10.1007/BF02238511; Bell, Olson and Schroder 2022, doi:10.21105/joss.04142.
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

# Interpolation of least energy: Jacobi's takes a third more iterations, and they grow.
INTERPOLATION = ("energy", {"degree": 2})
# Unknowns of the coarsest grid, which is inverted as a dense matrix.
COARSEST = 200
# Conjugate gradients update their residual; the true one may end above it by this factor.
DRIFT = 10.0


@dataclass(frozen=True)
class Iterated:
    """A solution ``(n,)``, its iterations, its residual |f - K u| / |f|, and if that will do."""

    solution: Array
    iterations: int
    residual: float
    converged: bool


def softness(matrix: sp.csr_matrix, modes: Array) -> float:
    """Least energy u'Ku / u'u among the ``modes`` ``(n, k)``, as a share of the largest entry.

    It is of rounding's size for a body that is not held.
    """
    basis = scipy.linalg.orth(modes)
    energies = np.linalg.eigvalsh(basis.T @ (matrix @ basis))
    return float(energies[0] / np.abs(matrix).max())


class MultigridSolver:
    """The coarse grids of a symmetric positive definite matrix, ready for right-hand sides.

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
        """Iterate until |f - K u| ≤ ``tolerance`` |f| or ``cap`` iterations are done."""
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
    """Give pyamg, which draws from numpy's global generator, the same numbers every time."""
    before = np.random.get_state()  # noqa: NPY002
    np.random.seed(0)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(before)  # noqa: NPY002
