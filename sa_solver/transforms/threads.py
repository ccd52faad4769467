"""Parallel work in threads, for jobs that mostly run without Python's interpreter lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

T = TypeVar("T")

THREADS = "OMP_NUM_THREADS"
"""Environment variable that limits the threads of numerical libraries, which otherwise use all
cores."""


def threads() -> int:
    """Return the number of threads to use: that of ``THREADS``, or all cores of this process."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    setting = os.environ.get(THREADS, "")
    return int(setting) if setting.isdecimal() and int(setting) > 0 else cores or 1


def run_parallel(jobs: Sequence[Callable[[], T]]) -> list[T]:
    """Run ``jobs`` in parallel threads and return their results.

    If a job raises an exception, or Ctrl-C is pressed, the exception is raised again after the
    running jobs have ended. No further jobs are started.

    Examples
    --------
    >>> from functools import partial
    >>> from sa_solver.transforms.threads import run_parallel
    >>> run_parallel([partial(pow, 2, 10), partial(pow, 3, 4)])
    [1024, 81]
    """
    shared = min(threads(), len(jobs))
    if shared < 2:
        return [job() for job in jobs]
    with ThreadPoolExecutor(shared) as pool:
        return list(pool.map(lambda job: job(), jobs))


def begun(job: Callable[[], T]) -> Callable[[], T]:
    """Start a job in another thread and return a function that waits for its result.

    The function returns the result of the job or raises its exception. If only a single thread may
    be used, the job runs when the function is called.

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
