"""Files that ParaView reads, and a contact grid as an image in one of them."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import h5py
import numpy as np

from sa_solver.types import Array, Frame, Grid
from workflow.shell.store import replacing

if TYPE_CHECKING:
    import pyvista

Fields = dict[str, tuple[Array, str]]
Step = tuple[float, str, Path, Any]
"""Time, name, file and data set of a part of a series."""


def grid_image(grid: Grid, frame: Frame) -> pyvista.ImageData:
    """The grid as a sheet of ``nx x ny`` cells at its place in space."""
    import pyvista

    corner = np.array([-0.5 * grid.size[0], -0.5 * grid.size[1], 0.0])
    return pyvista.ImageData(
        dimensions=(grid.shape[0] + 1, grid.shape[1] + 1, 1),
        spacing=(*grid.pitch, 1.0),
        origin=frame.origin + frame.to_global(corner),
        direction_matrix=frame.axes.T,
    )


def cells(field: h5py.Dataset | Array) -> Array:
    """A grid field ``(nx, ny)`` as ``(nx ny,)``, x fastest."""
    return np.ravel(field[()], order="F")


def traction_fields(contact: h5py.Group, frame: Frame) -> Fields:
    """Pressure, shear and slip on a grid: vectors are global, and components in the frame."""
    fields: Fields = {"pressure": (cells(contact["pressure"]), "MPa")}
    for name, unit in (("shear", "MPa"), ("slip", "mm")):
        x, y = (cells(component) for component in contact[name][()])
        fields[name] = frame.to_global(np.stack([x, y, np.zeros_like(x)], axis=1)), unit
        fields[f"{name}_x"], fields[f"{name}_y"] = (x, unit), (y, unit)
    return fields


def attach(data: pyvista.DataSetAttributes, fields: Fields) -> None:
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


def write_stl(surface: pyvista.PolyData, path: Path) -> None:
    """Write triangles as binary STL."""
    from vtkmodules.vtkIOGeometry import vtkSTLWriter

    writer = vtkSTLWriter()
    writer.SetInputData(surface)
    writer.SetFileTypeToBinary()
    _run(writer, path)


def write_series(path: Path, steps: Iterable[Step]) -> list[Path]:
    """Write the data sets of a series, and a ``.pvd`` over them; returns all files.

    Those of one time are its parts. Times are written with all digits.
    """
    parts: dict[float, int] = {}
    lines, written = [], []
    for time, name, file, data in steps:
        _write_xml(data, file)
        written.append(file)
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
    return [*written, path]


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


def _run(writer: Any, path: Path) -> None:
    """Let a VTK writer write ``path``; raises OSError where it cannot."""
    from vtkmodules.vtkCommonCore import vtkObject

    # Said once, by us.
    vtkObject.GlobalWarningDisplayOff()
    with replacing(path) as partial:
        writer.SetFileName(str(partial))
        if not writer.Write():
            # It does not tell why: mostly this.
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
