"""Figures of a run.

Each figure reads ``results.h5`` and nothing else; numbers in the titles come from the data. A
figure whose data a run does not have is left out. Images are 1200 pixels wide.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import h5py

from workflow.figures import contact, specimens, time, vibration, vibration_wear, wear
from workflow.figures.style import STYLE, save


def write_figures(results: Path, folder: Path, first: int = 0, every: int = 1) -> list[Path]:
    """Draw the figures of ``results`` (a ``results.h5``) as PNG files; returns their paths.

    ``every`` so many of them from the ``first`` on, so that several processes may share them.
    """
    import matplotlib

    folder.mkdir(parents=True, exist_ok=True)
    written = []
    with h5py.File(results) as file, matplotlib.rc_context(STYLE):
        kind = _kind(file)
        for name, draw in list(kind.figures_of(file).items())[first::every]:
            path = folder / f"{name}.png"
            save(draw(file), path)
            written.append(path)
    return written


def _kind(file: h5py.File) -> ModuleType:
    """The module that draws this kind of results."""
    if "worn" in file:
        return vibration_wear
    if "states" in file:
        return time
    if "responses" in file:
        return vibration
    if "specimens" in file:
        return specimens
    return contact if "history" in file else wear
