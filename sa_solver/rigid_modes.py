"""Rigid motions on cells, and the resultants that are their conjugates.

A rigid motion (δx, δy, δz, φx, φy, φz) displaces the cell at (x, y) by

    u_x = δx - φz y,    u_y = δy + φz x,    u_z = δz + φx y - φy x

The normal problem knows the three of u_z (:class:`NormalModes`), the tangential problem the three
of u_x and u_y (:class:`PlanarModes`), the contact of dissimilar bodies all six
(:class:`RigidModes`). Signs are those of :mod:`sa_solver.types`.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sa_solver.types import Array, Grid, Indices

BALANCE_TOLERANCE = 1e-13
"""Resultants left by :meth:`NormalModes.balance`, relative to the load: rounding of a sum."""

BALANCE_ITERATIONS = 100
"""Newton takes 2 to 5; the rest lets a load close to the edge of its support be reached."""

LARGEST_EXPONENT_STEP = 2.0
"""Cap on one Newton step of the exponent, so that no cell changes by more than e² at once."""

RANK_CUTOFF = 1e-12
"""Relative singular value below which a set of cells is one point or one line, and cannot feel
the corresponding rotation."""

APPROACH, TILT_X, TILT_Y = range(3)
"""The normal modes δz, φx and φy."""

POWERS, SIGNS = ((0, 0), (0, 1), (1, 0)), (1.0, 1.0, -1.0)
"""Of x and y in each of these modes, and its sign."""

RESULTANTS = ("P", "Qx", "Qy", "Mx", "My", "Mz")
"""Order of the six resultants, and of the motions conjugate to them: δz, δx, δy, φx, φy, φz."""

NORMAL, PLANAR = (0, 3, 4), (1, 2, 5)
"""Places among the six of P, Mx, My and of Qx, Qy, Mz, and of their motions."""

Window = tuple[slice, slice]


@dataclass(frozen=True)
class NormalModes:
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
    def on(cls, grid: Grid, free: tuple[int, ...] = (APPROACH, TILT_X, TILT_Y)) -> NormalModes:
        """Modes of a whole grid; a tilt that moves none of its cells is never free."""
        x, y = (
            centres.ravel() / (0.5 * size)
            for centres, size in zip((grid.x, grid.y), grid.size, strict=True)
        )
        still = {TILT_X: not y.any(), TILT_Y: not x.any()}
        return cls(x, y, tuple(mode for mode in free if not still.get(mode, False)))

    def cropped(self, window: Window) -> NormalModes:
        """The same modes on part of the cells."""
        x, y = self.x[window[0]], self.y[window[1]]
        whole = len(x) == len(self.x) and len(y) == len(self.y)
        return self if whole else replace(self, x=x, y=y)

    def sums(self, fields: Array) -> Array:
        """Products ``(..., k)`` of fields ``(..., nx, ny)`` with the modes."""
        moments = self._powers_x[:2] @ (fields @ self._powers_y[:, :2])
        i, j, signs = self._places
        return np.asarray(signs * moments[..., i, j])

    def motion(self, coefficients: Array) -> Array:
        """Rigid displacement field ``(nx, ny)``."""
        along_x, along_y = self._profiles(coefficients)
        return along_x[:, None] + along_y

    def subtract(self, field: Array, coefficients: Array, out: Array) -> None:
        """``field - motion(coefficients)`` into ``out``, all ``(nx, ny)``."""
        along_x, along_y = self._profiles(coefficients)
        np.subtract(field, along_x[:, None], out=out)
        if along_y.any():
            out -= along_y

    def subtract_weighted(
        self, field: Array, weight: Array, coefficients: Array, scratch: Array
    ) -> None:
        """``field -= weight * motion(coefficients)`` in place, all ``(nx, ny)``."""
        along_x, along_y = self._profiles(coefficients)
        field -= np.multiply(weight, along_x[:, None], out=scratch)
        if along_y.any():
            field -= np.multiply(weight, along_y, out=scratch)

    def fields(self) -> Array:
        """The modes themselves, ``(k, nx, ny)``."""
        units = np.eye(len(self.free))
        return np.reshape([self.motion(unit) for unit in units], (-1, self.x.size, self.y.size))

    def products(self, weight: Array) -> Array:
        """Products ``(k, k)`` of the modes with one another, weighted by a field ``(nx, ny)``."""
        return self._products(self._powers_x @ (weight @ self._powers_y))

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
            i, j, signs = self._places
            missing = target - signs * moments[i, j]
            if np.abs(missing).max() <= BALANCE_TOLERANCE * moments[0, 0]:
                along_x, along_y = (np.exp(part) for part in self._all_profiles(exponent))
                balanced: Array = pressure * along_x[:, None]
                balanced *= along_y
                return balanced
            step = np.zeros(3)
            step[at] = pseudoinverse(products) @ missing
            exponent += step * min(1.0, LARGEST_EXPONENT_STEP / self._largest(step))
        return None

    # -- fields that are sums or products of a profile along x and one along y ------------------
    @cached_property
    def _powers_x(self) -> Array:
        """1, x and x² ``(3, nx)``."""
        return np.stack([np.ones_like(self.x), self.x, self.x * self.x])

    @cached_property
    def _powers_y(self) -> Array:
        """1, y and y² ``(ny, 3)``."""
        return np.stack([np.ones_like(self.y), self.y, self.y * self.y], axis=1)

    @cached_property
    def _places(self) -> tuple[Indices, Indices, Array]:
        """Powers of x and y in the free modes, and their signs ``(k,)`` each."""
        free = list(self.free)
        i, j = np.array(POWERS)[free].T
        return i, j, np.array(SIGNS)[free]

    @cached_property
    def _places_of_products(self) -> tuple[Indices, Indices, Array]:
        """The same of products of two free modes ``(k, k)`` each."""
        i, j, signs = self._places
        return i[:, None] + i, j[:, None] + j, signs[:, None] * signs

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
        return (self._powers_x * along_x) @ (weight @ (self._powers_y * along_y[:, None]))

    def _products(self, moments: Array) -> Array:
        i, j, signs = self._places_of_products
        return np.asarray(signs * moments[i, j])


def pseudoinverse(matrix: Array) -> Array:
    """That of a symmetric ``matrix`` ``(k, k)`` of few modes, for which numpy's takes long."""
    values, vectors = np.linalg.eigh(matrix)
    sizes = np.abs(values)
    kept = sizes > RANK_CUTOFF * sizes.max(initial=0.0)
    basis = vectors[:, kept]
    return np.asarray((basis / values[kept]) @ basis.T)


