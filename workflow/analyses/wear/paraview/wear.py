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

from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from sa_solver.types import Array, Grid
from workflow.analyses.wear.body_mesh import body_mesh
from workflow.analyses.wear.layout import Contents, jump_name
from workflow.analyses.wear.paraview.subsurface import life_fields, write_sections
from workflow.pictures.vtk import (
    Fields,
    Step,
    attach,
    cells,
    grid_image,
    traction_fields,
    write_series,
    write_stl,
)
from workflow.shell.results import frame_of, grid_of

# Fields at the nodes of a body, with units.
NODAL = {"displacement": "mm", "von_mises": "MPa", "maximum_principal": "MPa"}


def write_wear(contents: Contents, file: h5py.File, folder: Path) -> list[Path]:
    """Write the files that show a wear run; returns their paths."""
    written: list[Path] = []
    for name in contents.names:
        images = _images(contents, file, name, folder / name)
        written += write_series(folder / f"{name}.pvd", images)
        written += write_sections(contents, file, name, folder)
        if not contents.line:
            written += _write_worn_surfaces(contents, file, name, folder)
    if contents.structure:
        written += write_series(folder / "structure.pvd", _bodies(file, folder / "structure"))
    return written


# --- faces --------------------------------------------------------------------------------------


def _images(contents: Contents, file: h5py.File, interface: str, folder: Path) -> Iterator[Step]:
    """Images of one face, one per jump."""
    grid, frame = grid_of(file["grid"][interface]), frame_of(file["grid"][interface])
    surfaces = file["surfaces"][interface]
    for jump in contents.jump_names:
        contact, image = file["contact"][interface][jump], grid_image(grid, frame)
        fields = traction_fields(contact, frame) | _surface_fields(surfaces, jump)
        attach(image.cell_data, fields | life_fields(contents, file, interface, jump))
        yield float(contact.attrs["cycles"]), interface, folder / f"{jump}.vti", image


def _surface_fields(surfaces: h5py.Group, jump: str) -> Fields:
    """Heights and wear depths of both bodies, and the depths' sum."""
    fields: Fields = {}
    for body in (1, 2):
        height = cells(surfaces[jump][f"body_{body}"])
        unworn = cells(surfaces[jump_name(0)][f"body_{body}"])
        fields[f"height_{body}"] = height, "mm"
        fields[f"wear_depth_{body}"] = np.abs(height - unworn), "mm"
    total = sum(fields[f"wear_depth_{body}"][0] for body in (1, 2))
    return fields | {"wear_depth": (np.asarray(total), "mm")}


# --- worn surfaces ------------------------------------------------------------------------------


def _write_worn_surfaces(
    contents: Contents, file: h5py.File, interface: str, folder: Path
) -> list[Path]:
    """STL of both worn surfaces of one face, for CAD and meshers.

    Vertices are the centres of the grid cells that lie on the FE contact face, rounding included:
    what the grid has beyond it is no part of the bodies. Normals point out of the body. An STL
    file holds single precision: about 1e-5 mm at 250 mm from the origin.
    """
    import pyvista

    grid, frame = grid_of(file["grid"][interface]), frame_of(file["grid"][interface])
    rows, columns = _face_window(file["structure"][interface]["coordinates"][()], grid)
    last = contents.jump_names[-1]
    written = []
    for body, name in enumerate(contents.bodies, start=1):
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


def _face_window(face: Array, grid: Grid) -> tuple[slice, slice]:
    """Rows and columns of the grid whose centres lie on the face with the nodes ``(n, 2)``."""
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


def _bodies(file: h5py.File, folder: Path) -> Iterator[Step]:
    """All bodies at peak load, unworn and worn, with nodal displacement and stresses."""
    times = {"unworn": 0.0, "worn": float(file["kinetics/cycles"][-1])}
    for state, time in times.items():
        for body, states in file["bodies"].items():
            mesh = body_mesh(states[state])
            fields = {name: (states[state][name][()], unit) for name, unit in NODAL.items()}
            attach(mesh.point_data, fields)
            yield time, body, folder / f"{body}_{state}.vtu", mesh
