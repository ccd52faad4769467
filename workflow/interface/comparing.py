"""Comparison of finished runs in Python."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from workflow import comparing
from workflow.comparing.compared import ComparedQuantity
from workflow.comparing.showing import columns_of, text_of
from workflow.comparing.writing import write_comparison
from workflow.interface.results import Results

if TYPE_CHECKING:
    import pandas as pd

AnyRun = str | os.PathLike[str] | Results
"""Finished run: its folder, or its results."""


def compare(*runs: AnyRun) -> Comparison:
    """Compare two or more finished runs of one analysis; the first is the reference.

    Each run is a folder or the results of :func:`fretscale.run` or :func:`fretscale.open`. Raises
    :class:`UserError` for fewer than two runs, one given twice, a folder without a finished run,
    and runs of different analyses.

    Examples
    --------
    >>> import fretscale, tempfile
    >>> coarse = {
    ...     "contact__grid": [16, 16],
    ...     "output__paraview": False,
    ...     "output__figures": False,
    ... }
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for name, force in {"light": "200 N", "heavy": "400 N"}.items():
    ...         _ = fretscale.run(
    ...             "cases/sphere_normal.yaml",
    ...             f"{folder}/{name}",
    ...             quiet=True,
    ...             **coarse,
    ...             **{"load_path.legs.0.P": force},
    ...         )
    ...     balls = fretscale.compare(f"{folder}/light", f"{folder}/heavy")
    >>> balls.entries
    {'load_path.legs.0.P': ('200 N', '400 N')}
    >>> force = balls["normal force on body 2, P"]
    >>> [f"{value:.6g} {force.unit}" for value in force.values]
    ['200 N', '400 N']
    >>> f"{force.differences[1]:.2%}"
    '100.00%'
    """
    folders = [run.folder if isinstance(run, Results) else Path(run) for run in runs]
    return Comparison(comparing.compare(folders))


class ComparedResult(NamedTuple):
    """Main result in every run, in the base ``unit`` of the first run that has it.

    ``of`` is the part that the result belongs to, empty for the whole run, and ``name`` its name.
    ``values`` are None where a run has none. ``errors`` are estimates and ``differences`` are from
    the first run; both are relative, and None where not known. ``beyond`` is whether a difference
    exceeds both estimated errors, None where one of them is not known.

    Examples
    --------
    The approach of Hertz grows with P to the power 2/3, so by 0.59 for twice the load:

    >>> import fretscale, tempfile
    >>> coarse = fretscale.load_case(
    ...     "cases/sphere_normal.yaml",
    ...     contact__grid=[16, 16],
    ...     output__paraview=False,
    ...     output__figures=False,
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for name, force in {"light": "200 N", "heavy": "400 N"}.items():
    ...         more = {"load_path.legs.0.P": force}
    ...         _ = fretscale.run(coarse, f"{folder}/{name}", quiet=True, **more)
    ...     balls = fretscale.compare(f"{folder}/light", f"{folder}/heavy")
    >>> motion = balls["motion of the bodies towards each other"]
    >>> print(f"{motion.differences[1]:.3f} of {2.0 ** (2.0 / 3.0) - 1.0:.3f}")
    0.586 of 0.587
    """

    of: str
    name: str
    unit: str
    values: tuple[float | None, ...]
    errors: tuple[float | None, ...]
    differences: tuple[float | None, ...]
    beyond: tuple[bool | None, ...]


class Comparison:
    """Comparison of finished runs; printed, it is the text of ``fretscale compare``.

    ``names`` are the names of the runs and ``results`` the main results of all of them.
    ``comparison["depth"]`` is the result of that name, as is ``comparison["flank, depth"]``, with
    its part. ``entries`` has the differences of the cases as text, by dotted path.

    Examples
    --------
    Two loads on one ball:

    >>> import fretscale, tempfile
    >>> coarse = fretscale.load_case(
    ...     "cases/sphere_normal.yaml",
    ...     contact__grid=[16, 16],
    ...     output__paraview=False,
    ...     output__figures=False,
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for name, force in {"light": "200 N", "heavy": "400 N"}.items():
    ...         more = {"load_path.legs.0.P": force}
    ...         _ = fretscale.run(coarse, f"{folder}/{name}", quiet=True, **more)
    ...     balls = fretscale.compare(f"{folder}/light", f"{folder}/heavy")
    >>> print(balls.names, balls.entries, len(balls.results))
    ('light', 'heavy') {'load_path.legs.0.P': ('200 N', '400 N')} 9
    """

    def __init__(self, compared: comparing.ComparedRuns) -> None:
        self._compared = compared
        self.names: tuple[str, ...] = tuple(compared.names)
        self.results: tuple[ComparedResult, ...] = tuple(map(_result, compared.rows))
        self.entries: dict[str, tuple[str, ...]] = dict(compared.entries)

    def __getitem__(self, name: str) -> ComparedResult:
        found = [r for r in self.results if name in (r.name, f"{r.of}, {r.name}")]
        if len(found) == 1:
            return found[0]
        if found:
            raise KeyError(f"{name}: of several; allowed: {_listed(found, whole=True)}")
        raise KeyError(f"{name}: not there; allowed: {_listed(self.results)}")

    def pandas(self) -> pd.DataFrame:
        """Return the table of ``compare.csv``, a row for each result, indexed by part and name.

        Values are in base units; errors and differences are relative.
        """
        import pandas

        frame = pandas.DataFrame(columns_of(self._compared))
        return frame.set_index(["of", "quantity"])

    def report(self, out: str | os.PathLike[str], force: bool = False) -> Path:
        """Write ``compare.html``, ``compare.csv`` and curves into a folder ``out``.

        Returns the path of the page. Raises :class:`UserError` for a folder that has them already,
        unless ``force``, or that holds something else.
        """
        _, page = write_comparison(self._compared, Path(out), force)
        return page

    def __repr__(self) -> str:
        return text_of(self._compared)


def _listed(results: Sequence[ComparedResult], whole: bool = False) -> str:
    return "; ".join(dict.fromkeys(f"{r.of}, {r.name}" if whole else r.name for r in results))


def _result(row: ComparedQuantity) -> ComparedResult:
    runs = range(len(row.values))
    return ComparedResult(
        row.first.group,
        row.first.name,
        row.first.unit,
        row.values,
        row.errors,
        tuple(row.difference(run) for run in runs),
        tuple(row.beyond(run) for run in runs),
    )
