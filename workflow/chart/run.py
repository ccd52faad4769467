"""Runs of the rungs of a chart, and the quantities by which they are compared.

Every axis is varied alone about the case's own settings. Rungs run one at a time, so that their
times do not disturb each other, with all cores and threads of the machine. Finished runs are
reused and interrupted ones resumed.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from workflow.analyses.wear.approximations.approximation import (
    Approximation,
    Rung,
    entry_at,
    overrides_of,
)
from workflow.case.changing import changed
from workflow.case.fields import Quantity, quantity_of_option
from workflow.case.sections import Case
from workflow.chart.axes import Setting, axes_of
from workflow.chart.costs import RunCost, costs
from workflow.chart.ladder import Ladder, Point, judge
from workflow.errors import MethodFailed, UserError
from workflow.kinds import analysis_of, load_case
from workflow.runs.job import Finished, Job
from workflow.runs.jobs import run_jobs
from workflow.runs.run import stored_run
from workflow.shell.folders.cache import cache_files
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.summary import number_at
from workflow.shell.processes import environment
from workflow.shell.terminal.reporter import Reporter
from workflow.shell.terminal.screen import Loudness

CACHE = "FRETSCALE_CACHE"
ACCURACY = Quantity("1", above=0.0, at_most=1.0)
# Name of the folder of a chart, of its subfolders, and of the run of the case as written.
KIND, LOG = "chart", "chart.log"
RUNS, STRUCTURES, BASELINE = "runs", "structures", "own"
# Entry of an interface in the summary: the longest stable explicit step of the unworn contact.
LIMIT = "explicit_limit"
# A state counted from the first increment, which is a different state with other increments.
FROM_THE_FIRST = re.compile(r"states\.\d")
# A run that ends in less than this share of its recorded time is reused from an earlier chart.
KEPT = 0.5
# Explicit runs of more steps are left out: each step solves a cycle, most of a day in 3-D.
MOST_STEPS = 5000


@dataclass(frozen=True)
class Chart:
    """Ladders of a case, the required accuracy, and whether all runs were complete."""

    title: str
    ladders: tuple[Ladder, ...]
    accuracy: float
    complete: bool = True


@dataclass(frozen=True)
class _Run:
    """Finished run of a setting; ``summary`` includes the middle sections of wear."""

    folder: Path
    summary: Mapping[str, Any]
    cost: RunCost


def accuracy_of(text: str) -> float:
    """Return a share such as ``1 %`` or ``0.01`` as a number; raise UserError for others."""
    return quantity_of_option(text, ACCURACY, "--accuracy")


def chart_case(
    case: Path,
    out: Path,
    *,
    axes: Sequence[str] = (),
    overrides: Sequence[str] = (),
    quantities: Sequence[str] = (),
    accuracy: float = 0.01,
    loudness: Loudness = Loudness.NORMAL,
) -> Chart:
    """Run the ladders of ``axes``, by default of all that apply, in folders below ``out/runs``.

    The structural cache is in ``out`` too; a run that reads from it is charged the cost of the run
    that computed the result. ``quantities`` are dotted paths into ``summary.json``. Raises
    :class:`UserError` if an axis does not apply or a quantity does not exist.
    """
    base = (*overrides, *_plain(load_case(case, overrides), quantities))
    written, settings = load_case(case, base), axes_of(case, base, axes)
    jobs = _jobs(case, base, settings)
    folder = OutputFolder(out, KIND)
    _claim(folder, written)
    log = folder.reserve(LOG, "messages of the chart, with times")
    with (
        environment({CACHE: str((out / STRUCTURES).absolute())}),
        closing(Reporter(log, True, loudness=loudness)) as reporter,
        reporter.course("runs"),
    ):
        ended, left_out = _run(jobs, settings, out / RUNS, quantities, reporter)
    runs = _runs(ended)
    if not runs:
        raise MethodFailed(f"{out}: no rung ran: {ended[0].job.name}: {ended[0].error}")
    failed = {end.job.name: end.error for end in ended if end.summary is None}
    ladders = []
    for axis, of_axis in settings.items():
        rungs = [(setting.rung, jobs[setting.text].name) for setting in of_axis]
        ladders.append(_ladder(axis, rungs, runs, left_out | failed, written, quantities))
    return Chart(written.title, tuple(ladders), accuracy, complete=not failed)


def _plain(case: Case, quantities: Sequence[str]) -> Iterator[str]:
    """Yield overrides that switch off what no quantity needs, and that fix automatic settings."""
    yield from ("output.paraview=false", "output.figures=false")
    for entry, overrides in analysis_of(case).comparison.plain.items():
        if not any(f".{entry}." in path for path in quantities):
            yield from overrides
    if hasattr(case, "fidelity"):
        yield "fidelity=fixed"
        case = changed(case, {"fidelity": "fixed"})
    # Open settings are chosen once, for the case as written, and fixed on all rungs.
    _, record = analysis_of(case).choose(case)
    if record is not None:
        yield from overrides_of(record["chosen"])


def _claim(folder: OutputFolder, case: Case) -> None:
    """Prepare the folder; raise UserError if it contains anything but a chart."""
    folder.refuse_foreign()
    structures = folder.reserve(STRUCTURES, "what runs of the same structure share")
    if stored_run(folder.root / RUNS / BASELINE, case) != "finished":
        # The case as written runs first, and must compute its structure itself to measure its cost.
        for path in [] if structures.is_symlink() else cache_files(structures):
            path.unlink()


def _jobs(
    case: Path, base: Sequence[str], settings: Mapping[Approximation, list[Setting]]
) -> dict[str, Job]:
    """Return a job for each different case, by its text; the case's own settings come first."""
    baseline = Setting.of(case, base)
    jobs = {baseline.text: Job(BASELINE, case, tuple(base))}
    for axis, rungs in settings.items():
        for setting in rungs:
            words = "".join(c if c.isalnum() or c in "-." else " " for c in setting.rung.name)
            name = "-".join([axis.name, *words.split()])
            job = Job(name, case, (*base, *setting.rung.overrides))
            jobs.setdefault(setting.text, job)
    return jobs


