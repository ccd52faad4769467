"""Results in the folder of a finished run."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from workflow.case.sections import Case
from workflow.case.text.plain import aligned, counted
from workflow.case.text.readable import percent, readable
from workflow.interface.datasets import Group
from workflow.kinds import analysis_of, load_case
from workflow.report.writing import write_report
from workflow.runs.provenance import case_values
from workflow.shell.folders.folder import DIGESTS, OutputFolder
from workflow.shell.output.summary import required_number


def open(folder: str | os.PathLike[str]) -> Results:  # noqa: A001 - fretscale.open
    """Return the results in the folder of a finished run.

    Raises :class:`UserError` where the folder has no run of fretscale, an unfinished run, or
    results that were changed since the run.

    Examples
    --------
    >>> import fretscale
    >>> try:
    ...     fretscale.open("no/such/folder")
    ... except fretscale.UserError as error:
    ...     print(error)
    no/such/folder: no run of fretscale here (case.yaml is missing)
    """
    root = Path(folder)
    run = OutputFolder(root)
    run.check_ended()
    run.check_results(case_values(run))
    return Results(root.absolute(), run.read_summary())


class MainResult(NamedTuple):
    """Main result of a run: its name and ``value`` in a base ``unit``, and its estimated error.

    ``of`` is the part that the result belongs to, empty for the whole run, and ``name`` its name.
    ``error`` is relative, None where it is not known.

    Examples
    --------
    The applied load:

    >>> import fretscale, tempfile
    >>> coarse = fretscale.load_case(
    ...     "cases/sphere_normal.yaml",
    ...     contact__grid=[16, 16],
    ...     output__paraview=False,
    ...     output__figures=False,
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     first = fretscale.run(coarse, folder, quiet=True).main[0]
    >>> print(f"{first.name} = {first.value:.3f} {first.unit}, error {first.error}")
    normal force on body 2, P = 400.000 N, error None
    """

    of: str
    name: str
    value: float
    unit: str
    error: float | None


class MainResults(tuple[MainResult, ...]):
    """Main results of a run; printed, they are a table with units and estimated errors."""

    __slots__ = ()

    def __repr__(self) -> str:
        rows = [
            (
                f"  {result.name}",
                str(readable(result.value, result.unit, result.error)),
                "" if result.error is None else f"± {percent(result.error)}",
            )
            for result in self
        ]
        lines, group = [], ""
        for result, line in zip(self, aligned(rows), strict=True):
            lines += [result.of, line] if result.of != group else [line]
            group = result.of
        return "\n".join(lines)


class Results(Group):
    """Results of a run: numbers in ``summary``, and everything computed, by name.

    ``folder`` is the folder of the run, ``warnings`` are its warnings, and ``main`` are its main
    results with units and estimated errors. ``results["contact"]`` is a :class:`Group`,
    ``results["kinetics/cycles"]`` an ``xarray.DataArray``; ``tree()`` lists the contents.

    Examples
    --------
    On this coarse grid the largest pressure is within 1 % of Hertz's, 1450 MPa:

    >>> import fretscale, tempfile
    >>> coarse = fretscale.load_case(
    ...     "cases/sphere_normal.yaml",
    ...     contact__grid=[16, 16],
    ...     output__paraview=False,
    ...     output__figures=False,
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ball = fretscale.run(coarse, folder, quiet=True)
    ...     peak = {result.name: result.value for result in ball.main}["largest pressure"]
    ...     print(f"{ball.title}: {peak / 1450.33:.2f}", ball.warnings)
    Sphere pressed on a flat (Hertz): 0.99 []
    """

    def __init__(self, folder: Path, summary: dict[str, Any]) -> None:
        super().__init__(OutputFolder(folder).results)
        self.folder = folder
        self.summary = {name: value for name, value in summary.items() if name != DIGESTS}

    @property
    def title(self) -> str:
        """Title of the case."""
        return str(self.summary["title"])

    @property
    def warnings(self) -> list[str]:
        """Warnings of the run, each with its code at the end."""
        return list(self.summary["warnings"])

    @cached_property
    def case(self) -> Case:
        """Case as run; :class:`CaseError` is raised if a file that it names no longer exists."""
        return load_case(OutputFolder(self.folder).case)

    @property
    def main(self) -> MainResults:
        """Main results, as in the report and in ``fretscale compare``."""
        found = analysis_of(self.case).quantities(self.case, self.summary)
        return MainResults(
            MainResult(q.group, q.name, required_number(self.summary, q.path), q.unit, q.error)
            for q in found
        )

    def report(self, out: str | os.PathLike[str] | None = None) -> Path:
        """Write ``report.html`` again, into the folder or to a file ``out``; return its path."""
        return write_report(self.folder, None if out is None else Path(out))

    def __repr__(self) -> str:
        warned = f", {counted(len(self.warnings), 'warning')}" if self.warnings else ""
        return f"{self.title}\n  in {self.folder}{warned}\n  {', '.join(self)}; see tree()"
