"""Stress inside either body of a contact, under the tractions on a grid.

Each body is a half-space of its own. Body 2 lies in z > 0 and feels the tractions as they are;
body 1 lies in z < 0 and feels the opposite ones: mirrored by z → -z it is a half-space like body 2
under (-qx, -qy, p), whose yz and zx change sign on the way back. Stress has six components xx, yy,
zz, xy, yz, zx in the interface frame, tension positive [MPa]. It is that of the tractions alone: a
bulk stress is to be added.

Tractions are uniform on each cell and stress is taken below the cells' centres, or at any points,
where it is exact for such tractions (:mod:`sa_solver.half_space.subsurface_influence`). At the
surface zz, yz and zx are -p, -qy and -qx in both bodies.

Inside, stress is of second order in the pitch where a cell's traction is the mean over it (3/2 for
Hertz's pressure sampled at the centres). At the surface it is of order 1/2 where shear starts as a
square root: the tension 2 µ p0 at the trailing edge of a sliding cylinder of half-width a
comes out 11, 8 and 6 % low for a pitch of a/64, a/128 and a/256. A body is pulled there behind the
shear it feels: body 2 at the -x end for qx > 0, body 1 at the +x end.

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
"""Share of a pitch up to which a point of the surface lies on the border of a cell."""

SHEAR = (0, 1)
"""The tractions along the surface."""

INSIDE = (XX, YY, ZZ, XY, YZ, ZX)
ALONG_SURFACE = (XX, YY, XY)
"""Components that convolutions give at the surface, where the others are the tractions."""

MIRROR: dict[int, Array] = {1: np.array([-1.0, -1.0, 1.0]), 2: np.ones(3)}
"""Tractions on the half-space z > 0 that a body is or mirrors, over those on body 2."""


class SubsurfaceError(InputError):
    """A body, depth, section or field of tractions that does not fit."""


class SubsurfaceStress:
    """Stress in one body under tractions on ``grid``.

    ``count`` is the number of zero-padded convolutions done so far, from three tractions to six
    components of stress inside and three at the surface. The symbols of the latest depth are kept.

    Examples
    --------
    The largest shear stress under a cylinder is 0.30 of the peak pressure (1000 MPa), 0.78 half
    widths (0.5 mm) deep:

    >>> import numpy as np
    >>> from sa_solver import Grid, Material, SubsurfaceStress
    >>> grid = Grid.strips(2.0, 200)
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
        """Plan for ``body``, of which only Poisson's ratio counts.

        Raises SubsurfaceError unless the body is 1 or 2.
        """
        if body not in MIRROR:
            raise SubsurfaceError(f"body {body}: there are bodies 1 and 2")
        self.grid, self.poisson = grid, material.poisson
        self.count = 0
        self._mirror = MIRROR[body]
        self._padded = padded_shape(grid)
        self._filter = lru_cache(1)(self._plan)

    def at_depth(self, traction: Array, depth: float) -> Array:
        """Stress ``(6, nx, ny)`` at ``depth`` below the cells' centres, 0 at the surface [mm].

        ``traction`` ``(3, nx, ny)`` is ordered qx, qy, p, on body 2 whichever the body [MPa].
        Raises SubsurfaceError for another shape or a depth below 0.
        """
        traction, (depth,) = self._checked(traction, depth)
        self.count += 1
        rows = ALONG_SURFACE if depth == 0.0 else INSIDE
        stress = np.empty((6, *self.grid.shape))
        stress[list(rows)] = self._filter(depth, rows).apply(self._felt(traction))
        if depth == 0.0:
            # So that they are what the other body feels to the last digit.
            stress[[ZX, YZ, ZZ]] = -traction
        else:
            stress[[YZ, ZX]] *= self._mirror[0]
        return stress

    def along_surface(self, traction: Array, depth: float) -> Array:
        """Its components xx, yy and xy alone, ``(3, nx, ny)``, with half as many transforms."""
        traction, (depth,) = self._checked(traction, depth)
        self.count += 1
        return self._filter(depth, ALONG_SURFACE).apply(self._felt(traction))

    def section(self, traction: Array, axis: Literal["x", "y"], at: float, depths: Array) -> Array:
        """Stress ``(6, n, len(depths))`` in a plane normal to the surface, n cells along ``axis``.

        As of :func:`sections`.
        """
        return sections([(self, traction, depths)], axis, at)[0]

    def at_points(self, traction: Array, points: Array) -> Array:
        """Stress ``(6, n)`` at ``points`` ``(n, 3)``: x, y and the depth below the surface [mm].

        ``traction`` is that of :meth:`at_depth`. Points may lie beside the grid too. It is the sum
        over all loaded cells, point by point: where many points lie at one depth under the cells'
        centres, the other methods are faster. Less than a pitch deep it shows the single cells.

        Raises SubsurfaceError for another shape, a depth below 0, and points of the surface on the
        border between two cells, where tractions jump.

        Examples
        --------
        The largest von Mises stress under a ball is 0.62 of the peak pressure (1000 MPa), 0.48
        radii of the contact (0.5 mm) deep:

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
        felt = self._felt(traction)
        loaded = [np.flatnonzero(felt.any(axis=axes)) for axes in ((0, 2), (0, 1))]
        if not all(map(len, loaded)):
            return stress
        # From the last cell back, so that point less source ascends.
        (x, y), (rows, columns) = zip(*map(self._edges, (0, 1), loaded), strict=True)
        felt = felt[:, rows, columns][:, ::-1, ::-1]
        for column, (at, depth) in enumerate(zip(points[:, :2], depths, strict=True)):
            away = [at[0] - x, at[1] - y]
            self._check_border(away, depth)
            stress[:, column] = np.einsum("ijxy,jxy->i", self._influence(away, depth), felt)
        stress[[YZ, ZX]] *= self._mirror[0]
        return stress

    def _edges(self, axis: int, loaded: Indices) -> tuple[Array, slice]:
        """Edges [mm] of the cells from the first to the last ``loaded`` one, the last one first."""
        rows = slice(int(loaded[0]), int(loaded[-1]) + 1)
        count, pitch = self.grid.shape[axis], self.grid.pitch[axis]
        edges = (np.arange(count + 1.0) - 0.5 * count) * pitch
        return edges[rows.start : rows.stop + 1][::-1], rows

    def _check_border(self, away: list[Array], depth: float) -> None:
        """Refuse a point of the surface that lies on edges ``away`` by 0 along x or y."""
        axes = 1 if self.grid.line else 2
        pairs = zip(away[:axes], self.grid.pitch, strict=False)
        if depth == 0.0 and any(np.abs(edges).min() < BORDER * pitch for edges, pitch in pairs):
            raise SubsurfaceError(
                "a point of the surface lies on the border between two cells, where tractions "
                "jump: take one within a cell, or a depth above 0"
            )

    def _sources(self, traction: Array, axis: Literal["x", "y"], at: float) -> Array | None:
        """Spectra along a section of the rows of cells: see :func:`_folded`; None without load."""
        if axis not in ("x", "y") or (axis == "y" and self.grid.line):
            raise SubsurfaceError(f"section along {axis}: must be x or, but for lines, y")
        along = "xy".index(axis)
        row = self._nearest_row(1 - along, at)
        felt = np.moveaxis(self._felt(traction), along + 1, 1)
        loaded = np.flatnonzero(felt.any(axis=(0, 1)))
        if len(loaded) == 0:
            return None
        rows = slice(loaded[0], loaded[-1] + 1)
        spectra = scipy.fft.rfft(felt[:, :, rows], self._padded[along], axis=1)
        return _folded(spectra, row - np.arange(rows.start, rows.stop))

    def _along_section(
        self, sources: Sequence[Array], axis: Literal["x", "y"], depth: float
    ) -> list[Array]:
        """Stress ``(6, n)`` at a depth of the section under each of the ``sources``."""
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
                f"section at {at:g} mm: the grid ends at {0.5 * self.grid.size[axis]:g} mm"
            )
        return int(np.argmin(np.abs(centres - at)))

    def _checked(self, traction: Array, *depths: float) -> tuple[Array, list[float]]:
        """Tractions and depths as all methods take them."""
        shape = 3, *self.grid.shape
        traction = checks.array("tractions", traction, shape, error=SubsurfaceError)
        error = SubsurfaceError
        return traction, [checks.number("depth", at, least=0.0, error=error) for at in depths]

    def _felt(self, traction: Array) -> Array:
        """Tractions on the half-space z > 0 that the body is or mirrors."""
        return traction * self._mirror[:, None, None]

    def _influence(self, edges: list[Array], depth: float) -> Array:
        if self.grid.line:
            return strip_stress(edges[0], depth, self.poisson)[..., None]
        return rectangle_stress(edges[0], edges[1], depth, self.poisson)

    def _plan(self, depth: float, rows: Sequence[int]) -> SpectralFilter:
        """Real symbols of such components, with shear tractions and yz and zx in units of i."""
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
        # What a kernel odd along one axis has of i is counted in the units of its components.
        turned = component in (YZ, ZX) and along_x != along_y
        return -symbol if turned or (along_x and along_y) else symbol


def sections(
    wanted: Sequence[tuple[SubsurfaceStress, Array, Array]], axis: Literal["x", "y"], at: float
) -> list[Array]:
    """Stress ``(6, n, k)`` in a plane normal to the surface, n cells along ``axis``, of each body.

    Each that is ``wanted`` is a body, its tractions as :meth:`SubsurfaceStress.at_depth` has them,
    and depths ``(k,)`` >= 0 [mm]. The section along x lies at y = ``at`` [mm], moved to the centre
    of the nearest row, and the other way round. Transforms go along the section only, rows without
    load are left out, and those as far on either side go together: a tenth of the cost of as many
    planes, each with new symbols. Coefficients of influence, most of that, are shared by those of
    one grid and Poisson's ratio at depths that they have in common.

    Raises SubsurfaceError for another shape, a depth below 0, a plane off the grid or a section
    along y of a line contact.

    Examples
    --------
    Bodies that are pressed without friction fare alike:

    >>> import numpy as np
    >>> from sa_solver import Grid, Material, SubsurfaceStress
    >>> from sa_solver.half_space.subsurface import sections
    >>> grid, steel = Grid.strips(2.0, 50), Material(young=210e3, poisson=0.3)
    >>> traction = np.zeros((3, 50, 1))
    >>> traction[2] = 1000.0 * np.sqrt(np.maximum(0.0, 1.0 - (grid.x / 0.5) ** 2))
    >>> bodies = [SubsurfaceStress(grid, steel, number) for number in (1, 2)]
    >>> depths = np.array([0.1, 0.2])
    >>> one, two = sections([(body, traction, depths) for body in bodies], "x", 0.0)
    >>> print(one.shape, np.abs(one[:4] - two[:4]).max())
    (6, 50, 2) 0.0
    """
    stresses: list[Array] = []
    shared: dict[tuple[Grid, float, float], list[tuple[SubsurfaceStress, Array, Array]]] = {}
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
            alike = shared.setdefault((body.grid, body.poisson, depth), [])
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
    """Whether a component of stress under a traction is odd along x or y."""
    return (*INDICES[component], traction).count(axis) % 2 == 1


def _folded(spectra: Array, away: Array) -> Array:
    """Those of rows ``away`` ``(r,)``, to either side, by distance ``(2, 3, frequency, distance)``.

    Rows on both sides act alike: their sums are for even kernels, their differences for odd ones.
    """
    folded = np.zeros((2, *spectra.shape[:2], np.abs(away).max() + 1), dtype=np.complex128)
    ahead = away >= 0
    folded[..., away[ahead]] = spectra[..., ahead]
    behind = spectra[..., ~ahead]
    folded[..., -away[~ahead]] += np.stack([behind, -behind])
    return folded


def _along_rows(kernels: Array, sources: Sequence[Array], along: int, period: int) -> list[Array]:
    """Convolutions along the rows of cells, summed over them, ``(6, period)`` each.

    ``kernels`` ``(6, 3, distance, row)`` and ``sources``, folded spectra of the tractions of as
    many rows or fewer; ``along`` is the direction of the rows.
    """
    totals = [np.zeros((6, spectra.shape[2]), dtype=np.complex128) for spectra in sources]
    for i, k in np.ndindex(6, 3):
        whole = continued(kernels[i, k], 0, period, _odd(i, k, along))
        transformed = scipy.fft.rfft(whole, axis=0)
        for total, spectra in zip(totals, sources, strict=True):
            rows = spectra[int(_odd(i, k, 1 - along)), k]
            total[i] += np.einsum("fr,fr->f", transformed[:, : rows.shape[1]], rows)
    return [scipy.fft.irfft(total, period, axis=1) for total in totals]
