"""Measured surfaces: levelled, filled where points are missing, and averaged onto a grid.

A scan has points of its own number and pitch. Each is taken as the mean height over its own cell,
and each cell of the contact's grid gets the mean over its area: nothing finer than the grid comes
back as a wave that is not there, as it would from points alone, and no volume is lost. Along each
direction the integral of the heights is interpolated by a cubic spline, which is exact for planes
and parabolas, and returns the scan itself where the grid is that of the scan
(Schoenberg 1973, "Splines and histograms", on such splines).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Grid, Mask

Level = Literal["none", "mean", "plane", "form"]
"""What is taken off a scan: nothing, its mean, its mean plane, or the mean surface of second order
(form), each by least squares over the points that were measured."""

Beyond = Literal["refused", "mirrored"]
"""What a grid finds beyond the border of a scan: nothing that it takes, or the scan mirrored."""

TERMS: dict[Level, tuple[tuple[int, int], ...]] = {
    "none": (),
    "mean": ((0, 0),),
    "plane": ((0, 0), (1, 0), (0, 1)),
    "form": ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)),
}
"""Powers of x and y in what is taken off."""

ROUNDING = 1e-6
"""Share of a point's pitch by which a grid of the scan's own size may reach beyond it."""

MOST_POINTS = 5e7
"""Points over a grid that are taken: 400 MB for each of the few copies that resampling has. More
come of a scan that is mirrored over a grid many times its size."""

QUARTER = 1e-9
"""Angle [rad] from a multiple of 90° up to which points are turned without interpolation."""


@dataclass(frozen=True, eq=False)
class Scan:
    """Heights as measured: ``heights`` ``(nx, ny)`` and ``pitch`` ``(dx, dy)``, all in mm.

    Rows are along x, columns along y; one column is a profile. Heights count out of the body; NaN
    is a missing point, and so is a masked one. The origin is in the middle.

    Examples
    --------
    A tilted scan of 20 µm pitch, with a hole:

    >>> import numpy as np
    >>> from sa_solver.surfaces.scans import Scan, filled, levelled
    >>> scan = Scan(np.add.outer(np.arange(4) * 1e-3, np.zeros(3)), (0.02, 0.02))
    >>> scan.heights[1, 1] = np.nan
    >>> print(scan.size, f"{scan.missing:.0%} missing")
    (0.08, 0.06) 8% missing
    >>> print(abs(filled(levelled(scan, "plane")).heights).max() < 1e-15)
    True
    """

    heights: Array
    pitch: tuple[float, float]

    def __post_init__(self) -> None:
        dimensions = np.ndim(self.heights)
        if dimensions != 2 or not all(0.0 < pitch < np.inf for pitch in self.pitch):
            raise InputError(
                f"a scan of {dimensions} dimensions, points {self.pitch} mm apart: give "
                "rows along x and columns along y, and a pitch above 0"
            )
        heights = checks.array(
            "heights of a scan", self.heights, (None, None), masked=np.nan, finite=False, order="K"
        )
        checks.settle(self, heights=heights)
        if not self.measured.any():
            raise InputError("a scan without a point: give one with heights")

    @property
    def measured(self) -> Mask:
        """Points that were measured ``(nx, ny)``."""
        return np.isfinite(self.heights)

    @property
    def missing(self) -> float:
        """Share of points that are missing."""
        return 1.0 - float(self.measured.mean())

    @property
    def size(self) -> tuple[float, float]:
        """Extent along x and y [mm]."""
        nx, ny = self.heights.shape
        return nx * self.pitch[0], ny * self.pitch[1]

    @property
    def turned_over(self) -> Scan:
        """As the other body sees it: turned over about x, with its heights still out of its own."""
        return replace(self, heights=self.heights[:, ::-1])


def rms(heights: Array) -> float:
    """Root mean square about the mean [mm], over the points that were measured."""
    return float(np.nanstd(heights))


# --- level, and missing points ------------------------------------------------------------------


def fit(scan: Scan, level: Level, where: Mask | None = None) -> Array:
    """What ``level`` names, at all points ``(nx, ny)`` [mm]: the least squares fit to those there.

    ``where`` narrows the points that count. Raises InputError for fewer than twice the terms.
    """
    (nx, ny), points = scan.heights.shape, scan.measured if where is None else where & scan.measured
    terms = [(i, j) for i, j in TERMS[level] if (nx > 1 or i == 0) and (ny > 1 or j == 0)]
    if not terms:
        return np.zeros((nx, ny))
    if np.count_nonzero(points) < 2 * len(terms):
        raise InputError(
            f"{np.count_nonzero(points)} points to fit a {level} to: give at least {2 * len(terms)}"
        )
    # Coordinates reach from -1 to 1, so that the normal equations are well conditioned; powers up
    # to those of two terms together.
    x, y = (np.vander(np.linspace(-1.0, 1.0, n), 5, increasing=True) for n in (nx, ny))
    moments = x.T @ points @ y
    products = np.array([[moments[i + k, j + m] for k, m in terms] for i, j in terms])
    sums = x.T @ np.where(points, scan.heights, 0.0) @ y
    factors = np.zeros((5, 5))
    at = tuple(np.transpose(terms))
    factors[at] = np.linalg.lstsq(products, sums[at])[0]
    surface: Array = x @ factors @ y.T
    return surface


def levelled(scan: Scan, level: Level) -> Scan:
    """The scan without what ``level`` names."""
    return replace(scan, heights=scan.heights - fit(scan, level))


def filled(scan: Scan, most: float = 1.0) -> Scan:
    """The scan with every missing point at the mean of its neighbours, missing ones included.

    Such a membrane (Laplace's equation with what was measured at its border) is laid over the mean
    surface of second order, so that tilt and curvature go on. Raises InputError where more than
    the share ``most`` is missing.
    """
    if scan.missing > most:
        raise InputError(
            f"{scan.missing:.1%} of the points are missing: allow more than {most:.1%}, or measure "
            "again"
        )
    measured = scan.measured
    if measured.all():
        return scan
    enough = np.count_nonzero(measured) >= 2 * len(TERMS["form"])
    mean = fit(scan, "form" if enough else "none")
    membrane = mean + _membrane(scan.heights - mean, measured)
    return replace(scan, heights=np.where(measured, scan.heights, membrane))


def _membrane(heights: Array, measured: Mask) -> Array:
    """Heights ``(nx, ny)`` with the rest at the means of their neighbours."""
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import spsolve

    numbers = np.full(heights.shape, -1)
    count = np.count_nonzero(~measured)
    numbers[~measured] = np.arange(count)
    diagonal, known = np.zeros(count), np.zeros(count)
    pairs = []
    for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
        here, there = _beside(axis, step)
        own, other, value = numbers[here], numbers[there], heights[there]
        at, beside = (own >= 0) & (other < 0), (own >= 0) & (other >= 0)
        diagonal += np.bincount(own[at | beside], minlength=count)
        known += np.bincount(own[at], value[at], minlength=count)
        pairs.append((own[beside], other[beside]))
    rows, columns = (np.concatenate(ends) for ends in zip(*pairs, strict=True))
    each = np.arange(count)
    matrix = coo_array(
        (
            np.concatenate([diagonal, -np.ones(len(rows))]),
            (np.concatenate([each, rows]), np.concatenate([each, columns])),
        ),
        shape=(count, count),
    )
    whole = heights.copy()
    whole[~measured] = spsolve(matrix.tocsc(), known, permc_spec="MMD_AT_PLUS_A")
    return whole


def _beside(axis: int, step: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Points that have a neighbour one ``step`` along ``axis``, and these neighbours."""
    first, last = slice(None, -1), slice(1, None)
    here, there = (first, last) if step > 0 else (last, first)
    whole = slice(None)
    return ((here, whole), (there, whole)) if axis == 0 else ((whole, here), (whole, there))


# --- onto a grid --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Resampled:
    """A scan on a grid: mean ``heights`` ``(nx, ny)`` [mm] of its cells.

    ``lost`` is the root mean square [mm] of what they do not carry: the scan less the surface with
    these means, over the points within the grid. 0 where no point lies wholly within it.
    ``beyond`` is the share of the cells whose middle lies beyond the border of the scan.
    """

    heights: Array
    lost: float
    beyond: float


def resampled(
    scan: Scan,
    grid: Grid,
    shift: tuple[float, float] = (0.0, 0.0),
    angle: float = 0.0,
    beyond: Beyond = "refused",
) -> Resampled:
    """The scan, none of whose points are missing, as means over the cells of ``grid``.

    ``shift`` [mm] is where its middle lies on the grid, ``angle`` [rad] how far it is turned there,
    from x to y. Turned by anything but quarters it is first interpolated at its own pitch, by
    bicubic splines, which takes some of the waves that are only a few points long.

    Raises InputError for missing points, for a scan of many columns on a line grid or of one on
    another, and for a grid that reaches beyond the scan, unless that is ``mirrored``.

    Examples
    --------
    Waves of 16 points on a grid of cells as large as 4, and as large as 16:

    >>> import numpy as np
    >>> from sa_solver import Grid
    >>> from sa_solver.surfaces.scans import Scan, resampled
    >>> waves = np.sin(2 * np.pi * (np.arange(256) + 0.5) / 16)
    >>> scan = Scan(np.repeat(waves[:, None], 256, axis=1), (0.01, 0.01))
    >>> for cells in (64, 16):
    ...     mean = resampled(scan, Grid.covering(scan.size, (cells, cells)))
    ...     print(f"{np.ptp(mean.heights):.2f} of {np.ptp(waves):.2f}, lost {mean.lost:.2f}")
    1.28 of 1.96, lost 0.03
    0.00 of 1.96, lost 0.71
    """
    if not scan.measured.all():
        raise InputError("a scan with missing points: fill them first")
    if (scan.heights.shape[1] == 1) != grid.line:
        raise InputError(
            f"a scan of {scan.heights.shape[1]} columns: give a profile, of one column, in a line "
            "contact, and more of them elsewhere"
        )
    off = _share_beyond(scan, grid, shift, angle)
    if not grid.line:
        scan = _turned(scan, grid, shift, angle, beyond)
    elif angle:
        raise InputError(f"a profile turned by {angle:g} rad: give 0 in a line contact")
    heights, points = _on_grid(scan, grid, shift, beyond)
    return Resampled(heights, _lost(points, scan.pitch, heights, grid, shift), off)


def cell_means(values: Array, known: Array, wanted: Array) -> Array:
    """Means ``(m, ...)`` between edges ``wanted`` ``(m + 1,)``, of means between edges ``known``.

    ``values`` ``(n, ...)`` are means between ``known`` ``(n + 1,)``; all edges ascend. The integral
    is interpolated by a spline of third order, of lower where there are fewer than 3 values.
    """
    from scipy.interpolate import make_interp_spline

    if np.array_equal(known, wanted):
        return values
    widths = np.diff(known).reshape(-1, *[1] * (values.ndim - 1))
    # About their mean, so that rounding is that of the roughness and not of the form.
    mean: Array = values.mean(axis=0)
    integral = np.concatenate([np.zeros((1, *values.shape[1:])), (values - mean) * widths])
    spline = make_interp_spline(known, np.cumsum(integral, axis=0), k=min(3, len(values)))
    heights: Array = np.diff(spline(wanted), axis=0)
    heights /= np.diff(wanted).reshape(-1, *[1] * (values.ndim - 1))
    heights += mean
    return heights


def _share_beyond(scan: Scan, grid: Grid, shift: tuple[float, float], angle: float) -> float:
    """Share of the cells whose middle is not on the scan."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = grid.x - shift[0], grid.y - (0.0 if grid.line else shift[1])
    room = [
        0.5 * size + ROUNDING * pitch for size, pitch in zip(scan.size, scan.pitch, strict=True)
    ]
    off = np.abs(cos * x + sin * y) > room[0]
    if not grid.line:
        off = off | (np.abs(cos * y - sin * x) > room[1])
    return float(off.mean())


def _edges(count: int, pitch: float, middle: float = 0.0) -> Array:
    """Edges ``(count + 1,)`` of cells about their ``middle``."""
    return middle + (np.arange(count + 1.0) - 0.5 * count) * pitch


def _on_grid(
    scan: Scan, grid: Grid, shift: tuple[float, float], beyond: Beyond
) -> tuple[Array, Array]:
    """Means over the cells, and the points of the scan, mirrored as far as the grid reaches."""
    points, axes = scan.heights, (0,) if grid.line else (0, 1)
    _check_points(scan, grid, axes)
    for axis in axes:
        reach = 0.5 * grid.size[axis] + abs(shift[axis]) - 0.5 * scan.size[axis]
        more = int(np.ceil(reach / scan.pitch[axis] - ROUNDING))
        if more > 0:
            _check_reach(beyond, grid, scan, shift)
            width = [(more, more) if axis == other else (0, 0) for other in (0, 1)]
            points = np.pad(points, width, mode="symmetric")
    heights = points
    for axis in axes:
        known = _edges(points.shape[axis], scan.pitch[axis], shift[axis])
        wanted = _edges(grid.shape[axis], grid.pitch[axis])
        wanted = np.clip(wanted, known[0], known[-1])  # rounding of a grid as large as the scan
        heights = np.moveaxis(cell_means(np.moveaxis(heights, axis, 0), known, wanted), 0, axis)
    return np.ascontiguousarray(heights), points


def _check_points(scan: Scan, grid: Grid, axes: tuple[int, ...]) -> None:
    """Refuse a scan that would have too many points over the grid."""
    points = float(np.prod([grid.size[axis] / scan.pitch[axis] for axis in axes]))
    if points > MOST_POINTS:
        raise InputError(
            f"{points:.2g} points of the scan's pitch over the grid: take the means of several "
            "points, or a smaller grid"
        )


def _check_reach(beyond: Beyond, grid: Grid, scan: Scan, shift: tuple[float, float]) -> None:
    if beyond == "mirrored":
        return
    sides = [f"{side:g} mm" for side in (*grid.size, *scan.size)]
    line = grid.line
    grid_text, scan_text = sides[0] if line else " x ".join(sides[:2]), " x ".join(sides[2:])
    raise InputError(
        f"the scan, {sides[2] if line else scan_text}, ends within the grid of {grid_text}"
        f"{' where it is put' if any(shift) else ''}: take a smaller grid or a larger scan, or let "
        "it be mirrored beyond its border"
    )


def _turned(
    scan: Scan, grid: Grid, shift: tuple[float, float], angle: float, beyond: Beyond
) -> Scan:
    """The scan turned from x to y, over as much of it as the grid reaches where it is not exact."""
    quarters = round(angle / (0.5 * np.pi))
    if abs(angle - quarters * 0.5 * np.pi) <= QUARTER:
        dx, dy = scan.pitch
        # numpy turns from rows to columns, which is from x to y.
        return Scan(np.rot90(scan.heights, quarters), (dx, dy) if quarters % 2 == 0 else (dy, dx))
    from scipy.ndimage import map_coordinates

    pitch = min(scan.pitch)
    half = [0.5 * side + abs(by) for side, by in zip(grid.size, shift, strict=True)]
    counts = [2 * int(np.ceil(reach / pitch - ROUNDING)) for reach in half]
    along, across = (pitch * (np.arange(count) - 0.5 * (count - 1)) for count in counts)
    cos, sin = np.cos(angle), np.sin(angle)
    x = cos * along[:, None] + sin * across[None, :]
    y = cos * across[None, :] - sin * along[:, None]
    corners = np.array([[i * half[0], j * half[1]] for i in (-1, 1) for j in (-1, 1)])
    own = np.abs(corners @ np.array([[cos, -sin], [sin, cos]])).max(axis=0)
    if np.any(own > 0.5 * np.array(scan.size) + ROUNDING * pitch):
        _check_reach(beyond, grid, scan, (1.0, 1.0))
    places = [
        place / step + 0.5 * (count - 1)
        for place, step, count in zip((x, y), scan.pitch, scan.heights.shape, strict=True)
    ]
    return Scan(map_coordinates(scan.heights, places, order=3, mode="reflect"), (pitch, pitch))


def _lost(
    points: Array,
    pitch: tuple[float, float],
    heights: Array,
    grid: Grid,
    shift: tuple[float, float],
) -> float:
    """Root mean square of points less the means over them of the surface with cells' means."""
    back = heights
    for axis in (0,) if grid.line else (0, 1):
        edges = _edges(points.shape[axis], pitch[axis], shift[axis])
        cells = _edges(grid.shape[axis], grid.pitch[axis])
        room = ROUNDING * pitch[axis]
        inside = np.flatnonzero((edges[:-1] >= cells[0] - room) & (edges[1:] <= cells[-1] + room))
        if not inside.size:
            return 0.0
        points = np.take(points, inside, axis)
        wanted = np.clip(edges[inside[0] : inside[-1] + 2], cells[0], cells[-1])
        back = np.moveaxis(cell_means(np.moveaxis(back, axis, 0), cells, wanted), 0, axis)
    return float(np.sqrt(np.mean((points - back) ** 2)))
