"""``fretscale sweep``: checks all runs, runs them, and writes table, summary and figures.

An interrupted sweep is resumed: finished runs are recognized by their folders.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.types import Array
from workflow.case.text.plain import counted, shares
from workflow.errors import CaseError, FolderTaken
from workflow.kinds import analysis_of
from workflow.runs.job import Finished, Job
from workflow.runs.jobs import run_jobs
from workflow.runs.run import stored_run
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import locked
from workflow.shell.folders.store import write_text
from workflow.shell.folders.versions import versions
from workflow.shell.terminal.reporter import Reporter, telling
from workflow.shell.terminal.screen import Loudness
from workflow.sweep.bands import FEWEST, band_of
from workflow.sweep.design import SweepRun, runs_of
from workflow.sweep.first_order import LINEAR, first_order
from workflow.sweep.schema import DRAWN, Sweep, load_sweep
from workflow.sweep.table import SweepRow, columns_of, spread, unit_of, varied_in, write_sweep_table

FILE, RUNS, TABLE, LOG = "sweep.yaml", "runs", "sweep.csv", "sweep.log"
FIGURES = "figures"
# Largest number of lines about invalid cases; the same mistake is often in many of them.
MOST_LINES = 10


def run_sweep(
    path: Path,
    out: Path,
    *,
    processes: int | None,
    dask: str | None,
    force: bool,
    loudness: Loudness = Loudness.NORMAL,
) -> bool:
    """Run the sweep in file ``path`` into ``out``; return False if any of its runs failed.

    Raises CaseError, before anything runs, if the file or the case of any run is wrong, and
    UserError if ``out`` holds other files, or runs of another case and ``force`` is not given.
    """
    sweep = load_sweep(path)
    text, runs = path.read_text(encoding="utf-8"), runs_of(sweep)
    folder = OutputFolder(out, "sweep")
    with locked(out) as gone:
        folder.refuse_foreign()
        finished = _check_runs(sweep, runs, out / RUNS, force)
        write_text(folder.reserve(FILE, "the sweep as run"), text)
        (out / RUNS).mkdir(exist_ok=True)
        log = folder.reserve(LOG, "messages of the sweep, with times")
        with closing(Reporter(log, True, loudness=loudness)) as reporter:
            if gone:
                reporter.say(gone)
            reporter.say(
                f"sweep: {counted(len(runs), 'run')} of {sweep.file.case}, {finished} finished "
                "before"
            )
            rows = _run(sweep, runs, folder, processes, dask, finished, reporter)
            with reporter.stage("figures"):
                _write_figures(sweep, rows, folder)
            _write_summary(sweep, rows, folder)
            failed = sum(not row.done for row in rows)
            reporter.say(f"{len(rows) - failed} runs done, {failed} failed: {out / TABLE}")
            if lacking := _lacking(sweep, rows):
                reporter.say(f"  {lacking}")
            # Cases without wear and contact have no figures and no folder of them.
            if figures := sorted((out / FIGURES).glob("*")) if failed < len(rows) else []:
                reporter.say(f"  figure    {figures[0]}")
    return failed == 0


def _check_runs(sweep: Sweep, runs: Sequence[SweepRun], out: Path, force: bool) -> int:
    """Load the case and check the folder of every run; return how many are finished."""
    wrong: dict[str, None] = {}
    states = []
    for run in {run.name: run for run in runs}.values():
        try:
            case = run.job(sweep).load()
        except CaseError as error:
            wrong |= dict.fromkeys(_explained(sweep, run.job(sweep), str(error)))
            continue
        states.append(stored_run(out / run.name, case))
        if states[-1] == "other" and not force:
            raise FolderTaken(
                f"{out / run.name}: holds a run of another case; give another folder, or --force"
            )
    if wrong:
        more = [f"and {len(wrong) - MOST_LINES} more errors"] if len(wrong) > MOST_LINES else []
        raise CaseError("\n".join([*list(wrong)[:MOST_LINES], *more]))
    return states.count("finished")


def _explained(sweep: Sweep, job: Job, text: str) -> Iterator[str]:
    """Yield lines about a case; errors in what the sweep sets point to the sweep's file."""
    paths = {f"--set {override}: ": override.partition("=")[0] for override in job.overrides}
    for line in text.splitlines():
        start = next((start for start in paths if line.startswith(start)), "")
        unknown = re.search(r":\d+: (\S+): unknown key", line)
        if start:
            yield f"{sweep.place(paths[start])}: {line.removeprefix(start)}"
        elif unknown and (below := [p for p in paths.values() if p.startswith(f"{unknown[1]}.")]):
            # The case has no such section; it exists only because the sweep sets an entry below it.
            yield f"{sweep.place(below[0])}: {line[unknown.start(1) :]}"
        else:
            yield line


