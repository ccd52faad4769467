"""Contents of ``results.h5``, read on demand, as xarray and pandas objects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from workflow.errors import RunChanged, UserError
from workflow.shell.output.results import DIMENSIONS, NO_COORDINATE, own

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

# Attributes that distinguish numbered groups: the first that all groups have, else their number.
DISTINGUISHED_BY = ("cycles", "increment", "force", "level", "energy", "frequency")
NUMBER = "number"


class Group(Mapping[str, "Group | xr.DataArray"]):
    """Groups and datasets under one name in ``results.h5``, accessed by name or path.

    A dataset is an ``xarray.DataArray`` with its coordinates, and with its unit and description as
    ``attrs["units"]`` and ``attrs["long_name"]``. ``attributes`` are the numbers and texts that
    belong to the group.

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
    ...     results = fretscale.run(coarse, folder, quiet=True)
    ...     print(list(results["grid/bodies"]), results["grid"]["bodies/x"].shape)
    ...     pressure = results["contact/bodies/00001/pressure"]
    ['x', 'y'] (16,)
    >>> print(pressure.dims, pressure.units, f"{float(pressure.sum()) / 16.0**2:.3f} N")
    ('x', 'y') MPa 400.000 N
    """

    def __init__(self, path: Path, name: str = "", written: tuple[int, ...] = ()) -> None:
        self._path, self.name = path, name
        # Another run may replace the file later.
        self._written = written or _written(path)

    @contextmanager
    def _reading(self) -> Iterator[h5py.Group]:
        """Open the file for reading; raise :class:`UserError` if it has changed."""
        if not self._path.exists() or _written(self._path) != self._written:
            raise RunChanged(
                f"{self._path}: replaced or removed since it was opened; open it again"
            )
        with h5py.File(self._path) as file:
            yield file[self.name or "/"]

    def __getitem__(self, name: str) -> Any:
        with self._reading() as group:
            if name not in group:
                known = ", ".join(self)
                raise KeyError(f"{name}: not there; {self.name or 'the results'}: {known}")
            if isinstance(group[name], h5py.Group):
                return Group(self._path, f"{self.name}/{name}".strip("/"), self._written)
            above, _, last = name.rpartition("/")
            return _data_set(group[above] if above else group, last)[last]

    def __iter__(self) -> Iterator[str]:
        with self._reading() as group:
            return iter([name for name in own(group) if name != DIMENSIONS])

    def __len__(self) -> int:
        return len(list(iter(self)))

    @property
    def attributes(self) -> dict[str, Any]:
        """Numbers and texts that belong to the group, by name."""
        with self._reading() as group:
            return _attributes(group)

    def tree(self, depth: int = 20) -> str:
        """Return the contents as lines with shapes and units, down to ``depth`` levels."""
        with self._reading() as group:
            return "\n".join(_lines(group, depth))

    def xarray(self) -> xr.Dataset:
        """Return the datasets as an ``xarray.Dataset``; those of numbered groups are concatenated.

        The new axis has the cycles, increments or forces that distinguish the groups.
        """
        import xarray

        with self._reading() as group:
            found = _data_set(group)
            numbered = _numbered(group)
            if not numbered:
                return found
            parts = [_data_set(part) for part in numbered.values()]
            along = xarray.Variable(*_distinguishing_attribute(numbered))
        first = parts[0]
        alike = [
            name
            for name, array in first.data_vars.items()
            if all(name in part and part[name].sizes == array.sizes for part in parts)
        ]
        stacked = xarray.concat(
            [part[alike] for part in parts],
            along,
            data_vars="all",
            coords="minimal",
            compat="override",
            join="outer",
            combine_attrs="override",
        )
        stacked.attrs = found.attrs
        return stacked.assign(found.data_vars)

    def pandas(self) -> pd.DataFrame:
        """Return the curves as a ``pandas.DataFrame``, or the numbers of numbered groups.

        Numbered groups have a row each. Raises :class:`UserError` where there is neither.
        """
        import pandas

        with self._reading() as group:
            numbered, found = _numbered(group), _data_set(group)
            rows = [
                {k: v for k, v in _attributes(part).items() if np.ndim(v) == 0}
                for part in numbered.values()
            ]
            axis, places = _distinguishing_attribute(numbered) if numbered else ("", [])
        curves = [name for name, array in found.data_vars.items() if array.ndim == 1]
        dims = {found[name].dims for name in curves}
        if len(dims) == 1:
            headings = {name: _heading(str(name), found[name]) for name in curves}
            table = found[curves].to_dataframe().rename(columns=headings)
            dim = str(table.index.name)
            # Increments without a coordinate have no numbers.
            table.index.name = _heading(dim, found[dim]) if dim in found.coords else None
            return table
        if curves or not numbered:
            raise UserError(
                f"{self.name or 'the results'}: no table; allowed: groups of curves that are "
                "equally long, or of numbered groups"
            )
        table = pandas.DataFrame(rows, pandas.Index(places, name=axis))
        return table.drop(columns=axis, errors="ignore")

    def __repr__(self) -> str:
        with self._reading() as group:
            return "\n".join([f"{self.name}/", *_lines(group, 2, "  ")])

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"


def _written(path: Path) -> tuple[int, ...]:
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns


# --- reading -------------------------------------------------------------------------------------


def _data_set(group: h5py.Group, only: str | None = None) -> xr.Dataset:
    """Return the datasets of a group, or one ``only``, with their coordinates."""
    import xarray

    chosen = group.keys() if only is None else [only, *_dims(only, group[only])]
    variables = {
        name: xarray.Variable(_dims(name, item), item[()], _described(item))
        for name, item in ((name, group[name]) for name in chosen if name in group)
        if isinstance(item, h5py.Dataset)
        and not (item.is_scale and NO_COORDINATE in str(item.attrs["NAME"]))
    }
    return xarray.Dataset(variables, attrs=_attributes(group))


def _dims(name: str, dataset: h5py.Dataset) -> list[str]:
    """Return the names of all axes; an unnamed axis gets a name from its dataset."""
    if dataset.is_scale:
        return [name]
    return [
        # An older version of fretscale wrote labels in place of scales.
        axis[0].name.rpartition("/")[2] if len(axis) else axis.label or f"{name}_{number}"
        for number, axis in enumerate(dataset.dims)
    ]


def _described(dataset: h5py.Dataset) -> dict[str, str]:
    """Return unit and description under their names in the CF conventions."""
    return {
        "units": str(dataset.attrs.get("unit", "1")),
        "long_name": str(dataset.attrs.get("description", "")),
    }


def _attributes(group: h5py.Group) -> dict[str, Any]:
    """Return the attributes of a group as Python objects."""
    return {
        name: value.item() if isinstance(value, np.generic) else value
        for name, value in group.attrs.items()
    }


def _lines(group: h5py.Group, depth: int, indent: str = "") -> Iterator[str]:
    """Yield the lines of a tree, with only the first of numbered groups."""
    numbered = list(_numbered(group))
    for name in own(group):
        if name in numbered[1:] or name == DIMENSIONS:
            continue
        more = f" to {numbered[-1]}" if name in numbered[:1] and len(numbered) > 1 else ""
        if isinstance(group[name], h5py.Dataset):
            yield indent + _line(group[name])
            continue
        yield f"{indent}{name}{more}/"
        if depth > 1:
            yield from _lines(group[name], depth - 1, indent + "  ")


def _line(dataset: h5py.Dataset) -> str:
    """Return the line of a dataset in a tree."""
    name, described = dataset.name.rpartition("/")[2], _described(dataset)
    sizes = zip(_dims(name, dataset), dataset.shape, strict=True)
    shape = ", ".join(f"{dim} {length}" for dim, length in sizes)
    unit = "" if described["units"] == "1" else f" [{described['units']}]"
    return f"{name} ({shape}){unit}: {described['long_name']}"


def _heading(name: str, array: xr.DataArray) -> str:
    return name if array.attrs["units"] == "1" else f"{name} [{array.attrs['units']}]"


def _numbered(group: h5py.Group) -> dict[str, h5py.Group]:
    """Return the groups in a group whose names are numbers."""
    return {name: group[name] for name in group if name.isdecimal()}


def _distinguishing_attribute(numbered: Mapping[str, h5py.Group]) -> tuple[str, list[Any]]:
    """Return the attribute that distinguishes the groups, and its value for each."""
    attributes = [_attributes(part) for part in numbered.values()]
    for name in DISTINGUISHED_BY:
        places = [found.get(name) for found in attributes]
        if None not in places and len(set(places)) == len(places):
            return name, places
    return NUMBER, [int(name) for name in numbered]
