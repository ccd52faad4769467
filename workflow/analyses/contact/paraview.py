"""A contact run for ParaView: ``contact.pvd``, an image on the grid at every computed increment."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py

from workflow.analyses.contact.datasets import BODIES, Contents
from workflow.pictures.vtk import Step, attach, cells, grid_image, traction_fields, write_series
from workflow.shell.results import frame_of, grid_of


def write_contact(contents: Contents, file: h5py.File, folder: Path) -> list[Path]:
    """Write images ``contact/<increment>.vti`` and their series; returns their paths.

    The series' times are the increments. A line contact has profiles, no images: nothing then.
    """
    return [] if contents.line else write_series(folder / "contact.pvd", _images(file, folder))


def _images(file: h5py.File, folder: Path) -> Iterator[Step]:
    grid, frame = grid_of(file["grid"][BODIES]), frame_of(file["grid"][BODIES])
    for name, state in file["contact"][BODIES].items():
        image = grid_image(grid, frame)
        fields = traction_fields(state, frame) | {"gap": (cells(state["gap"]), "mm")}
        attach(image.cell_data, fields)
        yield float(state.attrs["increment"]), BODIES, folder / "contact" / f"{name}.vti", image
