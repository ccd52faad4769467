"""Products with matrices that threads gain nothing for, by one thread.

A product of a symmetric matrix and a vector waits for memory. OpenBLAS shares it among all its
threads even so, which wait for each other without leaving their cores: with another process on
these a product of 2000 unknowns takes ten times as long, and alone no less than with one thread.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import scipy

# Unknowns up to which one thread multiplies: a matrix that a processor's caches may hold.
SMALL = 4000


@contextmanager
def one_thread(unknowns: int) -> Iterator[None]:
    """SciPy's OpenBLAS takes one thread, where matrices of so many ``unknowns`` are small.

    It does nothing to a SciPy that was built with another library. The number is that of the whole
    process: not for work side by side.
    """
    blas = _openblas() if unknowns <= SMALL else None
    if blas is None:
        yield
        return
    before = blas.scipy_openblas_get_num_threads()
    blas.scipy_openblas_set_num_threads(1)
    try:
        yield
    finally:
        blas.scipy_openblas_set_num_threads(before)


@cache
def _openblas() -> ctypes.CDLL | None:
    """The library that comes with SciPy's wheels; None where there is none such."""
    beside = Path(scipy.__file__).parents[1] / "scipy.libs"
    for path in sorted(beside.glob("libscipy_openblas*")):
        library = ctypes.CDLL(str(path))
        if hasattr(library, "scipy_openblas_set_num_threads"):
            return library
    return None
