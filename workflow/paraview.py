"""Results for ParaView: the flanks as they wear, the structure before and after, worn surfaces.

Written into one folder:

- ``<interface>.pvd``: time series over the cycles; every step is an image on the contact grid
  (``<interface>/<jump>.vti``), turned and moved to the flank's place in the structure;
- ``structure.pvd``: all bodies at peak load, unworn at 0 and worn at the last computed number of
  cycles (``structure/<body>_<state>.vtu``); Warp By Vector on ``displacement`` deforms them;
- ``flank_<interface>_<body>.stl``: the worn surfaces at true scale in global coordinates.

Lengths are in mm, stresses in MPa; each array carries its unit. ``shear`` and ``slip`` are global
vectors, so that glyphs point the right way; ``shear_x``, ``shear_y``, ``slip_x`` and ``slip_y`` are
their components in the interface frame. Fields are single precision, which halves the files: the
doubles are in ``results.h5``.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import h5py
import numpy as np

from sa_solver.types import Array, Frame, Grid
from workflow.store import BODY_NAMES, frame_of, grid_of, jump_names, replacing

if TYPE_CHECKING:
    import pyvista

UNWORN = "00000"

Fields = dict[str, tuple[Array, str]]
Step = tuple[float, str, Path]


def write_paraview(results: Path, folder: Path) -> list[Path]:
    """Write the files that show ``results`` (a ``results.h5``) in ParaView; returns their paths.

    Every file appears under its name only when it is complete.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    with h5py.File(results) as file:
        for interface in file["grid"]:
            written += _write_flank(file, interface, folder)
            written += _write_worn_surfaces(file, interface, folder)
        if "bodies" in file:
            written += _write_structure(file, folder)
    return written


# --- flanks -------------------------------------------------------------------------------------


def _write_flank(file: h5py.File, interface: str, folder: Path) -> list[Path]:
    """Images of one flank, one per jump, and the series that lists them."""
    grid, frame = _placement(file, interface)
    steps: list[Step] = []
    for jump in jump_names(file, interface):
        path = folder / interface / f"{jump}.vti"
        image = _flank_image(grid, frame)
        _attach(image.cell_data, _flank_fields(file, interface, jump, frame))
        _write_xml(image, path)
        steps.append((float(file["contact"][interface][jump].attrs["cycles"]), interface, path))
    return _write_series(folder / f"{interface}.pvd", steps)


def _flank_image(grid: Grid, frame: Frame) -> pyvista.ImageData:
    """The grid as a sheet of ``nx x ny`` cells at the flank's place in space."""
    import pyvista

    corner = np.array([-0.5 * grid.size[0], -0.5 * grid.size[1], 0.0])
    return pyvista.ImageData(
        dimensions=(grid.shape[0] + 1, grid.shape[1] + 1, 1),
        spacing=(*grid.pitch, 1.0),
        origin=frame.origin + frame.to_global(corner),
        direction_matrix=frame.axes.T,
    )


def _flank_fields(file: h5py.File, interface: str, jump: str, frame: Frame) -> Fields:
    """Cell fields of one jump, in the order in which an image counts its cells."""
    contact = file["contact"][interface][jump]
    fields: Fields = {"pressure": (_cells(contact["pressure"]), "MPa")}
    for name, unit in (("shear", "MPa"), ("slip", "mm")):
        x, y = (_cells(component) for component in contact[name][()])
        fields[name] = frame.to_global(np.stack([x, y, np.zeros_like(x)], axis=1)), unit
        fields[f"{name}_x"], fields[f"{name}_y"] = (x, unit), (y, unit)
    return fields | _surface_fields(file["surfaces"][interface], jump)


def _surface_fields(surfaces: h5py.Group, jump: str) -> Fields:
    """Heights and wear depths of both bodies, and the depths' sum."""
    fields: Fields = {}
    for body in BODY_NAMES:
        height = _cells(surfaces[jump][f"body_{body}"])
        unworn = _cells(surfaces[UNWORN][f"body_{body}"])
        fields[f"height_{body}"] = height, "mm"
        fields[f"wear_depth_{body}"] = np.abs(height - unworn), "mm"
    total = sum(fields[f"wear_depth_{body}"][0] for body in BODY_NAMES)
    return fields | {"wear_depth": (np.asarray(total), "mm")}


def _cells(field: h5py.Dataset | Array) -> Array:
    """A grid field ``(nx, ny)`` as ``(nx ny,)``, x fastest."""
    return np.ravel(field[()], order="F")


def _placement(file: h5py.File, interface: str) -> tuple[Grid, Frame]:
    """Grid and frame of an interface."""
    group = file["grid"][interface]
    return grid_of(group), frame_of(group)


