"""The same runs on a cluster: a dask.distributed scheduler hands them to its workers.

Cases and folders are read and written where their paths lead to, on a file system that all machines
share. A run whose worker dies is taken up by another one, from the last jump. Where none is left,
that is told, and after an hour of it given up.
"""

from __future__ import annotations

import hashlib
import logging
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.case.writing import dump_case
from workflow.errors import MethodFailed, UserError, one_line
from workflow.runs.job import Job, run_job
from workflow.shell.forecast import in_words

# Times a run is tried again where it could not even be started; how often its worker may die is
# the scheduler's `distributed.scheduler.allowed-failures`, 3 by default.
RETRIES = 2
# Seconds to wait for the scheduler to answer.
PATIENCE = "30 s"
# Seconds between two looks for runs that have ended, and for workers.
LOOK, WORKERS_LOOK = 0.2, 5.0
# Seconds without any worker until that is told, until it is told again, and until they are taken to
# be gone for good; a cluster's queue may bring the first one as late as it likes.
TELL, TELL_AGAIN, GIVE_UP = 10.0, 600.0, 3600.0
# Whose messages are for those who run the cluster.
LOGGERS = "distributed", "tornado"
LOG = logging.getLogger(__name__)


def run_on_cluster(
    jobs: Sequence[tuple[Job, Case]], out: Path, address: str, end: Callable[[Job, str], None]
) -> None:
    """Run jobs on the workers of the scheduler at ``address`` and ``end`` each with its error.

    Raises UserError if there is no scheduler, MethodFailed where it or all of its workers go away
    meanwhile. Runs that are no longer wanted, because this process has ended in whatever way, are
    ended by their workers.
    """
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise UserError(
            f"--dask needs the package distributed ({one_line(error)}): install fretscale[cluster]"
        ) from error
    _silence()
    try:
        client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        raise UserError(f"--dask {address}: no scheduler answers: {one_line(error)}") from error
    with client:
        futures = _submitted(client, jobs, out)
        completed, watch = as_completed(futures), _Watch(client, address, len(futures))
        while left := completed.count():
            for future in completed.next_batch(block=False):
                if future.cancelled():
                    raise watch.failure("the scheduler has gone", left)
                left -= 1
                end(futures[future], _error_of(future))
            if left:
                watch.look(left)
                time.sleep(LOOK)


class _Watch:
    """Looks after the workers of the scheduler at ``address``, which are to do ``total`` runs."""

    def __init__(self, client: Any, address: str, total: int) -> None:
        self._client, self._address, self._total = client, address, total
        self._come = False
        self._last = self._looked = time.monotonic()
        self._tell_at = TELL

    def failure(self, why: str, left: int) -> MethodFailed:
        """What to raise where ``left`` runs cannot be waited for."""
        return MethodFailed(
            f"--dask {self._address}: {why}, {left} of {self._total} runs not known to have ended; "
            "what is done is kept: the same command goes on"
        )

    def look(self, left: int) -> None:
        """Tell where there is no worker. Raises MethodFailed if that has been so for too long."""
        now = time.monotonic()
        if now < self._looked + WORKERS_LOOK:
            return
        self._looked = now
        if self._has_workers():
            self._come, self._last, self._tell_at = True, now, TELL
            return
        without = now - self._last
        if self._come and without >= GIVE_UP:
            raise self.failure(f"no worker for {in_words(without)}", left)
        if without >= self._tell_at:
            self._tell_at = without + TELL_AGAIN
            none, ending = "no worker yet", "Ctrl-C ends it"
            if self._come:
                none, ending = "no worker is left", f"given up after {in_words(GIVE_UP)} of that"
            LOG.warning(
                f"--dask {self._address}: {none}, {left} of {self._total} runs wait for one; "
                f"{ending}, what is done is kept"
            )

    def _has_workers(self) -> bool:
        try:
            return bool(self._client.nthreads(callback_timeout=PATIENCE))
        except Exception:  # what is asked of a scheduler that has gone ends in many ways
            return False


def _silence() -> None:
    """What becomes of the cluster is told in our own words, in one line."""
    for name in (*LOGGERS, *logging.root.manager.loggerDict):
        if name.partition(".")[0] in LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _submitted(client: Any, jobs: Sequence[tuple[Job, Case]], out: Path) -> dict[Any, Job]:
    """The jobs, each by what the scheduler will tell of it."""
    futures = {}
    for job, case in jobs:
        settings = {"key": _key(job, case, out), "pure": False, "retries": RETRIES}
        absolute = Job(job.name, job.case.absolute(), job.overrides)
        futures[client.submit(_on_worker, absolute, out.absolute(), **settings)] = job
    return futures


def _key(job: Job, case: Case, out: Path) -> str:
    """What the scheduler knows a run by: the same one submitted twice is run once."""
    parts = f"{out.absolute()}\n{dump_case(case)}"
    return f"{job.name}-{hashlib.sha256(parts.encode()).hexdigest()[:16]}"


def _on_worker(job: Job, out: Path) -> str:
    """Compute a job in a process below the worker, as long as the scheduler wants it."""
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def unwanted() -> bool:
        task = worker.state.tasks.get(key)
        return task is None or task.state == "cancelled"

    # The scheduler gives a run to one worker at a time, and has seen the last one die.
    return run_job(job, out, unwanted, take_over=True)


def _error_of(future: Any) -> str:
    """What the run said, or what became of it where no worker could say."""
    try:
        return str(future.result())
    except Exception as error:
        return f"lost by the cluster: {type(error).__name__}: {one_line(error)}"
