"""A run of specimens for ParaView: the pad as it wears, a time series for each normal force.

``load_<n>.pvd`` over the cycles, every step a mesh of the pad (``load_<n>/<state>.vtu``) with its
fields at the nodes; Warp By Scalar on ``worn_1`` or ``worn_2`` shows a body's worn shape.
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from workflow.pictures.vtk import Step, attach, write_series, write_xml
from workflow.shell.results import frame_of

FIELDS = ("pressure", "gap", "shear_x", "cycle_slip", "worn_1", "worn_2")


def write_specimens(file: h5py.File, folder: Path) -> list[Path]:
    """Write the pad's series of every normal force; returns the paths."""
    import pyvista

    pad, frame = file["specimens/pad"], frame_of(next(iter(file["grid"].values())))
    local = np.pad(pad["coordinates"][()], ((0, 0), (0, 1)))
    points = frame.to_global(local) + frame.origin
    triangles = pad["facets"][()]
    written: list[Path] = []
    for number, load in file["loads"].items():
        steps: list[Step] = []
        for name, state in load["states"].items():
            path = folder / f"load_{number}" / f"{name}.vtu"
            mesh = pyvista.UnstructuredGrid({pyvista.CellType.TRIANGLE: triangles}, points)
            attach(mesh.point_data, {n: (state[n][()], state[n].attrs["unit"]) for n in FIELDS})
            write_xml(mesh, path)
            steps.append((float(state.attrs["cycles"]), "pad", path))
        written += write_series(folder / f"load_{number}.pvd", steps)
    return written
