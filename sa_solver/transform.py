"""Real Fourier transforms of zero-padded fields, several components side by side.

The DFT is unnormalised forwards and carries ``1/N`` backwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from sa_solver.types import Array

Spectrum = NDArray[np.complex128]

BLOCK = 1 << 15
"""Complex numbers of a spectrum multiplied at once, about what the cache holds."""


SPARE_COLUMNS = 4
"""Unused complex numbers after each row of a spectrum: rows of 2ⁿ + 1 of them lie so close to a
multiple of a memory page that the pass along columns takes 1.6 to 2 times as long from 1024 up."""


class Transform(Protocol):
    """Real DFT of ``(nx, ny)`` fields zero-padded to ``padded``, and back.

    ``spectra`` holds one spectrum ``(mx, my//2 + 1)`` per component; a backward transform uses its
    component's up.
    """

    shape: tuple[int, int]
    padded: tuple[int, int]
    spectra: list[Spectrum]

    def forward(self, field: Array, component: int) -> None:
        """Transform ``field`` ``(nx, ny)`` into the spectrum of ``component``."""
        ...

    def backward(self, component: int, out: Array | None = None) -> Array:
        """The first ``(nx, ny)`` values of the field whose spectrum ``component`` holds."""
        ...


def plan_transform(
    shape: tuple[int, int], padded: tuple[int, int], components: int = 1, threads: int = 1
) -> Transform:
    """The fastest transform installed: FFTW where pyfftw can be imported, else scipy's."""
    try:
        return FftwTransform(shape, padded, components, threads)
    except ImportError:
        return ScipyTransform(shape, padded, components, threads)


class FftwTransform:
    """Real DFT planned once with FFTW.

    Plans are estimated, not measured: measuring picks another algorithm, and with it another
    rounding, from one run to the next. Rows of padding are zero, so their pass along y is skipped.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        padded: tuple[int, int],
        components: int = 1,
        threads: int = 1,
    ) -> None:
        """Plan; raises ImportError without pyfftw (1.2 s to import, hence here)."""
        import pyfftw

        def plan(source: Any, target: Any, axis: int, direction: str) -> Any:
            return pyfftw.FFTW(
                source,
                target,
                axes=(axis,),
                direction=direction,
                flags=("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"),
                threads=threads,
            )

        self.shape, self.padded = shape, padded
        rows, columns = shape[0], padded[1] // 2 + 1
        self._field = pyfftw.zeros_aligned((rows, padded[1]), dtype=np.float64)
        self.spectra = [
            pyfftw.zeros_aligned((padded[0], columns + SPARE_COLUMNS), dtype=np.complex128)[
                :, :columns
            ]
            for _ in range(components)
        ]
        self._forward, self._backward = [], []
        for spectrum in self.spectra:
            filled = spectrum[:rows]
            self._forward.append(
                (
                    plan(self._field, filled, 1, "FFTW_FORWARD"),
                    plan(spectrum, spectrum, 0, "FFTW_FORWARD"),
                )
            )
            self._backward.append(
                (
                    plan(spectrum, spectrum, 0, "FFTW_BACKWARD"),
                    plan(filled, self._field, 1, "FFTW_BACKWARD"),
                )
            )

    def forward(self, field: Array, component: int) -> None:
        """Transform ``field`` ``(nx, ny)`` into the spectrum of ``component``."""
        rows, columns = self.shape
        self._field[:, :columns] = field
        self._field[:, columns:] = 0.0
        along_y, along_x = self._forward[component]
        along_y.execute()
        self.spectra[component][rows:] = 0.0
        along_x.execute()

    def backward(self, component: int, out: Array | None = None) -> Array:
        """The first ``(nx, ny)`` values of the field whose spectrum ``component`` holds."""
        for pass_ in self._backward[component]:
            pass_.execute()
        # execute() leaves the inverse transform unnormalised.
        size = self.padded[0] * self.padded[1]
        field: Array = np.multiply(self._field[:, : self.shape[1]], 1.0 / size, out=out)
        return field


class ScipyTransform:
    """The same with scipy.fft: no planning, about three times slower."""

    def __init__(
        self,
        shape: tuple[int, int],
        padded: tuple[int, int],
        components: int = 1,
        threads: int = 1,
    ) -> None:
        self.shape, self.padded, self._threads = shape, padded, threads
        half = padded[0], padded[1] // 2 + 1
        self.spectra = [np.zeros(half, dtype=np.complex128) for _ in range(components)]

    def forward(self, field: Array, component: int) -> None:
        """Transform ``field`` ``(nx, ny)`` into the spectrum of ``component``."""
        self.spectra[component][:] = scipy.fft.rfft2(field, self.padded, workers=self._threads)

    def backward(self, component: int, out: Array | None = None) -> Array:
        """The first ``(nx, ny)`` values of the field whose spectrum ``component`` holds."""
        field: Array = scipy.fft.irfft2(self.spectra[component], self.padded, workers=self._threads)
        field = field[: self.shape[0], : self.shape[1]]
        if out is None:
            return field
        out[:] = field
        return out


class SpectralFilter:
    """A circulant matrix operator: fields with some components from fields with others.

    ``symbols[i][j]`` is the real array that multiplies the DFT of input ``j`` in output ``i``.
    ``imaginary`` names the inputs and the outputs that are counted in units of the imaginary one:
    a kernel that is odd along one direction between these and the rest has an imaginary symbol.
    """

    def __init__(
        self,
        transform: Transform,
        symbols: Sequence[Sequence[Array]],
        imaginary: tuple[Sequence[int], Sequence[int]] = ((), ()),
    ) -> None:
        """``transform`` needs as many spectra as there are inputs or outputs."""
        self._transform = transform
        # Spectra are multiplied as pairs of reals: numpy would make a real factor complex first.
        self._symbols = [[np.repeat(symbol, 2, axis=1) for symbol in row] for row in symbols]
        self._inputs, self._outputs = imaginary
        rows = transform.padded[0]
        row_size = transform.spectra[0].size // rows
        step = max(1, BLOCK // row_size)
        self._blocks = [slice(start, start + step) for start in range(0, rows, step)]

    def apply(self, fields: Array) -> Array:
        """Outputs ``(r, nx, ny)`` from inputs ``(c, nx, ny)``."""
        transform = self._transform
        for component, field in enumerate(fields):
            transform.forward(field, component)
        for block in self._blocks:
            self._multiply([spectrum[block] for spectrum in transform.spectra], block)
        outputs = np.empty((len(self._symbols), *transform.shape))
        for component in range(len(outputs)):
            transform.backward(component, outputs[component])
        return outputs

    def _multiply(self, spectra: list[Spectrum], block: slice) -> None:
        """Replace the inputs in ``spectra`` by the outputs."""
        pairs = [spectrum.view(np.float64) for spectrum in spectra]
        if len(self._symbols) == len(self._symbols[0]) == 1 and not (self._inputs or self._outputs):
            pairs[0] *= self._symbols[0][0][block]
            return
        for j in self._inputs:
            spectra[j] *= -1j
        inputs = [pairs[j].copy() for j in range(len(self._symbols[0]))]
        product = np.empty_like(inputs[0])
        for i, row in enumerate(self._symbols):
            np.multiply(row[0][block], inputs[0], out=pairs[i])
            for j in range(1, len(row)):
                pairs[i] += np.multiply(row[j][block], inputs[j], out=product)
            if i in self._outputs:
                spectra[i] *= 1j
