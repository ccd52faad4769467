"""Work side by side in threads, for what spends its time where Python's lock is not held."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

T = TypeVar("T")

# What tells the libraries below how many threads they may take; without it they take all cores.
THREADS = "OMP_NUM_THREADS"


def threads() -> int:
    """How many threads may work: all cores of this process, or as many as ``THREADS`` says."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    told = os.environ.get(THREADS, "")
    return int(told) if told.isdecimal() and int(told) > 0 else cores or 1


def at_once(jobs: Sequence[Callable[[], T]]) -> list[T]:
    """What each of the jobs gives, as many side by side as threads may work.

    Raises what one of them raised, or Ctrl-C, once those that had begun have ended; others do not
    begin.

    Examples
    --------
    >>> from functools import partial
    >>> from sa_solver.transforms.threads import at_once
    >>> at_once([partial(pow, 2, 10), partial(pow, 3, 4)])
    [1024, 81]
    """
    shared = min(threads(), len(jobs))
    if shared < 2:
        return [job() for job in jobs]
    with ThreadPoolExecutor(shared) as pool:
        return list(pool.map(lambda job: job(), jobs))


def begun(job: Callable[[], T]) -> Callable[[], T]:
    """Begin with a job beside what is to come; what is returned gives what it gives, or raises.

    Where a single thread may work it is done when that is asked for.

    Examples
    --------
    >>> from functools import partial
    >>> from sa_solver.transforms.threads import begun
    >>> power = begun(partial(pow, 2, 10))
    >>> print(power())
    1024
    """
    if threads() < 2:
        return cache(job)
    pool = ThreadPoolExecutor(1)
    answer = pool.submit(job)
    pool.shutdown(wait=False)
    return answer.result
