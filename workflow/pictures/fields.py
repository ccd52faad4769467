"""Fields on a grid as maps and profiles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sa_solver.types import Array, Grid
from workflow.pictures.panels import WIDTH_INCHES, new_figure
from workflow.pictures.style import COLOUR_MAP

# Edge peaks are a few cells: a scale that reached them would leave the rest in one colour.
MAP_PERCENTILE = 99.5
# More profiles than this overlap.
MAX_PROFILES = 6
# Nodes this close to the nearest row count as on the line, as a share of the face: less than half
# the rows of a mesh of 34 nodes, enough for rows that are not quite straight.
ROW_SHARE = 0.01
# Beyond what is in contact, how far maps and profiles reach: as a share of its size.
MARGIN, PROFILE_MARGIN = 0.08, 0.15
# From so many times as long along y on, a map has y to the right: x is there by habit.
LONGER = 1.25
# Maps at most so high, over their width, and so many of them lie below each other.
FLAT, MOST_STACKED = 0.3, 8
# Over the width, what a map's height is at least: along lower ones no numbers could be read.
FLATTEST = 0.08
# Around and between maps, for axes and colour bar; for titles, of several lines where maps are
# beside each other; and the highest of a map [inches].
BESIDE, BETWEEN, AROUND, HIGHEST = 2.6, 0.5, 1.3, 4.8
TITLE, LONG_TITLE = 0.55, 0.75
# Width of colour bars [inches].
BAR = 0.3
# Numbers along the sides of maps.
TICKS = 5
# Views that fill so much of what they cover together are one.
ALIKE = 0.7


class View(NamedTuple):
    """Part of a face that is shown: ends along x and along y [mm]."""

    x: tuple[float, float]
    y: tuple[float, float]

    @property
    def size(self) -> tuple[float, float]:
        """Extent along x and y [mm]."""
        return self.x[1] - self.x[0], self.y[1] - self.y[0]


class Map(NamedTuple):
    """A field ``(nx, ny)`` on a grid, and what is said above it."""

    title: str
    field: Array
    grid: Grid


# --- what is shown ------------------------------------------------------------------------------


def view_of(fields: Sequence[Array], grid: Grid, margin: float = MARGIN) -> View:
    """Where any of the fields is above 0, with a margin; all of the grid where none is."""
    there = np.any([field > 0.0 for field in fields], axis=0)
    ends = []
    for direction in (0, 1):
        places, half = centres(grid, direction), 0.5 * grid.pitch[direction]
        inside = places[there.any(axis=1 - direction)] if there.any() else places
        low, high = inside[0] - half, inside[-1] + half
        more = max(margin * (high - low), half)
        reach = 0.5 * grid.size[direction]
        ends.append((float(max(low - more, -reach)), float(min(high + more, reach))))
    return View(*ends)


def common_views(views: Sequence[View]) -> list[View]:
    """The one view that covers all, as often, where they are alike; else as they are."""
    together = View(
        *((min(ends)[0], max(end for _, end in ends)) for ends in zip(*views, strict=True))
    )
    alike = all(np.prod(view.size) >= ALIKE * np.prod(together.size) for view in views)
    return [together] * len(views) if alike else list(views)


def is_upright(views: Sequence[View]) -> bool:
    """Whether y is to go to the right, x up: where faces are longer along y."""
    return max(view.size[1] / view.size[0] for view in views) > LONGER


# --- maps ---------------------------------------------------------------------------------------


def draw_maps(title: str, rows: Sequence[Sequence[Map]], label: str, note: str) -> Figure:
    """Maps on one colour scale and to scale, cut to where they are above 0; a row is of one face.

    Their longer side is to the right; flat ones lie below each other, and very flat ones are drawn
    higher than they are. Those of nothing are left out, if not all are.
    """
    own = [view_of([shown.field for shown in row], row[0].grid) for row in rows]
    views = common_views(own)
    turned = is_upright(views)
    every = [(shown, view) for row, view in zip(rows, views, strict=True) for shown in row]
    panels = [(shown, view) for shown, view in every if shown.field.any()] or every
    columns = min(len(rows[0]), len(panels))
    if max(_height(view, turned) for view in views) <= FLAT and len(panels) <= MOST_STACKED:
        columns = 1
    heights = [max(_height(view, turned), FLATTEST) for _, view in panels]
    if min(_height(view, turned) for _, view in panels) < FLATTEST:
        note = f"{note}; not to scale" if note else "not to scale"
    in_rows = [max(heights[first : first + columns]) for first in range(0, len(panels), columns)]
    figure, axes = scaled_panels(title, in_rows, columns)
    for axis in axes.flat[len(panels) :]:
        axis.remove()
    top = map_top([shown.field for shown, _ in panels])
    for axis, (shown, view) in zip(axes.flat, panels, strict=False):
        image = draw_map(axis, shown.field, shown.grid, top, view, turned)
        axis.set_title(shown.title)
    name_sides(axes, turned)
    figure.supxlabel(note, fontsize="small")
    colour_bar(figure, image, list(axes.flat[: len(panels)]), label, extend="max")
    return figure


def colour_bar(figure: Figure, colours: Any, axes: Any, label: str, **look: Any) -> None:
    """A colour bar to the right of panels, of one width however high they are."""
    aspect = figure.get_figheight() / BAR
    figure.colorbar(colours, ax=axes, label=label, pad=0.01, aspect=aspect, **look)


def scaled_panels(title: str, heights: Sequence[float], columns: int) -> tuple[Figure, Any]:
    """A figure of panels to scale, a row for each of their ``heights`` over width; and its axes."""
    width = (WIDTH_INCHES - BESIDE - BETWEEN * (columns - 1)) / columns
    inches = [min(width * height, HIGHEST) for height in heights]
    above = TITLE if columns == 1 else LONG_TITLE
    figure = new_figure(title, AROUND + sum(inches) + above * len(inches), compress=True)
    axes = figure.subplots(len(inches), columns, squeeze=False, height_ratios=inches)
    return figure, axes


def _height(view: View, turned: bool) -> float:
    """Height of a map over its width."""
    x, y = view.size
    return x / y if turned else y / x


def draw_map(
    axis: Axes, field: Array, grid: Grid, top: float, view: View, turned: bool = False
) -> Any:
    """One field to scale unless very flat, x to the right or, ``turned``, y; returns the image."""
    half = 0.5 * grid.size[0], 0.5 * grid.size[1]
    values = np.ma.masked_less_equal(field, 0.0)
    right, up = (1, 0) if turned else (0, 1)
    axis.grid(visible=False)
    image = axis.imshow(
        values if turned else values.T,
        origin="lower",
        extent=(-half[right], half[right], -half[up], half[up]),
        cmap=COLOUR_MAP,
        vmin=0.0,
        vmax=top,
        interpolation="nearest",
        aspect="auto" if _height(view, turned) < FLATTEST else "equal",
    )
    axis.set(xlim=view[right], ylim=view[up])
    few = 3 if view.size[up] < FLAT * view.size[right] else TICKS
    axis.locator_params(axis="x", nbins=TICKS)
    axis.locator_params(axis="y", nbins=few)
    return image


def name_sides(axes: Any, turned: bool) -> None:
    """What is along the sides of maps, on the outer ones."""
    right, up = ("y", "x") if turned else ("x", "y")
    for axis in axes[-1]:
        axis.set_xlabel(f"{right} [mm]")
    for axis in axes[:, 0]:
        axis.set_ylabel(f"{up} [mm]")


def map_top(fields: Sequence[Array]) -> float:
    """Top of the colour scale, in the unit of the fields."""
    closed = np.concatenate([field[field > 0.0] for field in fields])
    return float(np.percentile(closed, MAP_PERCENTILE)) if closed.size else 1.0


# --- profiles -----------------------------------------------------------------------------------


def middle(field: Array, direction: int) -> Array:
    """Values along x (0) or y (1) next to the other axis' middle."""
    return np.take(field, field.shape[1 - direction] // 2, axis=1 - direction)


def near_middle(coordinates: Array, direction: int) -> Any:
    """Which nodes ``(n, 2)`` are on the row along x (0) or y (1) nearest to the middle."""
    across = coordinates[:, 1 - direction]
    distance = np.abs(across)
    return distance <= distance.min() + ROW_SHARE * np.ptp(across)


def centres(grid: Grid, direction: int) -> Array:
    """Cell centres along x (0) or y (1)."""
    return (grid.x, grid.y)[direction].ravel()
