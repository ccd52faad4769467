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
from workflow.case.writing import dump_case
from workflow.errors import UserError
from workflow.shell.analysis import Run
from workflow.shell.dataset import Dataset, Datasets, unit_in
from workflow.shell.store import replacing_hdf5
from workflow.shell.versions import versions

# Datasets of more values are worth packing.
LARGE = 4096
# Attribute of the file that says what is in it.
CONTENTS = "contents"
# Bytes of like weight together: a sixth less to store, in three quarters of the time.
PACKED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
# Attribute of a dataset: the group that has the coordinates along its axes, if not its own.
COORDINATES = "coordinates"
# The last axes of a field on a grid.
CELLS = "x", "y"


@dataclass(frozen=True)
class Along:
    """Datasets as long as that of this name are curves over it: of their group, or with a path."""

    name: str


@dataclass(frozen=True)
class On:
    """Datasets whose last two axes are as long as those of the ``grid`` are fields on its cells.

    It is the group that :meth:`ResultsWriter.put_grid` has written.
    """

    grid: str


class ResultsWriter:
    """Fills an open HDF5 file with datasets; ``line`` contacts have forces and energies per mm."""

    def __init__(self, file: h5py.File, line: bool = False) -> None:
        self._file, self._line = file, line

    def put(
        self, group: str, datasets: Datasets, over: Along | On | None = None, /, **attributes: Any
    ) -> None:
        """Write a group, new or there already; attributes that are None are left out.

        HDF5's labels of axes say what datasets are ``over``: they name datasets of the same group,
        or of that in their attribute ``coordinates``.
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
        elif isinstance(over, Along):
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
        """What is in the file, as those who draw it are told."""
        kind = TypeAdapter(type(contents))
        self._file.attrs[CONTENTS] = kind.dump_json(contents).decode("utf-8")

    def put_grid(self, group: str, grid: Grid, frame: Frame | None = None) -> None:
        """A grid, the centres of its cells and, where it is known, its place in space."""
        line = {"line": True} if grid.line else {}
        placed = {} if frame is None else {"origin": frame.origin, "axes": frame.axes}
        centres = {
            "x": Dataset(grid.x[:, 0], "mm", "centres of the cells along x"),
            "y": Dataset(grid.y[0], "mm", "centres of the cells along y"),
        }
        self.put(group, centres, shape=grid.shape, pitch=grid.pitch, **line, **placed)


@contextmanager
def writing(path: Path, line: bool = False) -> Iterator[ResultsWriter]:
    """Write an HDF5 file, which appears once it is whole."""
    with replacing_hdf5(path) as stream, h5py.File(stream, "w") as file:
        yield ResultsWriter(file, line)


@contextmanager
def run_results(
    run: Run[Any], case: Case, attributes: Mapping[str, Any], line: bool = False
) -> Iterator[ResultsWriter]:
    """Write ``results.h5`` of a run: what it is of, the ``case`` as run, and what is put there."""
    path = run.folder.reserve("results.h5", "fields and curves, with units and descriptions")
    with writing(path, line) as writer:
        writer.put("/", {}, kind=run.kind, title=case.title, **attributes)
        writer.put("case", {}, text=dump_case(case), **versions())
        yield writer


def read_contents(path: Path, kind: type[Any] | None) -> Any:
    """What is in the ``results.h5`` of a run that has ended, as a description of a ``kind``.

    Raises UserError where it does not say, or in the words of another version.
    """
    with h5py.File(path) as file:
        text = file.attrs.get(CONTENTS, "")
    try:
        return None if kind is None else TypeAdapter(kind).validate_json(text)
    except ValidationError as error:
        raise UserError(
            f"{path}: does not say what it holds: of another version; run the case again"
        ) from error


def grid_of(group: h5py.Group) -> Grid:
    """The grid that a group's attributes describe."""
    (nx, ny), (dx, dy) = group.attrs["shape"], group.attrs["pitch"]
    return Grid((int(nx), int(ny)), (float(dx), float(dy)), bool(group.attrs.get("line", False)))


def frame_of(group: h5py.Group) -> Frame:
    """The frame that a group's attributes describe."""
    return Frame(np.array(group.attrs["origin"]), np.array(group.attrs["axes"]))
