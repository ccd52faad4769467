"""Pictures of a run: figures, and files for ParaView.

Each is told what the results hold, and reads ``results.h5`` and nothing else: numbers in the titles
come from the data. A dataset that should be there and is not is an error. Images are 1200 pixels
wide.

In files for ParaView the name of every array ends in its unit, as ``pressure [MPa]``. All lengths
are in mm, worn depths too, so that Warp By Vector with a factor of 1 is true to scale. Vectors and
stresses have components along the global axes, so that glyphs point the right way, but for those
whose names begin with ``face_``: these are along the axes of the contact face. What is not known is
left out, not drawn as NaN. Fields are single precision, which halves the files: the doubles are in
``results.h5``.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import h5py

from sa_solver.types import Progress, Tally, unseen
from workflow.case.sections import Output
from workflow.shell.analysis import Pictures
from workflow.shell.folder import OutputFolder
from workflow.shell.processes import Beside, side_by_side


def write_pictures(
    output: Output,
    folder: OutputFolder,
    pictures: Callable[[], Pictures],
    contents: Any,
    team: Sequence[Beside] = (),
    progress: Progress = unseen,
) -> dict[str, str]:
    """Write the pictures of the results in a folder that a case asks for in its ``output``.

    ``contents`` is what the results hold, as ``pictures`` are told it. The processes of a ``team``
    and this one share them, and tell ``progress`` what is done. Returns the figures as
    SVG texts by their names, in the order in which they are to be looked at, if they are to go into
    a report.
    """
    formats = output.figure_formats
    with ExitStack() as stack:
        paraview = figures = None
        if output.paraview:
            paraview = stack.enter_context(folder.filling("paraview", "files for ParaView"))
        if formats:
            figures = stack.enter_context(folder.filling("figures", "figures of the results"))
        drawn = pictures, contents, folder.results, figures, formats, output.report
        parts = 1 + len(team) if formats else 1
        # The last one has files for ParaView to write besides.
        beside = [None] * (parts - 1) + [paraview]
        order = tuple(pictures().figures_of(contents))
        wanted = len(order) if formats else 0
        shares = side_by_side(
            [(_write_share, (*drawn, also, part, parts)) for part, also in enumerate(beside)],
            Tally(progress, wanted + (paraview is not None)),
            team,
        )
    vectors = {name: text for share in shares for name, text in share.items()}
    return {name: vectors[name] for name in order if name in vectors}


def load_what_draws(pictures: Callable[[], Pictures]) -> None:
    """Do beforehand what a process begins to draw with: a second and more of imports."""
    from workflow.pictures import style  # noqa: F401

    pictures()


def _write_share(
    pictures: Callable[[], Pictures],
    contents: Any,
    results: Path,
    figures: Path | None,
    formats: Sequence[str],
    keep: bool,
    paraview: Path | None,
    first: int,
    every: int,
) -> Generator[None, None, dict[str, str]]:
    """What one process draws, into the folders that there are; the figures to ``keep``, as SVG.

    Yields after each figure, and after the files for ParaView.
    """
    vectors: dict[str, str] = {}
    if figures is not None:
        kept = vectors if keep else None
        share = pictures, contents, results, figures, first, every, formats, kept
        for _ in _each_written(*share):
            yield
    if paraview is not None:
        write_paraview(pictures, contents, results, paraview)
        yield
    return vectors


def write_paraview(
    pictures: Callable[[], Pictures], contents: Any, results: Path, folder: Path
) -> list[Path]:
    """Write the files that show ``results`` in ParaView; returns their paths.

    Every file appears under its name only when it is complete.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write = pictures().write_paraview
    assert write is not None, "output.paraview of a case without fields"
    with h5py.File(results) as file:
        return write(contents, file, folder)


def write_figures(
    pictures: Callable[[], Pictures],
    contents: Any,
    results: Path,
    folder: Path,
    first: int = 0,
    every: int = 1,
    formats: Sequence[str] = ("png",),
    vectors: dict[str, str] | None = None,
) -> list[Path]:
    """Draw the figures of ``results`` (a ``results.h5``) as files; returns their paths.

    ``every`` so many of them from the ``first`` on, so that several processes may share them. For
    ``formats`` and ``vectors`` see :func:`workflow.pictures.style.write_figures`.
    """
    share = pictures, contents, results, folder, first, every, formats, vectors
    return [path for paths in _each_written(*share) for path in paths]


def _each_written(
    pictures: Callable[[], Pictures],
    contents: Any,
    results: Path,
    folder: Path,
    first: int,
    every: int,
    formats: Sequence[str],
    vectors: dict[str, str] | None,
) -> Iterator[list[Path]]:
    """As :func:`write_figures`: the paths of each figure once it is written."""
    # Plots take a second to load: where they are drawn.
    from workflow.pictures import style

    chosen = islice(pictures().figures_of(contents).items(), first, None, every)
    with h5py.File(results) as file:
        drawn = ((name, partial(draw, file)) for name, draw in chosen)
        yield from style.each_written(drawn, folder, formats, vectors)


def vector_figures(
    pictures: Callable[[], Pictures], contents: Any, results: Path
) -> dict[str, str]:
    """The figures of ``results`` as SVG texts by their names; nothing is written."""
    vectors: dict[str, str] = {}
    write_figures(pictures, contents, results, results.parent, formats=(), vectors=vectors)
    return vectors
