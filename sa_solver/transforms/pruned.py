"""DFT along x of spectra whose second half is zero padding.

FFTW has direct transforms up to a length of 128. For longer columns it takes twice the time per
operation, and it does not use that half of the values are zero. Columns of 256, 512 and more values
are therefore split by frequency, every second or every fourth, and the parts are transformed one
after the other (decimation in frequency). Since half of the values are zero, the first sums need
not be computed (Markel 1971, FFT pruning, doi:10.1109/TAU.1971.1162205).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sa_solver.transforms.fftw import plan
from sa_solver.transforms.passes import Spectrum, join_four, join_two, split_in_four, split_in_two
from sa_solver.types import Indices

PARTS = {256: 2, 512: 4, 1024: 4, 2048: 4, 4096: 4}
"""Number of parts by the length of columns. For other lengths splitting saves nothing."""

LARGE = 40_000
"""Size of a spectrum, in complex numbers, above which splitting saves time: smaller spectra stay in
the processor's cache."""


class PrunedColumns:
    """Transforms of the columns of ``spectrum`` ``(m, k)``, in place and unnormalised.

    Rows from ``rows`` on are taken as zero before the forward transform, and are not valid after
    the backward transform. Row ``i`` of the transform has the frequency ``order[i]``.
    """

    def __init__(self, spectrum: Spectrum, rows: int) -> None:
        """Plan the transforms of ``spectrum``, of which only the first ``rows`` are not zero."""
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
        """Transform rows to frequencies."""
        self._padding[:] = 0.0
        self._split()
        for part in self._forward:
            part.execute()

    def backward(self) -> None:
        """Transform frequencies to the first ``rows``."""
        for part in self._backward:
            part.execute()
        self._join()


def _steps(spectrum: Spectrum, parts: int) -> tuple[Callable[[], Any], Callable[[], Any]]:
    """Return the functions that split the columns into parts and join the parts."""
    if parts == 1:
        return _nothing, _nothing
    split, join = {2: (split_in_two, join_two), 4: (split_in_four, join_four)}[parts]
    steps = np.arange(parts)[:, None] * np.arange(len(spectrum) // parts)
    twiddles = np.exp(-2j * np.pi / len(spectrum) * steps)
    return lambda: split(spectrum, twiddles), lambda: join(spectrum, twiddles)


def _nothing() -> None:
    """Do nothing, for columns that are not split."""
