"""Writing of ``results.h5`` as the layout of an analysis declares it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from pydantic import TypeAdapter, ValidationError

from sa_solver.types import Frame, Grid
from workflow.case.sections import Case
from workflow.case.text.writing import dump_case
from workflow.errors import RunChanged
from workflow.layout.declared import Arrays, Layout
from workflow.shell.analysis import Run
from workflow.shell.folders.store import replacing_hdf5
from workflow.shell.folders.versions import versions
from workflow.shell.output.tables import write_curves

# Datasets with more values than this are compressed.
LARGE = 4096
# Attribute of the file that describes its contents.
CONTENTS = "contents"
# The shuffle filter stores bytes of equal significance together: it saves a sixth of the space and
# a quarter of the time.
PACKED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
# Group of the dimensions that have no coordinate, by length, and how netCDF marks them.
DIMENSIONS = "dimensions"
NO_COORDINATE = "This is a netCDF dimension but not a netCDF variable."


class ResultsWriter:
    """Writer of declared datasets to an HDF5 file; ``line`` contacts have forces per mm.

    Axes are HDF5 dimension scales, so that xarray opens the file as it is. A coordinate of another
    group stands in a group as a soft link.
    """

    def __init__(self, file: h5py.File, layout: Layout, line: bool = False) -> None:
        self._file, self._layout, self._line = file, layout, line
        self._scales: dict[tuple[str, str, int], h5py.Reference] = {}

    def put(self, group: str, arrays: Arrays, /, **attributes: Any) -> None:
        """Write arrays to a new or existing group; attributes that are None are left out.

        Raises KeyError for an array that the layout does not declare, and ValueError for one of
        other dimensions.
        """
        place = self._file.require_group(group)
        declared = self._layout.datasets(group) if arrays else {}
        datasets = {}
        for name, values in arrays.items():
            packed = PACKED if np.size(values) > LARGE else {}
            written = datasets[name] = place.create_dataset(name, data=values, **packed)
            unit, description = declared[name].unit_in(self._line), declared[name].description
            # The latter two are what xarray and netCDF call them.
            written.attrs.update(
                unit=unit, description=description, units=unit, long_name=description
            )
            if declared[name].dims == (name,):
                written.make_scale(name)
        place.attrs.update({name: value for name, value in attributes.items() if value is not None})
        for name, written in datasets.items():
            if declared[name].dims != (name,):
                self._label(place, written, declared[name].dims)

    def put_table(self, path: Path, group: str, arrays: Arrays, /, **attributes: Any) -> None:
        """Write curves to a group, as :meth:`put` does, and as a CSV table."""
        self.put(group, arrays, **attributes)
        write_curves(path, arrays, self._layout.datasets(group))

    def _label(self, place: h5py.Group, dataset: h5py.Dataset, dims: tuple[str, ...]) -> None:
        """Attach the scales of its dimensions to a dataset."""
        shape = dataset.shape
        if len(dims) != len(shape):
            raise ValueError(f"{dataset.name}: declared over {dims}, but has {len(shape)} axes")
        scales = np.empty(len(dims), dtype=object)
        for axis, (dim, length) in enumerate(zip(dims, shape, strict=True)):
            scales[axis] = np.array([self._scale(place, dim, length)], dtype=h5py.ref_dtype)
        # h5py's attach_scale lists all datasets in an attribute of the scale too, which is slow
        # and limited to 64 kB.
        references = h5py.vlen_dtype(h5py.ref_dtype)
        dataset.attrs.create("DIMENSION_LIST", scales, dtype=references)

    def _scale(self, place: h5py.Group, dim: str, length: int) -> h5py.Reference:
        """Return the scale of a dimension; a link to it is made where it is in another group."""
        key = (place.name, dim, length)
        if key not in self._scales:
            if dim not in place:
                place[dim] = h5py.SoftLink(self._coordinate(place.name.strip("/"), dim, length))
            scale = place[dim]
            if not scale.is_scale or len(scale) != length:
                raise ValueError(f"{place.name}: {dim} is no coordinate of {length} values")
            self._scales[key] = scale.ref
        return self._scales[key]

    def _coordinate(self, group: str, dim: str, length: int) -> str:
        """Return the path of a coordinate, or of a dimension of this length without one."""
        parts = group.split("/")
        above = ["/".join([*parts[:count], dim]) for count in range(len(parts) - 1, 0, -1)]
        for path in (*above, *self._layout.coordinates_of(group, dim)):
            found = self._file.get(path)
            if found is not None and found.is_scale and len(found) == length:
                return f"/{path}"
        path = f"{DIMENSIONS}/{length}/{dim}"
        if path not in self._file:
            scale = self._file.create_dataset(path, shape=(length,), dtype=">f4")
            scale.make_scale(f"{NO_COORDINATE}{length:10d}")
            scale.attrs.update(unit="1", description="dimension without a coordinate")
        return f"/{path}"

    def put_contents(self, contents: Any) -> None:
        """Write the description of the file's contents, for the functions that draw it."""
        kind = TypeAdapter(type(contents))
        self._file.attrs[CONTENTS] = kind.dump_json(contents).decode("utf-8")

    def put_grid(self, group: str, grid: Grid, frame: Frame | None = None) -> None:
        """Write a grid, the centres of its cells and, if known, its position in space."""
        line = {"line": True} if grid.line else {}
        placed = {} if frame is None else {"origin": frame.origin, "axes": frame.axes}
        centres = {"x": grid.x[:, 0], "y": grid.y[0]}
        self.put(group, centres, shape=grid.shape, pitch=grid.pitch, **line, **placed)


