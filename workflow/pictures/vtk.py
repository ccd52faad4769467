"""Files for ParaView: arrays with their units, faces as surfaces, series over time."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import h5py
import numpy as np

from sa_solver.types import Array, Frame, Grid, Indices, Mask
from workflow.shell.folders.store import replacing

if TYPE_CHECKING:
    import pyvista

Fields = dict[str, tuple[Array, str]]
"""Values ``(n,)``, ``(n, 3)`` or ``(n, 6)`` of points, each with its unit, by their names."""
Step = tuple[float, str, Path, Any]
"""Time, name, file and data set of a part of a series."""

# Names of the components of vectors, and of symmetric tensors in VTK's order.
COMPONENTS = {3: ("X", "Y", "Z"), 6: ("XX", "YY", "ZZ", "XY", "YZ", "XZ")}
# Possible meanings of the times of a series.
CYCLES, INCREMENTS, SECONDS = "cycles [1]", "increment [1]", "time [s]"
# Level of zlib; files of single precision are as small as with the default, for a quarter less
# work.
COMPRESSION = 1
# Vectors that show the pressure on a line as a profile.
PROFILE = "normal_traction [MPa]"


@dataclass(frozen=True)
class FacePoints:
    """Cells of a ``grid`` as points at their centres, in the nominal plane of a face.

    Only the cells that ``on_face`` ``(nx, ny)`` marks are used, or all without it. Triangles join
    the points; in line contacts, lines.
    """

    grid: Grid
    frame: Frame
    on_face: Mask | None = None

    def of(self, field: h5py.Dataset | Array) -> Array:
        """Return a grid field ``(nx, ny)`` at the points ``(n,)``, with x varying fastest."""
        values: Array = field[()].T[self._shown.T]
        return values

    def normal(self, heights: Array) -> Array:
        """Return global vectors ``(n, 3)`` of lengths ``heights`` ``(n,)`` along the normal."""
        return np.outer(heights, self.frame.axes[2])

    def tangential(self, field: h5py.Dataset | Array) -> tuple[Array, Array, Array]:
        """Return global vectors ``(n, 3)`` of a field ``(2, nx, ny)``, and its x and y ``(n,)``."""
        x, y = (self.of(component) for component in field[()])
        return self.frame.to_global(np.stack([x, y, np.zeros_like(x)], axis=1)), x, y

    def mesh(self, fields: Fields) -> pyvista.PolyData:
        """Return the points with their fields as a line or a surface."""
        import pyvista

        if self.grid.line:
            mesh = pyvista.PolyData(self.places, lines=self._lines)
        else:
            mesh = pyvista.PolyData.from_regular_faces(self.places, self.triangles)
        attach(mesh.point_data, {**fields, **self._shares})
        return mesh

    @property
    def _shares(self) -> Fields:
        """Part of the face for each point: the sum of a field times it is the field's integral."""
        if self.grid.line:
            return {"length": (np.full(len(self.places), self.grid.pitch[0]), "mm")}
        return {"area": (np.full(len(self.places), self.grid.cell_area), "mm^2")}

    @cached_property
    def places(self) -> Array:
        """Positions of the points in space ``(n, 3)`` [mm]."""
        local = np.stack([*map(self.of, self.grid.centres), self.of(np.zeros(self.grid.shape))])
        return self.frame.to_global(local.T) + self.frame.origin

    @cached_property
    def triangles(self) -> np.ndarray:
        """Points of the triangles ``(m, 3)`` of a surface, counterclockwise seen from body 2.

        A square of four points has two triangles, a square of three points one.
        """
        a, b, c, d = _corners(self._numbers)
        ways = np.array([[a, b, c], [a, c, d], [a, b, d], [b, c, d]]).swapaxes(1, 2)
        there = np.all(ways >= 0, axis=2)
        # The last two ways apply only to squares that have no other triangles.
        there = np.concatenate([there[:2], there[2:] & ~there[:2].any(axis=0)])
        triangles: np.ndarray = ways[there]
        return triangles

    @cached_property
    def _shown(self) -> Mask:
        return np.ones(self.grid.shape, dtype=np.bool_) if self.on_face is None else self.on_face

    @cached_property
    def _numbers(self) -> Indices:
        """Numbers of the points at their cells ``(nx, ny)``; -1 for cells without a point."""
        numbers = np.full(self.grid.shape, -1)
        numbers.T[self._shown.T] = np.arange(np.count_nonzero(self._shown))
        return numbers

    @property
    def _lines(self) -> Indices:
        """Uninterrupted lines along x in VTK's cell format."""
        cells = np.flatnonzero(self._shown)
        pieces = np.split(np.arange(len(cells)), np.flatnonzero(np.diff(cells) > 1) + 1)
        return np.concatenate([np.insert(piece, 0, len(piece)) for piece in pieces])


