"""MKL PARDISO for sparse symmetric positive definite matrices: factors, Schur complement.

pypardiso finds the library. Its solver compares the whole matrix before every solve, and provides
neither the memory that PARDISO predicts nor the Schur complement, so the routine is called here
directly. Source: Schenk and Gärtner 2004, doi:10.1016/j.future.2003.07.011; oneMKL's reference,
"pardiso".
"""

from __future__ import annotations

import ctypes
import os
import sys
import weakref
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from sa_solver.errors import ConvergenceError
from sa_solver.transforms.threads import run_parallel
from sa_solver.types import Array, Indices

T = TypeVar("T")

ANALYSE, FACTORISE, SOLVE, RELEASE = 11, 22, 33, -1
# Positions in PARDISO's table of parameters, counted from zero; the last three are outputs.
NO_DEFAULTS, ORDERING, SINGLE, ZERO_BASED, SCHUR = 0, 1, 27, 34, 35
ANALYSIS_PEAK, ANALYSIS_KEPT, FACTORS = 14, 15, 16
NESTED_DISSECTION = 2
# MKL's mode of reproducible results with its fastest kernels; otherwise two solutions with two
# threads differ in the last bits. MKL's environment variable can choose another mode, such as the
# one with the same bits on every processor, so the mode is set only if the variable is not.
REPRODUCIBLE = 2
MODE_VARIABLE = "MKL_CBWR"
# Variable with the path where pypardiso looks for MKL first; without it, pypardiso searches every
# folder of the environment.
PLACE_VARIABLE = "PYPARDISO_MKL_RT"
# PARDISO's number for real symmetric positive definite matrices.
POSITIVE_DEFINITE = 2
KILOBYTE = 1024
# Fewest threads of a factorisation beside others: with one each, PARDISO's analysis has crashed the
# process at random (sfinit, MKL 2026.2), with two never. Both take the same time on two cores.
FEWEST_THREADS = 2


class PardisoError(ConvergenceError):
    """Error if PARDISO is not installed or refuses a matrix.

    It refuses indefinite matrices and those with an empty row or too little memory.
    """


@cache
def library() -> Any | None:
    """Return the loaded MKL, or None if it is not installed."""
    installed = sorted(map(str, Path(sys.prefix).glob("lib*/libmkl_rt.so*")), key=len)
    if installed:
        os.environ.setdefault(PLACE_VARIABLE, installed[0])
    try:
        import pypardiso
    except ImportError:
        return None
    mkl = pypardiso.ps.libmkl
    if MODE_VARIABLE not in os.environ:
        mkl.MKL_CBWR_Set(REPRODUCIBLE)
    return mkl


def threads() -> int:
    """Return the number of threads that MKL uses for a call from here; 1 without MKL."""
    mkl = library()
    return 1 if mkl is None else int(mkl.MKL_Get_Max_Threads())


