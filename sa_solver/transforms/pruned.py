"""DFT along x of spectra whose second half is zero padding.

FFTW's direct transforms end at a length of 128: longer columns take it twice the time for each
operation, and it knows nothing of the zeros. So columns of 256 or 512 and more are taken apart by
their frequencies, every second or every fourth (decimation in frequency; with a zero half the
first sums fall away: Markel 1971, FFT pruning, doi:10.1109/TAU.1971.1162205), and the parts are
transformed one after the other.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sa_solver.transforms.fftw import plan
from sa_solver.transforms.passes import Spectrum, join_four, join_two, split_in_four, split_in_two
from sa_solver.types import Indices

PARTS = {256: 2, 512: 4, 1024: 4, 2048: 4, 4096: 4}
"""Parts of columns by their length. Other lengths gain nothing."""

LARGE = 40_000
"""Complex numbers of a spectrum from which on parts pay: smaller ones stay in the cache."""


class PrunedColumns:
    """Transforms the columns of ``spectrum`` ``(m, k)`` in place, and back.

    Rows from ``rows`` on are taken to be zero, and not needed of what comes back, unnormalised.
    Row ``i`` of the transform has the frequency ``order[i]``.
    """

    def __init__(self, spectrum: Spectrum, rows: int) -> None:
        """Plan it."""
        length = len(spectrum)
        large = spectrum.size >= LARGE and 2 * rows <= length
        parts = PARTS.get(length, 1) if large else 1
        part = length // parts
        blocks = [spectrum[first : first + part] for first in range(0, length, part)]
        self.order: Indices = np.arange(length).reshape(part, parts).T.ravel()
        self._forward = [plan(block, block, 0) for block in blocks]
        self._backward = [plan(block, block, 0, backward=True) for block in blocks]
        self._padding = spectrum[rows : length // 2 if parts > 1 else length]
        self._split, self._join = _steps(spectrum, parts)

    def forward(self) -> None:
        """From rows to frequencies."""
        self._padding[:] = 0.0
        self._split()
        for part in self._forward:
            part.execute()

    def backward(self) -> None:
        """From frequencies to the first ``rows``."""
        for part in self._backward:
            part.execute()
        self._join()


def _steps(spectrum: Spectrum, parts: int) -> tuple[Callable[[], Any], Callable[[], Any]]:
    """What takes columns apart, and puts them together."""
    if parts == 1:
        return _nothing, _nothing
    split, join = {2: (split_in_two, join_two), 4: (split_in_four, join_four)}[parts]
    steps = np.arange(parts)[:, None] * np.arange(len(spectrum) // parts)
    turns = np.exp(-2j * np.pi / len(spectrum) * steps)
    return lambda: split(spectrum, turns), lambda: join(spectrum, turns)


def _nothing() -> None:
    """Columns in one piece."""
