"""Runs of cases in Python."""

from __future__ import annotations

import hashlib
import os
import re
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.case.text.writing import dump_case
from workflow.interface.cases import AnyCase, load_case
from workflow.interface.results import Results
from workflow.interface.results import open as open_results
from workflow.kinds import kind_of
from workflow.runs.run import bring_to_end, run_case, stored_run
from workflow.shell.terminal.screen import Loudness
from workflow.shell.terminal.streams import hold_standard_streams

# Parent folder of runs for which no folder is given.
OUT = Path("out")
# Letters in the name of such a folder, before the hash digits that identify the case.
LONGEST_NAME = 40
DIGITS = 8


def run(
    case: AnyCase,
    /,
    out: str | os.PathLike[str] | None = None,
    *,
    force: bool = False,
    quiet: bool = False,
    **overrides: Any,
) -> Results:
    """Compute a case, or return its results if they exist already.

    ``case`` and ``overrides`` are the arguments of :func:`fretscale.load_case`. By default, results
    are written below the folder ``out``, in a folder named after the case and its values, so that
    the same case has the same folder. If the folder has a finished run of this case, nothing is
    computed; an interrupted run is resumed; a run of another case is an error. With ``force``, the
    files of an earlier run are replaced. Messages go to stderr, only warnings if ``quiet``, and to
    the log.

    Returns the results, which are read from the folder on demand. Raises :class:`FretscaleError`.
    After a KeyboardInterrupt, the same call or ``fretscale resume`` continues the run.

    Examples
    --------
    >>> import fretscale, tempfile
    >>> coarse = fretscale.load_case(
    ...     "cases/sphere_normal.yaml",
    ...     contact__grid=[32, 32],
    ...     output__paraview=False,
    ...     output__figures=False,
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ball = fretscale.run(coarse, folder, quiet=True)
    ...     force = ball["history/P"]
    >>> print(f"{force.long_name}: {float(force[-1]):.1f} {force.units}")
    normal force on body 2: 400.0 N
    """
    hold_standard_streams()
    loaded = load_case(case, **overrides)
    folder = OUT / _name(case, loaded) if out is None else Path(out)
    loudness = Loudness.QUIET if quiet else Loudness.NORMAL
    if not force and stored_run(folder, loaded) in ("finished", "unfinished"):
        bring_to_end(loaded, folder, loudness=loudness)
    else:
        run_case(loaded, folder, force, loudness)
    return open_results(folder)


def _name(case: AnyCase, loaded: Case) -> str:
    """Return the name of a folder for a case, different for every case."""
    text = Path(case).stem if isinstance(case, str | os.PathLike) else loaded.title
    words = re.sub(r"\W+", "-", text.lower()).strip("-")[:LONGEST_NAME].strip("-")
    digits = hashlib.sha256(dump_case(loaded).encode("utf-8")).hexdigest()[:DIGITS]
    return f"{words or kind_of(loaded)}-{digits}"
