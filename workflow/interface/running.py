"""A run of a case from a program."""

from __future__ import annotations

import hashlib
import os
import re
from pathlib import Path
from typing import Any

from workflow.case.sections import Case
from workflow.case.writing import dump_case
from workflow.interface.cases import AnyCase, load_case
from workflow.interface.results import Results
from workflow.interface.results import open as open_results
from workflow.kinds import kind_of
from workflow.runs.run import bring_to_end, kept_in, run_case
from workflow.shell.screen import Loudness
from workflow.shell.streams import hold_standard_streams

# Where runs go that are given no folder.
OUT = Path("out")
# Letters of the name of such a folder, before the digits that tell its case from others.
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
    """Compute a case, or find the results of it again.

    ``case`` and ``overrides`` are those of :func:`fretscale.load_case`. The folder ``out`` is by
    default one below ``out`` with a name made of the case and its values, the same for the same
    case. A finished run of this case that it holds is not computed again, one that was interrupted
    goes on from there; a run of another case is in the way. With ``force`` all that a run has
    written there gives way. What a run says goes to stderr, no more than warnings if ``quiet``, and
    into its log.

    Returns the results, which are read from the folder when they are asked for. Raises
    :class:`FretscaleError`; KeyboardInterrupt leaves a folder to go on from, by the same call or
    by ``fretscale resume``.

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
    ...     print(ball["history/P"])
    ...     print(f"{ball['history/P'][-1]:.1f}")
    history/P (increment 1) [N]: normal force on body 2
    400.0
    """
    hold_standard_streams()
    loaded = load_case(case, **overrides)
    folder = OUT / _name(case, loaded) if out is None else Path(out)
    loudness = Loudness.QUIET if quiet else Loudness.NORMAL
    if not force and kept_in(folder, loaded) in ("finished", "unfinished"):
        bring_to_end(loaded, folder, loudness=loudness)
    else:
        run_case(loaded, folder, force, loudness)
    return open_results(folder)


def _name(case: AnyCase, loaded: Case) -> str:
    """The name of a folder for a case, and for no other."""
    text = Path(case).stem if isinstance(case, str | os.PathLike) else loaded.title
    words = re.sub(r"\W+", "-", text.lower()).strip("-")[:LONGEST_NAME].strip("-")
    digits = hashlib.sha256(dump_case(loaded).encode("utf-8")).hexdigest()[:DIGITS]
    return f"{words or kind_of(loaded)}-{digits}"
