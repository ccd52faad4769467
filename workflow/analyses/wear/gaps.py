"""Gap of the unloaded bodies over a face, as a function of the position on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from sa_solver.surfaces.shapes import rounded_edge
from sa_solver.types import Array, Grid
from workflow.analyses.contact.surfaces import SurfacesOfTwo
from workflow.analyses.wear.case.gaps import GapShape, HeightsGap, ParaboloidGap, RoundedGap
from workflow.case.files.input_files import read_heights
from workflow.models.gaps import AddedGap, GapFunction, GridHeights


@dataclass(frozen=True)
class MeasuredHeights:
    """Gap of measured surfaces, as means over the cells of any grid on a face.

    ``face`` is a grid of the size of the face.
    """

    surfaces: SurfacesOfTwo
    face: Grid

    def __call__(self, x: Array, y: Array) -> Array:
        """Return means over cells centred at ``x`` ``(n, 1)`` and ``y`` ``(1, m)``."""
        grid = Grid.over(self.face.size, (x.size, y.size), self.face.line)
        # The function is called only at the centres of a grid over the whole face.
        assert np.allclose(grid.x, x)
        assert np.allclose(grid.y, y)
        return self.surfaces.gap(grid)


def with_measured(form: GapFunction, surfaces: SurfacesOfTwo | None, face: Grid) -> GapFunction:
    """Return the gap of a form, plus that of measured surfaces if there are any."""
    return form if surfaces is None else AddedGap(MeasuredHeights(surfaces, face)).on(form)


def gap_over(shape: GapShape | None, heights: Array | None, grid: Grid) -> GapFunction:
    """Return the gap [mm] as a function of x and y on the face that ``grid`` covers.

    ``heights`` on the grid apply if the case gives no shape; without either the gap is 0.
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
