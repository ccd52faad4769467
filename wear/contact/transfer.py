"""Transfers between the nodes of a contact face and the cells of its grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sa_solver.types import Array, Grid, Mask


class Transfer(Protocol):
    """Transfer between the ``n`` nodes of a face and the ``(nx, ny)`` cells of its grid."""

    @property
    def nodes(self) -> Array:
        """Coordinates ``(n, 2)`` of the nodes [mm]."""
        ...

    @property
    def areas(self) -> Array:
        """Area of each node ``(n,)`` [mm²]; in a line contact [mm]."""
        ...

    @property
    def opposed(self) -> Array:
        """Part of the ``areas`` covered by the face of the other body, 0 where there is none."""
        ...

    def spacing(self, region: Array) -> Array:
        """Return the distance of neighbouring nodes along x and y ``(2,)`` [mm].

        It is 0 along y on a line. Only nodes in the ``region`` ``(2, 2)`` of least and largest x
        and y count.
        """
        ...

    @property
    def per_facet(self) -> int:
        """Number of nodal spacings along a facet: 2 with midside nodes."""
        ...

    @property
    def places(self) -> Array:
        """Position of each cell on the face, or of the nearest point of it ``(2, nx, ny)`` [mm]."""
        ...

    def spread(self, forces: Array) -> Array:
        """Return tractions ``(..., nx, ny)`` [MPa] with the sums of ``forces`` ``(..., n)`` [N]."""
        ...

    @property
    def reached(self) -> Mask:
        """Nodes ``(n,)`` around which the grid contains all cells that :meth:`sample` uses."""
        ...

    def sample(self, cells: Array) -> Array:
        """Return fields ``(..., nx, ny)`` at the nodes, or averaged around them ``(..., n)``."""
        ...

    def means(self, nodal: Array) -> Array:
        """Return what :meth:`sample` gives for a field with ``nodal`` values ``(..., n)``."""
        ...

    def to_cells(self, nodal: Array) -> Array:
        """Return the cell values ``(..., nx, ny)`` of nodal values ``(..., n)``."""
        ...

    def to_nodes(self, cells: Array) -> Array:
        """Return the nodal values ``(n,)`` of cell values ``(nx, ny)``, with the same volume."""
        ...


@dataclass(frozen=True)
class CellNodes:
    """Transfer of a face whose nodes are the cells of its ``grid``, in C order.

    Examples
    --------
    Forces on the cells of a grid become pressures on the grid:

    >>> import numpy as np
    >>> from sa_solver import Grid
    >>> from wear import CellNodes
    >>> face = CellNodes(Grid.covering((1.0, 1.0), (2, 2)))
    >>> print(face.spread(np.array([10.0, 20.0, 30.0, 40.0])))
    [[ 40.  80.]
     [120. 160.]]
    >>> print(face.areas)
    [0.25 0.25 0.25 0.25]
    """

    grid: Grid

    @property
    def nodes(self) -> Array:
        return self.places.reshape(2, -1).T

    @property
    def areas(self) -> Array:
        return np.full(self.grid.shape[0] * self.grid.shape[1], self.grid.cell_area)

    @property
    def opposed(self) -> Array:
        return self.areas

    def spacing(self, region: Array) -> Array:
        return np.array([self.grid.pitch[0], 0.0 if self.grid.line else self.grid.pitch[1]])

    @property
    def per_facet(self) -> int:
        return 1

    @property
    def places(self) -> Array:
        return self.grid.centres

    def spread(self, forces: Array) -> Array:
        return self.to_cells(forces) / self.grid.cell_area

    @property
    def reached(self) -> Mask:
        return np.ones(self.grid.shape, dtype=np.bool_).ravel()

    def sample(self, cells: Array) -> Array:
        return cells.reshape(*cells.shape[:-2], -1)

    def means(self, nodal: Array) -> Array:
        return nodal

    def to_cells(self, nodal: Array) -> Array:
        return nodal.reshape(*nodal.shape[:-1], *self.grid.shape)

    def to_nodes(self, cells: Array) -> Array:
        return cells.ravel()
