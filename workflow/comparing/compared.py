"""Data of a comparison: common quantities of finished runs, and differences of their cases."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os.path import commonpath
from pathlib import Path
from typing import Any

from workflow.case.sections import ASIDE
from workflow.case.text.leaves import leaves_of
from workflow.case.text.readable import suited_unit
from workflow.errors import UserError
from workflow.kinds import analysis_of
from workflow.report.run_page import ReportData
from workflow.report.writing import report_data_of
from workflow.shell.analysis import Analysis
from workflow.shell.output.quantities import SummaryQuantity
from workflow.shell.output.summary import required_number

NOTHING = "–"


@dataclass(frozen=True)
class ComparedRun:
    """Run with the name that distinguishes it from the others."""

    name: str
    folder: Path
    run: ReportData


@dataclass(frozen=True)
class ComparedQuantity:
    """Quantity in every run with its value, None where a run has none.

    All values have the same base unit. The first run is the reference for the others.
    """

    quantities: tuple[SummaryQuantity | None, ...]
    values: tuple[float | None, ...]

    @property
    def first(self) -> SummaryQuantity:
        return next(quantity for quantity in self.quantities if quantity is not None)

    @property
    def everyday(self) -> str:
        """Unit in which the row is shown: that of the largest value."""
        largest = max(abs(value) for value in self.values if value is not None)
        return self.first.everyday or suited_unit(largest, self.first.unit)

    @property
    def errors(self) -> tuple[float | None, ...]:
        """Estimated relative errors; None where they are not known."""
        return tuple(q.error if q is not None else None for q in self.quantities)

    def difference(self, number: int) -> float | None:
        """Return the relative difference of a run from the first one; None if there is none."""
        first, value = self.values[0], self.values[number]
        if number == 0 or first is None or value is None:
            return None
        if value == first:
            return 0.0
        return (value - first) / abs(first) if first else math.inf

    def beyond(self, number: int) -> bool | None:
        """Return whether the difference exceeds both estimated errors; None if one is not known."""
        first, value = self.values[0], self.values[number]
        one, other = self.errors[0], self.errors[number]
        if number == 0 or first is None or value is None or one is None or other is None:
            return None
        return abs(value - first) > one * abs(first) + other * abs(value)


@dataclass(frozen=True)
class ComparedRuns:
    """Runs of one analysis, their main results, and entries in which their cases differ.

    ``entries`` are texts, one for every run, by dotted path.
    """

    analysis: Analysis[Any]
    runs: tuple[ComparedRun, ...]
    rows: tuple[ComparedQuantity, ...]
    entries: Mapping[str, tuple[str, ...]]

    @property
    def names(self) -> list[str]:
        return [run.name for run in self.runs]


def compare(folders: Sequence[str | Path]) -> ComparedRuns:
    """Compare the finished runs in two or more folders, all of one analysis.

    Raises UserError for folders without a finished run, changed results, and other analyses.
    """
    paths = [Path(folder) for folder in folders]
    if len({path.resolve() for path in paths}) < max(len(paths), 2):
        raise UserError("compare: two or more folders of finished runs are needed, each once")
    reported = [report_data_of(path, figures=False) for path in paths]
    names = _names(paths)
    runs = tuple(map(ComparedRun, names, paths, reported))
    first, analysis = reported[0], analysis_of(reported[0].case)
    for run in runs[1:]:
        if analysis_of(run.run.case) is not analysis:
            raise UserError(
                f"{run.folder}: a run of a {run.run.kind} case, but that in {paths[0]} is of a "
                f"{first.kind} case; allowed: {', '.join(analysis.cases)}"
            )
    return ComparedRuns(analysis, runs, _rows(analysis, reported), _entries(reported))


def _names(paths: Sequence[Path]) -> list[str]:
    """Return the last parts of the paths, as many as distinguish them."""
    whole = [path.resolve() for path in paths]
    if len({path.name for path in whole}) == len(whole):
        return [path.name for path in whole]
    above = Path(commonpath(whole))
    return [path.relative_to(above).as_posix() for path in whole]


def _rows(analysis: Analysis[Any], runs: Sequence[ReportData]) -> tuple[ComparedQuantity, ...]:
    """Return quantities of all runs by group, name and unit, in the order of the first run.

    In a line contact and in one over an area, a name may have different units, and so two rows.
    """
    of_runs = [
        {(q.group, q.name, q.unit): q for q in analysis.quantities(run.case, run.summary)}
        for run in runs
    ]
    keys = dict.fromkeys(key for of_run in of_runs for key in of_run)
    groups = list(dict.fromkeys(group for group, _, _ in keys))
    names = list(dict.fromkeys(key[:2] for key in keys))
    rows = []
    for key in sorted(keys, key=lambda key: (groups.index(key[0]), names.index(key[:2]))):
        quantities = tuple(of_run.get(key) for of_run in of_runs)
        values = tuple(
            None if quantity is None else required_number(run.summary, quantity.path)
            for quantity, run in zip(quantities, runs, strict=True)
        )
        rows.append(ComparedQuantity(quantities, values))
    return tuple(rows)


def _entries(runs: Sequence[ReportData]) -> dict[str, tuple[str, ...]]:
    """Return the entries in which the cases differ, as text."""
    leaves = [{leaf.path: leaf for leaf in leaves_of(run.case)} for run in runs]
    paths = dict.fromkeys(path for of_run in leaves for path in of_run)
    entries = {}
    for path in paths:
        if path.partition(".")[0] in ASIDE:
            continue
        found = [of_run.get(path) for of_run in leaves]
        if any(leaf is None or found[0] is None or leaf.value != found[0].value for leaf in found):
            # Show all digits where rounded texts are equal.
            exact = len({None if leaf is None else leaf.text for leaf in found}) == 1
            entries[path] = tuple(
                NOTHING if leaf is None else str(leaf.value) if exact else leaf.text
                for leaf in found
            )
    return entries