def _run(
    jobs: Mapping[str, Job],
    settings: Mapping[Approximation, list[Setting]],
    out: Path,
    quantities: Sequence[str],
    reporter: Reporter,
) -> tuple[list[Finished], dict[str, str]]:
    """Return how the jobs ended, and by name why some were left out.

    The first run shows whether the ``quantities`` exist, before all others start.
    """
    progress = _Progress(jobs, reporter)
    baseline, *others = jobs.values()
    ended = run_jobs([baseline], out, alone=True, report=progress, running=progress.running)
    if (summary := ended[0].summary) is not None:
        _check(quantities, _measured(baseline.load(), ended[0].folder, summary))
    left_out = {}
    for setting in chain.from_iterable(settings.values()):
        if why := _too_long(setting, ended[0].summary or {}):
            name = jobs[setting.text].name
            left_out[name] = why
            progress.times.pop(name, None)
    others = [job for job in others if job.name not in left_out]
    ended += run_jobs(others, out, alone=True, report=progress, running=progress.running)
    return ended, left_out


def _too_long(setting: Setting, summary: Mapping[str, Any]) -> str:
    """Return why explicit steps would take too long, judged by the run of the case as written."""
    share, case = setting.rung.of_limit, setting.case
    limits = [limit for name in summary if (limit := number_at(summary, f"{name}.{LIMIT}"))]
    if share is None or not limits:
        return ""
    length = share * min(limits)
    steps = entry_at(case, "wear.cycles") / length
    return f"it would take {steps:.2g} steps of {length:.3g} cycles" if steps > MOST_STEPS else ""


