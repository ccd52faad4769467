"""The layout of ``results.h5``: groups of datasets, each with its unit and description."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from pydantic import TypeAdapter, ValidationError

from sa_solver.types import Frame, Grid
from workflow.case.sections import Case
from workflow.case.text.writing import dump_case
from workflow.errors import UserError
from workflow.shell.analysis import Run
from workflow.shell.folders.store import replacing_hdf5
from workflow.shell.folders.versions import versions
from workflow.shell.output.dataset import Dataset, Datasets, unit_in

# Datasets with more values than this are compressed.
LARGE = 4096
# Attribute of the file that describes its contents.
CONTENTS = "contents"
# The shuffle filter stores bytes of equal significance together: it saves a sixth of the space and
# a quarter of the time.
PACKED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
# Attribute of a dataset: the group with the coordinates along its axes, if it is another group.
COORDINATES = "coordinates"
# The last axes of a field on a grid.
CELLS = "x", "y"


@dataclass(frozen=True)
class CurveAxis:
    """Marks datasets as curves over the dataset of this name, in the same group or given by a path.

    It applies to the datasets that have the same length.
    """

    name: str


@dataclass(frozen=True)
class On:
    """Marks datasets as fields on the cells of the ``grid``, a group that ``put_grid`` has written.

    It applies to the datasets whose last two axes have the shape of the grid.
    """

    grid: str


class ResultsWriter:
    """Writer of datasets to an HDF5 file; ``line`` contacts have forces and energies per mm."""

    def __init__(self, file: h5py.File, line: bool = False) -> None:
        self._file, self._line = file, line

    def put(
        self,
        group: str,
        datasets: Datasets,
        over: CurveAxis | On | None = None,
        /,
        **attributes: Any,
    ) -> None:
        """Write datasets to a new or existing group; attributes that are None are left out.

        The axes that datasets are ``over`` are stored as HDF5 axis labels, which name datasets of
        the same group, or of the group in the attribute ``coordinates``.
        """
        place = self._file.require_group(group)
        for name, dataset in datasets.items():
            packed = PACKED if np.size(dataset.values) > LARGE else {}
            written = place.create_dataset(name, data=dataset.values, **packed)
            written.attrs["unit"] = unit_in(self._line, dataset.unit)
            written.attrs["description"] = dataset.description
        place.attrs.update({name: value for name, value in attributes.items() if value is not None})
        made = [place[name] for name in datasets]
        if isinstance(over, On):
            self._label_fields(made, over.grid)
        elif isinstance(over, CurveAxis):
            self._label_curves(made, place, over.name)

    def _label_fields(self, made: Sequence[h5py.Dataset], grid: str) -> None:
        shape = tuple(self._file[grid].attrs["shape"])
        for dataset in made:
            if dataset.shape[-2:] == shape:
                dataset.dims[dataset.ndim - 2].label, dataset.dims[dataset.ndim - 1].label = CELLS
                dataset.attrs[COORDINATES] = grid

    def _label_curves(self, made: Sequence[h5py.Dataset], place: h5py.Group, along: str) -> None:
        elsewhere, _, name = along.rpartition("/")
        length = (self._file[elsewhere] if elsewhere else place)[name].shape
        for dataset in made:
            if dataset.shape[:1] == length:
                dataset.dims[0].label = name
                dataset.attrs.update({COORDINATES: elsewhere} if elsewhere else {})

    def put_contents(self, contents: Any) -> None:
        """Write the description of the file's contents, for the functions that draw it."""
        kind = TypeAdapter(type(contents))
        self._file.attrs[CONTENTS] = kind.dump_json(contents).decode("utf-8")

    def put_grid(self, group: str, grid: Grid, frame: Frame | None = None) -> None:
        """Write a grid, the centres of its cells and, if known, its position in space."""
        line = {"line": True} if grid.line else {}
        placed = {} if frame is None else {"origin": frame.origin, "axes": frame.axes}
        centres = {
            "x": Dataset(grid.x[:, 0], "mm", "centres of the cells along x"),
            "y": Dataset(grid.y[0], "mm", "centres of the cells along y"),
        }
        self.put(group, centres, shape=grid.shape, pitch=grid.pitch, **line, **placed)


@contextmanager
def writing(path: Path, line: bool = False) -> Iterator[ResultsWriter]:
    """Write an HDF5 file, which appears under its name once it is complete."""
    with replacing_hdf5(path) as stream, h5py.File(stream, "w") as file:
        yield ResultsWriter(file, line)


@contextmanager
def run_results(
    run: Run[Any], case: Case, attributes: Mapping[str, Any], line: bool = False
) -> Iterator[ResultsWriter]:
    """Write ``results.h5`` of a run: its kind and title, the ``case`` as run, and its datasets."""
    path = run.folder.reserve("results.h5", "fields and curves, with units and descriptions")
    with writing(path, line) as writer:
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
        raise UserError(
            f"{path}: has no contents list: of another version; run the case again"
        ) from error


def grid_of(group: h5py.Group) -> Grid:
    """Return the grid that a group's attributes describe."""
    (nx, ny), (dx, dy) = group.attrs["shape"], group.attrs["pitch"]
    return Grid((int(nx), int(ny)), (float(dx), float(dy)), bool(group.attrs.get("line", False)))


def frame_of(group: h5py.Group) -> Frame:
    """Return the frame that a group's attributes describe."""
    return Frame(np.array(group.attrs["origin"]), np.array(group.attrs["axes"]))
