"""Small dense algebra by one thread of OpenBLAS, which gains nothing from more.

A product of a symmetric matrix and a vector waits for memory, and small ones are done before
another thread has woken up. OpenBLAS shares them among all its threads even so, which wait for each
other without leaving their cores: a product of 2000 unknowns takes ten times as long beside another
process, and alone no less than with one thread.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy
import scipy

# Unknowns up to which one thread multiplies: of a matrix that a processor's caches may hold.
SMALL = 4000
# What sets the number of threads, and what tells it, in the libraries of the wheels of both.
CALLS = {
    scipy: ("scipy_openblas_set_num_threads", "scipy_openblas_get_num_threads"),
    numpy: ("scipy_openblas_set_num_threads64_", "scipy_openblas_get_num_threads64_"),
}


@contextmanager
def one_thread(unknowns: int = 0) -> Iterator[None]:
    """OpenBLAS takes one thread, where matrices of so many ``unknowns`` are small.

    It does nothing to NumPy and SciPy where other libraries than those of their wheels are below.
    The number is that of the whole process: not to be changed in threads side by side.
    """
    libraries = _openblas() if unknowns <= SMALL else ()
    before = [told() for _, told in libraries]
    for choose, _ in libraries:
        choose(1)
    try:
        yield
    finally:
        for (choose, _), number in zip(libraries, before, strict=True):
            choose(number)


@cache
def _openblas() -> tuple[tuple[Callable[[int], None], Callable[[], int]], ...]:
    """Of each library that is there: what sets the number of its threads, and what tells it."""
    found = []
    for package, (choose, told) in CALLS.items():
        beside = Path(package.__file__).parents[1] / f"{package.__name__}.libs"
        for path in sorted(beside.glob("libscipy_openblas*")):
            library = ctypes.CDLL(str(path))
            if hasattr(library, choose) and hasattr(library, told):
                found.append((getattr(library, choose), getattr(library, told)))
    return tuple(found)
