"""Elastic half-space on a uniform grid: convolution with influence coefficients by FFT.

The DFT is unnormalised forwards and carries ``1/N`` backwards. Zero padding to at least ``2n - 1``
makes the circular convolution equal to the linear one (Liu, Wang & Liu 2000, Wear 243, 101,
doi:10.1016/S0043-1648(00)00427-0).
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from sa_solver.influence import normal_influence
from sa_solver.types import Array, Grid

Spectrum = NDArray[np.complex128]

SMALLEST_RELATIVE_EIGENVALUE = 1e-6
"""Floor of a circulant symbol relative to its largest value. The smallest true one is of the order
of half a cell over the grid's length, far above; the floor only keeps an inverse finite."""

LEVELS = 4
LEVEL_SPACING = 2.0
"""Most levels of local compliance in the preconditioner, and their spacing in natural logarithm.
Where D runs from 0 to a thousand times a cell's own compliance, one level needs over 100 iterations
and four need 20; more gain nothing."""


class Transform(Protocol):
    """Real DFT of ``(nx, ny)`` fields zero-padded to ``padded``, and back."""

    shape: tuple[int, int]
    padded: tuple[int, int]

    def filter(self, field: Array, symbol: Array) -> Array:
        """Multiply the DFT of ``field`` by ``symbol``; returns the first ``(nx, ny)`` values."""
        ...


def plan_transform(shape: tuple[int, int], padded: tuple[int, int], threads: int = 1) -> Transform:
    """The fastest transform installed: FFTW where pyfftw can be imported, else scipy's."""
    try:
        return FftwTransform(shape, padded, threads)
    except ImportError:
        return ScipyTransform(shape, padded, threads)


class FftwTransform:
    """Real DFT planned once with FFTW.

    Plans are estimated, not measured: measuring picks another algorithm, and with it another
    rounding, from one run to the next. Rows of padding are zero, so their pass along y is skipped.
    """

    def __init__(self, shape: tuple[int, int], padded: tuple[int, int], threads: int = 1) -> None:
        """Plan; raises ImportError without pyfftw (1.2 s to import, hence here)."""
        import pyfftw

        self.shape, self.padded = shape, padded
        rows, columns = shape[0], padded[1] // 2 + 1
        self._field = pyfftw.zeros_aligned((rows, padded[1]), dtype=np.float64)
        self._spectrum = pyfftw.zeros_aligned((padded[0], columns), dtype=np.complex128)

        def plan(source: Any, target: Any, axis: int, direction: str) -> Any:
            return pyfftw.FFTW(
                source,
                target,
                axes=(axis,),
                direction=direction,
                flags=("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"),
                threads=threads,
            )

        filled = self._spectrum[:rows]
        self._along_y = plan(self._field, filled, 1, "FFTW_FORWARD")
        self._along_x = plan(self._spectrum, self._spectrum, 0, "FFTW_FORWARD")
        self._back_along_x = plan(self._spectrum, self._spectrum, 0, "FFTW_BACKWARD")
        self._back_along_y = plan(filled, self._field, 1, "FFTW_BACKWARD")

    def filter(self, field: Array, symbol: Array) -> Array:
        """Multiply the DFT of ``field`` by ``symbol``; returns the first ``(nx, ny)`` values."""
        rows, columns = self.shape
        self._field[:, :columns] = field
        self._field[:, columns:] = 0.0
        self._along_y.execute()
        self._spectrum[rows:] = 0.0
        self._along_x.execute()
        np.multiply(self._spectrum, symbol, out=self._spectrum)
        self._back_along_x.execute()
        self._back_along_y.execute()
        # execute() leaves the inverse transform unnormalised.
        filtered: Array = self._field[:, :columns] * (1.0 / (self.padded[0] * self.padded[1]))
        return filtered


class ScipyTransform:
    """The same with scipy.fft: no planning, about three times slower."""

    def __init__(self, shape: tuple[int, int], padded: tuple[int, int], threads: int = 1) -> None:
        self.shape, self.padded, self._threads = shape, padded, threads

    def filter(self, field: Array, symbol: Array) -> Array:
        """Multiply the DFT of ``field`` by ``symbol``; returns the first ``(nx, ny)`` values."""
        spectrum = scipy.fft.rfft2(field, self.padded, workers=self._threads)
        spectrum *= symbol
        filtered: Array = scipy.fft.irfft2(spectrum, self.padded, workers=self._threads)
        return filtered[: self.shape[0], : self.shape[1]]


def circulant_symbol(grid: Grid, contact_modulus: float, period: tuple[int, int]) -> Array:
    """DFT of Love's coefficients made periodic with ``period`` cells, ``(mx, my//2 + 1)`` [mm/MPa].

    Each displacement is taken at the nearest image, so the kernel is even and its DFT real.
    """
    distances = [
        np.minimum(np.arange(m), m - np.arange(m)) * pitch
        for m, pitch in zip(period, grid.pitch, strict=True)
    ]
    kernel = normal_influence(
        distances[0][:, None], distances[1][None, :], grid.pitch, contact_modulus
    )
    symbol: Array = np.ascontiguousarray(scipy.fft.rfft2(kernel).real)
    return symbol