# --- worn surfaces ------------------------------------------------------------------------------


def _write_worn_surfaces(file: h5py.File, interface: str, folder: Path) -> list[Path]:
    """STL of both worn surfaces of one flank, for CAD and meshers.

    Vertices are the centres of the grid cells that lie on the rounded flank (the FE contact face):
    what the grid has beyond it is no part of the bodies. Normals point out of the body. An STL
    file holds single precision: about 1e-5 mm at 250 mm from the origin.
    """
    import pyvista

    grid, frame = _placement(file, interface)
    rows, columns = _flank_window(file, interface, grid)
    last = jump_names(file, interface)[-1]
    written = []
    for body, name in BODY_NAMES.items():
        height = file["surfaces"][interface][last][f"body_{body}"][()]
        x, y, z = np.broadcast_arrays(grid.x, grid.y, height)
        local = np.stack([field[rows, columns] for field in (x, y, z)], axis=-1)
        triangles = _triangles(local.shape[0], local.shape[1])
        if body == 2:
            triangles = triangles[:, ::-1]
        points = frame.to_global(local.reshape(-1, 3)) + frame.origin
        path = folder / f"flank_{interface}_{name}.stl"
        _write_stl(pyvista.PolyData.from_regular_faces(points, triangles), path)
        written.append(path)
    return written


def _flank_window(file: h5py.File, interface: str, grid: Grid) -> tuple[slice, slice]:
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
                _write_xml(_body_mesh(states[state]), path)
                steps.append((time, body, path))
    return _write_series(folder / "structure.pvd", steps)


def _body_mesh(group: h5py.Group) -> pyvista.UnstructuredGrid:
    """One body as tetrahedra with nodal displacement and stresses."""
    import pyvista

    cells = {pyvista.CellType.TETRA: group["tets"][()]}
    mesh = pyvista.UnstructuredGrid(cells, group["points"][()])
    units = {"displacement": "mm", "von_mises": "MPa", "maximum_principal": "MPa"}
    _attach(mesh.point_data, {name: (group[name][()], unit) for name, unit in units.items()})
    return mesh


# --- files --------------------------------------------------------------------------------------


def _attach(data: pyvista.DataSetAttributes, fields: Fields) -> None:
    """Add ``fields`` to point or cell data, each with its unit and the names of its components."""
    from vtkmodules.vtkCommonCore import vtkDataArray

    for name, (values, unit) in fields.items():
        single: np.ndarray = values.astype(np.float32)
        data.set_array(single, name)
        array = data.VTKObject.GetArray(name)
        array.GetInformation().Set(vtkDataArray.UNITS_LABEL(), unit)
        if values.ndim == 2:
            for number, axis in enumerate("XYZ"):
                array.SetComponentName(number, axis)


def _write_xml(data: Any, path: Path) -> None:
    """Write a data set as VTK XML: raw appended data, compressed."""
    from vtkmodules.vtkIOXML import vtkXMLDataSetWriter

    path.parent.mkdir(parents=True, exist_ok=True)
    writer = vtkXMLDataSetWriter()
    writer.SetInputData(data)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()  # base64 would make the files a third larger
    writer.SetCompressorTypeToZLib()
    writer.SetHeaderTypeToUInt64()
    _run(writer, path)


def _write_stl(surface: pyvista.PolyData, path: Path) -> None:
    """Write triangles as binary STL."""
    from vtkmodules.vtkIOGeometry import vtkSTLWriter

    writer = vtkSTLWriter()
    writer.SetInputData(surface)
    writer.SetFileTypeToBinary()
    _run(writer, path)


def _run(writer: Any, path: Path) -> None:
    """Let a VTK writer write ``path``; raises OSError where it cannot."""
    with replacing(path) as partial:
        writer.SetFileName(str(partial))
        if not writer.Write():
            raise OSError(writer.GetErrorCode(), "could not be written", str(path))


def _write_series(path: Path, steps: list[Step]) -> list[Path]:
    """Write a ``.pvd`` over files already written; returns these and itself.

    The files of one time are its parts. Times are written with all digits.
    """
    parts: dict[float, int] = {}
    lines = []
    for time, name, file in steps:
        part = parts[time] = parts.get(time, -1) + 1
        relative = quoteattr(file.relative_to(path.parent).as_posix())
        attributes = f'timestep="{time!r}" part="{part}" name={quoteattr(name)} file={relative}'
        lines.append(f"    <DataSet {attributes}/>\n")
    with replacing(path) as partial:
        partial.write_text(
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
            + "".join(lines)
            + "  </Collection>\n</VTKFile>\n",
            encoding="utf-8",
        )
    return [*(file for _, _, file in steps), path]
