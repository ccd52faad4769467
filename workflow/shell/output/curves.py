"""Curves of results as an analysis declares them, read from ``results.h5``."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from sa_solver.types import Array
from workflow.case.text.readable import suited
from workflow.errors import RunChanged
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.quantities import ANY, LAST, CurvesOf
from workflow.shell.output.tables import heading

# Attributes of a numbered group that say in words what its number stands for.
TELLING = {
    "force": "under {:g} N",
    "level": "at level {:g}",
    "normal_force": "under {:g} N",
}


@dataclass(frozen=True)
class Curve:
    """Curve ``(n,)`` in base units, with a title, the names of its axes and their units."""

    title: str
    x: Array
    y: Array
    x_name: str
    y_name: str
    x_unit: str
    y_unit: str
    logarithmic: bool


def axis_labels(curve: Curve, x_unit: str, y_unit: str) -> dict[str, str]:
    """Return the labels of the axes of a curve in these units, as settings of matplotlib's axes."""
    return {"xlabel": heading(curve.x_name, x_unit), "ylabel": heading(curve.y_name, y_unit)}


def largest(*values: Array) -> float:
    """Return the largest size of the finite values, 0 if there are none."""
    finite = np.abs(np.concatenate([some[np.isfinite(some)] for some in values]))
    return float(finite.max(initial=0.0))


def suited_units(curves: Collection[Curve]) -> tuple[tuple[str, float], tuple[str, float]]:
    """Return name and size of the units in which to draw curves of equal units: of x and of y."""
    first = next(iter(curves))
    return (
        suited(largest(*(curve.x for curve in curves)), first.x_unit),
        suited(largest(*(curve.y for curve in curves)), first.y_unit),
    )


def curves_of_run(folder: Path, wanted: Sequence[CurvesOf]) -> list[Curve]:
    """Return the curves of these descriptions in the results of a finished run."""
    with h5py.File(OutputFolder(folder).results) as file:
        return [curve for each in wanted for curve in curves_in(file, each)]


def curves_in(file: h5py.File, wanted: CurvesOf) -> Iterator[Curve]:
    """Yield the curves of the description ``wanted`` that a file contains.

    Raises UserError for a file that does not name the axes of its datasets.
    """
    for y, words in _walk(file, wanted.y.split("/"), []):
        if not (y.is_scale or y.dims[0]):
            raise RunChanged(
                f"{file.filename}: of an older version of fretscale; run the case again"
            )
        if not wanted.x or wanted.x in y.parent:
            title = ", ".join([wanted.title, *words])
            yield _curve(title, y, wanted)


def _curve(title: str, y: h5py.Dataset, wanted: CurvesOf) -> Curve:
    dims = [_last_part(axis[0]) for axis in y.dims]
    if dims[-2:] == ["x", "y"]:
        x, field = y.dims[y.ndim - 2][0], y[()] if y.ndim == 2 else y[0]
        values = field[:, field.shape[1] // 2]
    else:
        x, values = y.parent[wanted.x or dims[0]], y[()] if y.ndim == 1 else y[:, -1]
    names, units = (_last_part(x), _last_part(y)), (x.attrs["unit"], y.attrs["unit"])
    return Curve(title, x[()], values, *names, *units, wanted.logarithmic)


def _last_part(dataset: h5py.Dataset) -> str:
    return str(dataset.name).rpartition("/")[2].replace("_", " ")


def _walk(
    group: h5py.Group, parts: list[str], words: list[str]
) -> Iterator[tuple[h5py.Dataset, list[str]]]:
    """Yield the datasets that match a pattern, and the wording of the groups for ``*``."""
    part, *rest = parts
    for name in _names(group, part):
        item = group[name]
        now = [*words, _in_words(item, name)] if part == ANY else words
        if not rest:
            yield item, now
        elif isinstance(item, h5py.Group):
            yield from _walk(item, rest, now)


def _names(group: h5py.Group, part: str) -> list[str]:
    """Return the names in a group that match one part of a pattern."""
    if part == ANY:
        return [name for name, item in group.items() if isinstance(item, h5py.Group)]
    if part == LAST:
        return sorted(name for name in group if name.isdecimal())[-1:]
    return [part] if part in group else []


def _in_words(group: h5py.Group, name: str) -> str:
    for attribute, text in TELLING.items():
        if attribute in group.attrs:
            return text.format(float(np.asarray(group.attrs[attribute])))
    return name
