"""Gaps between unloaded bodies over a contact face, as functions of the place on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sa_solver import checks
from sa_solver.types import Array, Grid

if TYPE_CHECKING:
    from fe_models.meshes.structure_mesh import Interface

GapFunction = Callable[[Array, Array], Array]
"""Return the gap ``(n, m)`` [mm] at ``x`` ``(n, 1)`` and ``y`` ``(1, m)`` of the face [mm]."""


@dataclass(frozen=True)
class AddedGap:
    """A gap added to the form of a contact face, such as a measured or worn profile.

    Parameters
    ----------
    over : GapFunction
        The gap [mm] at x and y of the face's frame.
    nodal : callable, optional
        Returns the gap at the nodes ``(n,)`` [mm] of a meshed face, which it is given. Without it
        ``over`` is sampled there; give it where ``over`` has more detail than facets can follow.

    Examples
    --------
    A groove of 2 µm across the middle of a face:

    >>> import numpy as np
    >>> import fretscale
    >>> groove = fretscale.AddedGap(lambda x, y: 2e-3 * np.exp(-(x**2)) + 0.0 * y)
    >>> print(groove.over(np.array([[0.0], [1.0]]), np.zeros((1, 1))).ravel())
    [0.002      0.00073576]
    """

    over: GapFunction
    nodal: Callable[[Interface], Array] | None = None

    def __post_init__(self) -> None:
        checks.instances(self, over=Callable, nodal=Callable | None)

    def at_nodes(self, face: Interface) -> Array:
        """Return the gap at the nodes of a meshed face ``(n,)`` [mm]."""
        if self.nodal is not None:
            values = self.nodal(face)
            return checks.array("added gaps", np.broadcast_to(values, len(face)), (len(face),))
        points = face.coordinates[:, :, None, None]
        values = np.array([np.broadcast_to(self.over(x, y), (1, 1))[0, 0] for x, y in points])
        return checks.array("added gaps", values, (len(face),))

    def on(self, form: GapFunction) -> GapFunction:
        """Return the sum of a ``form`` and this gap."""
        return _Sum(form, self.over)


@dataclass(frozen=True)
class _Sum:
    """The sum of two gaps; unlike a nested function, it can be sent to another process."""

    form: GapFunction
    added: GapFunction

    def __call__(self, x: Array, y: Array) -> Array:
        return self.form(x, y) + self.added(x, y)


@dataclass(frozen=True)
class GridHeights:
    """Heights ``(nx, ny)`` [mm] at the centres of a grid, with bilinear interpolation."""

    grid: Grid
    heights: Array

    def __call__(self, x: Array, y: Array) -> Array:
        """Return heights at ``x`` ``(n, 1)`` and ``y`` ``(1, m)``; on the grid, those given."""
        grid = self.grid
        if np.array_equal(x, grid.x) and np.array_equal(y, grid.y):
            return self.heights
        along_x = _linear(grid.x.ravel(), x.ravel())
        along_y = _linear(grid.y.ravel(), y.ravel())
        heights: Array = along_x @ self.heights @ along_y.T
        return heights


def _linear(known: Array, wanted: Array) -> Array:
    """Return weights ``(m, n)`` from ascending ``known`` ``(n,)`` points to ``wanted`` ones."""
    if len(known) == 1:
        return np.ones((len(wanted), 1))
    # Importing this takes a fifth of a second, so it is imported only where it is used.
    from scipy.interpolate import make_interp_spline

    return np.asarray(make_interp_spline(known, np.eye(len(known)), k=1)(wanted))
