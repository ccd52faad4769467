"""Rigid approach and tilts on cells, and the resultants that are their conjugates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

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

APPROACH, TILT_X, TILT_Y = range(3)
"""The modes δz, φx and φy."""

Window = tuple[slice, slice]


@dataclass(frozen=True)
class RigidModes:
    """Those modes of ``δz + φx y - φy x`` that are ``free``, on a box of cells.

    ``x`` ``(nx,)`` and ``y`` ``(ny,)`` are the cell centres over half the size of the whole grid,
    Lx and Ly, so that the modes 1, y, -x lie within -1 and 1. Their products with a pressure field
    are P/S, Mx/(Ly S), My/(Lx S), all in MPa. Coefficients and sums ``(k,)`` are of the free modes,
    in their order.
    """

    x: Array
    y: Array
    free: tuple[int, ...]

    @classmethod
    def on(cls, grid: Grid, free: tuple[int, ...] = (APPROACH, TILT_X, TILT_Y)) -> RigidModes:
        """Modes of a whole grid; a tilt that moves none of its cells is never free."""
        x, y = (
            centres.ravel() / (0.5 * size)
            for centres, size in zip((grid.x, grid.y), grid.size, strict=True)
        )
        still = {TILT_X: not y.any(), TILT_Y: not x.any()}
        return cls(x, y, tuple(mode for mode in free if not still.get(mode, False)))

    def cropped(self, window: Window) -> RigidModes:
        """The same modes on part of the cells."""
        return RigidModes(self.x[window[0]], self.y[window[1]], self.free)

    def sums(self, fields: Array) -> Array:
        """Products ``(..., k)`` of fields ``(..., nx, ny)`` with the modes."""
        rows = fields @ self._lines_y
        total = rows.sum(axis=-2)
        every = np.stack([total[..., 0], total[..., 1], -(rows[..., 0] @ self.x)], axis=-1)
        return every[..., list(self.free)]

    def motion(self, coefficients: Array) -> Array:
        """Rigid displacement field ``(nx, ny)``."""
        along_x, along_y = self._profiles(coefficients)
        field: Array = along_x[:, None] + along_y
        return field

    def take_off(self, field: Array, coefficients: Array, out: Array) -> None:
        """``field - motion(coefficients)`` into ``out``, all ``(nx, ny)``."""
        along_x, along_y = self._profiles(coefficients)
        np.subtract(field, along_x[:, None], out=out)
        if along_y.any():
            out -= along_y

    def take_off_weighted(
        self, field: Array, weight: Array, coefficients: Array, scratch: Array
    ) -> None:
        """``field -= weight * motion(coefficients)`` in place, all ``(nx, ny)``."""
        along_x, along_y = self._profiles(coefficients)
        field -= np.multiply(weight, along_x[:, None], out=scratch)
        if along_y.any():
            field -= np.multiply(weight, along_y, out=scratch)

    def fields(self) -> Array:
        """The modes themselves, ``(k, nx, ny)``."""
        fields = [self.motion(unit) for unit in np.eye(len(self.free))]
        return np.array(fields).reshape(-1, self.x.size, self.y.size)

    def products(self, weight: Array) -> Array:
        """Products ``(k, k)`` of the modes with one another, weighted by a field ``(nx, ny)``."""
        return self._products(self._moments(weight, np.zeros(3)))

    def balance(self, pressure: Array, target: Array) -> Array | None:
        """``pressure`` times ``exp(a + b y + c x)`` such that its sums are ``target`` ``(k,)``.

        The factor is positive, so cells in contact stay in contact: Newton's method on a convex
        function (the field of least relative entropy). Returns None where no such field exists,
        because the load acts outside the convex hull of the pressed cells.
        """
        if not self.free:
            return pressure
        exponent, at = np.zeros(3), list(self.free)
        total = pressure.sum()
        if not (np.isfinite(total) and total > 0.0):
            return None
        if APPROACH in self.free:
            exponent[APPROACH] = np.log(target[0] / total)
        for _ in range(BALANCE_ITERATIONS):
            moments = self._moments(pressure, exponent)
            products = self._products(moments)
            missing = target - self._first(moments)
            if np.abs(missing).max() <= BALANCE_TOLERANCE * moments[0, 0]:
                along_x, along_y = (np.exp(part) for part in self._all_profiles(exponent))
                balanced: Array = pressure * along_x[:, None]
                balanced *= along_y
                return balanced
            step = np.zeros(3)
            step[at] = np.linalg.pinv(products, rcond=RANK_CUTOFF, hermitian=True) @ missing
            exponent += step * min(1.0, LARGEST_EXPONENT_STEP / self._largest(step))
        return None

    # -- fields that are sums or products of a profile along x and one along y ------------------
    @cached_property
    def _lines_y(self) -> Array:
        return np.stack([np.ones_like(self.y), self.y], axis=1)

    def _profiles(self, coefficients: Array) -> tuple[Array, Array]:
        every = np.zeros(3)
        every[list(self.free)] = coefficients
        return self._all_profiles(every)

    def _all_profiles(self, every: Array) -> tuple[Array, Array]:
        """Parts along x and along y of the motion with three coefficients."""
        return every[APPROACH] - every[TILT_Y] * self.x, every[TILT_X] * self.y

    def _largest(self, every: Array) -> float:
        """Largest size of that motion, which it has at a corner."""
        along_x, along_y = (profile[[0, -1]] for profile in self._all_profiles(every))
        return max(float(np.abs(along_x[:, None] + along_y).max()), np.finfo(float).tiny)

    def _moments(self, weight: Array, exponent: Array) -> Array:
        """``Σ w e x^i y^j`` for i, j up to 2, with e the exponential of a rigid motion."""
        along_x, along_y = (np.exp(part) for part in self._all_profiles(exponent))
        powers = np.arange(3)
        rows = weight @ (self.y[:, None] ** powers * along_y[:, None])
        moments: Array = (self.x[:, None] ** powers * along_x[:, None]).T @ rows
        return moments

    def _first(self, m: Array) -> Array:
        return np.array([m[0, 0], m[0, 1], -m[1, 0]])[list(self.free)]

    def _products(self, m: Array) -> Array:
        every = np.array(
            [
                [m[0, 0], m[0, 1], -m[1, 0]],
                [m[0, 1], m[0, 2], -m[1, 1]],
                [-m[1, 0], -m[1, 1], m[2, 0]],
            ]
        )
        return every[np.ix_(self.free, self.free)]


def mode_lengths(grid: Grid) -> Array:
    """1, Ly, Lx: coefficients over these are δz [mm], φx and φy [rad], ``(3,)``."""
    return np.array([1.0, 0.5 * grid.size[1], 0.5 * grid.size[0]])
