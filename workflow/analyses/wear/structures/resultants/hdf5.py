"""Loads and slip fields of an HDF5 file, laid out as those of a structure in ``results.h5``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np

from sa_solver.errors import InputError
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, Frame, Indices
from workflow.analyses.wear.structures.resultants.consistency import (
    MIX,
    Bounds,
    checked_loads,
)
from workflow.analyses.wear.structures.resultants.faces import FaceError, check_facets, facets_over
from workflow.analyses.wear.structures.resultants.imported import (
    CLOSURE,
    ImportedLoads,
    base_units,
    required_columns,
    tilt_of,
)
from workflow.case import units
from workflow.case.files.input_files import InputFileError, open_hdf5
from workflow.case.files.table_file import check_unit
from workflow.layout.declared import unit_in
from workflow.shell.output.results import frame_of, own

LOADS = "load_history"
# Datasets in a group in addition to the loads: those that are read, and others of our results.
ON_NODES = ("facets", "slip", "force", "displacement", "nodes_1", "nodes_2", "nodal_height")
NODAL = ("coordinates", *ON_NODES, "height")
IGNORED = ("pressure", "shear")
# Accepted error of the sum of nodal forces, relative to the largest P.
ADD_UP = 0.01


@dataclass(frozen=True)
class FileGroup:
    """A group of an open file, whose errors name the place in the file."""

    file: str
    group: h5py.Group

    def error(self, name: str, wrong: str, allowed: str) -> InputFileError:
        place = f"{self.group.name.rstrip('/')}/{name}".rstrip("/")
        return InputFileError(f"{self.file}: {place}: {wrong}; allowed: {allowed}")

    def numbers(self, name: str, unit: str = "1") -> Array | None:
        """Return a dataset in the base unit ``unit``, None if missing. Raises InputFileError."""
        if name not in self.group:
            return None
        dataset = self.group[name]
        values = np.asarray(dataset[()]) if isinstance(dataset, h5py.Dataset) else np.empty(0)
        if values.dtype.kind not in "biuf" or values.size == 0:
            raise self.error(name, "no numbers", "a dataset of numbers")
        numbers = values.astype(np.float64)
        if not np.all(np.isfinite(numbers)):
            place = ", ".join(str(k + 1) for k in np.argwhere(~np.isfinite(numbers))[0])
            raise self.error(name, f"entry {place} is not finite", "finite numbers")
        written = dataset.attrs.get("unit", unit)
        # Some programs store texts as bytes.
        written = written.decode() if isinstance(written, bytes) else str(written)
        check_unit(f"{self.file}: {dataset.name}: unit", written, unit)
        factor = units.to_base(f"1 {written}", unit)
        return numbers if factor == 1.0 else numbers * factor

    def whole(self, name: str) -> Indices | None:
        """Return a dataset of whole numbers, None if missing. Raises InputFileError."""
        numbers = self.numbers(name)
        if numbers is None:
            return None
        if np.any(numbers != np.rint(numbers)):
            raise self.error(name, "not whole numbers", "whole numbers")
        return numbers.astype(np.int64)

    def shaped(self, name: str, unit: str, shape: tuple[int, ...]) -> Array | None:
        """Return :meth:`numbers` of a dataset with the given shape."""
        numbers = self.numbers(name, unit)
        if numbers is not None and numbers.shape != shape:
            raise self.error(name, f"shape {numbers.shape}", f"{shape}")
        return numbers


def read_h5(
    file: str, group: str, bounds: Callable[[str], Bounds], line: bool
) -> dict[str, ImportedLoads]:
    """Return the loads by interface from the groups in ``group``.

    Raises InputFileError.
    """
    with open_hdf5(file) as opened:
        top = opened.get(group or "/")
        interfaces = [
            (name, item)
            for name, item in (top.items() if isinstance(top, h5py.Group) else ())
            if isinstance(item, h5py.Group) and isinstance(item.get(LOADS), h5py.Group)
        ]
        if not interfaces:
            raise InputFileError(
                f"{file}: /{group}: no interfaces; allowed: a group for each, with a group "
                f"{LOADS} in it; at the top: {', '.join(own(opened)) or 'nothing'}"
            )
        read = {name: _read(FileGroup(file, item), bounds(name), line) for name, item in interfaces}
    _check_counts(file, read)
    return read


def _check_counts(file: str, read: dict[str, ImportedLoads]) -> None:
    counts = {name: len(imported.loads) for name, imported in read.items()}
    if len(set(counts.values())) > 1:
        listed = ", ".join(f"{name} {count}" for name, count in counts.items())
        raise InputFileError(
            f"{file}: increments differ: {listed}; allowed: as many for every interface"
        )


def _read(group: FileGroup, bounds: Bounds, line: bool) -> ImportedLoads:
    for name in own(group.group):
        if name not in (LOADS, *NODAL, *IGNORED):
            raise group.error(name, "unknown", ", ".join((LOADS, *NODAL)))
    loads = _loads(FileGroup(group.file, group.group[LOADS]), bounds)
    tilt = tilt_of(line, group.group[LOADS])
    height = group.numbers("height", "mm")
    if height is not None:
        height = height.reshape(len(height), -1)  # a list is one column, as in a line contact
    frame = _frame(group)
    closure, coordinates = _closure(group), _coordinates(group, line)
    if coordinates is None:
        for name in ON_NODES:
            if name in group.group:
                raise group.error(name, "given without coordinates", "both or neither")
        return ImportedLoads(loads, tilt, closure, frame=frame, height=height)
    count = len(coordinates)
    force, displacement = _solution(group, loads, count, line)
    return ImportedLoads(
        loads,
        tilt,
        closure,
        slip=group.shaped("slip", "mm", (len(loads), 2, count)),
        force=force,
        displacement=displacement,
        coordinates=coordinates,
        facets=_facets(group, coordinates, line),
        frame=frame,
        nodes_1=_nodes(group, "nodes_1", count),
        nodes_2=_nodes(group, "nodes_2", count),
        nodal_height=group.shaped("nodal_height", "mm", (count,)),
        height=height,
        weighted=bool(group.group.attrs.get("weighted", False)),
    )


def _loads(group: FileGroup, bounds: Bounds) -> LoadHistory:
    units_of = base_units(bounds.line)
    required = required_columns(bounds.line, group.group)
    missing = [name for name in required if name not in group.group]
    if missing:
        present = ", ".join(group.group) or "nothing"
        allowed = f"all of them (Mx and My, or neither: held tilt); found: {present}"
        raise group.error("", f"{', '.join(missing)} missing", allowed)
    for name in own(group.group):
        known = (*units_of, "sliding", *MIX)
        if name not in known:
            raise group.error(name, "unknown column", ", ".join(known))
    first = group.numbers("P", units_of["P"])
    assert first is not None
    shape = (first.size,)
    columns: dict[str, Any] = {}
    for name, unit in units_of.items():
        column = group.shaped(name, unit, shape)
        columns[name] = np.zeros(shape) if column is None else column

    optional = {name: group.shaped(name, "1", shape) for name in MIX}
    mix = {name: column for name, column in optional.items() if column is not None}

    def refusal(increment: int, column: str, wrong: str, allowed: str) -> InputFileError:
        value = (columns | mix)[column][increment]
        return group.error(column, f"increment {increment + 1}: {value:g}: {wrong}", allowed)

    marks = group.shaped("sliding", "1", shape)
    if marks is not None and not np.isin(marks, (0.0, 1.0)).all():
        raise group.error("sliding", "neither yes nor no", "0 or 1")
    sliding = None if marks is None else marks == 1.0
    return checked_loads(columns, sliding, mix, bounds, refusal)


def _solution(
    group: FileGroup, loads: LoadHistory, count: int, line: bool
) -> tuple[Array | None, Array | None]:
    """Return nodal forces and displacements ``(t, 3, n)``, both or neither."""
    shape, unit = (len(loads), 3, count), unit_in(line, "N")
    force = group.shaped("force", unit, shape)
    displacement = group.shaped("displacement", "mm", shape)
    if force is None or displacement is None:
        for name in ("force", "displacement"):
            if name in group.group:
                raise group.error(name, "given alone", "force and displacement, or neither")
        return None, None
    apart = np.abs(force.sum(axis=2) - loads.resultants[:, [1, 2, 0]]).max(axis=1)
    worst = int(np.argmax(apart))
    if apart[worst] > ADD_UP * loads.P.max():
        sums = ", ".join(f"{value:.6g}" for value in force[worst].sum(axis=1))
        wrong = f"increment {worst + 1}: the nodes add up to {sums} along x, y and z"
        raise group.error("force", wrong, "Qx, Qy and P of load_history")
    return force, displacement


def _closure(group: FileGroup) -> float | None:
    """Return how well the cycle is closed, or None if the file does not give it."""
    written = group.group.attrs.get(CLOSURE)
    if written is None:
        return None
    if np.ndim(written) or np.asarray(written).dtype.kind not in "iuf" or not written >= 0.0:
        raise group.error("", f"attribute {CLOSURE}: {written}", "a number, 0 or more")
    return float(written)


def _frame(group: FileGroup) -> Frame | None:
    attributes = [name for name in ("origin", "axes") if name in group.group.attrs]
    if not attributes:
        return None
    if len(attributes) == 1:
        raise group.error("", f"only the attribute {attributes[0]}", "origin (3,) and axes (3, 3)")
    try:
        return frame_of(group.group)
    except InputError as error:
        allowed = "origin (3,), and axes (3, 3) with rows x, y, z of length 1, z = x × y"
        raise group.error("", str(error), allowed) from error


def _coordinates(group: FileGroup, line: bool) -> Array | None:
    coordinates = group.numbers("coordinates", "mm")
    if coordinates is None:
        return None
    if line and coordinates.ndim == 1:
        coordinates = np.stack([coordinates, np.zeros(len(coordinates))], axis=1)
    if coordinates.ndim != 2 or coordinates.shape[1] != 2:
        raise group.error("coordinates", f"shape {coordinates.shape}", "x and y of every node")
    return coordinates


def _facets(group: FileGroup, coordinates: Array, line: bool) -> Indices:
    facets = group.whole("facets")
    corners = 2 if line else 3
    if facets is not None and (facets.ndim != 2 or facets.shape[1] != corners):
        raise group.error("facets", f"shape {facets.shape}", f"{corners} nodes for each")
    try:
        if facets is None:
            return facets_over(coordinates, line)
        check_facets(facets, len(coordinates))
    except FaceError as error:
        raise InputFileError(f"{group.file}: {group.group.name}: {error}") from error
    return facets


def _nodes(group: FileGroup, name: str, count: int) -> Indices | None:
    nodes = group.whole(name)
    if nodes is None:
        return None
    if nodes.shape != (count,) or len(np.unique(nodes)) != count:
        raise group.error(name, "not one number per node", f"{count} different numbers")
    return nodes
