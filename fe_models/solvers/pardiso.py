"""MKL PARDISO for sparse symmetric positive definite matrices: factors, Schur complement.

pypardiso finds the library. Its own solver compares the whole matrix before every solve, and gives
neither the memory PARDISO announces nor the Schur complement, so the routine is called here.
Source: Schenk and Gärtner 2004, doi:10.1016/j.future.2003.07.011; oneMKL's reference, "pardiso".
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
from sa_solver.types import Array, Indices

T = TypeVar("T")

ANALYSE, FACTORISE, SOLVE, RELEASE = 11, 22, 33, -1
# Places in PARDISO's table of parameters, counted from zero; the last three are answers.
NO_DEFAULTS, ORDERING, ZERO_BASED, SCHUR = 0, 1, 34, 35
ANALYSIS_PEAK, ANALYSIS_KEPT, FACTORS = 14, 15, 16
NESTED_DISSECTION = 2
# MKL's mode of reproducible results with its fastest kernels: two solutions with two threads
# differ in the last bits otherwise. MKL's own variable chooses another, say that which gives the
# same bits on every processor; what is set by a call would win over it.
REPRODUCIBLE = 2
MODE_VARIABLE = "MKL_CBWR"
# Where pypardiso looks for MKL first; without it, through every folder of the environment.
PLACE_VARIABLE = "PYPARDISO_MKL_RT"
# Its number for real symmetric positive definite matrices.
POSITIVE_DEFINITE = 2
KILOBYTE = 1024


class PardisoError(ConvergenceError):
    """PARDISO is not installed or refuses a matrix: indefinite, an empty row, no memory."""


@cache
def library() -> Any | None:
    """The loaded MKL, or None where it is not installed."""
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
    """Threads that MKL shares the work of a call from here among; 1 without it."""
    mkl = library()
    return 1 if mkl is None else int(mkl.MKL_Get_Max_Threads())


def sharing(jobs: Sequence[Callable[[], T]]) -> list[Callable[[], T]]:
    """Jobs for threads side by side, which share those that MKL takes.

    A factorisation of 50,000 unknowns gains little from a second thread, two of them beside each
    other nearly all of it.
    """

    def with_share(job: Callable[[], T]) -> T:
        mkl = library()
        if mkl is None:
            return job()
        before = mkl.MKL_Set_Num_Threads_Local(max(mkl.MKL_Get_Max_Threads() // len(jobs), 1))
        try:
            return job()
        finally:
            mkl.MKL_Set_Num_Threads_Local(before)

    library()  # here, which is the main thread
    return [partial(with_share, job) for job in jobs]


class Pardiso:
    """A matrix analysed by PARDISO; its memory is given back with the object.

    After :meth:`factorise` call it with right-hand sides. With ``kept`` unknowns, their Schur
    complement is what :meth:`schur` gives, and there are no factors to solve with.
    """

    def __init__(self, matrix: sp.csr_matrix, kept: Indices | None = None) -> None:
        mkl = library()
        if mkl is None:
            raise PardisoError("PARDISO is not installed")
        if not np.diff(matrix.indptr).all():
            raise PardisoError("the matrix has an empty row")  # PARDISO would crash
        upper = _upper(matrix)
        self._size = matrix.shape[0]
        self._values = upper.data.astype(float)
        self._pointers, self._columns = upper.indptr.astype("i4"), upper.indices.astype("i4")
        self._marked = np.zeros(self._size, np.int32)
        parameters = np.zeros(64, np.int32)
        parameters[[NO_DEFAULTS, ORDERING, ZERO_BASED]] = 1, NESTED_DISSECTION, 1
        if kept is not None:
            parameters[SCHUR] = 1
            self._marked[kept] = 1
        self._kept, self._parameters = kept, parameters
        # Looked up by item: the attribute is pypardiso's, with its types of arguments.
        self._state = (mkl["pardiso"], np.zeros(64, np.int64), parameters)
        # Unlike __del__ this also comes in time when the interpreter ends.
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
        """Compute the factors. Raises :class:`PardisoError`, if not positive definite say."""
        self._call(FACTORISE)

    def __call__(self, rhs: Array) -> Array:
        """Solve for ``(n,)`` or ``(n, m)``."""
        columns = np.asfortranarray(rhs, dtype=float).reshape(self._size, -1, order="F")
        solution = np.zeros_like(columns)
        self._call(SOLVE, columns, solution)
        return np.ascontiguousarray(solution).reshape(rhs.shape)

    def schur(self) -> Array:
        """Factorise, and the Schur complement of the ``kept`` unknowns in their order, dense."""
        assert self._kept is not None
        condensed = np.zeros((len(self._kept),) * 2)
        self._call(FACTORISE, np.zeros((self._size, 1)), condensed)
        # PARDISO orders the marked unknowns by their number, not as they were given.
        if np.all(np.diff(self._kept) > 0):
            return condensed
        place = np.argsort(np.argsort(self._kept))
        return condensed[np.ix_(place, place)]

    def _call(self, phase: int, rhs: Array | None = None, result: Array | None = None) -> None:
        matrix = self._values, self._pointers, self._columns, self._marked
        _pardiso(self._state, phase, self._size, matrix, rhs, result)


def _upper(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """Upper triangle with sorted rows and every diagonal entry stored, as PARDISO expects."""
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
    """One call of the routine, which takes every argument by its address."""
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
