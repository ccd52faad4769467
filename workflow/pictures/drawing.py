"""Pictures of a run: figures, and files for ParaView.

Each figure reads ``results.h5`` and nothing else; numbers in the titles come from the data. Images
are 1200 pixels wide.

In files for ParaView lengths are in mm, stresses in MPa; each array carries its unit. ``shear`` and
``slip`` are global vectors, so that glyphs point the right way; those with an axis at the end of
their names are components in the interface frame. Fields are single precision, which halves the
files: the doubles are in ``results.h5``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py

from workflow.case.sections import Output
from workflow.pictures.style import STYLE, save
from workflow.shell.analysis import Pictures
from workflow.shell.folder import OutputFolder
from workflow.shell.processes import side_by_side

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_pictures(output: Output, folder: OutputFolder, pictures: Pictures) -> None:
    """Write the pictures of the results in a folder that a case asks for in its ``output``."""
    results, figures_of, paraview_of = folder.results, pictures.figures_of, pictures.paraview_of
    jobs: list[tuple[Callable[..., Any], tuple[Any, ...]]] = []
    if output.paraview and paraview_of is not None:
        files = folder.reserve("paraview", "files for ParaView")
        jobs.append((write_paraview, (paraview_of, results, files)))
    if output.figures:
        parts = max(pictures.processes, 1)
        figures = folder.reserve("figures", "figures of the results")
        shares = [(figures_of, results, figures, part, parts) for part in range(parts)]
        jobs += [(write_figures, share) for share in shares]
    if pictures.processes:
        side_by_side(jobs)
        return
    for write, arguments in jobs:
        write(*arguments)


def write_paraview(
    paraview_of: Callable[[h5py.File, Path], list[Path]], results: Path, folder: Path
) -> list[Path]:
    """Write the files that show ``results`` in ParaView; returns their paths.

    Every file appears under its name only when it is complete.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with h5py.File(results) as file:
        return paraview_of(file, folder)


def write_figures(
    figures_of: Callable[[h5py.File], Mapping[str, Callable[[h5py.File], Figure]]],
    results: Path,
    folder: Path,
    first: int = 0,
    every: int = 1,
) -> list[Path]:
    """Draw the figures of ``results`` (a ``results.h5``) as PNG files; returns their paths.

    ``every`` so many of them from the ``first`` on, so that several processes may share them.
    """
    import matplotlib

    folder.mkdir(parents=True, exist_ok=True)
    written = []
    with h5py.File(results) as file, matplotlib.rc_context(STYLE):
        for name, draw in list(figures_of(file).items())[first::every]:
            path = folder / f"{name}.png"
            save(draw(file), path)
            written.append(path)
    return written
