"""Rigid motions of the cells of a grid, and the conjugate resultants.

A rigid motion (δx, δy, δz, φx, φy, φz) displaces the cell at (x, y) by

    u_x = δx - φz y,    u_y = δy + φz x,    u_z = δz + φx y - φy x

The normal problem has the three modes of u_z (:class:`NormalModes`), the tangential problem the
three modes of u_x and u_y (:class:`PlanarModes`), and the contact of dissimilar bodies has all six
(:class:`RigidModes`). Signs are those of :mod:`sa_solver.types`.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sa_solver.types import Array, Grid, Indices

BALANCE_TOLERANCE = 1e-13
"""Error of the resultants after :meth:`NormalModes.balance`, relative to the load: rounding."""

BALANCE_ITERATIONS = 100
"""Most iterations of a balance. Newton's method usually takes 2 to 5; loads close to the edge of
the pressed cells take more."""

LARGEST_EXPONENT_STEP = 2.0
"""Largest Newton step of the exponent, so that no cell changes by more than e² at once."""

RANK_CUTOFF = 1e-12
"""Relative singular value below which a set of cells is a single point or line, so that it cannot
resist the corresponding rotation."""

APPROACH, TILT_X, TILT_Y = range(3)
"""Indices of the normal modes δz, φx and φy."""

POWERS, SIGNS = ((0, 0), (0, 1), (1, 0)), (1.0, 1.0, -1.0)
"""Powers of x and y in each normal mode, and the sign of the mode."""

RESULTANTS = ("P", "Qx", "Qy", "Mx", "My", "Mz")
"""Order of the six resultants, and of the conjugate motions δz, δx, δy, φx, φy, φz."""

NORMAL, PLANAR = (0, 3, 4), (1, 2, 5)
"""Indices of P, Mx, My and of Qx, Qy, Mz among the six resultants, and of their motions."""

Window = tuple[slice, slice]


@dataclass(frozen=True)
class NormalModes:
    """Free modes of the rigid motion ``δz + φx y - φy x`` on a box of cells.

    ``x`` ``(nx,)`` and ``y`` ``(ny,)`` are the coordinates of the cell centres over half the size
    of the whole grid, Lx and Ly, so that the modes 1, y and -x lie between -1 and 1. Products of
    the modes with a pressure field are P/S, Mx/(Ly S) and My/(Lx S), all in MPa. Coefficients and
    sums ``(k,)`` have one entry for each of the modes ``free``, in their order.
    """

    x: Array
    y: Array
    free: tuple[int, ...]

    @classmethod
    def on(cls, grid: Grid, free: tuple[int, ...] = (APPROACH, TILT_X, TILT_Y)) -> NormalModes:
        """Return the modes of a whole grid, without tilts that move none of its cells."""
        x, y = (
            centres.ravel() / (0.5 * size)
            for centres, size in zip((grid.x, grid.y), grid.size, strict=True)
        )
        still = {TILT_X: not y.any(), TILT_Y: not x.any()}
        return cls(x, y, tuple(mode for mode in free if not still.get(mode, False)))

    def cropped(self, window: Window) -> NormalModes:
        """Return the same modes on the cells of ``window``."""
        x, y = self.x[window[0]], self.y[window[1]]
        whole = len(x) == len(self.x) and len(y) == len(self.y)
        return self if whole else replace(self, x=x, y=y)

    def sums(self, fields: Array) -> Array:
        """Return the products ``(..., k)`` of ``fields`` ``(..., nx, ny)`` with the modes."""
        moments = self._powers_x[:2] @ (fields @ self._powers_y[:, :2])
        i, j, signs = self._places
        return np.asarray(signs * moments[..., i, j])

    def motion(self, coefficients: Array) -> Array:
        """Return the rigid displacement field ``(nx, ny)`` with these ``coefficients`` ``(k,)``."""
        along_x, along_y = self._profiles(_of_all_modes(self.free, coefficients))
        return along_x[:, None] + along_y

    def subtract(self, field: Array, coefficients: Array, out: Array) -> None:
        """Write ``field - motion(coefficients)`` to ``out``, all ``(nx, ny)``."""
        approach, tilt_x, tilt_y = _of_all_modes(self.free, coefficients)
        np.subtract(field, self._along_x(approach, tilt_y), out=out)
        if tilt_x:
            out -= tilt_x * self.y

    def subtract_weighted(
        self, field: Array, weight: Array, coefficients: Array, scratch: Array
    ) -> None:
        """Subtract ``weight * motion(coefficients)`` from ``field`` in place, all ``(nx, ny)``."""
        approach, tilt_x, tilt_y = _of_all_modes(self.free, coefficients)
        field -= np.multiply(weight, self._along_x(approach, tilt_y), out=scratch)
        if tilt_x:
            field -= np.multiply(weight, tilt_x * self.y, out=scratch)

    def fields(self) -> Array:
        """Return the modes as fields ``(k, nx, ny)``."""
        units = np.eye(len(self.free))
        return np.reshape([self.motion(unit) for unit in units], (-1, self.x.size, self.y.size))

    def products(self, weight: Array) -> Array:
        """Return the products ``(k, k)`` of the modes, weighted by a field ``(nx, ny)``."""
        return self._products(self._powers_x @ (weight @ self._powers_y))

    def balance(self, pressure: Array, target: Array) -> Array | None:
        """Return ``pressure`` times ``exp(a + b y + c x)`` such that its sums are ``target``.

        The factor is positive, so that cells in contact stay in contact. It is found by Newton's
        method on a convex function: the result is the field of least relative entropy with the sums
        ``target`` ``(k,)``. None is returned where no such field exists because the load acts
        outside the convex hull of the pressed cells.
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
                along_x, along_y = (np.exp(part) for part in self._profiles(exponent))
                balanced: Array = pressure * along_x[:, None]
                balanced *= along_y
                return balanced
            step = np.zeros(3)
            step[at] = pseudoinverse(products) @ missing
            exponent += step * min(1.0, LARGEST_EXPONENT_STEP / self._largest(step))
        return None

    # -- fields that are the sum or product of a profile along x and one along y ----------------
    @cached_property
    def _powers_x(self) -> Array:
        return _powers(self.x)

    @cached_property
    def _powers_y(self) -> Array:
        return _powers(self.y).T

    @cached_property
    def _places(self) -> tuple[Indices, Indices, Array]:
        """Powers of x and of y in the free modes, and the signs of the modes, each ``(k,)``."""
        free = list(self.free)
        i, j = np.array(POWERS)[free].T
        return i, j, np.array(SIGNS)[free]

    @cached_property
    def _places_of_products(self) -> tuple[Indices, Indices, Array]:
        """Powers of x and of y in products of two free modes, and their signs, each ``(k, k)``."""
        i, j, signs = self._places
        return i[:, None] + i, j[:, None] + j, signs[:, None] * signs

    def _along_x(self, approach: float, tilt_y: float) -> Array | float:
        """Return the profile ``(nx, 1)`` along x, or a number where all cells move alike."""
        return (approach - tilt_y * self.x)[:, None] if tilt_y else approach

    def _profiles(self, all_three: Sequence[float] | Array) -> tuple[Array, Array]:
        """Return the profiles along x and y of the motion with the coefficients of all modes."""
        return all_three[APPROACH] - all_three[TILT_Y] * self.x, all_three[TILT_X] * self.y

    def _largest(self, all_three: Array) -> float:
        """Return the largest size of this motion, which is at a corner of the grid."""
        along_x, along_y = (profile[[0, -1]] for profile in self._profiles(all_three))
        return max(float(np.abs(along_x[:, None] + along_y).max()), np.finfo(float).tiny)

    def _moments(self, weight: Array, exponent: Array) -> Array:
        """Return ``Σ w e x^i y^j`` for i, j up to 2, with e the exponential of a rigid motion."""
        along_x, along_y = (np.exp(part) for part in self._profiles(exponent))
        return (self._powers_x * along_x) @ (weight @ (self._powers_y * along_y[:, None]))

    def _products(self, moments: Array) -> Array:
        i, j, signs = self._places_of_products
        return np.asarray(signs * moments[i, j])


