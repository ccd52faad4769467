"""Measured surfaces: levelled, filled where points are missing, and averaged onto a grid.

A scan has its own number of points and pitch. The height of a point is taken as the mean over its
own cell, and each cell of the contact's grid gets the mean over its area. In this way no aliasing
occurs, as it would if the points were sampled, and no volume is lost. Along each direction the
integral of the heights is interpolated by a cubic spline. This is exact for planes and parabolas,
and returns the scan itself where the grid is that of the scan (Schoenberg 1973, "Splines and
histograms").
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Grid, Mask

Level = Literal["none", "mean", "plane", "form"]
"""Surface that is subtracted from a scan: none, its mean, its mean plane, or the mean surface of
second order (``form``), each fitted by least squares to the measured points."""

Beyond = Literal["refused", "mirrored"]
"""Treatment of a grid that extends beyond the border of a scan: an error, or a mirrored scan."""

TERMS: dict[Level, tuple[tuple[int, int], ...]] = {
    "none": (),
    "mean": ((0, 0),),
    "plane": ((0, 0), (1, 0), (0, 1)),
    "form": ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)),
}
"""Powers of x and y in the surface that is subtracted."""

ROUNDING = 1e-6
"""Distance, in pitches of the scan, by which a grid may extend beyond it due to rounding."""

MOST_POINTS = 5e7
"""Most points over a grid: 400 MB for each of the few copies in resampling. A scan that is mirrored
over a grid many times its size would have more."""

QUARTER = 1e-9
"""Deviation from a multiple of 90° [rad] within which points are rotated without interpolation."""


@dataclass(frozen=True, eq=False)
class Scan:
    """Measured surface: ``heights`` ``(nx, ny)`` and ``pitch`` ``(dx, dy)`` of its points [mm].

    The first index counts along x, the second along y; a single column is a profile. Heights are
    positive out of the body. NaN or masked heights are missing points. The origin is in the middle.

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
                f"a scan of {dimensions} dimensions, with points {self.pitch} mm apart: give rows "
                "along x and columns along y, and a pitch above 0"
            )
        heights = checks.array(
            "heights of a scan", self.heights, (None, None), masked=np.nan, finite=False, order="K"
        )
        checks.settle(self, heights=heights)
        if not self.measured.any():
            raise InputError("a scan without a point: give one with measured heights")

    @property
    def measured(self) -> Mask:
        """Measured points ``(nx, ny)``."""
        return np.isfinite(self.heights)

    @property
    def missing(self) -> float:
        """Share of missing points."""
        return 1.0 - float(self.measured.mean())

    @property
    def size(self) -> tuple[float, float]:
        """Extent along x and y [mm]."""
        nx, ny = self.heights.shape
        return nx * self.pitch[0], ny * self.pitch[1]

    @property
    def turned_over(self) -> Scan:
        """Scan in the frame of the other body: mirrored along y, with unchanged heights."""
        return replace(self, heights=self.heights[:, ::-1])


def rms(heights: Array) -> float:
    """Return the root mean square of ``heights`` about their mean [mm], without missing points."""
    return float(np.nanstd(heights))


# --- level, and missing points ------------------------------------------------------------------


def fit(scan: Scan, level: Level) -> Array:
    """Return the surface of ``level``, fitted by least squares, at all points ``(nx, ny)`` [mm].

    Raises InputError for fewer measured points than twice the number of terms.
    """
    (nx, ny), points = scan.heights.shape, scan.measured
    terms = [(i, j) for i, j in TERMS[level] if (nx > 1 or i == 0) and (ny > 1 or j == 0)]
    if not terms:
        return np.zeros((nx, ny))
    if np.count_nonzero(points) < 2 * len(terms):
        raise InputError(
            f"{np.count_nonzero(points)} points are too few to fit a {level}: give at least "
            f"{2 * len(terms)}"
        )
    # Coordinates from -1 to 1 make the normal equations well conditioned. The highest powers are
    # those of a product of two terms.
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
    """Return the scan minus the fitted surface of ``level``."""
    return replace(scan, heights=scan.heights - fit(scan, level))


def filled(scan: Scan, most: float = 1.0) -> Scan:
    """Return the scan with every missing point at the mean of its neighbours.

    The neighbours include missing points, so that the filled points form a membrane (Laplace's
    equation with the measured points as boundary values). The membrane is added to the mean surface
    of second order, so that tilt and curvature continue. Raises InputError where more than the
    share ``most`` of the points is missing.
    """
    if scan.missing > most:
        raise InputError(
            f"{scan.missing:.1%} of the points are missing: allow more than {most:.1%}, or measure "
            "the surface again"
        )
    measured = scan.measured
    if measured.all():
        return scan
    enough = np.count_nonzero(measured) >= 2 * len(TERMS["form"])
    mean = fit(scan, "form" if enough else "none")
    membrane = mean + _membrane(scan.heights - mean, measured)
    return replace(scan, heights=np.where(measured, scan.heights, membrane))


def _membrane(heights: Array, measured: Mask) -> Array:
    """Return ``heights`` ``(nx, ny)`` with unmeasured points at the means of their neighbours."""
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import spsolve

    numbers = np.full(heights.shape, -1)
    count = np.count_nonzero(~measured)
    numbers[~measured] = np.arange(count)
    diagonal, known = np.zeros(count), np.zeros(count)
    pairs = []
    for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
        here, there = _neighbours(axis, step)
        own, other, value = numbers[here], numbers[there], heights[there]
        measured_next, missing_next = (own >= 0) & (other < 0), (own >= 0) & (other >= 0)
        diagonal += np.bincount(own[measured_next | missing_next], minlength=count)
        known += np.bincount(own[measured_next], value[measured_next], minlength=count)
        pairs.append((own[missing_next], other[missing_next]))
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


