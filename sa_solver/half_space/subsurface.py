"""Stress inside either body of a contact, under the tractions on a grid.

Each body is a half-space of its own. Body 2 lies in z > 0, under the tractions as they are. Body 1
lies in z < 0, under the opposite tractions. Mirrored by z → -z, body 1 is a half-space like body 2
under (-qx, -qy, p); its yz and zx change sign when it is mirrored back. Stress has six components
xx, yy, zz, xy, yz, zx in the interface frame, tension positive [MPa]. It is due to the tractions
alone; a bulk stress must be added.

Tractions are uniform on each cell. Stress is computed below the centres of the cells, or at any
points, and is exact for such tractions (:mod:`sa_solver.half_space.subsurface_influence`). At the
surface zz, yz and zx are -p, -qy and -qx in both bodies.

Inside a body, the stress converges with the second order of the pitch where the traction of a cell
is the mean over the cell (order 3/2 for Hertz's pressure sampled at the centres). At the surface
the order is 1/2 where shear rises like a square root: the tension 2 µ p0 at the trailing edge of a
sliding cylinder of half-width a is 11, 8 and 6 % too low for a pitch of a/64, a/128 and a/256. The
trailing edge is that from which the shear on the body points away: for qx > 0 it is the -x end of
body 2 and the +x end of body 1.

Source: Liu & Wang 2002, J. Tribol. 124, 36, doi:10.1115/1.1401017 (convolution at a depth).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

import numpy as np
import scipy.fft

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.half_space.layered_stress import layered_rectangles, layered_strips
from sa_solver.half_space.operator import padded_shape
from sa_solver.half_space.subsurface_influence import (
    INDICES,
    XX,
    XY,
    YY,
    YZ,
    ZX,
    ZZ,
    rectangle_stress,
    strip_stress,
)
from sa_solver.half_space.symbols import continued, quarter_edges, symbol_of
from sa_solver.transforms.padded import SpectralFilter, Transform
from sa_solver.types import Array, Grid, Indices, Material

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")
"""Names of the components of stress, in order."""

BORDER = 1e-9
"""Distance, in pitches, within which a point of the surface lies on the border of a cell."""

SHEAR = (0, 1)
"""Indices of the tractions along the surface."""

INSIDE = (XX, YY, ZZ, XY, YZ, ZX)
ALONG_SURFACE = (XX, YY, XY)
"""Components that are convolutions at the surface; the others equal the tractions there."""

MIRROR: dict[int, Array] = {1: np.array([-1.0, -1.0, 1.0]), 2: np.ones(3)}
"""Signs of the tractions on the half-space z > 0, relative to those on body 2. Body 1 is mirrored
to this half-space, body 2 lies in it."""


class SubsurfaceError(InputError):
    """Invalid body, depth, section or field of tractions."""


class SubsurfaceStress:
    """Stress in one body under tractions on ``grid``.

    ``count`` is the number of zero-padded convolutions so far, each from three tractions to six
    components of stress inside the body or three at the surface. The symbols of the latest depth
    are cached.

    Examples
    --------
    The largest shear stress under a cylinder is 0.30 of the peak pressure (1000 MPa). It lies at a
    depth of 0.78 half-widths (0.5 mm):

    >>> import numpy as np
    >>> from sa_solver import Grid, Material, SubsurfaceStress
    >>> grid = Grid.line_contact(2.0, 200)
    >>> traction = np.zeros((3, 200, 1))
    >>> traction[2] = 1000.0 * np.sqrt(np.maximum(0.0, 1.0 - (grid.x / 0.5) ** 2))
    >>> body = SubsurfaceStress(grid, Material(young=210e3, poisson=0.3), body=1)
    >>> depths = np.linspace(0.01, 1.0, 100)
    >>> xx, yy, zz, xy, yz, zx = body.section(traction, "x", 0.0, depths)
    >>> shear = 0.5 * np.abs(xx - zz)[100]
    >>> print(f"{shear.max():.0f} MPa at {depths[shear.argmax()]:.2f} mm")
    300 MPa at 0.39 mm
    """

    def __init__(self, grid: Grid, material: Material, body: Literal[1, 2]) -> None:
        """Prepare for ``body``, whose stress depends on Poisson's ratio of its ``material`` only.

        Raises SubsurfaceError unless the body is 1 or 2.
        """
        if body not in MIRROR:
            raise SubsurfaceError(f"body is {body}: give 1 or 2")
        self.grid, self.material = grid, material
        self.count = 0
        self._mirror = MIRROR[body]
        self._padded = padded_shape(grid)
        self._filter = lru_cache(1)(self._plan)

    def at_depth(self, traction: Array, depth: float) -> Array:
        """Return the stress ``(6, nx, ny)`` [MPa] at ``depth`` [mm] below the cells' centres.

        Depth 0 is the surface. ``traction`` ``(3, nx, ny)`` [MPa] is ordered qx, qy, p and acts on
        body 2, also for the stress in body 1. Raises SubsurfaceError for another shape or a depth
        below 0.
        """
        traction, (depth,) = self._checked(traction, depth)
        self.count += 1
        rows = ALONG_SURFACE if depth == 0.0 else INSIDE
        stress = np.empty((6, *self.grid.shape))
        stress[list(rows)] = self._filter(depth, rows).apply(self._mirrored(traction))
        if depth == 0.0:
            # Set exactly, so that they equal those of the other body to the last digit.
            stress[[ZX, YZ, ZZ]] = -traction
        else:
            stress[[YZ, ZX]] *= self._mirror[0]
        return stress

    def along_surface(self, traction: Array, depth: float) -> Array:
        """Return the components xx, yy and xy alone, ``(3, nx, ny)``, with half the transforms.

        The arguments are those of :meth:`at_depth`.
        """
        traction, (depth,) = self._checked(traction, depth)
        self.count += 1
        return self._filter(depth, ALONG_SURFACE).apply(self._mirrored(traction))

    def section(self, traction: Array, axis: Literal["x", "y"], at: float, depths: Array) -> Array:
        """Return the stress ``(6, n, len(depths))`` in a plane normal to the surface.

        The plane has n cells along ``axis``. The arguments are those of :func:`sections`.
        """
        return sections([(self, traction, depths)], axis, at)[0]

    def at_points(self, traction: Array, points: Array) -> Array:
        """Return the stress ``(6, n)`` [MPa] at given points, which may lie off the grid.

        The stress is summed over all loaded cells, point by point. For many points at one depth
        below the centres of the cells the other methods are faster. At depths of less than a pitch
        the result shows the individual cells.

        Parameters
        ----------
        traction
            Tractions as in :meth:`at_depth`.
        points
            Coordinates x, y and depth below the surface of each point ``(n, 3)`` [mm].

        Raises
        ------
        SubsurfaceError
            For another shape, a depth below 0, and points of the surface on the border between two
            cells, where the tractions jump.

        Examples
        --------
        The largest von Mises stress under a ball is 0.62 of the peak pressure (1000 MPa). It lies
        at a depth of 0.48 contact radii (0.5 mm):

        >>> import numpy as np
        >>> from sa_solver import Grid, Material, SubsurfaceStress, von_mises
        >>> grid = Grid.covering((1.1, 1.1), (44, 44))
        >>> traction = np.zeros((3, 44, 44))
        >>> inside = np.maximum(0.0, 1.0 - (grid.x**2 + grid.y**2) / 0.5**2)
        >>> traction[2] = 1000.0 * np.sqrt(inside)
        >>> body = SubsurfaceStress(grid, Material(young=210e3, poisson=0.3), body=1)
        >>> depths = np.linspace(0.1, 0.4, 31)
        >>> points = np.stack([0.0 * depths, 0.0 * depths, depths], axis=1)
        >>> equivalent = von_mises(body.at_points(traction, points))
        >>> print(f"{equivalent.max():.0f} MPa at {depths[equivalent.argmax()]:.2f} mm")
        620 MPa at 0.24 mm
        """
        points = checks.array("points", points, (None, 3), error=SubsurfaceError)
        traction, depths = self._checked(traction, *points[:, 2])
        stress = np.zeros((6, len(points)))
        mirrored = self._mirrored(traction)
        loaded = [np.flatnonzero(mirrored.any(axis=axes)) for axes in ((0, 2), (0, 1))]
        if not all(map(len, loaded)):
            return stress
        # The last cell comes first, so that point minus edge ascends.
        (x, y), (rows, columns) = zip(*map(self._edges, (0, 1), loaded), strict=True)
        mirrored = mirrored[:, rows, columns][:, ::-1, ::-1]
        for column, (at, depth) in enumerate(zip(points[:, :2], depths, strict=True)):
            distances = [at[0] - x, at[1] - y]
            self._check_border(distances, depth)
            influence = self._influence(distances, depth)
            stress[:, column] = np.einsum("ijxy,jxy->i", influence, mirrored)
        stress[[YZ, ZX]] *= self._mirror[0]
        return stress

    def _edges(self, axis: int, loaded: Indices) -> tuple[Array, slice]:
        """Return the edges [mm] of the cells from the last ``loaded`` one to the first.

        The slice of these cells, in ascending order, is returned as well.
        """
        rows = slice(int(loaded[0]), int(loaded[-1]) + 1)
        count, pitch = self.grid.shape[axis], self.grid.pitch[axis]
        edges = (np.arange(count + 1.0) - 0.5 * count) * pitch
        return edges[rows.start : rows.stop + 1][::-1], rows

    def _check_border(self, distances: list[Array], depth: float) -> None:
        """Raise an error for a point of the surface whose distance from an edge is 0."""
        axes = 1 if self.grid.line else 2
        pairs = zip(distances[:axes], self.grid.pitch, strict=False)
        if depth == 0.0 and any(np.abs(edges).min() < BORDER * pitch for edges, pitch in pairs):
            raise SubsurfaceError(
                "a point of the surface lies on the border between two cells, where tractions "
                "jump: give a point inside a cell, or a depth above 0"
            )

    def _sources(self, traction: Array, axis: Literal["x", "y"], at: float) -> Array | None:
        """Return the spectra of the rows of cells along a section, or None without load.

        Rows on both sides are combined: see :func:`_folded`.
        """
        if axis not in ("x", "y") or (axis == "y" and self.grid.line):
            raise SubsurfaceError(f"section along {axis}: give x, or y unless it is a line contact")
        along = "xy".index(axis)
        row = self._nearest_row(1 - along, at)
        mirrored = np.moveaxis(self._mirrored(traction), along + 1, 1)
        loaded = np.flatnonzero(mirrored.any(axis=(0, 1)))
        if len(loaded) == 0:
            return None
        rows = slice(loaded[0], loaded[-1] + 1)
        spectra = scipy.fft.rfft(mirrored[:, :, rows], self._padded[along], axis=1)
        return _folded(spectra, row - np.arange(rows.start, rows.stop))

    def _along_section(
        self, sources: Sequence[Array], axis: Literal["x", "y"], depth: float
    ) -> list[Array]:
        """Return the stress ``(6, n)`` at a ``depth`` of the section, for each of the sources."""
        along = "xy".index(axis)
        period, count = self._padded[along], self.grid.shape[along]
        rows = np.arange(max(spectra.shape[-1] for spectra in sources) + 1, dtype=np.float64) - 0.5
        edges = [quarter_edges(period, self.grid.pitch[along]), rows * self.grid.pitch[1 - along]]
        kernels = self._influence(edges if along == 0 else edges[::-1], depth)
        kernels = np.moveaxis(kernels, along + 2, 2)
        return [whole[:, :count] for whole in _along_rows(kernels, sources, along, period)]

    def _nearest_row(self, axis: int, at: float) -> int:
        centres = (self.grid.x[:, 0], self.grid.y[0])[axis]
        if not abs(at) <= 0.5 * self.grid.size[axis]:
            raise SubsurfaceError(
                f"section at {at:g} mm, but the grid ends at {0.5 * self.grid.size[axis]:g} mm: "
                "give a place on the grid"
            )
        return int(np.argmin(np.abs(centres - at)))

    def _checked(self, traction: Array, *depths: float) -> tuple[Array, list[float]]:
        """Return tractions and depths, checked."""
        shape = 3, *self.grid.shape
        traction = checks.array("tractions", traction, shape, error=SubsurfaceError)
        error = SubsurfaceError
        return traction, [checks.number("depth", at, least=0.0, error=error) for at in depths]

    def _mirrored(self, traction: Array) -> Array:
        """Return the tractions on the half-space z > 0 to which the body is mirrored."""
        return traction * self._mirror[:, None, None]

    @property
    def _elasticity(self) -> object:
        """What decides about the stress: Poisson's ratio, and how stiff layers are."""
        body = self.material
        return (body.young, body.poisson, body.layers) if body.layers else body.poisson

    def _influence(self, edges: list[Array], depth: float) -> Array:
        body = self.material
        if self.grid.line:
            strips = (
                layered_strips(edges[0], depth, body)
                if body.layers
                else strip_stress(edges[0], depth, body.poisson)
            )
            return strips[..., None]
        if body.layers:
            return layered_rectangles(edges[0], edges[1], depth, body)
        return rectangle_stress(edges[0], edges[1], depth, body.poisson)

    def _plan(self, depth: float, rows: Sequence[int]) -> SpectralFilter:
        """Return the filter from tractions to the components ``rows`` of stress at a ``depth``.

        Its symbols are real, because shear tractions and the components yz and zx are multiplied by
        the imaginary unit.
        """
        edges = list(map(quarter_edges, self._padded, self.grid.pitch))
        kernels = self._influence(edges, depth)
        symbols = [[self._symbol(kernels[i, k], i, k) for k in range(3)] for i in rows]
        count = max(3, len(rows))
        transform = Transform(self.grid.shape, self._padded, count)
        outputs = [place for place, i in enumerate(rows) if i in (YZ, ZX)]
        return SpectralFilter(transform, symbols, (SHEAR, outputs))

    def _symbol(self, kernel: Array, component: int, traction: int) -> Array:
        along_x, along_y = odd = (
            _odd(component, traction, 0),
            _odd(component, traction, 1),
        )
        symbol = symbol_of(kernel, self._padded, odd)
        # The imaginary unit of a kernel that is odd along one axis is in that of its components.
        sign_changes = component in (YZ, ZX) and along_x != along_y
        return -symbol if sign_changes or (along_x and along_y) else symbol


