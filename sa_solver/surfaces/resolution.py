"""Whether a grid resolves a contact, by the cells across it.

Against Hertz, on grids that lie anyhow to the contact, the largest pressure is too low by about
1/k² with k cells across (k = 2: 14 to 55 %, 4: 2 to 5 %, 8: 0.1 to 1.5 %, 16: 0.3 %), the approach
by half of that at most. The width of a line contact is off by up to a cell (k = 4: 44 %, 8: 16 %,
16: 8 %), the radius of an area by less (k = 4: 35 %, 8: 9 %, 12: 6 %, 16: 3 %). A flat of sharp
edges has the pressure of its middle within 10 % on 12 strips, 7 % on 16, 4 % on 32.
"""

from __future__ import annotations

import numpy as np

from sa_solver.types import Mask

FEWEST_CELLS, FEWEST_STRIPS = 10, 16
"""Across a contact that is resolved, over an area or along a line: its size to 8 %, pressure to 1 %
or 0.4 %."""

POINT = 2
"""Cells up to which resultants alone fix the pressure, however small the contact is in truth."""


def cells_across(pressed: Mask) -> tuple[int, int]:
    """Longest unbroken rows of ``pressed`` ``(nx, ny)`` cells along x and along y."""
    return _longest_row(pressed), _longest_row(pressed.T)


def is_point(pressed: Mask) -> bool:
    """Whether all ``pressed`` ``(nx, ny)`` cells lie in so few rows that there is no field."""
    places = (np.flatnonzero(pressed.any(axis=axis)) for axis in (0, 1))
    return all(len(place) > 0 and np.ptp(place) < POINT for place in places)


def fewest_across(line: bool) -> int:
    """Cells across a contact from which on it is resolved."""
    return FEWEST_STRIPS if line else FEWEST_CELLS


def peak_error(cells: int) -> float:
    """About how much too low the largest pressure is with so many cells across, relative."""
    return min(1.0, (1.0 if cells > POINT else 2.0) / cells**2)


def _longest_row(pressed: Mask) -> int:
    row, longest = np.zeros(pressed.shape[1], dtype=np.int64), 0
    for across in pressed:
        row = (row + 1) * across
        longest = max(longest, int(row.max()))
    return longest
