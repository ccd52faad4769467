"""Runs on a cluster, distributed to its workers by a dask.distributed scheduler.

Cases and folders are read and written under their paths, on a file system that all machines share.
If a worker dies, another one resumes its run from the last saved state. If no worker is left, a
warning is given, and after an hour the runs are given up.
"""

from __future__ import annotations

import hashlib
import logging
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.case.text.writing import dump_case
from workflow.errors import ClusterLost, UserError, one_line
from workflow.messages.error_kinds import ErrorKind
from workflow.messages.warning_kinds import WarningKind
from workflow.runs.job import Job, run_job
from workflow.shell.forecast import in_words

# Number of times that starting a run is tried again. How often its worker may die is a setting of
# the scheduler, `distributed.scheduler.allowed-failures`, 3 by default.
RETRIES = 2
# Seconds to wait for the scheduler to answer.
PATIENCE = "30 s"
# Seconds between two checks for runs that have ended, and for workers.
LOOK, WORKERS_LOOK = 0.2, 5.0
# Seconds without any worker until a warning, until the next warning, and until the runs are given
# up. There is no limit for the first worker, which may wait in a cluster's queue.
TELL, TELL_AGAIN, GIVE_UP = 10.0, 600.0, 3600.0
# Loggers whose messages are for the administrators of the cluster.
LOGGERS = "distributed", "tornado"
LOG = logging.getLogger(__name__)


def run_on_cluster(
    jobs: Sequence[tuple[Job, Case]], out: Path, address: str, end: Callable[[Job, str], None]
) -> None:
    """Run jobs on the workers of the scheduler at ``address``, and call ``end`` with each error.

    Raises UserError if there is no scheduler, MethodFailed if it or all of its workers disappear.
    Workers end runs that are no longer wanted because this process has ended, in whatever way.
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
    """Monitor of the workers of the scheduler at ``address``, which have ``total`` runs to do."""

    def __init__(self, client: Any, address: str, total: int) -> None:
        self._client, self._address, self._total = client, address, total
        self._come = False
        self._last = self._looked = time.monotonic()
        self._tell_at = TELL

    def failure(self, why: str, left: int) -> ClusterLost:
        """Return the exception to raise if ``left`` runs cannot be waited for."""
        return ClusterLost(
            f"--dask {self._address}: {why}, {left} of {self._total} runs may not have ended; "
            "finished runs are stored: continue with the same command"
        )

    def look(self, left: int) -> None:
        """Warn if there is no worker. Raises MethodFailed if there has been none for too long."""
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
            text = (
                f"--dask {self._address}: {none}, {left} of {self._total} runs wait for one; "
                f"{ending}, finished runs are stored"
            )
            LOG.warning(WarningKind.NO_WORKER.marked(text))

    def _has_workers(self) -> bool:
        try:
            return bool(self._client.nthreads(callback_timeout=PATIENCE))
        except Exception:  # requests to a vanished scheduler fail in many ways
            return False


def _silence() -> None:
    """Suppress the messages of the cluster's packages, which one line of ours replaces."""
    for name in (*LOGGERS, *logging.root.manager.loggerDict):
        if name.partition(".")[0] in LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _submitted(client: Any, jobs: Sequence[tuple[Job, Case]], out: Path) -> dict[Any, Job]:
    """Submit the jobs, and return them by their futures."""
    futures = {}
    for job, case in jobs:
        settings = {"key": _key(job, case, out), "pure": False, "retries": RETRIES}
        absolute = Job(job.name, job.case.absolute(), job.overrides)
        futures[client.submit(_on_worker, absolute, out.absolute(), **settings)] = job
    return futures


def _key(job: Job, case: Case, out: Path) -> str:
    """Return the scheduler's key of a run; the same run submitted twice is then run once."""
    parts = f"{out.absolute()}\n{dump_case(case)}"
    return f"{job.name}-{hashlib.sha256(parts.encode()).hexdigest()[:16]}"


def _on_worker(job: Job, out: Path) -> str:
    """Compute a job in a child process of the worker, as long as the scheduler wants it."""
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def abandoned() -> bool:
        task = worker.state.tasks.get(key)
        return task is None or task.state == "cancelled"

    # The lock can be taken over, because the scheduler gives a run to one worker at a time and only
    # after the last one has died.
    return run_job(job, out, abandoned, take_over=True)


def _error_of(future: Any) -> str:
    """Return the error of the run, or why no worker could report one."""
    try:
        return str(future.result())
    except Exception as error:
        text = f"lost by the cluster: {type(error).__name__}: {one_line(error)}"
        return ErrorKind.CLUSTER_LOST.marked(text)
