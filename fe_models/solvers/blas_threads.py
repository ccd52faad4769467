"""Restriction of OpenBLAS to one thread for small dense algebra, which gains nothing from more.

A product of a symmetric matrix and a vector is limited by memory, and small ones are finished
before another thread has woken up. OpenBLAS nevertheless distributes them over all its threads,
which wait for each other without releasing their cores. A product of 2000 unknowns then takes ten
times as long while another process runs, and alone no less than with one thread.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from functools import cache

import scipy.linalg  # noqa: F401 - its OpenBLAS has to be loaded to be found
from threadpoolctl import ThreadpoolController

# Number of unknowns up to which one thread is used: the matrix may fit into a processor's caches.
SMALL = 4000


def one_thread(unknowns: int = 0) -> AbstractContextManager[object]:
    """Restrict OpenBLAS to one thread if matrices of so many ``unknowns`` are small.

    The number of threads applies to the whole process, so do not use this in parallel threads.
    """
    return _openblas().limit(limits=1) if unknowns <= SMALL else nullcontext()


@cache
def _openblas() -> ThreadpoolController:
    """Return a controller of the OpenBLAS libraries of NumPy and SciPy."""
    return ThreadpoolController().select(internal_api="openblas")
