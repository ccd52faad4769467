"""Box of cells around a contact, on which the contact is solved with smaller transforms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from sa_solver.half_space.operator import HalfSpace
from sa_solver.rigid_modes import Window
from sa_solver.types import Array, Mask

T = TypeVar("T")

MARGIN = 0.06
"""Width of the margin around the pressed cells, relative to their extent. The margin must cover the
error of the contact area on a coarser grid. A wider margin costs more than the few boxes that have
to be enlarged."""

LEAST_MARGIN = 3
"""Least width of the margin, in cells: a coarser grid locates the edge to within two cells."""

LARGEST_SHARE = 0.7
"""Share of the grid above which a box saves less than the convolution that verifies it."""

SIZES = (8, 10, 12, 15)
"""Sides of a box are one of these times a power of two: transforms of these lengths are fast, and
there are few enough of them to be stored."""

BOXES = 4
"""Number of boxes whose operators are stored: a wear run needs two or three."""


@dataclass(frozen=True)
class Box:
    """Rectangle of cells, cut out of a grid of ``shape`` by the slices ``window``."""

    window: Window
    shape: tuple[int, int]

    @classmethod
    def whole(cls, shape: tuple[int, int]) -> Box:
        """Return the box of all cells of a grid of ``shape``."""
        return cls((slice(0, shape[0]), slice(0, shape[1])), shape)

    @classmethod
    def around(cls, cells: Mask) -> Box:
        """Return a box with a margin around ``cells`` ``(nx, ny)``.

        It is the whole grid where a smaller box would save little.
        """
        shape = (cells.shape[0], cells.shape[1])
        along_x, along_y = (
            _side(np.flatnonzero(cells.any(axis=1 - axis)), shape[axis]) for axis in (0, 1)
        )
        box = cls((along_x, along_y), shape)
        small = np.prod(box.size) <= LARGEST_SHARE * np.prod(shape)
        return box if small else cls.whole(shape)

    @property
    def size(self) -> tuple[int, int]:
        """Number of cells along x and y."""
        along_x, along_y = self.window
        return along_x.stop - along_x.start, along_y.stop - along_y.start

    def enlarged(self) -> Box:
        """Return a larger box around this one."""
        return Box.around(self.on_whole_grid(np.ones(self.size)) > 0.0)

    def on_whole_grid(self, field: Array) -> Array:
        """Return ``field`` ``(nx, ny)`` of the box on the whole grid, with 0 outside the box."""
        if self.size == self.shape:
            return field
        out = np.zeros(self.shape)
        out[self.window] = field
        return out

    def is_reached_by(self, cells: Mask) -> bool:
        """Return whether ``cells`` of the box reach a side of it inside the grid."""
        return any(
            (side.start > 0 and lines[0].any()) or (side.stop < count and lines[-1].any())
            for side, count, lines in zip(self.window, self.shape, (cells, cells.T), strict=True)
        )


def _side(pressed: NDArray[np.intp], count: int) -> slice:
    """Return the cells of the box along an axis of ``count`` cells."""
    if len(pressed) == 0:
        return slice(0, count)
    first, end = int(pressed[0]), int(pressed[-1]) + 1
    margin = max(LEAST_MARGIN, int(np.ceil(MARGIN * (end - first))))
    size = min(_fast(end - first + 2 * margin), count)
    start = min(max((first + end - size) // 2, 0), count - size)
    return slice(start, start + size)


def _fast(count: int) -> int:
    """Return the least of :data:`SIZES` times a power of two that is not below ``count``."""
    doublings = max(0, int(np.ceil(np.log2(count / SIZES[-1]))))
    return next(size << doublings for size in SIZES if size << doublings >= count)


class OnBoxes(Generic[T]):
    """Operators on a half-space and on boxes of its cells, each made once.

    Parameters
    ----------
    half_space
        The half-space.
    make
        Function that returns the operator on a half-space.
    """

    def __init__(self, half_space: HalfSpace, make: Callable[[HalfSpace], T]) -> None:
        self._half_space, self._make = half_space, make
        self._of_size = lru_cache(BOXES)(self._made)

    @cached_property
    def whole(self) -> T:
        """Operator on all cells."""
        return self._make(self._half_space)

    def on(self, box: Box) -> T:
        """Return the operator on a box."""
        return self.whole if box.size == box.shape else self._of_size(box.size)

    def _made(self, size: tuple[int, int]) -> T:
        return self._make(self._half_space.on(replace(self._half_space.grid, shape=size)))
