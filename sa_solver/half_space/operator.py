"""Displacement of two elastic half-spaces under tractions on a uniform grid, by FFT.

Zero padding to at least ``2n - 1`` cells makes the circular convolution with the influence
coefficients equal to the linear one (Liu, Wang & Liu 2000, Wear 243, 101,
doi:10.1016/S0043-1648(00)00427-0). On a line grid the same holds for half-planes in plane strain.

A periodic half-space repeats its grid along both axes without end, and needs no padding. A wave of
pressure with the wave number k displaces the surfaces by 2/(E* k) of its amplitude (Johnson 1985,
Contact Mechanics, section 13.2); a uniform pressure moves them as rigid bodies, which is left out.
The same holds for shear. The bodies must be similar.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.half_space.influence import X, Y, Z
from sa_solver.half_space.symbols import Coefficients, symbol_of, wave_symbol
from sa_solver.transforms.padded import SpectralFilter, Transform
from sa_solver.transforms.pruned import LARGE
from sa_solver.types import Array, ElasticPair, Grid

NORMAL = (Z,)
SHEAR = (X, Y)
ALL = (X, Y, Z)

DATUM = 2.0
"""Default datum of a line contact, in widths of its grid. From one width up the logarithmic kernel
is positive on the padded grid."""

SHIFT = 0.5
"""Shift ρ of a resolvent over the geometric mean of the extreme eigenvalues of K. This value takes
the fewest iterations of the splitting on spheres and flats; 0.2 and 2 take up to twice as many."""

SMALLEST_EIGENVALUE = 0.5
"""Approximate smallest eigenvalue of K over the self-compliance of a cell, for square cells. It is
smaller for long cells (0.2) and lines (0.1). The value affects ρ only, not the solution."""

POWER_OF_TWO = 1.15
"""Ratio up to which a longer power of two is preferred to a shorter length, because powers of two
transform fastest: 256² takes three quarters of the time of 225² or 240², and 1024² four fifths of
that of 960². Lengths of 200 or 400 would take longer as powers of two, a quarter larger."""

ODD_LENGTHS = [3**i * 5**j for i in range(10) for j in range(7)]
"""Fast transform lengths are one of these times a power of two."""

FAST_PRUNED = (256, 512)
"""Lengths along x at which pruned columns are faster than any shorter length: 256 takes three
quarters of the time of 144, and 512 four fifths of that of 280."""

Components = tuple[int, ...]
GridShape = tuple[int, int]


class HalfSpace:
    """Displacement of body 2's surface relative to body 1's under tractions on a grid.

    ``count`` is the number of zero-padded convolutions so far, each of one component (pressure),
    two (shear) or three.

    Examples
    --------
    The centre of a loaded square of side b sinks by Love's 4 ln(1 + √2) p b / π E*:

    >>> import numpy as np
    >>> from sa_solver import ElasticPair, Grid, HalfSpace, Material
    >>> steel = Material(young=210e3, poisson=0.3)
    >>> half_space = HalfSpace(Grid.covering((1.0, 1.0), (25, 25)), ElasticPair(steel, steel))
    >>> sunk = half_space.normal(np.full((25, 25), 100.0))[12, 12]
    >>> love = 4.0 * np.log(1.0 + np.sqrt(2.0)) * 100.0 / (np.pi * half_space.pair.contact_modulus)
    >>> print(f"{1e3 * sunk:.4f} um, Love {1e3 * love:.4f} um")
    0.9726 um, Love 0.9726 um
    """

    def __init__(
        self,
        grid: Grid,
        pair: ElasticPair,
        datum: float | None = None,
        *,
        periodic: bool = False,
    ) -> None:
        """Prepare the convolutions on ``grid`` for the bodies ``pair``.

        ``datum`` [mm] is the distance from a line force at which its displacement vanishes; it is
        used on line grids only. The displacements of a ``periodic`` half-space are relative to
        their mean. Raises InputError for a datum shorter than the grid, and for a periodic
        half-space of dissimilar bodies.
        """
        self.grid, self.pair, self.periodic = grid, pair, periodic
        self.datum = DATUM * grid.size[0] if datum is None else checks.number("datum", datum)
        if grid.line and not grid.size[0] <= self.datum < np.inf:
            raise InputError(
                f"datum {self.datum:g} mm is not between the width of the grid, "
                f"{grid.size[0]:g} mm, and infinity: give the depth of the bodies"
            )
        if periodic and not pair.similar:
            raise InputError(
                "the bodies of a periodic half-space must be similar: the effect of shear on "
                "pressure is not computed there"
            )
        self.padded = grid.shape if periodic else padded_shape(grid)
        self._coefficients = Coefficients(grid, pair, self.datum, self.padded)
        self.count = 0
        self._filters: dict[tuple[Components, Components], SpectralFilter] = {}
        self._symbols: dict[tuple[int, int, GridShape], Array] = {}
        self.transform = cache(Transform)
        """Function that returns the transform for a shape, padded shape and number of components,
        planned once for all users."""

    def on(self, grid: Grid) -> HalfSpace:
        """Return the same bodies on another ``grid``."""
        half_space = HalfSpace(grid, self.pair, self.datum, periodic=self.periodic)
        half_space._coefficients = Coefficients(
            grid, self.pair, self.datum, half_space.padded, self._coefficients
        )
        return half_space

    def normal(self, pressure: Array) -> Array:
        """Return ``u_z`` [mm] under ``pressure`` [MPa] alone, both ``(nx, ny)``."""
        pressure = checks.array("pressures", pressure, self.grid.shape, finite=False)
        displacement: Array = self._convolve(pressure[None], NORMAL, NORMAL)[0]
        return displacement

    def shear(self, shear: Array) -> Array:
        """Return ``u_x, u_y`` [mm] under ``shear`` [MPa] alone, both ``(2, nx, ny)``."""
        return self._convolve(self._checked(shear, 2), SHEAR, SHEAR)

    def displacement(self, traction: Array) -> Array:
        """Return ``u`` [mm] under ``traction`` [MPa], both ``(3, nx, ny)`` ordered x, y, z."""
        return self._convolve(self._checked(traction, 3), ALL, ALL)

    def normal_under_shear(self, shear: Array) -> Array:
        """Return ``u_z`` ``(nx, ny)`` [mm] under ``shear`` ``(2, nx, ny)`` [MPa].

        It is 0 for similar bodies.
        """
        if self.pair.similar:
            return np.zeros(shear.shape[1:])
        displacement: Array = self._convolve(self._checked(shear, 2), NORMAL, SHEAR)[0]
        return displacement

    def _checked(self, traction: Array, components: int) -> Array:
        """Return tractions ``(components, nx, ny)``, checked, in the form for the transforms."""
        return checks.array("tractions", traction, (components, *self.grid.shape), finite=False)

    def symbol(self, row: int, column: int, period: GridShape | None = None) -> Array:
        """Return the symbol of displacement ``row`` under traction ``column`` [mm/MPa].

        The symbol ``(mx, my//2 + 1)`` holds the eigenvalues of the influence coefficients, made
        periodic with ``period``, the padded shape by default: each displacement is that of the
        nearest image of the source. That of a periodic half-space is exact for waves, and has the
        period of the grid. The matrix of symbols is Hermitian. It is made real and
        symmetric here by multiplying components along z by the imaginary unit.
        """
        key = (min(row, column), max(row, column), period or self.padded)
        if key not in self._symbols:
            self._symbols[key] = self._compute_symbol(*key)
        return self._symbols[key]

    def self_compliance(self, component: int) -> float:
        """Return the displacement at the centre of a cell under unit traction on it [mm/MPa]."""
        edges_x, edges_y = (np.array([-0.5, 0.5]) * pitch for pitch in self.grid.pitch)
        return float(self._coefficients.between(edges_x, edges_y, component, component)[0, 0])

    def _convolve(self, fields: Array, rows: Components, columns: Components) -> Array:
        self.count += 1
        if (rows, columns) not in self._filters:
            transform = self.transform(self.grid.shape, self.padded, max(len(rows), len(columns)))
            symbols = [[self.symbol(row, column) for column in columns] for row in rows]
            self._filters[rows, columns] = spectral_filter(transform, symbols, rows, columns)
        return self._filters[rows, columns].apply(fields)

    def _compute_symbol(self, row: int, column: int, period: GridShape) -> Array:
        if self.periodic:
            return wave_symbol(self.grid, self.pair, row, column)
        odd = (row == X) != (column == X), (row == Y) != (column == Y)
        symbol = symbol_of(self._coefficients.quarter(row, column, period), period, odd)
        # The DFT of a kernel that is odd along both axes is minus the sum over sines.
        return -symbol if all(odd) else symbol


def spectral_filter(
    transform: Transform, symbols: list[list[Array]], rows: Components, columns: Components
) -> SpectralFilter:
    """Return the filter that maps components ``columns`` to components ``rows``.

    ``symbols`` are the real symbols of :meth:`HalfSpace.symbol`.
    """
    if rows == columns == NORMAL:
        return SpectralFilter(transform, symbols)
    inputs, outputs = ([n for n, k in enumerate(part) if k == Z] for part in (columns, rows))
    return SpectralFilter(transform, symbols, (inputs, outputs))


def padded_shape(grid: Grid) -> GridShape:
    """Return the fast transform lengths that hold the linear convolution on ``grid``."""
    linear = [2 * n - 1 for n in grid.shape]
    along_x, along_y = fast_lengths(*linear)
    power = _power_of_two(linear[0])
    pruned = power in FAST_PRUNED and power * (along_y // 2 + 1) >= LARGE
    return power if pruned else along_x, along_y


def fast_lengths(nx: int, ny: int) -> GridShape:
    """Return the next lengths, from ``nx`` and ``ny`` up, that transform fast."""
    return _fast_length(nx), _fast_length(ny)


def _fast_length(count: int) -> int:
    power = _power_of_two(count)
    near = power <= POWER_OF_TWO * count
    return power if near else min(n * _power_of_two(-(-count // n)) for n in ODD_LENGTHS)


def _power_of_two(count: int) -> int:
    """Return the least power of two that is not below ``count``."""
    return 1 << (int(count) - 1).bit_length()


class HalfSpaceResolvent:
    """Resolvent ``(K + ρ)⁻¹`` on the zero-padded grid, where K is circulant and the inverse exact.

    Fields have the shape ``(c, *padded)``; the grid is their first block of ``(nx, ny)`` cells.
    """

    def __init__(
        self, half_space: HalfSpace, components: Components, share: float | Array = SHIFT
    ) -> None:
        """Prepare the inverse for tractions with these ``components``.

        ``share``, a number or ``(c,)``, is ρ over the geometric mean of K's extreme eigenvalues.
        """
        self.padded_shape = half_space.padded
        self._half_space, self._shape = half_space, half_space.grid.shape
        largest = max(float(half_space.symbol(k, k).max()) for k in components)
        smallest = SMALLEST_EIGENVALUE * min(half_space.self_compliance(k) for k in components)
        mean = float(np.sqrt(largest * smallest))
        self.shift = (share * np.full(len(components), mean))[:, None, None]
        """Shift ρ of each component ``(c, 1, 1)`` [mm/MPa]."""
        symbols = [[half_space.symbol(i, j) for j in components] for i in components]
        for k, row in enumerate(symbols):
            row[k] = row[k] + self.shift[k]
        transform = half_space.transform(self.padded_shape, self.padded_shape, len(components))
        inverse = inverse_symbols(symbols)
        self._filter = spectral_filter(transform, inverse, components, components)

    def solve(self, displacement: Array) -> Array:
        """Return the traction ``(K + ρ)⁻¹ u`` [MPa] for ``displacement`` u ``(c, mx, my)`` [mm].

        Both are on the padded grid.
        """
        self._half_space.count += 1
        return self._filter.apply(displacement)

    def padded(self, fields: Array) -> Array:
        """Return ``fields`` ``(c, nx, ny)``, extended by zeros to the padded grid."""
        out = np.zeros((len(fields), *self.padded_shape))
        self.on_grid(out)[:] = fields
        return out

    def on_grid(self, fields: Array) -> Array:
        """Return the part of ``fields`` ``(c, mx, my)`` that lies on the grid."""
        return fields[:, : self._shape[0], : self._shape[1]]


def inverse_symbols(symbols: list[list[Array]]) -> list[list[Array]]:
    """Return the inverse of a symmetric matrix of symbols, frequency by frequency."""
    if len(symbols) == 1:
        return [[1.0 / symbols[0][0]]]
    if len(symbols) == 2:
        (a, b), (c, d) = symbols
        determinant = a * d - b * c
        across = -b / determinant
        return [[d / determinant, across], [across, a / determinant]]
    matrices = np.moveaxis(np.array(symbols), (0, 1), (-2, -1))
    inverses = np.linalg.inv(matrices)
    count = range(len(symbols))
    return [[np.ascontiguousarray(inverses[..., i, j]) for j in count] for i in count]
