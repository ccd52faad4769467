"""Fields on a grid as maps and profiles."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from sa_solver.types import Array, Grid
from workflow.pictures.style import COLOUR_MAP

# Edge peaks are a few cells: a scale that reached them would leave the rest in one colour.
MAP_PERCENTILE = 99.5
# More profiles than this overlap.
MAX_PROFILES = 6
# Nodes this close to the nearest row count as on the line, as a share of the face: less than half
# the rows of a mesh of 34 nodes, enough for rows that are not quite straight.
ROW_SHARE = 0.01


def draw_map(axis: Axes, field: Array, grid: Grid, top: float) -> Any:
    """One field with y to the right, to scale."""
    half = 0.5 * grid.size[1], 0.5 * grid.size[0]
    axis.grid(visible=False)
    axis.locator_params(axis="y", nbins=3)
    return axis.imshow(
        np.ma.masked_less_equal(field, 0.0),
        origin="lower",
        extent=(-half[0], half[0], -half[1], half[1]),
        cmap=COLOUR_MAP,
        vmin=0.0,
        vmax=top,
        interpolation="nearest",
    )


def map_top(fields: list[Array]) -> float:
    """Top of the colour scale [MPa]."""
    closed = np.concatenate([field[field > 0.0] for field in fields])
    return float(np.percentile(closed, MAP_PERCENTILE)) if closed.size else 1.0


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
