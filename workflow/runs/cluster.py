"""The same runs on a cluster: a dask.distributed scheduler hands them to its workers.

Cases and folders are read and written where their paths lead to, on a file system that all machines
share. A run whose worker dies is taken up by another one, from the last jump.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.case.writing import dump_case
from workflow.errors import MethodFailed, UserError, one_line
from workflow.runs.job import Job, run_job

# Times a run is tried again where it could not even be started; how often its worker may die is
# the scheduler's `distributed.scheduler.allowed-failures`, 3 by default.
RETRIES = 2
# Seconds to wait for the scheduler to answer.
PATIENCE = "30 s"
# Whose messages are for those who run the cluster.
LOGGERS = "distributed", "tornado"


def run_on_cluster(
    jobs: Sequence[tuple[Job, Case]], out: Path, address: str, end: Callable[[Job, str], None]
) -> None:
    """Run jobs on the workers of the scheduler at ``address`` and ``end`` each with its error.

    Raises UserError if there is no scheduler, MethodFailed where it goes away meanwhile. Runs that
    are no longer wanted, because this process has ended in whatever way, are ended by their
    workers.
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
        for ended, future in enumerate(as_completed(futures)):
            if future.cancelled():
                raise MethodFailed(
                    f"--dask {address}: the scheduler has gone, {len(jobs) - ended} of {len(jobs)} "
                    "runs not known to have ended; what is done is kept: the same command goes on"
                )
            end(futures[future], _error_of(future))


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
