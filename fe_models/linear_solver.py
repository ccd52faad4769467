"""Sparse direct solves with symmetric positive definite matrices.

MKL PARDISO (pypardiso) when it is installed, SuperLU otherwise. PARDISO is never trusted blindly:
every solution's residual is checked and a bad one is solved again with SuperLU.
"""

from __future__ import annotations

import ctypes
import os
import weakref
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from sa_solver.types import Array

# A backward-stable factorisation leaves about 1e-13; anything above this is a wrong answer.
RESIDUAL_LIMIT = 1e-9
# |K| |u| / |f|, at most the condition number: 1e2 to 1e4 if a body is held, 1e16 if it is not.
GROWTH_LIMIT = 1e12
# Interface unknowns condensed at once without PARDISO: enough to amortise, little memory.
COLUMNS_AT_ONCE = 256

PARDISO_SPD = 2
PARDISO_ANALYSE_FACTORISE = 12


Indices = NDArray[np.int64]


SINGULAR = (
    "the stiffness matrix is close to singular: a body is not held, or the mesh has a degenerate "
    "element"
)


class SolverError(RuntimeError):
    """A linear system could not be solved; the message says what is likely wrong with it."""


class Factorisation(Protocol):
    """A factorised matrix: call it with right-hand sides ``(n,)`` or ``(n, m)``."""

    def __call__(self, rhs: Array) -> Array: ...


def factorise(matrix: sp.csr_matrix) -> Factorisation:
    """Factorise a sparse symmetric positive definite matrix.

    Raises :class:`SolverError` if it is singular, which one random load shows.
    """
    solve = _Checked(matrix, _pardiso(matrix) or _superlu(matrix))
    load = np.random.default_rng(0).standard_normal(matrix.shape[0])
    if np.abs(matrix).max() * np.abs(solve(load)).max() > GROWTH_LIMIT * np.abs(load).max():
        raise SolverError(SINGULAR)
    return solve


def schur_complement(
    matrix: sp.csr_matrix, kept: Indices, inner: Indices, solve_inner: Factorisation
) -> Array:
    """Condense a symmetric matrix onto the unknowns ``kept``: K_cc - K_ci K_ii⁻¹ K_ic, dense.

    Rows and columns follow the order of ``kept``; ``inner`` are all others and ``solve_inner`` the
    factorised K_ii, which must be positive definite, as K need not be.
    """
    condensed = _pardiso_schur(matrix, kept)
    if condensed is None or not _is_schur(matrix, kept, inner, solve_inner, condensed):
        condensed = _schur_by_columns(matrix, kept, inner, solve_inner)
    return condensed


def _load_pardiso() -> Any | None:
    try:
        import pypardiso
    except ImportError:
        return None
    # Every solver object would search the whole environment for the library again.
    os.environ.setdefault("PYPARDISO_MKL_RT", pypardiso.ps.libmkl._name)
    return pypardiso


class _Checked:
    """Solutions whose residual has been looked at."""

    def __init__(self, matrix: sp.csr_matrix, solve: Any) -> None:
        self._matrix = matrix
        self._solve = solve

    def __call__(self, rhs: Array) -> Array:
        solution = self._solve(rhs)
        if not self._is_good(rhs, solution):
            self._solve = _superlu(self._matrix)
            solution = self._solve(rhs)
            if not self._is_good(rhs, solution):
                raise SolverError(SINGULAR)
        return solution

    def _is_good(self, rhs: Array, solution: Array) -> bool:
        """Whether the residual is that of rounding; NaN is not."""
        scale = np.abs(self._matrix).max() * np.abs(solution).max(initial=0.0)
        error = np.abs(self._matrix @ solution - rhs).max(initial=0.0)
        return bool(error <= RESIDUAL_LIMIT * max(scale, np.abs(rhs).max(initial=0.0)))


def _superlu(matrix: sp.csr_matrix) -> Any:
    options = {"SymmetricMode": True}
    try:
        factors = splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0, options=options
        )
    except RuntimeError as error:
        raise SolverError(SINGULAR) from error
    return factors.solve


