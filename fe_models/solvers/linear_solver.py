"""Sparse symmetric linear systems: factorised, condensed, or solved by multigrid.

The direct solver is MKL PARDISO (pypardiso) where it is installed, and SuperLU otherwise. The
residual of every solution of PARDISO is checked, and a bad one is solved again with SuperLU. The
memory of a factorisation is estimated before it begins. For a few right-hand sides of a system
whose factors do not fit, conjugate gradients with multigrid are used.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_models.solvers import superlu
from fe_models.solvers.memory import available_bytes
from fe_models.solvers.multigrid import MultigridSolver, softness
from fe_models.solvers.pardiso import Pardiso, PardisoError
from sa_solver.errors import ConvergenceError
from sa_solver.types import Array, Indices

# Relative residual above which a solution is wrong; stable factorisations have about 1e-13.
RESIDUAL_LIMIT = 1e-9
# Limit of |K| |u| / |f|, which is at most the condition number: 1e2 to 1e4 if a body is held, 1e16
# if it is not.
GROWTH_LIMIT = 1e12
# Number of right-hand sides solved together where there may be thousands: enough for efficiency,
# with little memory.
COLUMNS_AT_ONCE = 256
# Fewest inner unknowns for which PARDISO condenses: its analysis has crashed the process with one.
FEWEST_INNER = 8
BYTES = 8
# Residual over the load to which solutions of factors in single precision are refined, in 3 to 5
# solutions, and the number of solutions after which this has failed. Below the share ROUNDED of
# |K| |u| a residual consists of rounding.
REFINED, MOST_REFINED, ROUNDED = 1e-11, 12, 1e-14
# Residual over the load at which iterations end, and the number of iterations that is an error.
ITERATED = 1e-10
MOST_ITERATIONS = 500

# A factorised matrix: call it with right-hand sides ``(n,)`` or ``(n, m)``.
Factorisation = Callable[[Array], Array]

SINGULAR = (
    "the stiffness matrix is close to singular: a body is not held, or the mesh has a "
    "degenerate element"
)


class SolverError(ConvergenceError):
    """Error of a linear system that could not be solved; the message gives the likely cause."""


class FactorMemoryError(SolverError, MemoryError):
    """Error of a factorisation that needs more memory than is free; nothing was allocated.

    ``needed`` and ``available`` are in bytes.
    """

    def __init__(self, task: str, needed: float, available: float) -> None:
        super().__init__(
            f"{task} needs about {needed / 1e9:.2g} GB of memory, {available / 1e9:.2g} GB are "
            "free: use a coarser mesh or fewer interface nodes; a few right-hand sides, but not a "
            "condensation, can be solved iteratively"
        )
        self.needed, self.available = needed, available


def factorise(matrix: sp.csr_matrix, memory: float | None = None) -> Factorisation:
    """Factorise a sparse symmetric positive definite matrix.

    ``memory`` is the memory that it may use [bytes]; None means all that is free. Raises
    :class:`FactorMemoryError` before anything large is allocated, and :class:`SolverError` if the
    matrix is singular, which is tested with one random load.
    """
    solve = _Checked(matrix, _limit(memory))
    load = _random_load(matrix)
    if _has_grown(matrix, load, solve(load)):
        raise SolverError(SINGULAR)
    return solve


def _random_load(matrix: sp.csr_matrix) -> Array:
    return np.random.default_rng(0).standard_normal(matrix.shape[0])


def _has_grown(matrix: sp.csr_matrix, load: Array, solution: Array) -> bool:
    """Return whether the matrix must be singular to have such a solution."""
    growth = np.abs(matrix).max() * np.abs(solution).max()
    return bool(growth > GROWTH_LIMIT * np.abs(load).max())


class RefinedFactors:
    """Factors in single precision, with half the memory and time of those in double precision.

    Called with right-hand sides ``(n,)`` or ``(n, m)``, it refines the solutions until they are as
    good as those of :func:`factorise`. Where that fails, and without PARDISO, the factors are in
    double precision. ``memory`` and errors are those of :func:`factorise`.
    """

    def __init__(self, matrix: sp.csr_matrix, memory: float | None = None) -> None:
        self._matrix, self._memory = matrix, memory
        self._largest = np.abs(matrix).max()
        # The type is Any because None releases the memory of factors before the next ones.
        self._solve: Any = _pardiso(matrix, _limit(memory), single=True)
        self._single = self._solve is not None
        load = _random_load(matrix)
        solution = self._refined(load) if self._single else None
        if solution is None or _has_grown(matrix, load, solution):
            self._factorise_in_double()

    def rounded(self, rhs: Array) -> Array:
        """Return solutions as exact as the factors."""
        return np.asarray(self._solve(rhs))

    def __call__(self, rhs: Array) -> Array:
        if self._single:
            solution = self._refined(rhs)
            if solution is not None:
                return solution
            self._factorise_in_double()
        return np.asarray(self._solve(rhs))

    def _factorise_in_double(self) -> None:
        self._solve, self._single = None, False
        self._solve = factorise(self._matrix, self._memory)

    def _refined(self, rhs: Array) -> Array | None:
        """Return refined solutions, or None if refinement does not converge."""
        load = np.linalg.norm(rhs, axis=0)
        solution, left = np.zeros(rhs.shape), rhs
        for _ in range(MOST_REFINED):
            # Scaled to unit size, since loads may lie outside the range of single precision.
            size = np.linalg.norm(left, axis=0)
            size = np.where(size > 0.0, size, 1.0)
            solution = solution + size * self._solve(left / size)
            left = rhs - self._matrix @ solution
            rounding = ROUNDED * self._largest * np.linalg.norm(solution, axis=0)
            if np.all(np.linalg.norm(left, axis=0) <= np.maximum(REFINED * load, rounding)):
                return solution
        return None


def prepare(
    matrix: sp.csr_matrix, near_nullspace: Array | None = None, memory: float | None = None
) -> Factorisation:
    """Return a solver of a sparse symmetric positive definite matrix for a few right-hand sides.

    The matrix is factorised if the factors fit into memory. Otherwise systems are solved by
    conjugate gradients with multigrid.

    Parameters
    ----------
    matrix
        The matrix ``(n, n)``.
    near_nullspace
        Motions of little energy ``(n, k)`` for the iterative solver: those of
        :func:`fe_models.loads.rigid_motions.rigid_body_modes` if the matrix is an elastic body's.
    memory
        Memory for the factors [bytes]; by default all that is free.

    Raises
    ------
    SolverError
        If the matrix is singular; or later, when the solver is called, if the iterations do not
        converge.
    """
    try:
        return RefinedFactors(matrix, memory)
    except FactorMemoryError:
        return _Iterative(matrix, near_nullspace)


def condense(
    matrix: sp.csr_matrix, loads: Array, kept: Indices, memory: float | None = None
) -> tuple[Array, Array]:
    """Condense a symmetric system onto the unknowns ``kept``.

    The results are K_cc - K_ci K_ii⁻¹ K_ic ``(c, c)``, dense, and f_c - K_ci K_ii⁻¹ f_i ``(c, m)``,
    in the order of ``kept``; ``i`` are all other unknowns. K_ii must be positive definite, K need
    not be.

    Parameters
    ----------
    matrix
        K ``(n, n)``.
    loads
        Loads f ``(n, m)``.
    kept
        Numbers of the unknowns to keep ``(c,)``.
    memory
        Memory that it may use [bytes]; by default all that is free.

    Raises
    ------
    SolverError
        If K_ii is singular.
    FactorMemoryError
        If it needs more memory. There is no iterative alternative.
    """
    limit = _limit(memory)
    # The result is checked with one more load, whose displacements are known.
    displacement = np.random.default_rng(0).standard_normal(matrix.shape[0])
    all_loads = np.column_stack([loads, matrix @ displacement])
    condensed = _condense_by_pardiso(matrix, all_loads, kept, limit)
    if condensed is None or not _is_condensed(*condensed, displacement[kept]):
        condensed = _condense_by_columns(matrix, all_loads, kept, limit)
    return condensed[0], condensed[1][:, :-1]


class _Iterative:
    """Solver by conjugate gradients that checks convergence."""

    def __init__(self, matrix: sp.csr_matrix, near_nullspace: Array | None) -> None:
        soft = np.ones((matrix.shape[0], 1)) if near_nullspace is None else near_nullspace
        if not softness(matrix, soft) * GROWTH_LIMIT > 1.0:
            raise SolverError(SINGULAR)
        self._grids = MultigridSolver(matrix, soft)

    def __call__(self, rhs: Array) -> Array:
        columns = rhs.reshape(len(rhs), -1).T
        return np.stack([self._column(column) for column in columns], axis=1).reshape(rhs.shape)

    def _column(self, rhs: Array) -> Array:
        result = self._grids.solve(rhs, ITERATED, MOST_ITERATIONS)
        if not result.converged:
            raise SolverError(
                f"conjugate gradients did not converge: residual {result.residual:.1e} of the load "
                f"after {result.iterations} iterations; check that all bodies are held and no "
                "element is degenerate, or free memory for a factorisation"
            )
        return result.solution


def _limit(memory: float | None) -> float:
    """Return the memory allowed: what is free unless it is given."""
    return available_bytes() if memory is None else memory


class _Checked:
    """Direct solver that checks the residual of every solution."""

    def __init__(self, matrix: sp.csr_matrix, limit: float) -> None:
        self._matrix, self._limit = matrix, limit
        self._largest = np.abs(matrix).max()
        self._solve = _pardiso(matrix, limit) or _superlu(matrix, limit)

    def __call__(self, rhs: Array) -> Array:
        try:
            solution = self._solve(rhs)
        except PardisoError:
            solution = np.full(rhs.shape, np.nan)
        if not self._is_good(rhs, solution):
            self._solve = None  # Release the memory of the factors before the next ones.
            self._solve = _superlu(self._matrix, self._limit)
            solution = self._solve(rhs)
            if not self._is_good(rhs, solution):
                raise SolverError(SINGULAR)
        return solution

    def _is_good(self, rhs: Array, solution: Array) -> bool:
        """Return whether the residual of every column is of the size of rounding; NaN is not."""
        scale = self._largest * np.abs(solution).max(axis=0, initial=0.0)
        error = np.abs(self._matrix @ solution - rhs).max(axis=0, initial=0.0)
        load = np.abs(rhs).max(axis=0, initial=0.0)
        return bool(np.all(error <= RESIDUAL_LIMIT * np.maximum(scale, load)))


def _superlu(matrix: sp.csr_matrix, limit: float) -> Any:
    _require(superlu.factor_bytes(matrix), limit, f"factorising {matrix.shape[0]} unknowns")
    try:
        return superlu.factors(matrix).solve
    except RuntimeError as error:
        raise SolverError(SINGULAR) from error


def _pardiso(matrix: sp.csr_matrix, limit: float, single: bool = False) -> Pardiso | None:
    """Return PARDISO's factors, or None if it is not installed or refuses the matrix."""
    try:
        analysed = Pardiso(matrix, single=single)
        _require(analysed.factor_bytes, limit, f"factorising {matrix.shape[0]} unknowns")
        analysed.factorise()
    except PardisoError:
        return None
    return analysed


