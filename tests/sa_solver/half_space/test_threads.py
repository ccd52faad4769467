"""Work in threads: number of threads, order of the results, and exceptions."""

import threading
import time
from functools import partial

import pytest

from sa_solver.transforms.threads import THREADS, begun, run_parallel, threads


def _after(seconds: float, value: int) -> int:
    time.sleep(seconds)
    return value


def _fail() -> int:
    raise ZeroDivisionError


def test_jobs_work_side_by_side_only_where_threads_may(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(THREADS, "2")
    assert threads() == 2
    # Each job waits for the other.
    barrier = threading.Barrier(2, timeout=120.0)
    assert sorted(run_parallel([barrier.wait, barrier.wait])) == [0, 1]
    monkeypatch.setenv(THREADS, "1")
    here = threading.get_ident()
    assert run_parallel([threading.get_ident, threading.get_ident]) == [here, here]


@pytest.mark.parametrize("allowed", ["1", "2"])
def test_what_a_job_raises_is_raised_and_later_jobs_do_not_begin(monkeypatch, allowed):
    monkeypatch.setenv(THREADS, allowed)
    begun: list[int] = []
    jobs = [_fail, *(partial(_after, 0.05, n) for n in range(2)), partial(begun.append, 1)]
    with pytest.raises(ZeroDivisionError):
        run_parallel(jobs)
    assert begun == []


@pytest.mark.parametrize("allowed", ["1", "2"])
def test_a_job_that_is_begun_is_done_once(monkeypatch: pytest.MonkeyPatch, allowed: str) -> None:
    """With two threads the job runs in the other one, otherwise when its result is needed."""
    monkeypatch.setenv(THREADS, allowed)
    where: list[int] = []
    answer = begun(lambda: where.append(threading.get_ident()) or len(where))
    assert [answer(), answer()] == [1, 1]
    assert (where == [threading.get_ident()]) == (allowed == "1")
    with pytest.raises(ZeroDivisionError):
        begun(_fail)()