def in_parallel(jobs: Sequence[Callable[[], T]]) -> list[T]:
    """Run jobs in parallel threads, among which MKL's threads are divided.

    A factorisation of 50,000 unknowns gains little from a second thread, but two of them in
    parallel run almost twice as fast. With one thread of MKL, jobs run one after the other.
    """
    mkl, count = library(), threads()
    if mkl is not None and count < FEWEST_THREADS:
        return [job() for job in jobs]
    share = max(count // max(len(jobs), 1), FEWEST_THREADS)

    def with_share(job: Callable[[], T]) -> T:
        if mkl is None:
            return job()
        before = mkl.MKL_Set_Num_Threads_Local(share)
        try:
            return job()
        finally:
            mkl.MKL_Set_Num_Threads_Local(before)

    return run_parallel([partial(with_share, job) for job in jobs])


class Pardiso:
    """Matrix analysed by PARDISO, whose memory is released with the object.

    After :meth:`factorise`, call the object with right-hand sides. With ``kept`` unknowns,
    :meth:`schur` returns their Schur complement, and there are no factors to solve with. Factors in
    ``single`` precision take half the memory and the time.
    """

    def __init__(
        self, matrix: sp.csr_matrix, kept: Indices | None = None, single: bool = False
    ) -> None:
        mkl = library()
        if mkl is None:
            raise PardisoError("PARDISO is not installed")
        if not np.diff(matrix.indptr).all():
            raise PardisoError("the matrix has an empty row")  # PARDISO would crash.
        upper = _upper(matrix)
        self._size = matrix.shape[0]
        self._values = upper.data.astype(np.float32 if single else np.float64)
        self._pointers, self._columns = upper.indptr.astype("i4"), upper.indices.astype("i4")
        self._marked = np.zeros(self._size, np.int32)
        parameters = np.zeros(64, np.int32)
        parameters[[NO_DEFAULTS, ORDERING, ZERO_BASED]] = 1, NESTED_DISSECTION, 1
        parameters[SINGLE] = single
        if kept is not None:
            parameters[SCHUR] = 1
            self._marked[kept] = 1
        self._kept, self._parameters = kept, parameters
        # The function is looked up by item, because the attribute has the argument types that
        # pypardiso has set.
        self._state = (mkl["pardiso"], np.zeros(64, np.int64), parameters)
        # Unlike __del__, this is also called in time when the interpreter ends.
        weakref.finalize(self, _release, self._state)
        self._call(ANALYSE)

    @property
    def factor_bytes(self) -> int:
        """Peak memory of the numerical factorisation, known before it [bytes].

        With ``kept`` unknowns the dense Schur complement is included.
        """
        analysis, kept, factors = (
            KILOBYTE * int(self._parameters[place])
            for place in (ANALYSIS_PEAK, ANALYSIS_KEPT, FACTORS)
        )
        return max(analysis, kept + factors)

    def factorise(self) -> None:
        """Compute the factors. Raises :class:`PardisoError` if PARDISO refuses the matrix."""
        self._call(FACTORISE)

    def __call__(self, rhs: Array) -> Array:
        """Solve for right-hand sides ``(n,)`` or ``(n, m)``."""
        columns = np.asfortranarray(rhs, dtype=self._values.dtype)
        columns = columns.reshape(self._size, -1, order="F")
        solution = np.zeros_like(columns)
        if columns.size:
            self._call(SOLVE, columns, solution)
        return np.ascontiguousarray(solution, dtype=np.float64).reshape(rhs.shape)

    def schur(self) -> Array:
        """Factorise and return the dense Schur complement of the ``kept`` unknowns, in order."""
        assert self._kept is not None
        condensed = np.zeros((len(self._kept),) * 2)
        self._call(FACTORISE, np.zeros((self._size, 1)), condensed)
        # PARDISO orders the marked unknowns by number, not in the order given.
        if np.all(np.diff(self._kept) > 0):
            return condensed
        place = np.argsort(np.argsort(self._kept))
        return condensed[np.ix_(place, place)]

    def _call(self, phase: int, rhs: Array | None = None, result: Array | None = None) -> None:
        matrix = self._values, self._pointers, self._columns, self._marked
        _pardiso(self._state, phase, self._size, matrix, rhs, result)


def _upper(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """Return the upper triangle with sorted rows and every diagonal entry, as PARDISO expects."""
    upper = sp.triu(matrix, format="coo")
    diagonal = np.arange(matrix.shape[0])
    rows, columns = np.append(upper.row, diagonal), np.append(upper.col, diagonal)
    values = np.append(upper.data, np.zeros(len(diagonal)))
    full = sp.csr_matrix((values, (rows, columns)), shape=matrix.shape)
    full.sort_indices()
    return full


def _pardiso(
    state: tuple[Any, NDArray, NDArray],
    phase: int,
    size: int,
    matrix: tuple[NDArray | None, ...],
    rhs: Array | None = None,
    result: Array | None = None,
) -> None:
    """Call the routine, which takes every argument by its address."""
    routine, handle, parameters = state
    error = ctypes.c_int32(0)
    columns = 1 if rhs is None else rhs.shape[1]
    routine(
        _address(handle), _integer(1), _integer(1), _integer(POSITIVE_DEFINITE), _integer(phase),
        _integer(size), *map(_address, matrix), _integer(columns), _address(parameters),
        _integer(0), _address(rhs), _address(result), ctypes.byref(error),
    )  # fmt: skip
    if error.value != 0:
        raise PardisoError(f"PARDISO's error {error.value} in phase {phase}")


def _release(state: tuple[Any, NDArray, NDArray]) -> None:
    _pardiso(state, RELEASE, 0, (None,) * 4)


def _integer(value: int) -> Any:
    return ctypes.byref(ctypes.c_int32(value))


def _address(array: NDArray | None) -> Any:
    return None if array is None else array.ctypes.data_as(ctypes.c_void_p)