class _Progress:
    """Reporter of each run as it ends, and of the remaining time.

    Runs are weighted by the estimates of their ``times``, which grow from rung to rung.
    """

    def __init__(self, jobs: Mapping[str, Job], reporter: Reporter) -> None:
        self._reporter, self._spent, self._ended = reporter, 0.0, 0
        self._total, self._last = len(jobs), time.perf_counter()
        cases = {job.name: job.load() for job in jobs.values()}
        self.times = {n: analysis_of(case).run_time(case).seconds for n, case in cases.items()}

    def running(self, names: Sequence[str]) -> None:
        """Report the names of the runs in progress."""
        self._reporter.doing(f"{self._ended} of {self._total}, now {', '.join(names)}")

    def __call__(self, finished: Finished) -> None:
        ending, own = f"failed: {finished.error}", 0.0
        if finished.summary is not None:
            own = sum(finished.summary.get("seconds", {}).values())
            ending = f"{own:.1f} s"
        name, now = finished.job.name, time.perf_counter()
        self._spent += self.times[name]
        self._ended += 1
        line = f"{self._ended}/{self._total} {name}: {ending}"
        self._reporter.say(line, always=finished.summary is None)
        at = f"{self._ended} of {self._total}"
        self._reporter.reached(self._spent / sum(self.times.values()), at)
        if now - self._last < KEPT * own:
            self._reporter.goes_on()
        self._last = now


def _runs(ended: Sequence[Finished]) -> dict[str, _Run]:
    """Return the finished runs, by the name of the job."""
    completed = [(end, end.job.load(), end.summary) for end in ended if end.summary is not None]
    cases, folders = [case for _, case, _ in completed], [end.folder for end, _, _ in completed]
    paid = costs(cases, folders, [summary for *_, summary in completed])
    return {
        end.job.name: _Run(end.folder, _measured(case, end.folder, summary), cost)
        for (end, case, summary), cost in zip(completed, paid, strict=True)
    }


def _measured(case: Case, folder: Path, summary: Mapping[str, Any]) -> Mapping[str, Any]:
    return analysis_of(case).comparison.measured(folder, summary)


def _check(quantities: Sequence[str], summary: Mapping[str, Any]) -> None:
    for path in quantities:
        value = number_at(summary, path)
        if not value:
            wrong = "no number there" if value is None else "0, and no error is relative to it"
            raise UserError(
                f"--quantity {path}: {wrong}; allowed: dotted paths to numbers of summary.json, "
                "such as states.-1.approach or intrados.depth_1"
            )


def _ladder(
    axis: Approximation,
    rungs: Sequence[tuple[Rung, str]],
    runs: Mapping[str, _Run],
    errors: Mapping[str, str],
    case: Case,
    picked: Sequence[str],
) -> Ladder:
    """Return the ladder of an axis, with its finished and its failed rungs, by names of runs."""
    failed = {rung.name: errors[name] for rung, name in rungs if name in errors}
    completed = [(rung, name) for rung, name in rungs if name in runs]
    if not completed:
        return Ladder(axis, (), {}, failed)
    last, comparison = runs[completed[-1][1]], analysis_of(case).comparison
    wanted = _quantities(axis, case, runs.get(BASELINE, last).summary, picked)
    points = []
    for rung, name in completed:
        run = runs[name]
        extras = _numbers(run.summary, comparison.extras(run.summary))
        extras |= comparison.apart(run.folder, last.folder, run.summary)
        values = _numbers(run.summary, wanted)
        points.append(Point(rung, name == BASELINE, name, values, run.cost, extras))
    exact = {entry.quantity: entry.value for entry in case.expect if entry.exact}
    return judge(axis, points, exact, failed, finest=rungs[-1][0].name)


def _quantities(
    axis: Approximation, case: Case, summary: Mapping[str, Any], picked: Sequence[str]
) -> list[str]:
    """Return the quantities by which the rungs of an axis are compared."""
    comparison = analysis_of(case).comparison
    if axis.sections:
        return comparison.sections(summary)
    # A relative error of a quantity that is 0 is not defined.
    by_default = [p for p in comparison.quantities(case, summary) if number_at(summary, p)]
    paths = list(picked) or by_default
    if axis.moves_states:
        paths = [p for p in paths if not FROM_THE_FIRST.match(p)] or list(comparison.at_the_end)
    return paths


def _numbers(summary: Mapping[str, Any], paths: Sequence[str]) -> dict[str, float]:
    """Return the numbers at the paths where there are any."""
    numbers = {path: number_at(summary, path) for path in paths}
    return {path: value for path, value in numbers.items() if value is not None}
