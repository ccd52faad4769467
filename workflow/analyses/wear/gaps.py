"""Gap of the unloaded bodies over a face, as a function of the place on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from sa_solver.surfaces.shapes import rounded_edge
from sa_solver.types import Array, Grid
from workflow.analyses.contact.surfaces import SurfacesOfTwo
from workflow.analyses.wear.case.gaps import GapShape, HeightsGap, ParaboloidGap, RoundedGap
from workflow.case.input_files import read_heights

GapFunction = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class GridHeights:
    """Heights ``(nx, ny)`` [mm] at the centres of a grid; bilinear between and beyond them."""

    grid: Grid
    heights: Array

    def __call__(self, x: Array, y: Array) -> Array:
        """Heights at ``x`` ``(n, 1)`` and ``y`` ``(1, m)``; on the grid itself as they are."""
        grid = self.grid
        if np.array_equal(x, grid.x) and np.array_equal(y, grid.y):
            return self.heights
        along_x = _linear(grid.x.ravel(), x.ravel())
        along_y = _linear(grid.y.ravel(), y.ravel())
        heights: Array = along_x @ self.heights @ along_y.T
        return heights


@dataclass(frozen=True)
class MeasuredGap:
    """Gap of a ``form`` [mm] and of measured ``surfaces``, of the cells of any grid over a face.

    ``face`` is the grid that tells its size.
    """

    form: GapFunction
    surfaces: SurfacesOfTwo
    face: Grid

    def __call__(self, x: Array, y: Array) -> Array:
        """Means over cells at ``x`` ``(n, 1)`` and ``y`` ``(1, m)``, which cover the face."""
        grid = Grid.over(self.face.size, (x.size, y.size), self.face.line)
        # No other places are asked for.
        assert np.allclose(grid.x, x)
        assert np.allclose(grid.y, y)
        return self.form(x, y) + self.surfaces.gap(grid)


def with_measured(form: GapFunction, surfaces: SurfacesOfTwo | None, face: Grid) -> GapFunction:
    """The gap of a form, and of measured surfaces where there are any."""
    return form if surfaces is None else MeasuredGap(form, surfaces, face)


def gap_over(shape: GapShape | None, heights: Array | None, grid: Grid) -> GapFunction:
    """Gap [mm] at x and y of a face that ``grid`` covers.

    ``heights`` on the grid count where the case gives no shape; without either it is 0.
    """
    match shape:
        case RoundedGap():
            return partial(_rounded, shape, grid.size, grid.line)
        case ParaboloidGap():
            return partial(_paraboloid, shape)
        case HeightsGap():
            return GridHeights(grid, read_heights(shape.file))
    if heights is not None:
        return GridHeights(grid, heights)
    return _plane


def _plane(x: Array, y: Array) -> Array:
    return np.zeros_like(x + y)


def _rounded(shape: RoundedGap, size: tuple[float, float], line: bool, x: Array, y: Array) -> Array:
    edges = rounded_edge(np.abs(x), 0.5 * size[0], shape.edge_width, shape.edge_radius)
    if line or shape.end_width is None or shape.end_radius is None:
        return edges
    return edges + rounded_edge(np.abs(y), 0.5 * size[1], shape.end_width, shape.end_radius)


def _paraboloid(shape: ParaboloidGap, x: Array, y: Array) -> Array:
    curvature_x, curvature_y = (
        0.0 if radius is None else 1.0 / radius for radius in (shape.radius_x, shape.radius_y)
    )
    return 0.5 * (curvature_x * x**2 + curvature_y * y**2)


def _linear(known: Array, wanted: Array) -> Array:
    """Weights ``(m, n)`` of values at ``known`` ``(n,)``, ascending, for those at ``wanted``."""
    if len(known) == 1:
        return np.ones((len(wanted), 1))
    # A fifth of a second to import: where it is used.
    from scipy.interpolate import make_interp_spline

    return np.asarray(make_interp_spline(known, np.eye(len(known)), k=1)(wanted))