@contextmanager
def writing(path: Path, layout: Layout, line: bool = False) -> Iterator[ResultsWriter]:
    """Write an HDF5 file, which appears under its name once it is complete."""
    with replacing_hdf5(path) as file:
        yield ResultsWriter(file, layout, line)


@contextmanager
def run_results(
    run: Run[Any], case: Case, layout: Layout, attributes: Mapping[str, Any], line: bool = False
) -> Iterator[ResultsWriter]:
    """Write ``results.h5`` of a run: its kind and title, the ``case`` as run, and its datasets."""
    path = run.folder.reserve("results.h5", "fields and curves, with units and descriptions")
    with writing(path, layout, line) as writer:
        writer.put("/", {}, kind=run.kind, title=case.title, **attributes)
        writer.put("case", {}, text=dump_case(case), **versions())
        yield writer


def read_contents(path: Path, kind: type[Any] | None) -> Any:
    """Return the description, of type ``kind``, of the ``results.h5`` of a finished run.

    Raises UserError if the description is missing or was written by another version.
    """
    with h5py.File(path) as file:
        text = file.attrs.get(CONTENTS, "")
    try:
        return None if kind is None else TypeAdapter(kind).validate_json(text)
    except ValidationError as error:
        raise RunChanged(
            f"{path}: has no contents list: of another version; run the case again"
        ) from error


def grid_of(group: h5py.Group) -> Grid:
    """Return the grid that a group's attributes describe."""
    (nx, ny), (dx, dy) = group.attrs["shape"], group.attrs["pitch"]
    return Grid((int(nx), int(ny)), (float(dx), float(dy)), bool(group.attrs.get("line", False)))


def frame_of(group: h5py.Group) -> Frame:
    """Return the frame that a group's attributes describe."""
    return Frame(np.array(group.attrs["origin"]), np.array(group.attrs["axes"]))


def own(group: h5py.Group) -> list[str]:
    """Return the names in a group other than coordinates and dimensions of all groups."""
    return [
        name
        for name in group
        if name != DIMENSIONS and not isinstance(group.get(name, getlink=True), h5py.SoftLink)
    ]