def _powers(coordinate: Array) -> Array:
    """Return the powers 0, 1 and 2 ``(3, n)`` of a ``coordinate`` ``(n,)``."""
    return np.stack([np.ones_like(coordinate), coordinate, coordinate * coordinate])


def _of_all_modes(free: tuple[int, ...], coefficients: Array) -> list[float]:
    """Return the coefficients of three modes, which are 0 for those that are not ``free``."""
    all_three = [0.0, 0.0, 0.0]
    for mode, coefficient in zip(free, coefficients.tolist(), strict=True):
        all_three[mode] = coefficient
    return all_three


def pseudoinverse(matrix: Array) -> Array:
    """Return the pseudoinverse of a symmetric ``matrix`` ``(k, k)``.

    For matrices of a few modes this is much faster than numpy's function.
    """
    values, vectors = np.linalg.eigh(matrix)
    sizes = np.abs(values)
    kept = sizes > RANK_CUTOFF * sizes.max(initial=0.0)
    basis = vectors[:, kept]
    return np.asarray((basis / values[kept]) @ basis.T)


def mode_lengths(grid: Grid) -> Array:
    """Return 1, Ly, Lx ``(3,)``: coefficients of normal modes over these are δz, φx and φy.

    Ly and Lx are half the size of the grid [mm].
    """
    return np.array([1.0, 0.5 * grid.size[1], 0.5 * grid.size[0]])