def sections(
    wanted: Sequence[tuple[SubsurfaceStress, Array, Array]], axis: Literal["x", "y"], at: float
) -> list[Array]:
    """Return the stress in a plane normal to the surface, for each of several bodies.

    Fields are transformed along the section only, rows without load are left out, and rows at the
    same distance on both sides are combined. This takes a tenth of the time of computing planes of
    constant depth. Most of the time goes into influence coefficients, which are shared by bodies
    with the same grid, Poisson's ratio and depth.

    Parameters
    ----------
    wanted
        For each body the solver, the tractions as in :meth:`SubsurfaceStress.at_depth`, and the
        depths ``(k,)`` >= 0 [mm].
    axis
        Direction of the section, ``x`` or ``y``.
    at
        Place of the section along the other axis [mm]; it is moved to the nearest row of cells.

    Returns
    -------
    list of Array
        Stress ``(6, n, k)`` [MPa] of each body, below the n cells along ``axis``.

    Raises
    ------
    SubsurfaceError
        For another shape, a depth below 0, a plane off the grid or a section along y of a line
        contact.

    Examples
    --------
    Two bodies pressed together without friction have the same normal stresses:

    >>> import numpy as np
    >>> from sa_solver import Grid, Material, SubsurfaceStress
    >>> from sa_solver.half_space.subsurface import sections
    >>> grid, steel = Grid.line_contact(2.0, 50), Material(young=210e3, poisson=0.3)
    >>> traction = np.zeros((3, 50, 1))
    >>> traction[2] = 1000.0 * np.sqrt(np.maximum(0.0, 1.0 - (grid.x / 0.5) ** 2))
    >>> bodies = [SubsurfaceStress(grid, steel, number) for number in (1, 2)]
    >>> depths = np.array([0.1, 0.2])
    >>> one, two = sections([(body, traction, depths) for body in bodies], "x", 0.0)
    >>> print(one.shape, np.abs(one[:4] - two[:4]).max())
    (6, 50, 2) 0.0
    """
    stresses: list[Array] = []
    shared: dict[tuple[Grid, object, float], list[tuple[SubsurfaceStress, Array, Array]]] = {}
    at = checks.number("place of a section", at, error=SubsurfaceError)
    for body, traction, depths in wanted:
        depths = checks.array("depths", depths, (None,), error=SubsurfaceError)
        traction, _ = body._checked(traction, *depths)
        spectra = body._sources(traction, axis, at)
        stress = np.zeros((6, body.grid.shape["xy".index(axis)], len(depths)))
        stresses.append(stress)
        if spectra is None:
            continue
        for column, depth in enumerate(depths.tolist()):
            alike = shared.setdefault((body.grid, body._elasticity, depth), [])
            alike.append((body, spectra, stress[:, :, column]))
    for (_, _, depth), alike in shared.items():
        bodies, sources, columns = zip(*alike, strict=True)
        found = bodies[0]._along_section(sources, axis, depth)
        for column, stress in zip(columns, found, strict=True):
            column[:] = stress
    for (body, *_), stress in zip(wanted, stresses, strict=True):
        stress[[YZ, ZX]] *= body._mirror[0]
    return stresses