def _condense_by_pardiso(
    matrix: sp.csr_matrix, loads: Array, kept: Indices, limit: float
) -> tuple[Array, Array] | None:
    """Return PARDISO's Schur complement, or None if it is not installed, fails or hardly pays.

    The matrix is bordered by the loads, as if they were further unknowns to keep. The entries of
    the Schur complement between these and the others are then the condensed loads.
    """
    size, cases = loads.shape
    if size - len(kept) < FEWEST_INNER:
        return None
    border = sp.csr_matrix(loads)
    bordered = sp.bmat([[matrix, border], [border.T, sp.identity(cases)]], format="csr")
    try:
        analysed = Pardiso(bordered, np.append(kept, np.arange(size, size + cases)))
        # The memory includes the result and its copy in the requested order.
        needed = analysed.factor_bytes + 2 * BYTES * (len(kept) + cases) ** 2
        _require(needed, limit, f"condensing {size} unknowns onto {len(kept)}")
        schur = analysed.schur()
    except PardisoError:
        return None
    return schur[: len(kept), : len(kept)], schur[: len(kept), len(kept) :]


def _require(needed: float, limit: float, task: str) -> None:
    if needed > limit:
        raise FactorMemoryError(task, needed, limit)


def _is_condensed(stiffness: Array, loads: Array, displacement: Array) -> bool:
    """Return whether the last of the loads is that of the ``displacement``."""
    expected = stiffness @ displacement
    return bool(np.abs(loads[:, -1] - expected).max() < RESIDUAL_LIMIT * np.abs(expected).max())


def _condense_by_columns(
    matrix: sp.csr_matrix, loads: Array, kept: Indices, limit: float
) -> tuple[Array, Array]:
    inner = np.setdiff1d(np.arange(matrix.shape[0]), kept)
    # Memory of the result and its symmetric part, and of one block of right-hand sides.
    dense = 2 * len(kept) ** 2 + 3 * len(inner) * min(COLUMNS_AT_ONCE, len(kept))
    _require(BYTES * dense, limit, f"condensing {matrix.shape[0]} unknowns onto {len(kept)}")
    solve = factorise(matrix[inner][:, inner].tocsr(), limit)
    coupling = matrix[inner][:, kept].tocsc()
    condensed = matrix[kept][:, kept].toarray()
    for start in range(0, len(kept), COLUMNS_AT_ONCE):
        block = slice(start, start + COLUMNS_AT_ONCE)
        condensed[:, block] -= coupling.T @ solve(coupling[:, block].toarray())
    return 0.5 * (condensed + condensed.T), loads[kept] - coupling.T @ solve(loads[inner])