@dataclass(frozen=True)
class PlanarModes:
    """Free modes δx, δy and φz of rigid motion in the contact plane, on a box of cells.

    The rotation is scaled by ``length``, half the larger side of the grid: ``x`` ``(nx,)`` and
    ``y`` ``(ny,)`` are the coordinates of the cell centres over this length. Products of the modes
    with a shear field are Qx/S, Qy/S and Mz/(L S), all in MPa. Coefficients and sums ``(k,)`` have
    one entry for each of the modes ``free``.
    """

    x: Array
    y: Array
    length: float
    free: tuple[int, ...] = (0, 1, 2)

    @classmethod
    def on(cls, grid: Grid) -> PlanarModes:
        """Return all modes of a whole grid; a line contact has no rotation."""
        length = 0.5 * max(grid.size)
        free = (0, 1) if grid.line else (0, 1, 2)
        return cls(grid.x[:, 0] / length, grid.y[0] / length, length, free)

    def cropped(self, window: Window) -> PlanarModes:
        """Return the same modes on the cells of ``window``."""
        return replace(self, x=self.x[window[0]], y=self.y[window[1]])

    def only(self, free: tuple[int, ...]) -> PlanarModes:
        """Return the same modes with only those in ``free``."""
        return replace(self, free=free)

    @property
    def lengths(self) -> Array:
        """Factors 1, 1 and the length ``(k,)`` from sums times the cell area to resultants."""
        return np.array([1.0, 1.0, self.length])[list(self.free)]

    def sums(self, field: Array) -> Array:
        """Return the products ``(k,)`` of a field ``(2, nx, ny)`` with the modes."""
        along_x, along_y = self._moments(field)
        all_three = along_x[0][0], along_y[0][0], along_y[1][0] - along_x[0][1]
        return np.array([all_three[mode] for mode in self.free])

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
        """Return the modes as fields ``(k, 2, nx, ny)``."""
        fields = np.zeros((len(self.free), 2, self.x.size, self.y.size))
        for field, unit in zip(fields, np.eye(len(self.free)), strict=True):
            self.add_motion(field, unit)
        return fields

    def products(self, xx: Array, xy: Array, yy: Array) -> Array:
        """Return the products ``(k, k)`` of the modes, weighted by a symmetric tensor field.

        ``xx``, ``xy`` and ``yy`` ``(nx, ny)`` are the components of the tensors.
        """
        xx_, xy_, yy_ = self._moments(np.stack([xx, xy, yy]))
        x_rotation = xy_[1][0] - xx_[0][1]
        y_rotation = yy_[1][0] - xy_[0][1]
        rotation_squared = xx_[0][2] - 2.0 * xy_[1][1] + yy_[2][0]
        all_products = (
            (xx_[0][0], xy_[0][0], x_rotation),
            (xy_[0][0], yy_[0][0], y_rotation),
            (x_rotation, y_rotation, rotation_squared),
        )
        return np.array([[all_products[i][j] for j in self.free] for i in self.free])

    def _moments(self, fields: Array) -> list[list[list[float]]]:
        """Return ``Σ f x^i y^j`` of each of ``fields`` ``(m, nx, ny)``, for i, j up to 2."""
        moments: list[list[list[float]]] = (self._powers_x @ (fields @ self._powers_y)).tolist()
        return moments

    @cached_property
    def _powers_x(self) -> Array:
        return _powers(self.x)

    @cached_property
    def _powers_y(self) -> Array:
        return _powers(self.y).T

    def _profiles(self, coefficients: Array) -> tuple[Array, Array]:
        """Return the displacement along x, ``(ny,)``, and along y, ``(nx,)``."""
        shift_x, shift_y, twist = _of_all_modes(self.free, coefficients)
        return shift_x - twist * self.y, shift_y + twist * self.x


