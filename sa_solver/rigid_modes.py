"""Rigid approach and tilts on a grid, and the resultants that are their conjugates."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array, Grid

BALANCE_TOLERANCE = 1e-13
"""Resultants left by :meth:`RigidModes.balance`, relative to the load: rounding of a sum."""

BALANCE_ITERATIONS = 100
"""Newton takes 2 to 5; the rest lets a load close to the edge of its support be reached."""

LARGEST_EXPONENT_STEP = 2.0
"""Cap on one Newton step of the exponent, so that no cell changes by more than e² at once."""

RANK_CUTOFF = 1e-12
"""Relative singular value below which a set of cells is one point or one line, and cannot feel
the corresponding tilt."""


class RigidModes:
    """``δz + φx y - φy x`` on the cells, with tilts scaled by the grid's half size.

    ``shapes`` is ``(3, nx ny)``, dimensionless: 1, y/Ly, -x/Lx. Its products with a pressure field
    are P/S, Mx/(Ly S), My/(Lx S), all in MPa.
    """

    def __init__(self, grid: Grid) -> None:
        """Modes of ``grid``."""
        self.grid = grid
        half_x, half_y = (0.5 * size for size in grid.size)
        ones = np.ones(grid.shape)
        self.shapes = np.stack([ones, ones * grid.y / half_y, -ones * grid.x / half_x])
        self.shapes = self.shapes.reshape(3, -1)
        self.lengths = np.array([1.0, half_y, half_x])

    def scaled(self, P: float, Mx: float, My: float) -> Array:
        """``(P, Mx, My)`` [N, N mm] as sums of pressure times shape, ``(3,)`` [MPa]."""
        return np.array([P, Mx, My]) / (self.lengths * self.grid.cell_area)

    def resultants(self, sums: Array) -> Array:
        """``(P, Mx, My)`` [N, N mm] of ``sums`` of pressure times shape, ``(3,)`` [MPa]."""
        physical: Array = sums * self.lengths * self.grid.cell_area
        return physical

    def motion(self, coefficients: Array) -> Array:
        """Rigid displacement field ``(nx, ny)`` of scaled ``coefficients`` ``(3,)`` [mm]."""
        field: Array = (coefficients @ self.shapes).reshape(self.grid.shape)
        return field

    def balance(self, pressure: Array, target: Array) -> Array | None:
        """``pressure`` times ``exp(a + b y + c x)`` such that its sums are ``target`` ``(3,)``.

        The factor is positive, so cells in contact stay in contact: Newton's method on a convex
        function (the field of least relative entropy). Returns None where no such field exists,
        because the load acts outside the convex hull of the pressed cells.
        """
        pressed = np.flatnonzero(pressure)
        values = pressure.ravel()[pressed]
        total = values.sum()
        if not (np.isfinite(total) and total > 0.0):
            return None
        values = values * (target[0] / total)
        shapes = self.shapes[:, pressed]
        for _ in range(BALANCE_ITERATIONS):
            missing = target - shapes @ values
            if np.abs(missing).max() <= BALANCE_TOLERANCE * target[0]:
                balanced = np.zeros_like(pressure)
                balanced.ravel()[pressed] = values
                return balanced
            hessian = (shapes * values) @ shapes.T
            step = np.linalg.pinv(hessian, rcond=RANK_CUTOFF, hermitian=True) @ missing
            exponent = step @ shapes
            largest = np.abs(exponent).max()
            values = values * np.exp(exponent * min(1.0, LARGEST_EXPONENT_STEP / largest))
        return None
