"""A wear run for ParaView: faces as they wear, the structure before and after, worn surfaces.

Written into one folder:

- ``<interface>.pvd``: time series over the cycles; every step is an image on the contact grid
  (``<interface>/<jump>.vti``), turned and moved to the face's place in the structure;
- ``section_<interface>.pvd``: stress in a plane through both bodies under the contact, unworn and
  worn (``section/<interface>_<state>_<body>.vts``);
- ``structure.pvd``: all bodies at peak load, unworn at 0 and worn at the last computed number of
  cycles (``structure/<body>_<state>.vtu``); Warp By Vector on ``displacement`` deforms them;
- ``flank_<interface>_<body>.stl``: the worn surfaces at true scale in global coordinates, but for
  line contacts.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from sa_solver.types import Frame, Grid
from workflow.analyses.wear.body_mesh import body_mesh
from workflow.analyses.wear.layout import body_names, jump_names
from workflow.analyses.wear.paraview.subsurface import life_fields, write_sections
from workflow.pictures.vtk import (
    Fields,
    Step,
    attach,
    cells,
    grid_image,
    write_series,
    write_stl,
    write_xml,
)
from workflow.shell.results import frame_of, grid_of

if TYPE_CHECKING:
    import pyvista

UNWORN = "00000"


def write_wear(file: h5py.File, folder: Path) -> list[Path]:
    """Write the files that show a wear run; returns their paths."""
    written: list[Path] = []
    for interface in file["grid"]:
        written += _write_face(file, interface, folder)
        written += write_sections(file, interface, _placement(file, interface)[1], folder)
        if not grid_of(file["grid"][interface]).line:
            written += _write_worn_surfaces(file, interface, folder)
    if "bodies" in file:
        written += _write_structure(file, folder)
    return written


# --- faces --------------------------------------------------------------------------------------


def _write_face(file: h5py.File, interface: str, folder: Path) -> list[Path]:
    """Images of one face, one per jump, and the series that lists them."""
    grid, frame = _placement(file, interface)
    steps: list[Step] = []
    for jump in jump_names(file, interface):
        path = folder / interface / f"{jump}.vti"
        image = grid_image(grid, frame)
        attach(image.cell_data, _face_fields(file, interface, jump, frame))
        write_xml(image, path)
        steps.append((float(file["contact"][interface][jump].attrs["cycles"]), interface, path))
    return write_series(folder / f"{interface}.pvd", steps)


def _face_fields(file: h5py.File, interface: str, jump: str, frame: Frame) -> Fields:
    """Cell fields of one jump, in the order in which an image counts its cells."""
    contact = file["contact"][interface][jump]
    fields: Fields = {"pressure": (cells(contact["pressure"]), "MPa")}
    for name, unit in (("shear", "MPa"), ("slip", "mm")):
        x, y = (cells(component) for component in contact[name][()])
        fields[name] = frame.to_global(np.stack([x, y, np.zeros_like(x)], axis=1)), unit
        fields[f"{name}_x"], fields[f"{name}_y"] = (x, unit), (y, unit)
    fields |= _surface_fields(file["surfaces"][interface], jump)
    return fields | life_fields(file, interface, jump)


def _surface_fields(surfaces: h5py.Group, jump: str) -> Fields:
    """Heights and wear depths of both bodies, and the depths' sum."""
    fields: Fields = {}
    for body in (1, 2):
        height = cells(surfaces[jump][f"body_{body}"])
        unworn = cells(surfaces[UNWORN][f"body_{body}"])
        fields[f"height_{body}"] = height, "mm"
        fields[f"wear_depth_{body}"] = np.abs(height - unworn), "mm"
    total = sum(fields[f"wear_depth_{body}"][0] for body in (1, 2))
    return fields | {"wear_depth": (np.asarray(total), "mm")}


def _placement(file: h5py.File, interface: str) -> tuple[Grid, Frame]:
    """Grid and frame of an interface."""
    group = file["grid"][interface]
    return grid_of(group), frame_of(group)


# --- worn surfaces ------------------------------------------------------------------------------


def _write_worn_surfaces(file: h5py.File, interface: str, folder: Path) -> list[Path]:
    """STL of both worn surfaces of one face, for CAD and meshers.

    Vertices are the centres of the grid cells that lie on the FE contact face, rounding included:
    what the grid has beyond it is no part of the bodies. Normals point out of the body. An STL
    file holds single precision: about 1e-5 mm at 250 mm from the origin.
    """
    import pyvista

    grid, frame = _placement(file, interface)
    rows, columns = _face_window(file, interface, grid)
    last = jump_names(file, interface)[-1]
    written = []
    for body, name in body_names(file).items():
        height = file["surfaces"][interface][last][f"body_{body}"][()]
        x, y, z = np.broadcast_arrays(grid.x, grid.y, height)
        local = np.stack([field[rows, columns] for field in (x, y, z)], axis=-1)
        triangles = _triangles(local.shape[0], local.shape[1])
        if body == 2:
            triangles = triangles[:, ::-1]
        points = frame.to_global(local.reshape(-1, 3)) + frame.origin
        path = folder / f"flank_{interface}_{name}.stl"
        write_stl(pyvista.PolyData.from_regular_faces(points, triangles), path)
        written.append(path)
    return written


def _face_window(file: h5py.File, interface: str, grid: Grid) -> tuple[slice, slice]:
    """Rows and columns of the grid whose centres lie on the FE face; all without an FE face."""
    face = file.get(f"structure/{interface}/coordinates")
    if face is None:
        return slice(None), slice(None)
    low, high = np.min(face, axis=0), np.max(face, axis=0)
    inside_x = np.flatnonzero((grid.x.ravel() >= low[0]) & (grid.x.ravel() <= high[0]))
    inside_y = np.flatnonzero((grid.y.ravel() >= low[1]) & (grid.y.ravel() <= high[1]))
    return slice(inside_x[0], inside_x[-1] + 1), slice(inside_y[0], inside_y[-1] + 1)


def _triangles(nx: int, ny: int) -> np.ndarray:
    """Two triangles per square of an ``(nx, ny)`` array of points, normal along +z, ``(m, 3)``."""
    index = np.arange(nx * ny).reshape(nx, ny)
    corners = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    a, b, c, d = (corner.ravel() for corner in corners)
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


# --- structure ----------------------------------------------------------------------------------


def _write_structure(file: h5py.File, folder: Path) -> list[Path]:
    """All bodies at peak load, unworn and (where there is one) worn."""
    times = {"unworn": 0.0}
    if "kinetics" in file:
        times["worn"] = float(file["kinetics/cycles"][-1])
    steps: list[Step] = []
    for state, time in times.items():
        for body, states in file["bodies"].items():
            if state in states:
                path = folder / "structure" / f"{body}_{state}.vtu"
                write_xml(_stressed_body(states[state]), path)
                steps.append((time, body, path))
    return write_series(folder / "structure.pvd", steps)


def _stressed_body(group: h5py.Group) -> pyvista.UnstructuredGrid:
    """One body with nodal displacement and stresses."""
    mesh = body_mesh(group)
    units = {"displacement": "mm", "von_mises": "MPa", "maximum_principal": "MPa"}
    attach(mesh.point_data, {name: (group[name][()], unit) for name, unit in units.items()})
    return mesh