def _run(
    sweep: Sweep,
    runs: Sequence[SweepRun],
    folder: OutputFolder,
    processes: int | None,
    dask: str | None,
    finished_before: int,
    reporter: Reporter,
) -> list[SweepRow]:
    """Run each different run once; always write the table of those that have ended.

    The ``finished_before`` runs end first. A sample may contain the same run twice, which then has
    two rows.
    """
    jobs = {run.name: run.job(sweep) for run in runs}
    ended: dict[str, Finished] = {}
    begin = time.perf_counter()

    def report(finished: Finished) -> None:
        ended[finished.job.name] = finished
        how = f"failed: {finished.error}" if finished.error else "done"
        spent = time.perf_counter() - begin
        reported = f"  {len(ended)}/{len(jobs)}, {spent:.0f} s: {finished.job.name}: {how}"
        reporter.say(reported, always=bool(finished.error))
        reporter.reached(len(ended) / len(jobs), f"{len(ended)} of {len(jobs)}")
        if len(ended) <= finished_before:
            reporter.goes_on()

    def running(names: Sequence[str]) -> None:
        reporter.doing(f"{len(ended)} of {len(jobs)}, now {', '.join(names)}")

    try:
        out = folder.root / RUNS
        with reporter.course("runs"), telling(reporter):
            run_jobs(
                list(jobs.values()),
                out,
                processes=processes,
                dask=dask,
                report=report,
                running=running,
            )
    finally:
        rows = [SweepRow(run, ended[run.name]) for run in runs if run.name in ended]
        if rows:
            write_sweep_table(rows, folder.reserve(TABLE, "values and results of every run"))
    return rows


def _write_summary(sweep: Sweep, rows: list[SweepRow], folder: OutputFolder) -> None:
    columns = columns_of(rows)
    summary = {
        "title": _title(sweep, rows),
        "case": os.path.relpath(sweep.file.case, folder.root),
        "design": sweep.file.design,
        "varied": [varied.path for varied in varied_in(rows)],
        "runs": len(rows),
        "failed": {row.run.name: row.finished.error for row in rows if not row.done},
        "found": {
            name: {"unit": unit_of(name, rows), **found}
            for name, values in columns.items()
            if (found := _found(sweep, values)) is not None
        },
        "seconds": round(sum(row.seconds or 0.0 for row in rows), 2),
        "versions": versions(),
    }
    folder.write_summary(summary)


def _found(sweep: Sweep, values: Array) -> dict[str, Any] | None:
    """Return the statistics of a number over the runs, with its 95 % band if there is one."""
    if sweep.file.design == "linear":
        return _stepped(values)
    statistics = spread(values)
    if statistics is None or sweep.file.design != "sample":
        return statistics
    return statistics | {"band": band_of(values)}


def _stepped(values: Array) -> dict[str, Any] | None:
    """Return a number to first order, with its band and its nonlinearity in half widths."""
    if not np.isfinite(values[0]):
        return None
    if not np.all(np.isfinite(values)):
        return {"best": float(values[0]), "band": None, "bent": None}
    found = first_order(values)
    return {"best": float(found.middle), "band": found.reported(), "bent": found.bent}


def _lacking(sweep: Sweep, rows: Sequence[SweepRow]) -> str:
    """Return which bands cannot be determined; empty if there are all."""
    done = sum(row.done for row in rows)
    if sweep.file.design == "sample" and done < FEWEST:
        return f"no 95 % bands: {counted(done, 'run')} done, {FEWEST} are needed"
    if sweep.file.design != "linear":
        return ""
    if done < len(rows):
        return "no 95 % bands: to first order they need all runs"
    bent = [name for name, values in columns_of(rows).items() if _bent(values)]
    if not bent:
        return ""
    return (
        f"{counted(len(bent), 'number')} not linear within {shares(LINEAR)} and without a band, "
        f"such as {bent[0]}: take design: sample"
    )


def _bent(values: Array) -> bool:
    found = _stepped(values)
    return found is not None and found["band"] is None


def _title(sweep: Sweep, rows: Sequence[SweepRow]) -> str:
    """Return the title of the sweep, or else that of its first run."""
    if sweep.file.title is not None:
        return sweep.file.title
    summaries = (row.finished.summary for row in rows if row.finished.summary)
    return next((str(summary["title"]) for summary in summaries), sweep.name)


def _write_figures(sweep: Sweep, rows: list[SweepRow], folder: OutputFolder) -> None:
    if not any(row.done for row in rows):
        return
    from workflow.sweep.figures import write_sweep_figures

    with folder.filling(FIGURES, "figures of the results") as figures:
        write_sweep_figures(_title(sweep, rows), rows, figures)
        if sweep.file.design in DRAWN:
            from workflow.sweep.band_figures import (
                OF_A_SAMPLE,
                to_first_order,
                write_band_figures,
            )

            analysis = analysis_of(rows[0].run.job(sweep).load())
            way = OF_A_SAMPLE if sweep.file.design == "sample" else to_first_order(len(rows))
            write_band_figures(_title(sweep, rows), analysis, rows, figures, way)
