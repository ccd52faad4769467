"""Compiled loops over the cells of a grid, where numpy would read the memory several times.

The loops are called through the functions of the same names in :mod:`sa_solver.transforms.passes`.
None calls another, so that the cached machine code of each is valid as long as this file does not
change. Sums are evaluated in the order in which they are written, so that a function returns the
same digits on every machine.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def multiply_spectrum(spectrum, symbol):  # type: ignore[no-untyped-def]
    """Multiply a spectrum ``(mx, m)`` by a real symbol of that shape."""
    for line in range(len(spectrum)):
        for n in range(spectrum.shape[1]):
            s, z = symbol[line, n], spectrum[line, n]
            spectrum[line, n] = complex(s * z.real, s * z.imag)


@njit(cache=True, nogil=True)
def multiply_spectra(spectra, symbols, places, imaginary_inputs, imaginary_outputs):  # type: ignore[no-untyped-def]
    """Replace the first spectra ``(k, mx, m)`` by sums of them times real symbols ``(s, mx, m)``.

    ``places[i, j]`` is the index of the symbol that multiplies input j in output i. Inputs marked
    in ``imaginary_inputs`` ``(c,)`` are first divided by the imaginary unit; outputs marked in
    ``imaginary_outputs`` ``(r,)`` are multiplied by it.
    """
    outputs, inputs = places.shape
    _, lines, length = spectra.shape
    given = np.empty((inputs, length), np.complex128)
    for line in range(lines):
        for j in range(inputs):
            for n in range(length):
                z = spectra[j, line, n]
                given[j, n] = complex(z.imag, -z.real) if imaginary_inputs[j] else z
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
            if imaginary_outputs[i]:
                for n in range(length):
                    z = spectra[i, line, n]
                    spectra[i, line, n] = complex(-z.imag, z.real)


@njit(cache=True, nogil=True)
def split_in_two(spectrum, twiddles):  # type: ignore[no-untyped-def]
    """Set the second half of rows ``(2 m, k)`` to the first times ``twiddles[1]`` ``(m,)``."""
    half, columns = len(spectrum) // 2, spectrum.shape[1]
    for n in range(half):
        c, s = twiddles[1, n].real, twiddles[1, n].imag
        for j in range(columns):
            a = spectrum[n, j]
            spectrum[half + n, j] = complex(a.real * c - a.imag * s, a.real * s + a.imag * c)


@njit(cache=True, nogil=True)
def join_two(spectrum, twiddles):  # type: ignore[no-untyped-def]
    """Add the second half of rows ``(2 m, k)``, times ``twiddles[1]`` conjugate, to the first."""
    half, columns = len(spectrum) // 2, spectrum.shape[1]
    for n in range(half):
        c, s = twiddles[1, n].real, twiddles[1, n].imag
        for j in range(columns):
            a, b = spectrum[n, j], spectrum[half + n, j]
            spectrum[n, j] = complex(
                a.real + (b.real * c + b.imag * s), a.imag + (b.imag * c - b.real * s)
            )


@njit(cache=True, nogil=True)
def split_in_four(spectrum, twiddles):  # type: ignore[no-untyped-def]
    """Set quarter r of rows ``(4 m, k)`` to (a + (-i)^r b) ``twiddles[r]``.

    a and b are the first two quarters.
    """
    quarter, columns = len(spectrum) // 4, spectrum.shape[1]
    for n in range(quarter):
        c, s = twiddles[:, n].real, twiddles[:, n].imag
        for j in range(columns):
            a, b = spectrum[n, j], spectrum[quarter + n, j]
            spectrum[n, j] = a + b
            x, y = a.real + b.imag, a.imag - b.real
            spectrum[quarter + n, j] = complex(x * c[1] - y * s[1], x * s[1] + y * c[1])
            x, y = a.real - b.real, a.imag - b.imag
            spectrum[2 * quarter + n, j] = complex(x * c[2] - y * s[2], x * s[2] + y * c[2])
            x, y = a.real - b.imag, a.imag + b.real
            spectrum[3 * quarter + n, j] = complex(x * c[3] - y * s[3], x * s[3] + y * c[3])


@njit(cache=True, nogil=True)
def join_four(spectrum, twiddles):  # type: ignore[no-untyped-def]
    """Set a to Σ w_r and b to Σ i^r w_r, where w_r is quarter r times ``twiddles[r]`` conjugate.

    a and b are the first two quarters of the rows ``(4 m, k)``.
    """
    quarter, columns = len(spectrum) // 4, spectrum.shape[1]
    for n in range(quarter):
        c, s = twiddles[:, n].real, twiddles[:, n].imag
        for j in range(columns):
            z0, z1 = spectrum[n, j], spectrum[quarter + n, j]
            z2, z3 = spectrum[2 * quarter + n, j], spectrum[3 * quarter + n, j]
            x1, y1 = z1.real * c[1] + z1.imag * s[1], z1.imag * c[1] - z1.real * s[1]
            x2, y2 = z2.real * c[2] + z2.imag * s[2], z2.imag * c[2] - z2.real * s[2]
            x3, y3 = z3.real * c[3] + z3.imag * s[3], z3.imag * c[3] - z3.real * s[3]
            spectrum[n, j] = complex((z0.real + x2) + (x1 + x3), (z0.imag + y2) + (y1 + y3))
            spectrum[quarter + n, j] = complex(
                (z0.real - x2) - (y1 - y3), (z0.imag - y2) + (x1 - x3)
            )


@njit(cache=True, nogil=True)
def tensor_product(xx, xy, yy, field, product):  # type: ignore[no-untyped-def]
    """Write the product of a symmetric tensor field with a ``field`` to ``product``.

    The components of the tensors are ``(nx, ny)``; the fields are ``(2, nx, ny)``.
    """
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


@njit(cache=True, nogil=True)
def spread_product(tensor, values, cells, field):  # type: ignore[no-untyped-def]
    """Set ``cells`` of a ``field`` ``(3, n)`` to the product of tensors with ``values``.

    The tensors ``(4, m)`` have the components xx, xy, yy, zz; ``values`` are ``(3, m)``.
    """
    for i in range(len(cells)):
        x, y, cell = values[0, i], values[1, i], cells[i]
        field[0, cell] = tensor[0, i] * x + tensor[1, i] * y
        field[1, cell] = tensor[1, i] * x + tensor[2, i] * y
        field[2, cell] = tensor[3, i] * values[2, i]


@njit(cache=True, nogil=True)
def gather_product(tensor, field, cells, product):  # type: ignore[no-untyped-def]
    """Add the product of tensors with the values of a ``field`` on ``cells`` to ``product``.

    The tensors ``(4, m)`` have the components xx, xy, yy, zz; ``field`` is ``(3, n)``.
    """
    for i in range(len(cells)):
        cell = cells[i]
        x, y = field[0, cell], field[1, cell]
        product[0, i] += tensor[0, i] * x + tensor[1, i] * y
        product[1, i] += tensor[1, i] * x + tensor[2, i] * y
        product[2, i] += tensor[3, i] * field[2, cell]


@njit(cache=True, nogil=True)
def add_product(tensor, values, product):  # type: ignore[no-untyped-def]
    """Add the product of tensors xx, xy, yy, zz ``(4, m)`` with ``values`` to ``product``.

    ``values`` and ``product`` are ``(3, m)``.
    """
    for i in range(values.shape[1]):
        x, y = values[0, i], values[1, i]
        product[0, i] += tensor[0, i] * x + tensor[1, i] * y
        product[1, i] += tensor[1, i] * x + tensor[2, i] * y
        product[2, i] += tensor[3, i] * values[2, i]
