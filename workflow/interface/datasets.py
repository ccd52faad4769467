"""Contents of ``results.h5``, read on demand, as numpy, xarray and pandas objects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from workflow.errors import UserError
from workflow.shell.output.results import COORDINATES

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

# Attributes that distinguish numbered groups: the first that all groups have, else their number.
TOLD_APART_BY = ("cycles", "increment", "force", "level", "energy", "frequency")
NUMBER = "number"


@dataclass(frozen=True)
class ResultsFile:
    """File ``results.h5`` in its state when opened, since another run may replace it later."""

    path: Path
    written: tuple[int, ...]

    @classmethod
    def at(cls, path: Path) -> ResultsFile:
        return cls(path, _written(path))

    @contextmanager
    def reading(self) -> Iterator[h5py.File]:
        """Open the file for reading; raise :class:`UserError` if it has changed."""
        if not self.path.exists() or _written(self.path) != self.written:
            raise UserError(f"{self.path}: replaced or removed since it was opened; open it again")
        with h5py.File(self.path) as file:
            yield file


def _written(path: Path) -> tuple[int, ...]:
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns


class Values(NDArrayOperatorsMixin):
    """Dataset whose ``values`` are read on demand; the rest is known at once.

    Numpy treats it as an array; ``[...]`` reads a part of it. ``unit`` is "1" for none. ``dims``
    are the names of its axes, "" for an unnamed one; ``coordinates`` are the values along the axes,
    by name.

    Examples
    --------
    The pressures on cells of 1/16 mm add up to the load of 400 N:

    >>> import fretscale, tempfile
    >>> coarse = fretscale.load_case(
    ...     "cases/sphere_normal.yaml",
    ...     contact__grid=[16, 16],
    ...     output__paraview=False,
    ...     output__figures=False,
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     pressure = fretscale.run(coarse, folder, quiet=True)["contact/bodies/00001/pressure"]
    ...     print(pressure.dims, pressure.unit, f"{pressure.values.sum() / 16.0**2:.3f} N")
    ('x', 'y') MPa 400.000 N
    """

    def __init__(self, file: ResultsFile, dataset: h5py.Dataset) -> None:
        self._file = file
        self.name: str = dataset.name.strip("/")
        self.unit = str(dataset.attrs.get("unit", "1"))
        self.description = str(dataset.attrs.get("description", ""))
        self.shape: tuple[int, ...] = dataset.shape
        self.dtype = dataset.dtype
        self.dims = tuple(str(axis.label) for axis in dataset.dims)
        above = self.name.rpartition("/")[0]
        self._homes = (above, str(dataset.attrs.get(COORDINATES, above)))

    def __getitem__(self, part: Any) -> Any:
        with self._file.reading() as file:
            return file[self.name][part]

    @cached_property
    def values(self) -> NDArray[Any]:
        """All values of the dataset."""
        return np.asarray(self[()])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.values, dtype=dtype, copy=copy)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **settings: Any) -> Any:
        plain = [item.values if isinstance(item, Values) else item for item in inputs]
        return getattr(ufunc, method)(*plain, **settings)

    def __len__(self) -> int:
        return len(self.values)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.values)

    def __float__(self) -> float:
        return float(self.values)

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self.shape)

    @property
    def coordinates(self) -> dict[str, Values]:
        """Datasets along the axes, by the names of the axes."""
        found = {}
        with self._file.reading() as file:
            for dim in filter(None, self.dims):
                paths = (f"{home}/{dim}" for home in self._homes)
                there = [file[path] for path in paths if path in file]
                if there:
                    found[dim] = Values(self._file, there[0])
        return found

    def xarray(self) -> xr.DataArray:
        """Return the dataset as an ``xarray.DataArray``."""
        return _data_array(self)

    def pandas(self) -> pd.Series:
        """Return a curve as a ``pandas.Series``; raise :class:`UserError` for other datasets."""
        return _series(self)

    def __repr__(self) -> str:
        shape = ", ".join(
            f"{dim} {n}" if dim else str(n) for dim, n in zip(self.dims, self.shape, strict=True)
        )
        unit = "" if self.unit == "1" else f" [{self.unit}]"
        return f"{self.name} ({shape}){unit}: {self.description}"


class Group(Mapping[str, "Group | Values"]):
    """Groups and datasets under one name in ``results.h5``, accessed by name or path.

    ``attributes`` are the numbers and texts that belong to the group.

    Examples
    --------
    Access by names and by paths:

    >>> import fretscale, tempfile
    >>> coarse = fretscale.load_case(
    ...     "cases/sphere_normal.yaml",
    ...     contact__grid=[16, 16],
    ...     output__paraview=False,
    ...     output__figures=False,
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     results = fretscale.run(coarse, folder, quiet=True)
    ...     print(list(results["grid/bodies"]), results["grid"]["bodies/x"].shape)
    ['x', 'y'] (16,)
    """

    def __init__(self, file: ResultsFile, name: str = "") -> None:
        self._file, self.name = file, name

    @contextmanager
    def _reading(self) -> Iterator[h5py.Group]:
        with self._file.reading() as file:
            yield file[self.name or "/"]

    def __getitem__(self, name: str) -> Any:
        path = f"{self.name}/{name}".strip("/")
        with self._file.reading() as file:
            if path not in file:
                with self._reading() as group:
                    known = ", ".join(group)
                raise KeyError(f"{name}: not there; {self.name or 'the results'}: {known}")
            item = file[path]
            dataset = isinstance(item, h5py.Dataset)
            return Values(self._file, item) if dataset else Group(self._file, path)

    def __iter__(self) -> Iterator[str]:
        with self._reading() as group:
            return iter(list(group))

    def __len__(self) -> int:
        with self._reading() as group:
            return len(group)

    @property
    def attributes(self) -> dict[str, Any]:
        """Numbers and texts that belong to the group, by name."""
        with self._reading() as group:
            return {name: _plain(value) for name, value in group.attrs.items()}

    def tree(self, depth: int = 20) -> str:
        """Return the contents as lines with shapes and units, down to ``depth`` levels."""
        return "\n".join(self._lines(depth))

    def _lines(self, depth: int, indent: str = "") -> Iterator[str]:
        """Yield the lines of the tree, with only the first of numbered groups."""
        numbered = [name for name in self if name.isdecimal()]
        for name in self:
            if name in numbered[1:]:
                continue
            more = f" to {numbered[-1]}" if name in numbered[:1] and len(numbered) > 1 else ""
            item = self[name]
            if isinstance(item, Values):
                yield indent + repr(item).removeprefix(f"{self.name}/")
            else:
                yield f"{indent}{name}{more}/"
                if depth > 1:
                    yield from item._lines(depth - 1, indent + "  ")

    def xarray(self) -> xr.Dataset:
        """Return the datasets as an ``xarray.Dataset``; those of numbered groups are concatenated.

        The new axis has the cycles, increments or forces that distinguish the groups.
        """
        return _data_set(self)

    def pandas(self) -> pd.DataFrame:
        """Return the curves as a ``pandas.DataFrame``, or the numbers of numbered groups.

        Numbered groups have a row each. Raises :class:`UserError` where there is neither.
        """
        return _data_frame(self)

    def __repr__(self) -> str:
        return f"{self.name}/\n" + "\n".join(self._lines(2, "  "))

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"


def _plain(value: Any) -> Any:
    """Return an attribute as a Python object."""
    return value.item() if isinstance(value, np.generic) else value


# --- xarray and pandas ---------------------------------------------------------------------------


def _data_array(values: Values) -> xr.DataArray:
    """Return a dataset with its coordinates."""
    import xarray

    dims = _dims(values)
    coordinates = {
        dim: xarray.Variable((dim,), along.values, _attributes(along))
        for dim, along in values.coordinates.items()
        if along.shape == (values.shape[dims.index(dim)],)
    }
    return xarray.DataArray(
        values.values, coordinates, dims, values.name.rpartition("/")[2], _attributes(values)
    )


def _data_set(group: Group) -> xr.Dataset:
    """Return the datasets of a group, with those of its numbered groups concatenated."""
    import xarray

    arrays = {name: _data_array(item) for name, item in _datasets(group).items()}
    curves = {name: array for name, array in arrays.items() if name not in array.coords}
    numbered = _numbered(group)
    if numbered:
        axis, places = _told_apart(numbered)
        along = xarray.Variable((axis,), places)
        for name, parts in _alike(numbered).items():
            stacked = [_data_array(part) for part in parts]
            curves[name] = xarray.concat(stacked, along, combine_attrs="override")
    return xarray.Dataset(curves, attrs=group.attributes)


def _series(values: Values) -> pd.Series:
    """Return a curve over its coordinate."""
    import pandas

    if values.ndim != 1:
        raise UserError(f"{values.name}: of {values.ndim} axes; allowed: curves, of one")
    return pandas.Series(values.values, _index(values), name=_heading(values))


def _data_frame(group: Group) -> pd.DataFrame:
    """Return the curves of a group as columns, or the numbers of its numbered groups."""
    import pandas

    datasets = {name: item for name, item in _datasets(group).items() if item.ndim == 1}
    if datasets and len({item.shape for item in datasets.values()}) == 1:
        index = _index(next(iter(datasets.values())))
        over = None if index is None else index.name
        columns = {_heading(item): item.values for item in datasets.values()}
        return pandas.DataFrame({k: v for k, v in columns.items() if k != over}, index)
    numbered = _numbered(group)
    if datasets or not numbered:
        raise UserError(
            f"{group.name or 'the results'}: no table; allowed: groups of curves that are equally "
            "long, or of numbered groups"
        )
    axis, places = _told_apart(numbered)
    rows = [
        {name: value for name, value in part.attributes.items() if np.ndim(value) == 0}
        for part in numbered.values()
    ]
    return pandas.DataFrame(rows, pandas.Index(places, name=axis)).drop(
        columns=axis, errors="ignore"
    )


def _attributes(values: Values) -> dict[str, str]:
    """Return the attributes under their names in the CF conventions."""
    return {"units": values.unit, "long_name": values.description}


def _heading(values: Values) -> str:
    name = values.name.rpartition("/")[2]
    return name if values.unit == "1" else f"{name} [{values.unit}]"


def _dims(values: Values) -> list[str]:
    """Return the names of all axes; an unnamed axis gets a name from its dataset."""
    name = values.name.rpartition("/")[2]
    return [dim or f"{name}_{axis}" for axis, dim in enumerate(values.dims)]


def _index(values: Values) -> Any:
    """Return the coordinate of curves as an index; None if they have none."""
    along = values.coordinates.get(values.dims[0])
    if along is None:
        return None
    import pandas

    return pandas.Index(along.values, name=_heading(along))


def _datasets(group: Group) -> dict[str, Values]:
    return {name: item for name, item in group.items() if isinstance(item, Values)}


def _numbered(group: Group) -> dict[str, Group]:
    """Return the groups in a group whose names are numbers."""
    groups = {name: item for name, item in group.items() if isinstance(item, Group)}
    return {name: item for name, item in groups.items() if name.isdecimal()}


def _told_apart(numbered: dict[str, Group]) -> tuple[str, list[Any]]:
    """Return the attribute that distinguishes the groups, and its value for each."""
    attributes = [part.attributes for part in numbered.values()]
    for name in TOLD_APART_BY:
        places = [found.get(name) for found in attributes]
        if None not in places and len(set(places)) == len(places):
            return name, places
    return NUMBER, [int(name) for name in numbered]


def _alike(numbered: dict[str, Group]) -> dict[str, list[Values]]:
    """Return the datasets that all groups have in the same shape."""
    parts = [_datasets(part) for part in numbered.values()]
    return {
        name: [part[name] for part in parts]
        for name, first in parts[0].items()
        if all(name in part and part[name].shape == first.shape for part in parts)
    }
