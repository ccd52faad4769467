"""Real Fourier transforms of zero-padded fields with several components.

The forward DFT is unnormalised and the backward DFT is divided by N.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sa_solver.transforms.fftw import load_pyfftw, plan
from sa_solver.transforms.passes import Spectra, multiply_spectra, multiply_spectrum
from sa_solver.transforms.pruned import PrunedColumns
from sa_solver.types import Array, Indices

Multiplication = Callable[[Spectra], None]

SPARE_COLUMNS = 4
"""Unused complex numbers after each row of a spectrum. Without them, rows of 2ⁿ + 1 numbers are so
close to a multiple of a memory page that transforms along columns take 1.6 to 2 times as long for
lengths from 1024 up."""


class Transform:
    """Real DFT of ``(nx, ny)`` fields, zero-padded to ``padded``, and its inverse.

    The transforms are planned once with FFTW. ``spectra`` ``(k, mx, my//2 + 1)`` holds one spectrum
    for each component; a backward transform destroys it. Row ``i`` of a spectrum has the frequency
    ``order[i]`` along x. Rows of padding are zero, so that they are not transformed along y.
    """

    def __init__(
        self, shape: tuple[int, int], padded: tuple[int, int], components: int = 1
    ) -> None:
        """Plan the transforms of fields of ``shape`` ``(nx, ny)``, padded to ``padded``."""
        fftw = load_pyfftw()
        self.shape, self.padded = shape, padded
        rows, columns = shape[0], padded[1] // 2 + 1
        self._field = fftw.empty_aligned((rows, padded[1]), dtype=np.float64)
        stored = (components, padded[0], columns + SPARE_COLUMNS)
        self.spectra: Spectra = fftw.empty_aligned(stored, dtype=np.complex128)[:, :, :columns]
        self._columns = [PrunedColumns(spectrum, rows) for spectrum in self.spectra]
        self._forward = [plan(self._field, filled, 1) for filled in self.spectra[:, :rows]]
        self._backward = [plan(filled, self._field, 1, True) for filled in self.spectra[:, :rows]]
        self.order = self._columns[0].order

    def forward(self, field: Array, component: int) -> None:
        """Transform ``field`` ``(nx, ny)`` into the spectrum of ``component``."""
        columns = self.shape[1]
        self._field[:, :columns] = field
        self._field[:, columns:] = 0.0
        self._forward[component].execute()
        self._columns[component].forward()

    def backward(self, component: int, out: Array) -> None:
        """Write the field with the spectrum of ``component`` to ``out`` ``(nx, ny)``."""
        self._columns[component].backward()
        self._backward[component].execute()
        # execute() leaves the inverse transform unnormalised.
        size = self.padded[0] * self.padded[1]
        np.multiply(self._field[:, : self.shape[1]], 1.0 / size, out=out)


class SpectralFilter:
    """Circulant matrix operator that maps fields with several components to other fields.

    ``symbols[i][j]`` is the real array that multiplies the DFT of input ``j`` in output ``i``.
    ``imaginary`` lists the inputs and the outputs that are multiplied by the imaginary unit, so
    that all symbols are real: a kernel that is odd along one direction has an imaginary symbol.
    """

    def __init__(
        self,
        transform: Transform,
        symbols: Sequence[Sequence[Array]],
        imaginary: tuple[Sequence[int], Sequence[int]] = ((), ()),
    ) -> None:
        """Prepare the operator; ``transform`` needs a spectrum for each input and output."""
        self._transform = transform
        self._outputs = len(symbols)
        single = len(symbols) == len(symbols[0]) == 1 and not any(imaginary)
        self._multiply = (
            _single_multiplication(symbols[0][0][transform.order])
            if single
            else _matrix_multiplication(symbols, transform.order, imaginary)
        )

    def apply(self, fields: Array) -> Array:
        """Return the outputs ``(r, nx, ny)`` for the inputs ``fields`` ``(c, nx, ny)``."""
        transform = self._transform
        for component, field in enumerate(fields):
            transform.forward(field, component)
        self._multiply(transform.spectra)
        outputs = np.empty((self._outputs, *transform.shape))
        for component in range(len(outputs)):
            transform.backward(component, outputs[component])
        return outputs


def _single_multiplication(symbol: Array) -> Multiplication:
    """Return a function that multiplies the first spectrum by one ``symbol``."""
    return lambda spectra: multiply_spectrum(spectra[0], symbol)


def _matrix_multiplication(
    symbols: Sequence[Sequence[Array]],
    order: Indices,
    imaginary: tuple[Sequence[int], Sequence[int]],
) -> Multiplication:
    """Return a function that replaces the spectra of the inputs by those of the outputs.

    The rows of the spectra have the frequencies ``order``.
    """
    rows = [list(row) for row in symbols]
    place: dict[int, int] = {}
    # In a symmetric matrix some symbols are the same array, which is stored once.
    places = np.array(
        [[place.setdefault(id(symbol), len(place)) for symbol in row] for row in rows]
    )
    different = {id(symbol): symbol for row in rows for symbol in row}.values()
    stacked = np.stack([symbol[order] for symbol in different])
    imaginary_outputs, imaginary_inputs = (
        np.zeros(places.shape[0], bool),
        np.zeros(places.shape[1], bool),
    )
    imaginary_inputs[list(imaginary[0])] = imaginary_outputs[list(imaginary[1])] = True

    def multiply(spectra: Spectra) -> None:
        multiply_spectra(spectra, stacked, places, imaginary_inputs, imaginary_outputs)

    return multiply