def mode_lengths(grid: Grid) -> Array:
    """1, Ly, Lx: coefficients of normal modes over these are δz [mm], φx and φy [rad], ``(3,)``."""
    return np.array([1.0, 0.5 * grid.size[1], 0.5 * grid.size[0]])


@dataclass(frozen=True)
class PlanarModes:
    """Those rigid motions δx, δy, φz in the contact plane that are ``free``, on a box of cells.

    The rotation is scaled by ``length``, half the larger side of the grid: ``x`` ``(nx,)`` and
    ``y`` ``(ny,)`` are cell centres over that. Coefficients and sums ``(k,)`` are of the free
    modes; products with a shear field are Qx/S, Qy/S, Mz/(L S), all in MPa.
    """

    x: Array
    y: Array
    length: float
    free: tuple[int, ...] = (0, 1, 2)

    @classmethod
    def on(cls, grid: Grid) -> PlanarModes:
        """All modes of a whole grid; a line contact knows no rotation."""
        length = 0.5 * max(grid.size)
        free = (0, 1) if grid.line else (0, 1, 2)
        return cls(grid.x[:, 0] / length, grid.y[0] / length, length, free)

    def cropped(self, window: Window) -> PlanarModes:
        """The same modes on part of the cells."""
        return replace(self, x=self.x[window[0]], y=self.y[window[1]])

    def only(self, free: tuple[int, ...]) -> PlanarModes:
        """Fewer of the modes."""
        return replace(self, free=free)

    @property
    def lengths(self) -> Array:
        """Resultants over sums and cell area, ``(k,)``: 1, 1 and the length."""
        return np.array([1.0, 1.0, self.length])[list(self.free)]

    def sums(self, field: Array) -> Array:
        """Products ``(k,)`` of a field ``(2, nx, ny)`` with the modes."""
        along_x, along_y = field @ self._lines_y
        turned = self.x @ along_y[:, 0] - along_x[:, 1].sum()
        every = np.array([along_x[:, 0].sum(), along_y[:, 0].sum(), turned])
        return every[list(self.free)]

    def add_motion(self, field: Array, coefficients: Array) -> None:
        """Add the rigid motion with these coefficients ``(k,)`` to a field ``(2, nx, ny)``."""
        along_x, along_y = self._profiles(coefficients)
        field[0] += along_x
        field[1] += along_y[:, None]

    def add_weighted(self, field: Array, weight: Array, coefficients: Array) -> None:
        """Add ``weight`` ``(nx, ny)`` times a rigid motion to a field ``(2, nx, ny)``."""
        along_x, along_y = self._profiles(coefficients)
        field[0] += weight * along_x
        field[1] += weight * along_y[:, None]

    def fields(self) -> Array:
        """The modes themselves, ``(k, 2, nx, ny)``."""
        fields = np.zeros((len(self.free), 2, self.x.size, self.y.size))
        for field, unit in zip(fields, np.eye(len(self.free)), strict=True):
            self.add_motion(field, unit)
        return fields

    def products(self, xx: Array, xy: Array, yy: Array) -> Array:
        """Products ``(k, k)`` of the modes with one another under a field of tensors."""
        moments = np.array([tensor @ self._lines_y for tensor in (xx, xy, yy)])
        (xx_, xy_, yy_), x = moments, self.x
        turned_x = x @ xy_[:, 0] - xx_[:, 1].sum()
        turned_y = x @ yy_[:, 0] - xy_[:, 1].sum()
        twice = xx_[:, 2].sum() - 2.0 * (x @ xy_[:, 1]) + (x * x) @ yy_[:, 0]
        both = xy_[:, 0].sum()
        every = np.array(
            [
                [xx_[:, 0].sum(), both, turned_x],
                [both, yy_[:, 0].sum(), turned_y],
                [turned_x, turned_y, twice],
            ]
        )
        return every[np.ix_(self.free, self.free)]

    @cached_property
    def _lines_y(self) -> Array:
        """1, y and y² as columns, ``(ny, 3)``."""
        return np.stack([np.ones_like(self.y), self.y, self.y * self.y], axis=1)

    def _profiles(self, coefficients: Array) -> tuple[Array, Array]:
        """The motion along x, ``(ny,)``, and along y, ``(nx,)``."""
        every = np.zeros(3)
        every[list(self.free)] = coefficients
        return every[0] - every[2] * self.y, every[1] + every[2] * self.x