class _Pardiso:
    """A factorisation of PARDISO's; its memory is given back with the object."""

    def __init__(self, pypardiso: Any, upper: sp.csr_matrix) -> None:
        self._upper = upper
        self._solver = pypardiso.PyPardisoSolver(mtype=PARDISO_SPD)
        # Unlike __del__ this also comes in time when the interpreter ends.
        weakref.finalize(self, self._solver.free_memory, everything=True)
        self._solver.factorize(upper)

    def __call__(self, rhs: Array) -> Array:
        return self._solver.solve(self._upper, np.asfortranarray(rhs)).reshape(rhs.shape)


def _pardiso(matrix: sp.csr_matrix) -> _Pardiso | None:
    pypardiso = _load_pardiso()
    if pypardiso is None:
        return None
    try:
        return _Pardiso(pypardiso, sp.triu(matrix, format="csr"))
    except (pypardiso.pardiso_wrapper.PyPardisoError, ValueError):
        # A matrix that is not positive definite, or has an empty row.
        return None


def _pardiso_schur(matrix: sp.csr_matrix, kept: Indices) -> Array | None:
    """PARDISO's own Schur complement (iparm 36); None where PARDISO is not installed or fails."""
    pypardiso = _load_pardiso()
    if pypardiso is None:
        return None
    upper = sp.triu(matrix, format="csr")
    upper.sort_indices()
    solver = pypardiso.PyPardisoSolver(mtype=PARDISO_SPD)
    for parameter, value in ((1, 1), (2, 2), (36, 1)):
        solver.set_iparm(parameter, value)
    size = matrix.shape[0]
    marked = np.zeros(size, np.int32)
    marked[kept] = 1
    condensed = np.zeros((len(kept), len(kept)))
    pointers, columns = ((part + 1).astype(np.int32) for part in (upper.indptr, upper.indices))
    unused, error = np.zeros(size), ctypes.c_int32(0)

    def integer(value: int) -> Any:
        return ctypes.byref(ctypes.c_int32(value))

    def address(array: NDArray[Any]) -> Any:
        return array.ctypes.data_as(ctypes.c_void_p)

    # pypardiso wraps the routine without argument types: every argument is passed by address.
    routine = solver._mkl_pardiso
    routine.argtypes = None
    routine(
        address(solver.pt), integer(1), integer(1), integer(PARDISO_SPD),
        integer(PARDISO_ANALYSE_FACTORISE), integer(size), address(upper.data), address(pointers),
        address(columns), address(marked), integer(1), address(solver.iparm), integer(0),
        address(unused), address(condensed), ctypes.byref(error),
    )  # fmt: skip
    solver.free_memory(everything=True)
    if error.value != 0:
        return None
    # PARDISO orders the marked unknowns by their number, not as they were given.
    place = np.argsort(np.argsort(kept))
    return condensed[np.ix_(place, place)]


def _is_schur(
    matrix: sp.csr_matrix, kept: Indices, inner: Indices, solve: Factorisation, condensed: Array
) -> bool:
    """Whether S v equals the interface forces of the full system, for one random v."""
    v = np.random.default_rng(0).standard_normal(len(kept))
    exact = matrix[kept][:, kept] @ v
    exact -= matrix[kept][:, inner] @ solve(matrix[inner][:, kept] @ v)
    return bool(np.abs(condensed @ v - exact).max() < RESIDUAL_LIMIT * np.abs(exact).max())


def _schur_by_columns(
    matrix: sp.csr_matrix, kept: Indices, inner: Indices, solve: Factorisation
) -> Array:
    coupling = matrix[inner][:, kept].tocsc()
    condensed = matrix[kept][:, kept].toarray()
    for start in range(0, len(kept), COLUMNS_AT_ONCE):
        block = slice(start, start + COLUMNS_AT_ONCE)
        condensed[:, block] -= coupling.T @ solve(coupling[:, block].toarray())
    return 0.5 * (condensed + condensed.T)
