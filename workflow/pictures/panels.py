"""What figures are made with: an empty one, colours in an order, legends, ticks, words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import h5py
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from workflow.pictures.style import COLOUR_MAP, LAST_SHADE

Figures = Mapping[str, Callable[[h5py.File], Figure]]
"""What draws each figure of results, by the figure's name."""

WIDTH_INCHES = 12.0
# Of a decade: further numbers would touch each other.
TICKS = (2.0, 5.0)


def new_figure(title: str, height: float) -> Figure:
    """An empty figure with a title, ``height`` in inches."""
    figure = Figure(figsize=(WIDTH_INCHES, height), layout="constrained")
    figure.suptitle(title, fontweight="bold")
    return figure


def spread(items: Sequence[Any], most: int) -> list[Any]:
    """At most so many of the items, evenly spread, first and last among them."""
    places = np.linspace(0, len(items) - 1, min(most, len(items)))
    return [items[round(place)] for place in places]


def shaded(items: Sequence[Any], most: int) -> list[tuple[Any, Any]]:
    """At most so many of the items, each with its colour: more curves than that overlap."""
    chosen = spread(items, most)
    shades = colormaps[COLOUR_MAP](np.linspace(0.0, LAST_SHADE, len(chosen)))
    return list(zip(chosen, shades, strict=True))


def changes(values: Mapping[str, Iterable[float]], digits: str, unit: str = "") -> str:
    """What became of a value, by name, for a title."""
    steps = {name: " → ".join(format(v, digits) for v in series) for name, series in values.items()}
    return ", ".join(f"{name} {text}{unit}" for name, text in steps.items())


def legend_beside(axis: Axes, title: str | None = None) -> None:
    """A legend to the right of the panel."""
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title=title)


def legend_below(
    figure: Any, axes: Iterable[Axes], columns: int | None = None, fontsize: float | None = None
) -> None:
    """One legend of several panels, each name once, below all of them; by default in a row."""
    named: dict[str, Any] = {}
    for axis in axes:
        handles, names = axis.get_legend_handles_labels()
        named |= dict(zip(names, handles, strict=True))
    figure.legend(
        named.values(),
        named.keys(),
        loc="outside lower center",
        ncols=columns or len(named),
        fontsize=fontsize,
    )


def plain_ticks(axis: Axes) -> None:
    """Plain numbers along a logarithmic x axis, few of them."""
    axis.xaxis.set_minor_locator(LogLocator(subs=TICKS))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter("{x:g}")
