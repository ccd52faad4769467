"""The results in the folder of a finished run."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.errors import UserError
from workflow.interface.datasets import File, Group
from workflow.kinds import load_case
from workflow.runs.provenance import case_values
from workflow.shell.folder import DIGESTS, OutputFolder


def open(folder: str | os.PathLike[str]) -> Results:  # noqa: A001 - fretscale.open
    """The results in the folder of a finished run.

    Raises :class:`UserError` where the folder has no run of fretscale, one that is not finished, or
    one whose results are not as it has left them.

    >>> import fretscale
    >>> try:
    ...     fretscale.open("no/such/folder")
    ... except fretscale.UserError as error:
    ...     print(error)
    no/such/folder: no run of fretscale here (case.yaml is missing)
    """
    root = Path(folder)
    run = OutputFolder(root)
    if not run.case.exists():
        raise UserError(f"{root}: no run of fretscale here (case.yaml is missing)")
    if not run.summary.exists():
        raise UserError(
            f"{root}: this run is not finished; continue it with `fretscale resume {root}`"
        )
    run.check_results(case_values(run))
    return Results(root.absolute(), run.read_summary())


class Results(Group):
    """The results of a run: ``summary`` has the numbers, names lead to all that was computed.

    ``folder`` is where it lies, ``warnings`` what the run has warned of. ``results["contact"]`` is
    a :class:`Group`, ``results["kinetics/cycles"]`` are :class:`Values`; :meth:`tree` tells what
    there is.
    """

    def __init__(self, folder: Path, summary: dict[str, Any]) -> None:
        super().__init__(File.at(OutputFolder(folder).results))
        self.folder = folder
        self.summary = {name: value for name, value in summary.items() if name != DIGESTS}

    @property
    def title(self) -> str:
        """Of the case."""
        return str(self.summary["title"])

    @property
    def warnings(self) -> list[str]:
        """What the run has warned of."""
        return list(self.summary["warnings"])

    @cached_property
    def case(self) -> Case:
        """The case as run. Raises :class:`CaseError` where a file that it names has gone."""
        return load_case(OutputFolder(self.folder).case)

    def __repr__(self) -> str:
        warned = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"{self.title}\n  in {self.folder}{warned}\n  {', '.join(self)}; see tree()"
