"""ParaView files of a run of specimens: the pad as it wears, a series for each normal force.

``load_<n>.pvd`` is over the cycles. Every step is a mesh of the pad (``load_<n>/<state>.vtu``) with
its fields at the nodes. Warp By Vector on ``worn_1`` or ``worn_2`` shows a body's worn shape.
``view.py`` shows the first force.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from workflow.pictures.view import FIRST, PictureScene, Shown, View, write_view
from workflow.pictures.vtk import CYCLES, Fields, Step, attach, write_series
from workflow.shell.output.results import frame_of

FIELDS = {
    "pressure": "pressure",
    "gap": "gap",
    "shear_x": "face_shear_x",
    "cycle_slip": "cycle_slip",
    "worn_1": "depth_1",
    "worn_2": "depth_2",
}
# Sign along the normal of the motion of each surface by wear.
INTO_BODY = {1: -1.0, 2: 1.0}


def write_specimens(_: None, file: h5py.File, folder: Path) -> list[Path]:
    """Write the pad's series of every normal force, and the script; return the paths."""
    written: list[Path] = []
    for number, load in file["loads"].items():
        steps = _steps(file, load, folder / f"load_{number}")
        written += write_series(folder / f"load_{number}.pvd", CYCLES, steps)
    return [*written, _write_view(file, folder)]


def _steps(file: h5py.File, load: h5py.Group, folder: Path) -> Iterator[Step]:
    import pyvista

    pad, frame = file["specimens/pad"], frame_of(file["grid/pad"])
    local = np.pad(pad["coordinates"][()], ((0, 0), (0, 1)))
    points, triangles = frame.to_global(local) + frame.origin, pad["facets"][()]
    for name, state in load["states"].items():
        mesh = pyvista.UnstructuredGrid({pyvista.CellType.TRIANGLE: triangles}, points)
        fields: Fields = {
            shown: (state[key][()], str(state[key].attrs["unit"])) for key, shown in FIELDS.items()
        }
        for body, into in INTO_BODY.items():
            worn = into * state[f"worn_{body}"][()]
            fields[f"worn_{body}"] = np.outer(worn, frame.axes[2]), "mm"
        fields["area"] = pad["area"][()], "mm^2"
        attach(mesh.point_data, fields)
        yield float(state.attrs["cycles"]), "pad", folder / f"{name}.vtu", mesh


def _write_view(file: h5py.File, folder: Path) -> Path:
    """Write the script that shows the first normal force, and return its path."""
    number, load = next(iter(file["loads"].items()))
    series = f"load_{number}.pvd"
    states = load["states"].values()
    last = max(float(state.attrs["cycles"]) for state in states)
    views = [
        View("Worn shape of body 1", [Shown(series, "depth_1 [mm]", "worn_1 [mm]")]),
        View("Worn shape of body 2", [Shown(series, "depth_2 [mm]", "worn_2 [mm]")]),
        View("Contact pressure", [Shown(series, "pressure [MPa]")]),
        View("Slip in a cycle", [Shown(series, "cycle_slip [mm]")]),
    ]
    scene = PictureScene(str(file.attrs["title"]), CYCLES, last, views)
    return write_view(scene, folder / FIRST)
