"""Loops over spectra and fields, by numpy in short computations and compiled in long ones.

Compiled loops take an eighth of numpy's time, but a second or two to load, longer than many
short computations. Each function here has a compiled function of the same name in
:mod:`sa_solver.transforms.kernels` that does the same operations in the same order, so that the
results are the same in every digit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import wraps
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sa_solver.types import Array, Indices

Spectrum = NDArray[np.complex128]
Spectra = NDArray[np.complex128]

PAYS = 500_000_000
"""Numbers processed by numpy after which a process uses the compiled loops. At 3 to 4 ns per number
numpy has then lost the one and a half seconds that loading the compiler and the loops takes."""

CALL = 3_000
"""Numbers that are counted for each call in addition: a call costs 10 to 20 us, however few numbers
it processes."""

BLOCK = 8_000
"""Complex numbers processed at a time, so that intermediate results stay in the processor's cache.
"""

passed = 0
"""Numbers that numpy has processed in this process."""


def _compiled_in_long_runs(by_numpy: Callable[..., None]) -> Callable[..., None]:
    """Return a function that calls ``by_numpy``, or its compiled version after many numbers."""

    @wraps(by_numpy)
    def loop(*arrays: Any) -> None:
        global passed
        if passed < PAYS:
            passed += arrays[0].size + CALL
            by_numpy(*arrays)
        else:
            getattr(import_module("sa_solver.transforms.kernels"), by_numpy.__name__)(*arrays)

    return loop


def _blocks(rows: int, columns: int) -> Iterator[slice]:
    """Return the rows of each block."""
    height = max(1, BLOCK // columns)
    return (slice(first, min(first + height, rows)) for first in range(0, rows, height))


# --- spectra --------------------------------------------------------------------------------------


@_compiled_in_long_runs
def multiply_spectrum(spectrum: Spectrum, symbol: Array) -> None:
    """Multiply a spectrum ``(mx, m)`` by a real symbol of that shape."""
    spectrum *= symbol  # The symbol has no imaginary part, so that each part is rounded once.


@_compiled_in_long_runs
def multiply_spectra(
    spectra: Spectra,
    symbols: Array,
    places: Indices,
    imaginary_inputs: NDArray[np.bool_],
    imaginary_outputs: NDArray[np.bool_],
) -> None:
    """Replace the first spectra ``(k, mx, m)`` by sums of them times real symbols ``(s, mx, m)``.

    ``places[i, j]`` is the index of the symbol that multiplies input j in output i. Inputs marked
    in ``imaginary_inputs`` ``(c,)`` are first divided by the imaginary unit; outputs marked in
    ``imaginary_outputs`` ``(r,)`` are multiplied by it.
    """
    for block in _blocks(*spectra.shape[1:]):
        given = [
            (z.imag.copy(), -z.real) if is_imaginary else (z.real.copy(), z.imag.copy())
            for z, is_imaginary in zip(
                spectra[: places.shape[1], block], imaginary_inputs, strict=True
            )
        ]
        for z, row, is_imaginary in zip(spectra[:, block], places, imaginary_outputs, strict=False):
            real, imaginary = (symbols[row[0], block] * part for part in given[0])
            for place, (x, y) in zip(row[1:], given[1:], strict=True):
                real += symbols[place, block] * x
                imaginary += symbols[place, block] * y
            z.real, z.imag = (-imaginary, real) if is_imaginary else (real, imaginary)


@_compiled_in_long_runs
def split_in_two(spectrum: Spectrum, twiddles: Spectra) -> None:
    """Set the second half of rows ``(2 m, k)`` to the first times ``twiddles[1]`` ``(m,)``."""
    first, second = np.split(spectrum, 2)
    for block in _blocks(*first.shape):
        a = first[block]
        _rotate(a.real, a.imag, twiddles[1, block], second[block])


@_compiled_in_long_runs
def join_two(spectrum: Spectrum, twiddles: Spectra) -> None:
    """Add the second half of rows ``(2 m, k)``, times ``twiddles[1]`` conjugate, to the first."""
    first, second = np.split(spectrum, 2)
    for block in _blocks(*first.shape):
        a = first[block]
        x, y = _rotated_back(second[block], twiddles[1, block])
        a.real += x
        a.imag += y


@_compiled_in_long_runs
def split_in_four(spectrum: Spectrum, twiddles: Spectra) -> None:
    """Set quarter r of rows ``(4 m, k)`` to (a + (-i)^r b) ``twiddles[r]``.

    a and b are the first two quarters.
    """
    quarters = np.split(spectrum, 4)
    for block in _blocks(*quarters[0].shape):
        a, b, c, d = (quarter[block] for quarter in quarters)
        _rotate(a.real - b.real, a.imag - b.imag, twiddles[2, block], c)
        _rotate(a.real - b.imag, a.imag + b.real, twiddles[3, block], d)
        x, y = a.real + b.imag, a.imag - b.real
        a += b
        _rotate(x, y, twiddles[1, block], b)


@_compiled_in_long_runs
def join_four(spectrum: Spectrum, twiddles: Spectra) -> None:
    """Set a to Σ w_r and b to Σ i^r w_r, where w_r is quarter r times ``twiddles[r]`` conjugate.

    a and b are the first two quarters of the rows ``(4 m, k)``.
    """
    quarters = np.split(spectrum, 4)
    for block in _blocks(*quarters[0].shape):
        a, b, c, d = (quarter[block] for quarter in quarters)
        x1, y1 = _rotated_back(b, twiddles[1, block])
        x2, y2 = _rotated_back(c, twiddles[2, block])
        x3, y3 = _rotated_back(d, twiddles[3, block])
        np.subtract(a.real - x2, y1 - y3, out=b.real)
        np.add(a.imag - y2, x1 - x3, out=b.imag)
        np.add(a.real + x2, x1 + x3, out=a.real)
        np.add(a.imag + y2, y1 + y3, out=a.imag)


def _rotate(x: Array, y: Array, twiddles: Spectrum, out: Spectrum) -> None:
    """Write the numbers x + i y ``(m, k)`` times ``twiddles`` ``(m,)`` to ``out``."""
    # Real and imaginary parts are computed separately because the rounding of numpy's complex
    # product differs between machines.
    c, s = twiddles.real[:, None], twiddles.imag[:, None]
    np.subtract(x * c, y * s, out=out.real)
    np.add(x * s, y * c, out=out.imag)


def _rotated_back(z: Spectrum, twiddles: Spectrum) -> tuple[Array, Array]:
    """Return real and imaginary parts of ``z`` ``(m, k)`` times ``twiddles`` ``(m,)`` conjugate."""
    c, s, x, y = twiddles.real[:, None], twiddles.imag[:, None], z.real, z.imag
    return x * c + y * s, y * c - x * s


# --- fields ---------------------------------------------------------------------------------------


@_compiled_in_long_runs
def tensor_product(xx: Array, xy: Array, yy: Array, field: Array, product: Array) -> None:
    """Write the product of a symmetric tensor field with a ``field`` to ``product``.

    The components of the tensors are ``(nx, ny)``; the fields are ``(2, nx, ny)``.
    """
    x, y = field
    np.add(xx * x, xy * y, out=product[0])
    np.add(yy * y, xy * x, out=product[1])


@_compiled_in_long_runs
def add_scaled(total: Array, field: Array, scale: float) -> None:
    """Add ``scale`` times a ``field`` to ``total``, both ``(k, nx, ny)``."""
    total += scale * field


@_compiled_in_long_runs
def spread_product(tensor: Array, values: Array, cells: Indices, field: Array) -> None:
    """Set ``cells`` of a ``field`` ``(3, n)`` to the product of tensors with ``values``.

    The tensors ``(4, m)`` have the components xx, xy, yy, zz; ``values`` are ``(3, m)``.
    """
    for part, product in zip(field, _products(tensor, values), strict=True):
        part[cells] = product


@_compiled_in_long_runs
def gather_product(tensor: Array, field: Array, cells: Indices, product: Array) -> None:
    """Add the product of tensors with the values of a ``field`` on ``cells`` to ``product``.

    The tensors ``(4, m)`` have the components xx, xy, yy, zz; ``field`` is ``(3, n)``.
    """
    for part, more in zip(product, _products(tensor, field[:, cells]), strict=True):
        part += more


@_compiled_in_long_runs
def add_product(tensor: Array, values: Array, product: Array) -> None:
    """Add the product of tensors xx, xy, yy, zz ``(4, m)`` with ``values`` to ``product``.

    ``values`` and ``product`` are ``(3, m)``.
    """
    for part, more in zip(product, _products(tensor, values), strict=True):
        part += more


def _products(tensor: Array, values: Array) -> tuple[Array, Array, Array]:
    """Return the product of tensors xx, xy, yy, zz ``(4, m)`` with ``values`` ``(3, m)``."""
    x, y, z = values
    return tensor[0] * x + tensor[1] * y, tensor[1] * x + tensor[2] * y, tensor[3] * z
