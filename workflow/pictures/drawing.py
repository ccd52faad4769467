"""Pictures of a run: figures, and files for ParaView.

Each picture is given the contents of the results and reads only ``results.h5``: numbers in the
titles come from the data. A missing dataset is an error. Images are 1200 pixels wide.

In files for ParaView the name of every array ends with its unit, as in ``pressure [MPa]``. All
lengths, including worn depths, are in mm, so that Warp By Vector with a factor of 1 is true to
scale. Vectors and stresses have components along the global axes, so that glyphs point the right
way; the exception are arrays whose names begin with ``face_``, which have components along the axes
of the contact face. Unknown values are left out instead of drawn as NaN. Fields have single
precision, which halves the size of the files; ``results.h5`` has double precision.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import h5py

from fe_models.interpreter import attempt
from sa_solver.types import Progress, Tally, unseen
from workflow.case.sections import Output
from workflow.shell.analysis import Pictures, Share
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.isolation import Isolation
from workflow.shell.processes import Task, WorkerProcess, share_out


def write_pictures(
    output: Output,
    folder: OutputFolder,
    pictures: Callable[[], Pictures],
    contents: Any,
    isolated: Isolation,
    worker: WorkerProcess | None = None,
    share: Share = "pictures",
    progress: Progress = unseen,
) -> dict[str, str]:
    """Write the pictures of the results in a folder that a case asks for in its ``output``.

    ``contents`` describes the results for ``pictures``. Each picture is ``isolated`` from the
    others and from the run, so that one that fails is left out. A worker process ``worker`` this
    one does a ``share`` of the work, and ``progress`` is called with what is done. Returns the
    figures for the report, if the case asks for one: SVG texts by their names, in the order of
    presentation.
    """
    formats, reported = output.figure_formats, (pictures, contents, folder.results)
    names = tuple(pictures().figures_of(contents)) if formats else ()
    with ExitStack() as stack:
        tasks: list[Task] = []
        if formats:
            figures = stack.enter_context(folder.filling("figures", "figures of the results"))
            tasks += [
                (_write_figure, (*reported, figures, n, formats, output.report)) for n in names
            ]
        if output.paraview:
            paraview = stack.enter_context(folder.filling("paraview", "files for ParaView"))
            tasks.append((write_paraview, (*reported, paraview)))
        there = worker if share != "nothing" else None
        own = len(names) if share == "files" else 0
        attempts: list[Task] = [(attempt, task) for task in tasks]
        written = share_out(attempts, there, Tally(progress, len(tasks)), own)
    drawn: dict[str, str] = {}
    for name, answer in zip((*names, "paraview"), written, strict=False):
        with isolated(name if name == "paraview" else f"figures/{name}"):
            if isinstance(answer, Exception):
                raise answer
            drawn[name] = answer
    return {name: drawn[name] for name in names if name in drawn} if output.report else {}


def load_what_draws(pictures: Callable[[], Pictures], output: Output, share: Share) -> None:
    """Import the plotting libraries in advance, which takes two seconds."""
    pictures()
    if share == "pictures":
        from workflow.pictures import style  # noqa: F401
    if output.paraview:
        import pyvista  # noqa: F401


def _write_figure(
    pictures: Callable[[], Pictures],
    contents: Any,
    results: Path,
    folder: Path,
    name: str,
    formats: Sequence[str],
    keep: bool,
) -> str:
    """Write one figure, and return it as SVG if ``keep`` is true."""
    vectors: dict[str, str] = {}
    write_figures(pictures, contents, results, folder, [name], formats, vectors if keep else None)
    return vectors.get(name, "")


def write_paraview(
    pictures: Callable[[], Pictures], contents: Any, results: Path, folder: Path
) -> list[Path]:
    """Write the files that show ``results`` in ParaView; return their paths.

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
    names: Sequence[str] | None = None,
    formats: Sequence[str] = ("png",),
    vectors: dict[str, str] | None = None,
) -> list[Path]:
    """Draw the figures of ``results`` (a ``results.h5``) as files; return their paths.

    Only the figures named in ``names`` are drawn, or all by default. For ``formats`` and
    ``vectors`` see :func:`workflow.pictures.style.write_figures`.
    """
    # Imported here because the plotting library takes a second to load.
    from workflow.pictures import style

    figures = pictures().figures_of(contents)
    with h5py.File(results) as file:
        drawn = [(name, partial(figures[name], file)) for name in names or figures]
        return style.write_figures(drawn, folder, formats, vectors)


def vector_figures(
    pictures: Callable[[], Pictures], contents: Any, results: Path
) -> dict[str, str]:
    """Return the figures of ``results`` as SVG texts by their names, without writing files."""
    vectors: dict[str, str] = {}
    write_figures(pictures, contents, results, results.parent, formats=(), vectors=vectors)
    return vectors
