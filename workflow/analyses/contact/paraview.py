"""A contact run for ParaView: ``contact.pvd``, an image on the grid at every computed increment."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from sa_solver.types import Frame
from workflow.analyses.contact.datasets import BODIES
from workflow.pictures.vtk import Fields, Step, attach, cells, grid_image, write_series, write_xml
from workflow.shell.results import frame_of, grid_of


def write_contact(file: h5py.File, folder: Path) -> list[Path]:
    """Write images ``contact/<increment>.vti`` and their series; returns their paths.

    The series' times are the increments. A line contact has profiles, no images: nothing then.
    """
    grid, frame = grid_of(file["grid"][BODIES]), frame_of(file["grid"][BODIES])
    if grid.line:
        return []
    steps: list[Step] = []
    for name, state in file["contact"][BODIES].items():
        path = folder / "contact" / f"{name}.vti"
        image = grid_image(grid, frame)
        attach(image.cell_data, _fields(state, frame))
        write_xml(image, path)
        steps.append((float(state.attrs["increment"]), BODIES, path))
    return write_series(folder / "contact.pvd", steps)


def _fields(state: h5py.Group, frame: Frame) -> Fields:
    """Cell fields of one state, in the order in which an image counts its cells."""
    fields: Fields = {"pressure": (cells(state["pressure"]), "MPa")}
    for name, unit in (("shear", "MPa"), ("slip", "mm")):
        x, y = (cells(component) for component in state[name][()])
        fields[name] = frame.to_global(np.stack([x, y, np.zeros_like(x)], axis=1)), unit
        fields[f"{name}_x"], fields[f"{name}_y"] = (x, unit), (y, unit)
    return fields | {"gap": (cells(state["gap"]), "mm")}
