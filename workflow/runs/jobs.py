"""Runs of many cases in folders: in separate processes side by side, or one after the other.

Finished runs are reused, interrupted ones are resumed, and a run that fails is returned as a value.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path

from workflow.case.sections import Case
from workflow.errors import Ending, marked_line
from workflow.runs.cluster import run_on_cluster
from workflow.runs.job import Finished, Job, finished, run_job
from workflow.runs.run import stored_run
from workflow.shell.folders.folder import OutputFolder


def run_jobs(
    jobs: Sequence[Job],
    out: Path,
    *,
    processes: int | None = None,
    alone: bool = False,
    dask: str | None = None,
    report: Callable[[Finished], None] | None = None,
    running: Callable[[Sequence[str]], None] = lambda names: None,
) -> list[Finished]:
    """Run every job in the folder of its name below ``out``; return them in the order of ``jobs``.

    A finished run of the same case is reused, an unfinished wear run is resumed from its last saved
    state, and anything else in such a folder is run again. A job that fails is returned as a
    :class:`Finished` with its ``error``. Local runs share ``processes`` cores (default: all); each
    takes as many as it has contacts. With ``alone`` they run one after the other, each with all
    cores and threads. ``dask`` is the address of a scheduler that runs them instead. ``report`` is
    called with each job as it ends, ``running`` with the names of the jobs running here whenever
    they change. Ctrl-C ends all of them; another call resumes them.

    Raises ValueError if two jobs would share a folder.
    """
    _check_names(jobs)
    ended: dict[str, Finished] = {}

    def end(job: Job, error: str) -> None:
        ended[job.name] = finished(job, out, error)
        if report is not None:
            report(ended[job.name])

    left: list[tuple[Job, Case]] = []
    for job in jobs:
        try:
            case = job.load()
        except Ending as error:
            end(job, marked_line(error))
            continue
        root = out / job.name
        # A finished run with leftovers is not reused here: resuming it removes them.
        if stored_run(root, case) == "finished" and not OutputFolder(root).has_leftovers:
            end(job, "")
        else:
            left.append((job, case))
    if dask is not None:
        run_on_cluster(left, out, dask, end)
    else:
        cores = 1 if alone else processes or os.cpu_count() or 1
        _run_here(left, out, cores, end, running, one_thread=not alone)
    return [ended[job.name] for job in jobs]


def _check_names(jobs: Sequence[Job]) -> None:
    names = [job.name for job in jobs]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{name}: the name of two jobs; allowed: a folder for each")
        if Path(name).name != name or name in ("", ".."):
            raise ValueError(f"{name}: no name of a folder")


def _run_here(
    jobs: Sequence[tuple[Job, Case]],
    out: Path,
    cores: int,
    end: Callable[[Job, str], None],
    tell: Callable[[Sequence[str]], None],
    one_thread: bool,
) -> None:
    """Run jobs side by side in their order; one that needs more cores than there are runs alone."""
    stop = threading.Event()
    queue = [(job, min(case.cores, cores)) for job, case in jobs]
    running: dict[Future[str], tuple[Job, int]] = {}
    with ThreadPoolExecutor(max_workers=cores) as pool:
        try:
            while queue or running:
                free = cores - sum(wanted for _, wanted in running.values())
                while queue and queue[0][1] <= free:
                    job, wanted = queue.pop(0)
                    running[pool.submit(run_job, job, out, stop.is_set, one_thread)] = job, wanted
                    free -= wanted
                tell([job.name for job, _ in running.values()])
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    job, _ = running.pop(future)
                    end(job, future.result())
        finally:
            stop.set()
