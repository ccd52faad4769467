"""A run of specimens for ParaView: the pad as it wears, a time series for each normal force.

``load_<n>.pvd`` over the cycles, every step a mesh of the pad (``load_<n>/<state>.vtu``) with its
fields at the nodes; Warp By Scalar on ``worn_1`` or ``worn_2`` shows a body's worn shape.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from workflow.pictures.vtk import Step, attach, write_series
from workflow.shell.results import frame_of

FIELDS = ("pressure", "gap", "shear_x", "cycle_slip", "worn_1", "worn_2")


def write_specimens(_: None, file: h5py.File, folder: Path) -> list[Path]:
    """Write the pad's series of every normal force; returns the paths."""
    written: list[Path] = []
    for number, load in file["loads"].items():
        steps = _steps(file, load, folder / f"load_{number}")
        written += write_series(folder / f"load_{number}.pvd", steps)
    return written


def _steps(file: h5py.File, load: h5py.Group, folder: Path) -> Iterator[Step]:
    import pyvista

    pad, frame = file["specimens/pad"], frame_of(file["grid/pad"])
    local = np.pad(pad["coordinates"][()], ((0, 0), (0, 1)))
    points, triangles = frame.to_global(local) + frame.origin, pad["facets"][()]
    for name, state in load["states"].items():
        mesh = pyvista.UnstructuredGrid({pyvista.CellType.TRIANGLE: triangles}, points)
        attach(mesh.point_data, {n: (state[n][()], state[n].attrs["unit"]) for n in FIELDS})
        yield float(state.attrs["cycles"]), "pad", folder / f"{name}.vtu", mesh
