"""Real Fourier transforms of zero-padded fields, several components side by side.

The DFT is unnormalised forwards and carries ``1/N`` backwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sa_solver.types import Array

Spectrum = NDArray[np.complex128]

BLOCK = 1 << 15
"""Complex numbers of a spectrum multiplied at once, about what the cache holds."""


SPARE_COLUMNS = 4
"""Unused complex numbers after each row of a spectrum: rows of 2ⁿ + 1 of them lie so close to a
multiple of a memory page that the pass along columns takes 1.6 to 2 times as long from 1024 up."""


class Transform:
    """Real DFT of ``(nx, ny)`` fields zero-padded to ``padded``, and back, planned once with FFTW.

    ``spectra`` holds one spectrum ``(mx, my//2 + 1)`` per component; a backward transform uses its
    component's up.

    Plans are estimated, not measured: measuring picks another algorithm, and with it another
    rounding, from one run to the next. Rows of padding are zero, so their pass along y is skipped.
    """

    def __init__(
        self, shape: tuple[int, int], padded: tuple[int, int], components: int = 1
    ) -> None:
        """Plan for fields of ``shape`` ``(nx, ny)``."""
        # A second to import: where it is used.
        import pyfftw

        forwards = partial(pyfftw.FFTW, flags=("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"))
        backwards = partial(forwards, direction="FFTW_BACKWARD")
        self.shape, self.padded = shape, padded
        rows, columns = shape[0], padded[1] // 2 + 1
        self._field = pyfftw.zeros_aligned((rows, padded[1]), dtype=np.float64)
        stored = (padded[0], columns + SPARE_COLUMNS)
        self.spectra: list[Spectrum] = [
            pyfftw.zeros_aligned(stored, dtype=np.complex128)[:, :columns]
            for _ in range(components)
        ]
        self._forward, self._backward = [], []
        for spectrum in self.spectra:
            along_x, along_y = {"axes": (0,)}, {"axes": (1,)}
            filled = spectrum[:rows]
            self._forward.append(
                (forwards(self._field, filled, **along_y), forwards(spectrum, spectrum, **along_x))
            )
            self._backward.append(
                (
                    backwards(spectrum, spectrum, **along_x),
                    backwards(filled, self._field, **along_y),
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

    def backward(self, component: int, out: Array) -> None:
        """The first ``(nx, ny)`` values of the field whose spectrum ``component`` holds."""
        for pass_ in self._backward[component]:
            pass_.execute()
        # execute() leaves the inverse transform unnormalised.
        size = self.padded[0] * self.padded[1]
        np.multiply(self._field[:, : self.shape[1]], 1.0 / size, out=out)


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
