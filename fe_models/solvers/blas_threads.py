"""Restriction of OpenBLAS to one thread for small dense algebra, which gains nothing from more.

A product of a symmetric matrix and a vector is limited by memory, and small ones are finished
before another thread has woken up. OpenBLAS nevertheless distributes them over all its threads,
which wait for each other without releasing their cores. A product of 2000 unknowns then takes ten
times as long while another process runs, and alone no less than with one thread.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy
import scipy

# Number of unknowns up to which one thread is used: the matrix may fit into a processor's caches.
SMALL = 4000
# Functions that set and get the number of threads, in the OpenBLAS libraries of both wheels.
CALLS = {
    scipy: ("scipy_openblas_set_num_threads", "scipy_openblas_get_num_threads"),
    numpy: ("scipy_openblas_set_num_threads64_", "scipy_openblas_get_num_threads64_"),
}


@contextmanager
def one_thread(unknowns: int = 0) -> Iterator[None]:
    """Restrict OpenBLAS to one thread if matrices of so many ``unknowns`` are small.

    It has no effect if NumPy and SciPy use other libraries than those of their wheels. The number
    of threads applies to the whole process, so do not use this in parallel threads.
    """
    libraries = _openblas() if unknowns <= SMALL else ()
    before = [get() for _, get in libraries]
    for set_number, _ in libraries:
        set_number(1)
    try:
        yield
    finally:
        for (set_number, _), number in zip(libraries, before, strict=True):
            set_number(number)


@cache
def _openblas() -> tuple[tuple[Callable[[int], None], Callable[[], int]], ...]:
    """Return the functions that set and get the number of threads, of each library found."""
    found = []
    for package, (set_number, get) in CALLS.items():
        folder = Path(package.__file__).parents[1] / f"{package.__name__}.libs"
        for path in sorted(folder.glob("libscipy_openblas*")):
            library = ctypes.CDLL(str(path))
            if hasattr(library, set_number) and hasattr(library, get):
                found.append((getattr(library, set_number), getattr(library, get)))
    return tuple(found)
