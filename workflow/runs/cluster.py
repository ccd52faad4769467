"""The same runs on a cluster: a dask.distributed scheduler hands them to its workers.

Cases and folders are read and written where their paths lead to, on a file system that all machines
share. A run whose worker dies is taken up by another one, from the last jump.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.case.writing import dump_case
from workflow.errors import UserError, one_line
from workflow.runs.job import Job, run_job

# Times a run is tried again where it could not even be started; how often its worker may die is
# the scheduler's `distributed.scheduler.allowed-failures`, 3 by default.
RETRIES = 2
# Seconds to wait for the scheduler to answer.
PATIENCE = "30 s"


def run_on_cluster(
    jobs: Sequence[tuple[Job, Case]], out: Path, address: str, end: Callable[[Job, str], None]
) -> None:
    """Run jobs on the workers of the scheduler at ``address`` and ``end`` each with its error.

    Raises UserError if there is no scheduler. Runs that are no longer wanted, because this process
    has ended in whatever way, are ended by their workers.
    """
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise UserError(
            f"--dask needs the package distributed ({one_line(error)}): install fretscale[cluster]"
        ) from error
    try:
        client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        raise UserError(f"--dask {address}: no scheduler answers: {one_line(error)}") from error
    with client:
        futures = {}
        for job, case in jobs:
            settings = {"key": _key(job, case, out), "pure": False, "retries": RETRIES}
            absolute = Job(job.name, job.case.absolute(), job.overrides)
            futures[client.submit(_on_worker, absolute, out.absolute(), **settings)] = job
        for future in as_completed(futures):
            end(futures[future], _error_of(future))


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
