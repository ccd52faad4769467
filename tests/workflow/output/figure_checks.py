"""Checks of any figure: no panel is empty or without limits."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure


def problems(figure: Figure) -> list[str]:
    """Return the problems of a figure that has been laid out."""
    return [*_empty(figure), *_unbounded(figure)]


def _panels(figure: Figure) -> list[Axes]:
    """Return the visible axes except colour bars."""
    return [axis for axis in figure.axes if axis.get_visible() and axis.get_label() != "<colorbar>"]


def _empty(figure: Figure) -> Iterator[str]:
    for axis in _panels(figure):
        drawn = [*axis.lines, *axis.collections, *axis.images, *axis.patches]
        if not any(artist.get_visible() for artist in drawn):
            yield f"a panel without anything: {_name(axis)}"


def _unbounded(figure: Figure) -> Iterator[str]:
    for axis in _panels(figure):
        if not np.isfinite([*axis.get_xlim(), *axis.get_ylim()]).all():
            yield f"limits that are no numbers: {_name(axis)}"


def _name(axis: Axes) -> str:
    return axis.get_title(loc="left") or axis.get_ylabel() or axis.get_xlabel() or "no name"