class HalfSpaceConvolution:
    """Normal displacement of an elastic half-space under a pressure field.

    ``count`` is the number of forward and backward pairs of zero-padded transforms done so far.
    """

    def __init__(self, grid: Grid, contact_modulus: float, threads: int = 1) -> None:
        """Plan for ``grid``; ``contact_modulus`` is E* [MPa]."""
        self.grid, self.contact_modulus, self.threads = grid, contact_modulus, threads
        self.count = 0
        self._transform = plan_transform(grid.shape, padded_shape(grid), threads)
        self.symbol = circulant_symbol(grid, contact_modulus, padded_shape(grid))
        """Eigenvalues of the circulant on the padded grid, shape ``(mx, my//2 + 1)`` [mm/MPa]."""

    def displacement(self, pressure: Array) -> Array:
        """``u_z = K p`` for ``pressure`` ``(nx, ny)`` [MPa]; returns ``(nx, ny)`` [mm]."""
        self.count += 1
        return self._transform.filter(pressure, self.symbol)


def padded_shape(grid: Grid) -> tuple[int, int]:
    """The fast transform lengths that hold the linear convolution on ``grid``."""
    nx, ny = (int(scipy.fft.next_fast_len(2 * n - 1, real=True)) for n in grid.shape)
    return nx, ny


class HalfSpaceResolvent:
    """``(K + ρ)⁻¹`` on the zero-padded grid, where K is circulant and the inverse exact.

    Fields have the shape ``padded``; the grid is their first ``(nx, ny)`` block.
    """

    def __init__(self, convolution: HalfSpaceConvolution, shift: float) -> None:
        """Plan; ``shift`` is ρ > 0 [mm/MPa]."""
        self.padded, self.shift = padded_shape(convolution.grid), shift
        self._convolution = convolution
        self._transform = plan_transform(self.padded, self.padded, convolution.threads)
        self._symbol = 1.0 / (np.maximum(convolution.symbol, 0.0) + shift)

    def solve(self, displacement: Array) -> Array:
        """Pressure ``(K + ρ)⁻¹ u`` for ``displacement`` on the padded grid [mm] → [MPa]."""
        self._convolution.count += 1
        return self._transform.filter(displacement, self._symbol)


class HalfSpacePreconditioner:
    """An approximate inverse of K + D for conjugate gradients: the inverse symbol, unpadded.

    The inverse kernel decays as 1/r³, so periodicity without padding costs few iterations, and the
    transform takes a quarter of the time of the convolution.
    Source: Vollebregt 2014, J. Comput. Phys. 257, 333, doi:10.1016/j.jcp.2013.10.005.
    """

    def __init__(self, grid: Grid, contact_modulus: float, threads: int = 1) -> None:
        """Plan for ``grid``; ``contact_modulus`` is E* [MPa]."""
        self._transform = plan_transform(grid.shape, grid.shape, threads)
        symbol = circulant_symbol(grid, contact_modulus, grid.shape)
        self._symbol = np.maximum(symbol, SMALLEST_RELATIVE_EIGENVALUE * symbol.max())
        self._parts: list[tuple[Array | None, Array]] = []
        self.include(None)

    def include(self, compliance: Array | None) -> None:
        """Make it approximate ``(K + D)⁻¹`` for a local ``compliance`` D ``(nx, ny)`` [mm/MPa].

        Each level j of D has its own inverse symbol and a window χj on the cells near that level,
        with Σ χj² = 1: the inverse is Σ χj (K + Dj)⁻¹ χj.
        """
        if compliance is None:
            self._parts = [(None, 1.0 / self._symbol)]
            return
        levels, windows = _compliance_levels(compliance, float(self._symbol.min()))
        self._parts = [
            (window, 1.0 / (self._symbol + level))
            for level, window in zip(levels, windows, strict=True)
        ]

    def apply(self, displacement: Array) -> Array:
        """Pressure ``(nx, ny)`` [MPa] that causes about ``displacement`` ``(nx, ny)`` [mm]."""
        total = np.zeros_like(displacement)
        for window, inverse in self._parts:
            if window is None:
                return self._transform.filter(displacement, inverse)
            total += window * self._transform.filter(window * displacement, inverse)
        return total


def _compliance_levels(compliance: Array, stiffest: float) -> tuple[Array, list[Array | None]]:
    """Levels of ``compliance`` evenly spaced in log(D + ``stiffest``), and windows around them."""
    logarithm = np.log(compliance + stiffest)
    lowest, highest = float(logarithm.min()), float(logarithm.max())
    intervals = min(LEVELS - 1, round((highest - lowest) / LEVEL_SPACING))
    if intervals == 0:
        return np.array([np.mean(compliance)]), [None]
    position = (logarithm - lowest) * (intervals / (highest - lowest))
    hats = [np.maximum(0.0, 1.0 - np.abs(position - j)) for j in range(intervals + 1)]
    centres = np.linspace(lowest, highest, intervals + 1)
    return np.exp(centres) - stiffest, [np.sqrt(hat) for hat in hats]
