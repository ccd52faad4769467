"""Curves of results as an analysis declares them, read from ``results.h5``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import h5py
import numpy as np

from sa_solver.types import Array
from workflow.shell.output.quantities import ANY, LAST, CurvesOf
from workflow.shell.output.results import grid_of

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


def curves_in(file: h5py.File, wanted: CurvesOf) -> Iterator[Curve]:
    """Yield the curves of the description ``wanted`` that a file contains."""
    for place, stood, words in _walk(file, wanted.y.split("/"), "", [], []):
        path = _with_last(wanted.x, place)
        for name in stood:
            path = path.replace(ANY, name, 1)
        if path in file:
            title = ", ".join([wanted.title, *words])
            yield _curve(title, file[path], file[place], wanted.logarithmic)


def _curve(title: str, x: h5py.Group | h5py.Dataset, y: h5py.Dataset, logarithmic: bool) -> Curve:
    if isinstance(x, h5py.Group):
        grid = grid_of(x)
        field = y[()] if y.ndim == 2 else y[0]
        places, values, x_name, x_unit = grid.x.ravel(), field[:, grid.shape[1] // 2], "x", "mm"
    else:
        values = y[()] if y.ndim == 1 else y[:, -1]
        places, x_name, x_unit = x[()], _last_part(x), x.attrs["unit"]
    return Curve(title, places, values, x_name, _last_part(y), x_unit, y.attrs["unit"], logarithmic)


def _last_part(dataset: h5py.Dataset) -> str:
    return str(dataset.name).rpartition("/")[2].replace("_", " ")


def _walk(
    group: h5py.Group, parts: list[str], above: str, stood: list[str], words: list[str]
) -> Iterator[tuple[str, list[str], list[str]]]:
    """Yield each path that matches a pattern, the groups that replace ``*``, and their wording."""
    part, *rest = parts
    for name in _names(group, part):
        place, item, now = f"{above}{name}", group[name], (stood, words)
        if part == ANY:
            now = ([*stood, name], [*words, _in_words(item, name)])
        if not rest:
            yield place, *now
        elif isinstance(item, h5py.Group):
            yield from _walk(item, rest, f"{place}/", *now)


def _names(group: h5py.Group, part: str) -> list[str]:
    """Return the names in a group that match one part of a pattern."""
    if part == ANY:
        return [name for name, item in group.items() if isinstance(item, h5py.Group)]
    if part == LAST:
        return sorted(name for name in group if name.isdecimal())[-1:]
    return [part] if part in group else []


def _with_last(path: str, place: str) -> str:
    """Return the path with each ``-1`` replaced by the part of ``place`` at that position."""
    there = place.split("/")
    return "/".join(there[n] if part == LAST else part for n, part in enumerate(path.split("/")))


def _in_words(group: h5py.Group, name: str) -> str:
    for attribute, text in TELLING.items():
        if attribute in group.attrs:
            return text.format(float(np.asarray(group.attrs[attribute])))
    return name
