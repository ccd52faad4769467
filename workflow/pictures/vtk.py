"""Files that ParaView reads, and a contact grid as an image in one of them."""

from __future__ import annotations

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
Step = tuple[float, str, Path]


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


def write_xml(data: Any, path: Path) -> None:
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


def write_stl(surface: pyvista.PolyData, path: Path) -> None:
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


def write_series(path: Path, steps: list[Step]) -> list[Path]:
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
