"""The box of cells around a contact, on which it can be solved with smaller transforms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sa_solver.rigid_modes import Window
from sa_solver.types import Array, Mask

MARGIN = 0.06
"""Rim left around the pressed cells, over their extent. It must hold the error of a coarser grid's
contact; wider boxes cost more than the few that have to be enlarged."""

LEAST_MARGIN = 3
"""Cells of rim at least: a coarser grid places the edge within two."""

LARGEST_SHARE = 0.7
"""A box above this share of the grid saves less than the convolution that verifies it."""

SIZES = (8, 10, 12, 15)
"""Sides of a box are these times a power of two: fast transforms, and few enough to keep."""


@dataclass(frozen=True)
class Box:
    """The cells of a grid of ``shape`` that the slices ``window`` cut out of a field."""

    window: Window
    shape: tuple[int, int]

    @classmethod
    def whole(cls, shape: tuple[int, int]) -> Box:
        """All cells."""
        return cls((slice(0, shape[0]), slice(0, shape[1])), shape)

    @classmethod
    def around(cls, cells: Mask) -> Box:
        """A box with a rim around ``cells`` ``(nx, ny)``, or all where that is not much larger."""
        shape = (cells.shape[0], cells.shape[1])
        along_x, along_y = (
            _side(np.flatnonzero(cells.any(axis=1 - axis)), shape[axis]) for axis in (0, 1)
        )
        box = cls((along_x, along_y), shape)
        small = np.prod(box.size) <= LARGEST_SHARE * np.prod(shape)
        return box if small else cls.whole(shape)

    @property
    def size(self) -> tuple[int, int]:
        """Cells along x and y."""
        along_x, along_y = self.window
        return along_x.stop - along_x.start, along_y.stop - along_y.start

    def grown(self) -> Box:
        """A larger box around this one."""
        return Box.around(self.placed(np.ones(self.size)) > 0.0)

    def placed(self, field: Array) -> Array:
        """``field`` on the box, continued by 0 over the grid."""
        if self.size == self.shape:
            return field
        out = np.zeros(self.shape)
        out[self.window] = field
        return out

    def left_by(self, cells: Mask) -> bool:
        """Whether ``cells`` of the box reach a side of it that is not a border of the grid."""
        return any(
            (side.start > 0 and lines[0].any()) or (side.stop < count and lines[-1].any())
            for side, count, lines in zip(self.window, self.shape, (cells, cells.T), strict=True)
        )


def _side(pressed: NDArray[np.intp], count: int) -> slice:
    """Cells of the box along an axis of ``count`` cells."""
    if len(pressed) == 0:
        return slice(0, count)
    first, end = int(pressed[0]), int(pressed[-1]) + 1
    margin = max(LEAST_MARGIN, int(np.ceil(MARGIN * (end - first))))
    size = min(_fast(end - first + 2 * margin), count)
    start = min(max((first + end - size) // 2, 0), count - size)
    return slice(start, start + size)


def _fast(count: int) -> int:
    """The least of :data:`SIZES` times a power of two that is not below ``count``."""
    doublings = max(0, int(np.ceil(np.log2(count / SIZES[-1]))))
    return next(size << doublings for size in SIZES if size << doublings >= count)