def _odd(component: int, traction: int, axis: int) -> bool:
    """Return whether a component of stress under a traction is odd along ``axis`` (0: x, 1: y)."""
    return (*INDICES[component], traction).count(axis) % 2 == 1


def _folded(spectra: Array, offsets: Array) -> Array:
    """Return sums and differences of the spectra of rows at equal distances on both sides.

    ``offsets`` ``(r,)`` are the positions of the rows relative to the section, in rows. The result
    ``(2, 3, frequency, distance)`` holds the sums, for even kernels, and the differences, for odd
    ones.
    """
    folded = np.zeros((2, *spectra.shape[:2], np.abs(offsets).max() + 1), dtype=np.complex128)
    ahead = offsets >= 0
    folded[..., offsets[ahead]] = spectra[..., ahead]
    behind = spectra[..., ~ahead]
    folded[..., -offsets[~ahead]] += np.stack([behind, -behind])
    return folded


def _along_rows(kernels: Array, sources: Sequence[Array], along: int, period: int) -> list[Array]:
    """Return the convolutions along the rows of cells, summed over the rows, each ``(6, period)``.

    ``kernels`` are ``(6, 3, distance, row)``. ``sources`` are the folded spectra of the tractions,
    of as many rows or fewer. ``along`` is the direction of the rows.
    """
    totals = [np.zeros((6, spectra.shape[2]), dtype=np.complex128) for spectra in sources]
    for i, k in np.ndindex(6, 3):
        whole = continued(kernels[i, k], 0, period, _odd(i, k, along))
        transformed = scipy.fft.rfft(whole, axis=0)
        for total, spectra in zip(totals, sources, strict=True):
            rows = spectra[int(_odd(i, k, 1 - along)), k]
            total[i] += np.einsum("fr,fr->f", transformed[:, : rows.shape[1]], rows)
    return [scipy.fft.irfft(total, period, axis=1) for total in totals]