def _neighbours(axis: int, step: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Return the points that have a neighbour one ``step`` along ``axis``, and the neighbours."""
    first, last = slice(None, -1), slice(1, None)
    here, there = (first, last) if step > 0 else (last, first)
    whole = slice(None)
    return ((here, whole), (there, whole)) if axis == 0 else ((whole, here), (whole, there))


# --- onto a grid --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Resampled:
    """Scan averaged onto a grid.

    Attributes
    ----------
    heights
        Mean heights of the cells ``(nx, ny)`` [mm].
    lost
        Root mean square [mm] of the roughness that the cells do not represent: of the scan minus
        the surface with these means, at the points within the grid. It is 0 where no point lies
        completely within the grid.
    beyond
        Share of the cells whose middle lies beyond the border of the scan.
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
    """Return the means of a scan over the cells of ``grid``.

    Parameters
    ----------
    scan
        Scan without missing points.
    grid
        Grid of the contact.
    shift
        Position of the middle of the scan on the grid [mm].
    angle
        Rotation of the scan from x to y [rad]. For angles other than multiples of 90° the scan is
        first interpolated at its own pitch by bicubic splines, which dampens waves of only a few
        points.
    beyond
        Treatment of cells beyond the border of the scan.

    Raises
    ------
    InputError
        For missing points, for a scan of several columns on a line grid or of one column on another
        grid, and for a grid that extends beyond the scan, unless it is ``mirrored``.

    Examples
    --------
    Waves with a length of 16 points, on a grid with cells of 4 points and of 16 points:

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
        raise InputError("a scan has missing points: fill them first")
    if (scan.heights.shape[1] == 1) != grid.line:
        raise InputError(
            f"a scan of {scan.heights.shape[1]} columns: give a profile, of one column, for a line "
            "contact, and more columns for other contacts"
        )
    off = _share_beyond(scan, grid, shift, angle)
    if not grid.line:
        scan = _turned(scan, grid, shift, angle, beyond)
    elif angle:
        raise InputError(f"a profile is turned by {angle:g} rad: give 0 for a line contact")
    heights, points = _on_grid(scan, grid, shift, beyond)
    return Resampled(heights, _lost(points, scan.pitch, heights, grid, shift), off)


def cell_means(values: Array, known: Array, wanted: Array) -> Array:
    """Return means between the edges ``wanted`` from means between the edges ``known``.

    All edges are in ascending order. The integral is interpolated by a spline of third order, or of
    lower order for fewer than 3 values.

    Parameters
    ----------
    values
        Means ``(n, ...)`` between known edges.
    known
        Known edges ``(n + 1,)``.
    wanted
        Edges ``(m + 1,)`` of the means ``(m, ...)`` to return.
    """
    from scipy.interpolate import make_interp_spline

    if np.array_equal(known, wanted):
        return values
    widths = np.diff(known).reshape(-1, *[1] * (values.ndim - 1))
    # The mean is subtracted, so that rounding is relative to the roughness and not to the form.
    mean: Array = values.mean(axis=0)
    integral = np.concatenate([np.zeros((1, *values.shape[1:])), (values - mean) * widths])
    spline = make_interp_spline(known, np.cumsum(integral, axis=0), k=min(3, len(values)))
    heights: Array = np.diff(spline(wanted), axis=0)
    heights /= np.diff(wanted).reshape(-1, *[1] * (values.ndim - 1))
    heights += mean
    return heights


def _share_beyond(scan: Scan, grid: Grid, shift: tuple[float, float], angle: float) -> float:
    """Return the share of the cells whose middle is not on the scan."""
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
    """Return the edges ``(count + 1,)`` of cells that are centred on ``middle`` [mm]."""
    return middle + (np.arange(count + 1.0) - 0.5 * count) * pitch


def _on_grid(
    scan: Scan, grid: Grid, shift: tuple[float, float], beyond: Beyond
) -> tuple[Array, Array]:
    """Return the means over the cells, and the points of the scan, mirrored to cover the grid."""
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
        # A grid as large as the scan may extend beyond it by rounding.
        wanted = np.clip(wanted, known[0], known[-1])
        heights = np.moveaxis(cell_means(np.moveaxis(heights, axis, 0), known, wanted), 0, axis)
    return np.ascontiguousarray(heights), points


def _check_points(scan: Scan, grid: Grid, axes: tuple[int, ...]) -> None:
    """Raise an error for a scan that would have too many points over the grid."""
    points = float(np.prod([grid.size[axis] / scan.pitch[axis] for axis in axes]))
    if points > MOST_POINTS:
        raise InputError(
            f"the grid would hold {points:.2g} points of the scan: give means of several points, "
            "or a smaller grid"
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
    """Return the scan, rotated by ``angle`` from x to y.

    Where it must be interpolated, only the part under the grid is returned.
    """
    quarters = round(angle / (0.5 * np.pi))
    if abs(angle - quarters * 0.5 * np.pi) <= QUARTER:
        dx, dy = scan.pitch
        # numpy rotates from the first to the second axis, which is from x to y.
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
    """Return the root mean square of the points minus the surface with the means of the cells.

    The surface is averaged over the points.
    """
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