class RigidModes:
    """All six modes of rigid motion on a grid, in the order of :data:`RESULTANTS`.

    Coefficients ``(6,)`` are in mm: rotations are multiplied by ``lengths``, half the size of the
    grid across their axis. Sums ``(6,)`` are in MPa: resultants over the cell area, moments also
    over ``lengths``. ``present`` lists the motions that move at least one cell of the grid.
    """

    def __init__(self, grid: Grid) -> None:
        """Prepare the modes of ``grid``; a line contact has neither φx nor φz."""
        self.grid = grid
        self._normal, self._planar = NormalModes.on(grid), PlanarModes.on(grid)
        self.lengths = np.ones(6)
        self.lengths[list(NORMAL)] = mode_lengths(grid)
        self.lengths[PLANAR[-1]] = self._planar.length
        # A twist does not move the centre of a single cell.
        planar = self._planar.free if max(grid.shape) > 1 else self._planar.free[:2]
        self._planar = self._planar.only(planar)
        self._places = [NORMAL[k] for k in self._normal.free], [PLANAR[k] for k in planar]
        self.present = tuple(sorted([*self._places[0], *self._places[1]]))

    def cropped(self, window: Window) -> RigidModes:
        """Return the same modes on the cells of ``window``."""
        part = copy(self)
        part._normal, part._planar = self._normal.cropped(window), self._planar.cropped(window)
        return part

    def normal(self, free: tuple[int, ...]) -> NormalModes:
        """Return the normal modes among the motions ``free``."""
        return replace(self._normal, free=tuple(k for k in self._normal.free if NORMAL[k] in free))

    def planar(self, free: tuple[int, ...]) -> PlanarModes:
        """Return the planar modes among the motions ``free``."""
        return self._planar.only(tuple(k for k in self._planar.free if PLANAR[k] in free))

    def motion(self, coefficients: Array) -> Array:
        """Return the displacement ``(3, nx, ny)`` [mm] with these ``coefficients`` ``(6,)``."""
        normal, planar = self._places
        field = np.zeros((3, self._normal.x.size, self._normal.y.size))
        self._planar.add_motion(field[:2], coefficients[planar])
        field[2] = self._normal.motion(coefficients[normal])
        return field

    def sums(self, traction: Array) -> Array:
        """Return the products ``(6,)`` of ``traction`` ``(3, nx, ny)`` with the modes.

        They are 0 for modes that are not ``present``.
        """
        normal, planar = self._places
        sums = np.zeros(6)
        sums[normal] = self._normal.sums(traction[2])
        sums[planar] = self._planar.sums(traction[:2])
        return sums

    def resultants(self, traction: Array) -> Array:
        """Return ``(P, Qx, Qy, Mx, My, Mz)`` [N, N mm] of ``traction`` ``(3, nx, ny)`` [MPa]."""
        return self.sums(traction) * self.lengths * self.grid.cell_area
