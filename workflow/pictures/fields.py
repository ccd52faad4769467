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

# Edge peaks cover few cells; a colour scale up to them would show the rest in one colour.
MAP_PERCENTILE = 99.5
# Largest number of profiles in a panel; more would overlap.
MAX_PROFILES = 6
# Nodes within this share of the face from the nearest row count as on the line. It is less than
# half the row distance of a mesh with 34 rows, and enough for rows that are not quite straight.
ROW_SHARE = 0.01
# Margin of maps and profiles around the contact, relative to its size.
MARGIN, PROFILE_MARGIN = 0.08, 0.15
# Ratio of the lengths along y and x above which a map has y to the right; otherwise x is.
LONGER = 1.25
# Largest ratio of height to width, and largest number, of maps that are placed below each other.
FLAT, MOST_STACKED = 0.3, 8
# Smallest ratio of height to width of a map; the numbers along a flatter one would be illegible.
FLATTEST = 0.08
# Space around and between maps for axes and colour bar, and the largest height of a map; space for
# titles, which have several lines where maps are next to each other [inches].
BESIDE, BETWEEN, AROUND, HIGHEST = 2.6, 0.5, 1.3, 4.8
TITLE, LONG_TITLE = 0.55, 0.75
# Width of colour bars [inches].
BAR = 0.3
# Number of tick labels along a side of a map.
TICKS = 5
# Views become one common view if each fills this share of it.
ALIKE = 0.7


class FaceWindow(NamedTuple):
    """Visible part of a face: its ends along x and along y [mm]."""

    x: tuple[float, float]
    y: tuple[float, float]

    @property
    def size(self) -> tuple[float, float]:
        """Extent along x and y [mm]."""
        return self.x[1] - self.x[0], self.y[1] - self.y[0]


class Map(NamedTuple):
    """Field ``(nx, ny)`` on a grid, with its title."""

    title: str
    field: Array
    grid: Grid


# --- views --------------------------------------------------------------------------------------


def view_of(fields: Sequence[Array], grid: Grid, margin: float = MARGIN) -> FaceWindow:
    """Return the region where any field is above 0, with a margin, or else the whole grid."""
    there = np.any([field > 0.0 for field in fields], axis=0)
    ends = []
    for direction in (0, 1):
        places, half = centres(grid, direction), 0.5 * grid.pitch[direction]
        inside = places[there.any(axis=1 - direction)] if there.any() else places
        low, high = inside[0] - half, inside[-1] + half
        more = max(margin * (high - low), half)
        reach = 0.5 * grid.size[direction]
        ends.append((float(max(low - more, -reach)), float(min(high + more, reach))))
    return FaceWindow(*ends)


def common_views(views: Sequence[FaceWindow]) -> list[FaceWindow]:
    """Return one view that covers all, repeated, if the views are similar; else return them."""
    together = FaceWindow(
        *((min(ends)[0], max(end for _, end in ends)) for ends in zip(*views, strict=True))
    )
    alike = all(np.prod(view.size) >= ALIKE * np.prod(together.size) for view in views)
    return [together] * len(views) if alike else list(views)


def is_upright(views: Sequence[FaceWindow]) -> bool:
    """Return whether maps have y to the right and x up, because the faces are longer along y."""
    return max(view.size[1] / view.size[0] for view in views) > LONGER


# --- maps ---------------------------------------------------------------------------------------


def draw_maps(title: str, rows: Sequence[Sequence[Map]], label: str, note: str) -> Figure:
    """Draw maps to scale on one colour scale, cut to where they are above 0; a row for each face.

    Their longer side is horizontal. Flat maps are placed below each other, and very flat ones are
    drawn higher than to scale. Maps without values above 0 are left out, unless all are such.
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
    """Draw a colour bar to the right of panels, with the same width whatever their height."""
    aspect = figure.get_figheight() / BAR
    figure.colorbar(colours, ax=axes, label=label, pad=0.01, aspect=aspect, **look)


def scaled_panels(title: str, heights: Sequence[float], columns: int) -> tuple[Figure, Any]:
    """Return a figure and its axes, with a row of panels for each ratio of height to width."""
    width = (WIDTH_INCHES - BESIDE - BETWEEN * (columns - 1)) / columns
    inches = [min(width * height, HIGHEST) for height in heights]
    above = TITLE if columns == 1 else LONG_TITLE
    figure = new_figure(title, AROUND + sum(inches) + above * len(inches), compress=True)
    axes = figure.subplots(len(inches), columns, squeeze=False, height_ratios=inches)
    return figure, axes


def _height(view: FaceWindow, turned: bool) -> float:
    """Return the ratio of height to width of a map."""
    x, y = view.size
    return x / y if turned else y / x


def draw_map(
    axis: Axes, field: Array, grid: Grid, top: float, view: FaceWindow, turned: bool = False
) -> Any:
    """Draw one field, to scale unless very flat; return the image. ``turned``: y to the right."""
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
    """Label the sides of the outer maps."""
    right, up = ("y", "x") if turned else ("x", "y")
    for axis in axes[-1]:
        axis.set_xlabel(f"{right} [mm]")
    for axis in axes[:, 0]:
        axis.set_ylabel(f"{up} [mm]")


def map_top(fields: Sequence[Array]) -> float:
    """Return the top of the colour scale, in the unit of the fields."""
    closed = np.concatenate([field[field > 0.0] for field in fields])
    return float(np.percentile(closed, MAP_PERCENTILE)) if closed.size else 1.0


# --- profiles -----------------------------------------------------------------------------------


def middle(field: Array, direction: int) -> Array:
    """Return the values along x (0) or y (1) next to the middle of the other axis."""
    return np.take(field, field.shape[1 - direction] // 2, axis=1 - direction)


def near_middle(coordinates: Array, direction: int) -> Any:
    """Return which nodes ``(n, 2)`` are on the row along x (0) or y (1) nearest to the middle."""
    across = coordinates[:, 1 - direction]
    distance = np.abs(across)
    return distance <= distance.min() + ROW_SHARE * np.ptp(across)


def centres(grid: Grid, direction: int) -> Array:
    """Return the cell centres along x (0) or y (1)."""
    return (grid.x, grid.y)[direction].ravel()
