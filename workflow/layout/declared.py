"""Declarations of datasets: what each array of the results is, in which unit, over which axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

# Units in a line contact for the units of extensive quantities of a contact over an area.
PER_LENGTH = {"N": "N/mm", "N mm": "N mm/mm", "mm^2": "mm^2/mm", "mm^3": "mm^3/mm"}


def unit_in(line: bool, unit: str) -> str:
    """Return the unit of a quantity in a contact over an area, or per mm in a ``line`` contact."""
    return PER_LENGTH.get(unit, unit) if line else unit


class Declared(NamedTuple):
    """Unit, description and dimensions of a dataset.

    ``unit`` is a base unit ("1" for none) in a contact over an area. Extensive quantities are per
    mm in a line contact; ``line_unit`` is needed only where :func:`unit_in` does not know that
    unit. A dataset whose only dimension is its own name is a coordinate.
    """

    unit: str
    description: str
    dims: tuple[str, ...] = ()
    line_unit: str = ""

    def unit_in(self, line: bool) -> str:
        """Return the unit in a contact over an area or in a ``line`` contact."""
        return (line and self.line_unit) or unit_in(line, self.unit)

    def over(self, *dims: str) -> Declared:
        """Return the same dataset with further dimensions, which come first."""
        return self._replace(dims=(*dims, *self.dims))

    def variable(self, values: NDArray[Any], line: bool = False) -> xr.Variable:
        """Return values as a variable of xarray, with unit and description."""
        import xarray as xr

        attributes = {"units": self.unit_in(line), "long_name": self.description}
        return xr.Variable(self.dims, values, attributes)


Declarations = Mapping[str, Declared]
"""Declared datasets of one group, by name."""
Arrays = Mapping[str, NDArray[Any]]
"""Arrays of one group, by name."""


def declared(text: str) -> dict[str, Declared]:
    """Return the datasets of a text, with a line for each.

    A line has name, unit, dimensions and description, and perhaps the unit in a line contact,
    separated by bars. A line without bars continues the description above it. Several names may
    share a line, separated by commas; # stands for the part of each behind its last underscore.
    """
    rows: list[list[str]] = []
    for line in filter(str.strip, text.splitlines()):
        cells = [cell.strip() for cell in line.split("|")]
        if len(cells) == 1:
            rows[-1][3] += f" {cells[0]}"
        else:
            rows.append(cells)
    return {
        name: Declared(
            unit, text.replace("#", name.split("_")[-1]), tuple(dims.split()), *line_unit
        )
        for names, unit, dims, text, *line_unit in rows
        for name in names.split(", ")
    }


GRID = """
    x | mm | x | centres of the cells along x
    y | mm | y | centres of the cells along y
"""
"""Coordinates of the cells of a grid."""


@dataclass(frozen=True)
class Layout:
    """Layout of a results file: the declared datasets of every group, by path.

    A part such as ``<face>`` of a path stands for any name; the first path that matches counts.
    Coordinates stand in the group itself or in one above it. ``coordinates`` are the groups of all
    others, by dimension; their ``<face>`` is that of the group which uses them.
    """

    groups: Mapping[str, Declarations]
    coordinates: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def read(cls, text: str, **coordinates: str) -> Layout:
        """Return the layout of a text: groups, and below them, indented, their datasets.

        The datasets are as in :func:`declared`. Groups of the same datasets share a line, separated
        by commas.
        """
        groups: dict[str, str] = {}
        names: list[str] = []
        for line in filter(str.strip, text.splitlines()):
            if line.startswith(" "):
                groups |= {name: f"{groups[name]}{line}\n" for name in names}
            else:
                names = line.split(", ")
                groups |= dict.fromkeys(names, "")
        return cls({name: declared(lines) for name, lines in groups.items()}, coordinates)

    def datasets(self, group: str) -> Declarations:
        """Return the datasets that a group may have. Raises KeyError for an undeclared group."""
        return self.groups[self._pattern(group)]

    def units(self, y: str, x: str, line: bool) -> tuple[str, str]:
        """Return the units of a curve: of its abscissa, and of the dataset at the path ``y``.

        ``x`` is a dataset of the same group, or empty for the coordinate of the first axis, of a
        field the coordinate x.
        """
        group, _, name = y.rpartition("/")
        own = next(d for p, d in self.groups.items() if name in d and _matches(p, group))
        dim = x or ("x" if "x" in own[name].dims else own[name].dims[0])
        places = (own, *(d for d in self.groups.values() if dim in d and d[dim].dims == (dim,)))
        along = next(datasets[dim] for datasets in places if dim in datasets)
        return along.unit_in(line), own[name].unit_in(line)

    def coordinates_of(self, group: str, dim: str) -> list[str]:
        """Return the path of a coordinate that is neither in a group nor above it, if any."""
        if dim not in self.coordinates:
            return []
        names = dict(zip(self._pattern(group).split("/"), group.split("/"), strict=True))
        home = [names.get(part, part) for part in self.coordinates[dim].split("/")]
        return ["/".join([*home, dim])]

    def _pattern(self, group: str) -> str:
        for pattern in self.groups:
            if _matches(pattern, group):
                return pattern
        raise KeyError(f"no group {group} is declared")


def _matches(pattern: str, group: str) -> bool:
    """Return whether a group is one of those that a pattern stands for."""
    parts, names = pattern.split("/"), group.split("/")
    return len(parts) == len(names) and all(
        part == name or part.startswith("<") for part, name in zip(parts, names, strict=True)
    )