def _corners(numbers: Indices) -> tuple[Indices, ...]:
    """Return the four corners ``(m,)`` of each square between numbered points, counterclockwise."""
    corners = numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]
    return tuple(corner.ravel() for corner in corners)


def quadrilaterals(numbers: Indices) -> Indices:
    """Return the corners ``(m, 4)`` of the squares between points ``numbers`` ``(nx, ny)``."""
    return np.stack(_corners(numbers), axis=1)


def traction_fields(contact: h5py.Group, points: FacePoints) -> Fields:
    """Return pressure, shear and slip on a grid: global vectors, and ``face_`` components.

    For a line contact the pressure is also a vector, ``normal_traction``, which shows it as a
    profile when the line is warped by it.
    """
    pressure = points.of(contact["pressure"])
    fields: Fields = {"pressure": (pressure, "MPa")}
    if points.grid.line:
        fields["normal_traction"] = points.normal(pressure), "MPa"
    for name, unit in (("shear", "MPa"), ("slip", "mm")):
        vectors, x, y = points.tangential(contact[name])
        fields[name] = vectors, unit
        fields[f"face_{name}_x"], fields[f"face_{name}_y"] = (x, unit), (y, unit)
    return fields


def named(name: str, unit: str) -> str:
    """Return the name of an array with its unit, ``1`` if none; ParaView shows only the name."""
    return f"{name} [{unit}]"


def attach(data: pyvista.DataSetAttributes, fields: Fields) -> None:
    """Add ``fields`` to point data in single precision, with their units at the end of their names.

    A field without finite values is left out.
    """
    for name, (values, unit) in fields.items():
        if not np.isfinite(values).any():
            continue
        single: np.ndarray = values.astype(np.float32)
        data.set_array(single, named(name, unit))
        if values.ndim == 2:
            array = data.VTKObject.GetArray(named(name, unit))
            for number, component in enumerate(COMPONENTS[values.shape[1]]):
                array.SetComponentName(number, component)


def write_stl(surface: pyvista.PolyData, path: Path) -> None:
    """Write triangles as binary STL."""
    from vtkmodules.vtkIOGeometry import vtkSTLWriter

    writer = vtkSTLWriter()
    writer.SetInputData(surface)
    writer.SetFileTypeToBinary()
    _run(writer, path)


def write_series(path: Path, time_is: str, steps: Iterable[Step]) -> list[Path]:
    """Write the data sets of a series, and a ``.pvd`` file that lists them; return all files.

    Data sets at the same time are its parts. Times are written with all digits; ``time_is`` names
    their meaning and unit, and becomes a field array of every data set.
    """
    parts: dict[float, int] = {}
    lines, written = [], []
    for time, name, file, data in steps:
        data.field_data[time_is] = [time]
        write_xml(data, file)
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


def write_xml(data: Any, path: Path) -> None:
    """Write a data set as VTK XML: raw appended data, compressed."""
    from vtkmodules.vtkIOXML import vtkXMLDataSetWriter

    path.parent.mkdir(parents=True, exist_ok=True)
    writer = vtkXMLDataSetWriter()
    writer.SetInputData(data)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()  # base64 would make the files a third larger
    writer.SetCompressorTypeToZLib()
    writer.SetCompressionLevel(COMPRESSION)
    writer.SetHeaderTypeToUInt64()
    _run(writer, path)


def _run(writer: Any, path: Path) -> None:
    """Let a VTK writer write ``path``. Raises OSError if it fails."""
    from vtkmodules.vtkCommonCore import vtkObject

    # VTK's warning is suppressed, because the exception reports the failure.
    vtkObject.GlobalWarningDisplayOff()
    with replacing(path) as partial:
        writer.SetFileName(str(partial))
        if not writer.Write():
            # VTK does not report the reason; this is the most frequent one.
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
