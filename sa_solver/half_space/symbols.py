"""Symbols: Fourier transforms of influence coefficients on a grid made periodic.

The coefficients are even or odd along each axis, so that those at distances from zero to half a
period determine all others. The spectrum is computed along one axis after the other, each time from
half of the values along the other axis. This takes half of the time and memory of a full transform.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from sa_solver.half_space.influence import Z, rectangle_influence, strip_influence
from sa_solver.half_space.layered_influence import layered_influence
from sa_solver.half_space.layers import Compliances, pair_compliances
from sa_solver.types import Array, ElasticPair, Grid

Period = tuple[int, int]
Odd = tuple[bool, bool]


class Coefficients:
    """Cached influence coefficients of the cells of a grid, by distance.

    Kernels of rectangles are homogeneous of degree one where the bodies have no layers: cells twice
    as large displace each other twice as far. The coefficients of a grid with cells of the same
    proportions, and no more of them, are therefore scaled from those of a ``finer`` grid, which are
    needed there anyway.
    """

    def __init__(
        self,
        grid: Grid,
        pair: ElasticPair,
        datum: float,
        padded: Period,
        finer: Coefficients | None = None,
    ) -> None:
        """Prepare the coefficients of ``grid``, padded to ``padded`` cells.

        ``datum`` [mm] is that of line contacts: see :func:`.influence.strip_influence`.
        """
        self._grid, self._pair, self._datum = grid, pair, datum
        self._counts = _counts(padded)
        self._finer = finer if finer is not None and self._lies_in(finer) else None
        self._kept: dict[tuple[int, int], Array] = {}

    def quarter(self, row: int, column: int, period: Period) -> Array:
        """Return the coefficients at distances 0 to ``period``//2 along both axes [mm/MPa].

        The array is shared and must not be modified.
        """
        nx, ny = counts = _counts(period)
        if not _within(counts, self._counts):
            return self._computed(row, column, counts)
        if (row, column) not in self._kept:
            self._kept[row, column] = self._whole(row, column)
        return self._kept[row, column][:nx, :ny]

    def between(self, edges_x: Array, edges_y: Array, row: int, column: int) -> Array:
        """Return the coefficients of rectangles, or strips, between neighbouring edges [mm/MPa].

        The edges are those of :func:`.influence.rectangle_influence`.
        """
        outermost = self._pair.surface
        if self._grid.line:
            strips = strip_influence(edges_x, outermost, row, column, self._datum)
            if self._pair.layered:
                strips += layered_influence(self._pair).strips(edges_x, row, column, self._datum)
            return strips[:, None]
        rectangles = rectangle_influence(edges_x, edges_y, outermost, row, column)
        if self._pair.layered:
            rectangles += layered_influence(self._pair).rectangles(edges_x, edges_y, row, column)
        return rectangles

    def _whole(self, row: int, column: int) -> Array:
        if self._finer is None:
            return self._computed(row, column, self._counts)
        nx, ny = self._counts
        found = self._finer.quarter(row, column, self._finer.period)[:nx, :ny]
        scale = self._grid.pitch[0] / self._finer._grid.pitch[0]
        return found if scale == 1.0 else scale * found

    @property
    def period(self) -> Period:
        """Smallest period that needs all cached coefficients."""
        nx, ny = self._counts
        return 2 * nx - 2, 2 * ny - 2

    def _computed(self, row: int, column: int, counts: Period) -> Array:
        edges_x, edges_y = (
            quarter_edges(2 * n - 2, pitch)
            for n, pitch in zip(counts, self._grid.pitch, strict=True)
        )
        return self.between(edges_x, edges_y, row, column)

    def _lies_in(self, finer: Coefficients) -> bool:
        """Return whether the cells have the proportions of those of ``finer`` and are no more."""
        (x, y), (fine_x, fine_y) = self._grid.pitch, finer._grid.pitch
        scalable = not self._grid.line and not self._pair.layered
        alike = scalable and x / fine_x == y / fine_y
        return alike and _within(self._counts, finer._counts)


def _counts(period: Period) -> Period:
    """Return the numbers of distances from zero to half a period, along both axes."""
    return period[0] // 2 + 1, period[1] // 2 + 1


def _within(counts: Period, others: Period) -> bool:
    return counts[0] <= others[0] and counts[1] <= others[1]


def quarter_edges(period: int, pitch: float) -> Array:
    """Return the edges of cells centred at the distances 0 to ``period``//2 [mm]."""
    return (np.arange(period // 2 + 2, dtype=np.float64) - 0.5) * pitch


def symbol_of(quarter: Array, period: Period, odd: Odd) -> Array:
    """Return the sums over a period of a kernel times cosines, or sines along ``odd`` axes.

    The kernel ``quarter`` is given at distances 0 to ``period``//2 along both axes. The sums
    ``(mx, my//2 + 1)`` have the frequencies of numpy's ``rfft2``; the result of ``rfft2`` is
    ``(-i)^k`` times the sums, where the kernel is odd along k axes.
    """
    sums = _half_spectrum(_half_spectrum(quarter, 1, period[1], odd[1]), 0, period[0], odd[0])
    return np.ascontiguousarray(continued(sums, 0, period[0], odd[0]))


def wave_symbol(grid: Grid, pair: ElasticPair, row: int, column: int) -> Array:
    """Return displacements ``row`` under unit waves of traction ``column`` on a periodic grid.

    They have the frequencies of numpy's ``rfft2``, ``(nx, ny//2 + 1)`` [mm/MPa], and are 0 for the
    mean traction. With the compliances n, a and s of a ``pair`` of similar bodies under pressure
    and under shear along and across a wave, waves of the wave number k at the angle θ to x have n/k
    under pressure, and (s + (a - s) cos²θ)/k, (s + (a - s) sin²θ)/k and (a - s) cosθ sinθ/k under
    shear. Without layers these are the transforms of the kernels in
    :mod:`sa_solver.half_space.influence`.
    """
    (nx, ny), (dx, dy) = grid.shape, grid.pitch
    along = np.fft.fftfreq(nx, dx)[:, None], np.fft.rfftfreq(ny, dy)[None, :]
    frequency = np.hypot(*along)
    frequency[0, 0] = np.inf
    wave_number = 2.0 * np.pi * frequency
    compliances = _on_grid(pair, wave_number)
    if row == column == Z:
        return np.asarray(compliances.normal / wave_number)
    cosines = along[row] / frequency, along[column] / frequency
    difference = compliances.along - compliances.across
    mean = compliances.across * (row == column)
    symbol = (mean + difference * cosines[0] * cosines[1]) / wave_number
    if row != column:
        # A wave of two cells along an axis runs in both directions, which cancel.
        if nx % 2 == 0:
            symbol[nx // 2] = 0.0
        if ny % 2 == 0:
            symbol[:, ny // 2] = 0.0
    return np.asarray(symbol)


def _on_grid(pair: ElasticPair, wave_number: Array) -> Compliances:
    """Return the compliances at ``wave_number`` of any shape, solved once for equal ones."""
    if not pair.layered:
        return pair_compliances(pair, np.ones(1))
    different, place = np.unique(wave_number, return_inverse=True)
    found = pair_compliances(pair, different)
    place = place.reshape(wave_number.shape)
    return Compliances(*(getattr(found, f.name)[place] for f in fields(Compliances)))


def _half_spectrum(kernel: Array, axis: int, period: int, odd: bool) -> Array:
    """Return such sums along one ``axis``, at frequencies 0 to ``period``//2."""
    spectrum = np.fft.rfft(continued(kernel, axis, period, odd), axis=axis)
    return -spectrum.imag if odd else spectrum.real


def continued(kernel: Array, axis: int, period: int, odd: bool) -> Array:
    """Return a ``kernel`` at distances 0 to ``period``//2, extended to a period along ``axis``."""
    kernel = np.moveaxis(kernel, axis, 0)[: period // 2 + 1]
    mirrored = kernel[1 : (period + 1) // 2][::-1]
    if odd:
        kernel, mirrored = kernel.copy(), -mirrored
        if period % 2 == 0:
            kernel[-1] = 0.0  # Two images of the source at the same distance cancel.
    return np.moveaxis(np.concatenate([kernel, mirrored]), 0, axis)
