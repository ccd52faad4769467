"""Passes over spectra and fields: by numpy until those that are compiled pay.

Compiled loops take an eighth of numpy's time, but half a second to load, in which many a short
solution is over. Each function here has a compiled
namesake in :mod:`sa_solver.transforms.kernels` that does the same operations in the same order:
which of them has run shows in no digit.
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

PAYS = 150_000_000
"""Numbers after which a process turns to compiled loops. Numpy has then lost as much time, at 3 to
4 ns each in whole runs, as loading the compiler and its loops takes: half a second."""

CALL = 3_000
"""Numbers that a call counts for besides its own: 10 to 20 us, however few those are."""

BLOCK = 8_000
"""Complex numbers taken at a time: what lies between the operations on them stays in the cache."""

passed = 0
"""Numbers that numpy has passed over in this process."""


def _while_short(by_numpy: Callable[..., None]) -> Callable[..., None]:
    """The function, or its compiled namesake once enough numbers have been passed over."""

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
    """Rows of a block each."""
    height = max(1, BLOCK // columns)
    return (slice(first, min(first + height, rows)) for first in range(0, rows, height))


# --- spectra --------------------------------------------------------------------------------------


@_while_short
def multiply_spectrum(spectrum: Spectrum, symbol: Array) -> None:
    """Multiply a spectrum ``(mx, m)`` by a real symbol of that shape."""
    spectrum *= symbol  # by a complex number without an imaginary part: rounded once as well


@_while_short
def multiply_spectra(
    spectra: Spectra,
    symbols: Array,
    places: Indices,
    turned_inputs: NDArray[np.bool_],
    turned_outputs: NDArray[np.bool_],
) -> None:
    """Replace the first spectra ``(k, mx, m)`` by sums of them times real symbols ``(s, mx, m)``.

    ``places`` ``(r, c)`` names the symbol that takes input j to output i. Inputs that are
    ``turned`` ``(c,)`` are divided by the imaginary unit first, outputs ``(r,)`` multiplied by it.
    """
    for block in _blocks(*spectra.shape[1:]):
        given = [
            (z.imag.copy(), -z.real) if turned else (z.real.copy(), z.imag.copy())
            for z, turned in zip(spectra[: places.shape[1], block], turned_inputs, strict=True)
        ]
        for z, row, turned in zip(spectra[:, block], places, turned_outputs, strict=False):
            real, imaginary = (symbols[row[0], block] * part for part in given[0])
            for place, (x, y) in zip(row[1:], given[1:], strict=True):
                real += symbols[place, block] * x
                imaginary += symbols[place, block] * y
            z.real, z.imag = (-imaginary, real) if turned else (real, imaginary)


@_while_short
def split_in_two(spectrum: Spectrum, turns: Spectra) -> None:
    """Set the second half of rows ``(2 m, k)`` to the first times ``turns[1]`` ``(m,)``."""
    first, second = np.split(spectrum, 2)
    for block in _blocks(*first.shape):
        a = first[block]
        _turn(a.real, a.imag, turns[1, block], second[block])


@_while_short
def join_two(spectrum: Spectrum, turns: Spectra) -> None:
    """Add the second half of rows ``(2 m, k)``, times ``turns[1]`` conjugate, to the first."""
    first, second = np.split(spectrum, 2)
    for block in _blocks(*first.shape):
        a = first[block]
        x, y = _turned_back(second[block], turns[1, block])
        a.real += x
        a.imag += y


@_while_short
def split_in_four(spectrum: Spectrum, turns: Spectra) -> None:
    """Of rows ``(4 m, k)``, a and b the first two quarters: (a + (-i)^r b) ``turns[r]`` in each."""
    quarters = np.split(spectrum, 4)
    for block in _blocks(*quarters[0].shape):
        a, b, c, d = (quarter[block] for quarter in quarters)
        _turn(a.real - b.real, a.imag - b.imag, turns[2, block], c)
        _turn(a.real - b.imag, a.imag + b.real, turns[3, block], d)
        x, y = a.real + b.imag, a.imag - b.real
        a += b
        _turn(x, y, turns[1, block], b)


@_while_short
def join_four(spectrum: Spectrum, turns: Spectra) -> None:
    """Sum the quarters z_r times ``turns[r]`` conjugate into a, and i^r times them into b."""
    quarters = np.split(spectrum, 4)
    for block in _blocks(*quarters[0].shape):
        a, b, c, d = (quarter[block] for quarter in quarters)
        x1, y1 = _turned_back(b, turns[1, block])
        x2, y2 = _turned_back(c, turns[2, block])
        x3, y3 = _turned_back(d, turns[3, block])
        np.subtract(a.real - x2, y1 - y3, out=b.real)
        np.add(a.imag - y2, x1 - x3, out=b.imag)
        np.add(a.real + x2, x1 + x3, out=a.real)
        np.add(a.imag + y2, y1 + y3, out=a.imag)


def _turn(x: Array, y: Array, turns: Spectrum, out: Spectrum) -> None:
    """``out``: numbers x + i y ``(m, k)`` times ``turns`` ``(m,)``."""
    # By parts: numpy's product of complex numbers is rounded otherwise from machine to machine.
    c, s = turns.real[:, None], turns.imag[:, None]
    np.subtract(x * c, y * s, out=out.real)
    np.add(x * s, y * c, out=out.imag)


def _turned_back(z: Spectrum, turns: Spectrum) -> tuple[Array, Array]:
    """Parts of numbers ``(m, k)`` times ``turns`` ``(m,)`` conjugate."""
    c, s, x, y = turns.real[:, None], turns.imag[:, None], z.real, z.imag
    return x * c + y * s, y * c - x * s


# --- fields ---------------------------------------------------------------------------------------


@_while_short
def tensor_product(xx: Array, xy: Array, yy: Array, field: Array, product: Array) -> None:
    """``product`` ``(2, nx, ny)`` of symmetric tensors ``(nx, ny)`` with a ``field``."""
    x, y = field
    np.add(xx * x, xy * y, out=product[0])
    np.add(yy * y, xy * x, out=product[1])


@_while_short
def add_scaled(total: Array, field: Array, scale: float) -> None:
    """Add ``scale`` times a ``field`` to ``total``, both ``(k, nx, ny)``."""
    total += scale * field


@_while_short
def spread_product(tensor: Array, values: Array, cells: Indices, field: Array) -> None:
    """Set cells of a field ``(3, n)`` to tensors xx, xy, yy, zz ``(4, m)`` times ``(3, m)``."""
    for part, product in zip(field, _products(tensor, values), strict=True):
        part[cells] = product


@_while_short
def gather_product(tensor: Array, field: Array, cells: Indices, product: Array) -> None:
    """Add the same tensors times what a ``field`` ``(3, n)`` has on cells to ``product``."""
    for part, more in zip(product, _products(tensor, field[:, cells]), strict=True):
        part += more


@_while_short
def add_product(tensor: Array, values: Array, product: Array) -> None:
    """Add the same tensors times ``values`` ``(3, m)`` to ``product`` ``(3, m)``."""
    for part, more in zip(product, _products(tensor, values), strict=True):
        part += more


def _products(tensor: Array, values: Array) -> tuple[Array, Array, Array]:
    """Tensors xx, xy, yy, zz ``(4, m)`` times ``values`` ``(3, m)``."""
    x, y, z = values
    return tensor[0] * x + tensor[1] * y, tensor[1] * x + tensor[2] * y, tensor[3] * z
