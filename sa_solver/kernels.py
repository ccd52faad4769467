"""Loops over the cells of a grid that are compiled, where numpy would pass over memory many times.

None calls another, so that what is kept of each stays right as long as this file does. Sums keep
the order in which they are written: a function gives the same digits on every machine.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def multiply_spectra(spectra, symbols, places, turned_inputs, turned_outputs):  # type: ignore[no-untyped-def]
    """Replace the first spectra ``(k, mx, m)`` by sums of them times real symbols ``(s, mx, m)``.

    ``places`` ``(r, c)`` names the symbol that takes input j to output i. Inputs that are
    ``turned`` ``(c,)`` are divided by the imaginary unit first, outputs ``(r,)`` multiplied by it.
    """
    outputs, inputs = places.shape
    _, lines, length = spectra.shape
    given = np.empty((inputs, length), np.complex128)
    for line in range(lines):
        for j in range(inputs):
            for n in range(length):
                z = spectra[j, line, n]
                given[j, n] = complex(z.imag, -z.real) if turned_inputs[j] else z
        for i in range(outputs):
            first = places[i, 0]
            for n in range(length):
                s, z = symbols[first, line, n], given[0, n]
                spectra[i, line, n] = complex(s * z.real, s * z.imag)
            for j in range(1, inputs):
                place = places[i, j]
                for n in range(length):
                    s, z, y = symbols[place, line, n], given[j, n], spectra[i, line, n]
                    spectra[i, line, n] = complex(y.real + s * z.real, y.imag + s * z.imag)
            if turned_outputs[i]:
                for n in range(length):
                    z = spectra[i, line, n]
                    spectra[i, line, n] = complex(-z.imag, z.real)


@njit(cache=True, nogil=True)
def tensor_product(xx, xy, yy, field, product):  # type: ignore[no-untyped-def]
    """``product`` ``(2, nx, ny)`` of symmetric tensors ``(nx, ny)`` with a ``field``."""
    rows, columns = xx.shape
    for i in range(rows):
        for j in range(columns):
            x, y = field[0, i, j], field[1, i, j]
            product[0, i, j] = xx[i, j] * x + xy[i, j] * y
            product[1, i, j] = yy[i, j] * y + xy[i, j] * x


@njit(cache=True, nogil=True)
def add_scaled(total, field, scale):  # type: ignore[no-untyped-def]
    """Add ``scale`` times a ``field`` to ``total``, both ``(k, nx, ny)``."""
    parts, rows, columns = total.shape
    for k in range(parts):
        for i in range(rows):
            for j in range(columns):
                total[k, i, j] += scale * field[k, i, j]