class RigidModes:
    """All six rigid motions on a grid, in the order of :data:`RESULTANTS`.

    Coefficients ``(6,)`` are in mm: rotations times ``lengths``, half the grid's size across their
    axis. Resultants ``(6,)`` are in MPa: over the cell area, and moments over ``lengths`` too.
    ``present`` are the motions that move some cell of the grid.
    """

    def __init__(self, grid: Grid) -> None:
        """Modes of ``grid``. A line contact goes on along y and knows neither φx nor φz."""
        self.grid = grid
        self._normal, self._planar = NormalModes.on(grid), PlanarModes.on(grid)
        self.lengths = np.ones(6)
        self.lengths[list(NORMAL)] = mode_lengths(grid)
        self.lengths[PLANAR[-1]] = self._planar.length
        # On a single cell a twist moves nothing.
        planar = self._planar.free if max(grid.shape) > 1 else self._planar.free[:2]
        self._planar = self._planar.only(planar)
        self._places = [NORMAL[k] for k in self._normal.free], [PLANAR[k] for k in planar]
        self.present = tuple(sorted([*self._places[0], *self._places[1]]))

    def cropped(self, window: Window) -> RigidModes:
        """The same modes on part of the cells."""
        part = copy(self)
        part._normal, part._planar = self._normal.cropped(window), self._planar.cropped(window)
        return part

    def normal(self, free: tuple[int, ...]) -> NormalModes:
        """Those of pressure among the ``free`` ones."""
        return replace(self._normal, free=tuple(k for k in self._normal.free if NORMAL[k] in free))

    def planar(self, free: tuple[int, ...]) -> PlanarModes:
        """Those of shear among the ``free`` ones."""
        return self._planar.only(tuple(k for k in self._planar.free if PLANAR[k] in free))

    def motion(self, coefficients: Array) -> Array:
        """The displacement ``(3, nx, ny)`` [mm] with ``coefficients`` ``(6,)``."""
        normal, planar = self._places
        field = np.zeros((3, self._normal.x.size, self._normal.y.size))
        self._planar.add_motion(field[:2], coefficients[planar])
        field[2] = self._normal.motion(coefficients[normal])
        return field

    def sums(self, traction: Array) -> Array:
        """Products ``(6,)`` of ``traction`` ``(3, nx, ny)`` with the modes, 0 if not present."""
        normal, planar = self._places
        sums = np.zeros(6)
        sums[normal] = self._normal.sums(traction[2])
        sums[planar] = self._planar.sums(traction[:2])
        return sums

    def resultants(self, traction: Array) -> Array:
        """``(P, Qx, Qy, Mx, My, Mz)`` [N, N mm] of ``traction`` ``(3, nx, ny)`` [MPa]."""
        return self.sums(traction) * self.lengths * self.grid.cell_area
