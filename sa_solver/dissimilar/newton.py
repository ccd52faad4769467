"""Newton's method with truncated GMRES for pressure and shear of dissimilar bodies together.

Cells are out of contact, or stick, with all three components of traction free, or slip. In cells
that slip, the shear is on the circle |q| = µp, so that its size follows from the pressure and only
its direction is free. A phase of the search keeps these sets of cells and replaces the circles by
their tangents. The problem is then linear: the half-space with its coupling, plus the curvature
|Δs|/µp along the tangents. It is not symmetric where shear follows pressure. GMRES lowers its
residual, preconditioned by the inverse 3 x 3 symbol of the half-space on the free components. Then
the tractions are projected back: cells in tension leave the contact, cells that interpenetrate join
it, cells outside their circle begin to slip, cells whose slip has the direction of the shear begin
to stick, and the resultants are restored.

There is no energy that falls from phase to phase, because the friction limit depends on the
pressure. A search whose residual no longer falls stops without convergence. The solution is then
continued by :mod:`sa_solver.splitting`.

Sources: Alart & Curnier 1991, Comput. Methods Appl. Mech. Eng. 92, 353,
doi:10.1016/0045-7825(91)90022-X (the linearisation); Saad & Schultz 1986, SIAM J. Sci. Stat.
Comput. 7, 856, doi:10.1137/0907058 (GMRES); Vollebregt 2014, J. Comput. Phys. 257, 333,
doi:10.1016/j.jcp.2013.10.005 (preconditioner). Phases and projection are those of
:mod:`sa_solver.tangential.disk_newton`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sa_solver.dissimilar.problem import CoupledProblem, coupled_residuals
from sa_solver.half_space.influence import X, Z
from sa_solver.half_space.operator import (
    ALL,
    HalfSpace,
    fast_lengths,
    inverse_symbols,
    spectral_filter,
)
from sa_solver.rigid_modes import RANK_CUTOFF
from sa_solver.tangential.problem import BoxOperator, TangentialProblem
from sa_solver.transforms.padded import SpectralFilter
from sa_solver.transforms.passes import add_product, gather_product, spread_product
from sa_solver.types import Array, Indices, Mask

SETTLED = 0.1
STEADY = 1e-3
"""Factors by which the preconditioned residual must fall in a phase: the first in general, the
second where no cell has changed in the last phase, because convergence is then quadratic."""

ENOUGH = 0.3
"""Share of the tolerance at which a phase ends in any case, as far as the phase can estimate it."""

PHASE_STEPS = 16
"""Most directions of a phase, all of which are stored."""

LEAST_PUNCH = 1e-3
"""Share of the largest pressure that is added to the pressure of each cell in the weight of a
punch."""

PATIENCE = 8
"""Number of phases without a lower residual after which the search stops."""

ROUNDING = 1e-12
"""Relative distance below its limit of shear that has reached the limit, and relative size of a
direction that is a combination of the others."""

LEAST_PRESSURE = 1e-9
"""Share of the largest pressure below which the curvature 1/p no longer grows."""

TINY = 1e-200
"""Keeps divisions by a vanishing size finite."""


@dataclass(frozen=True)
class CoupledIterate:
    """Result of a search.

    Attributes
    ----------
    traction
        Traction ``(3, nx, ny)`` [MPa] that obeys both bounds and has the imposed resultants.
    slipping
        Cells ``(nx, ny)`` on their circle.
    rigid
        Free motions ``(6,)`` [mm].
    residual, iterations, converged
        Largest residual, number of directions, and whether the residual is within the tolerance.
    left_bounds
        Whether the search ended because the contact left its bounds.
    """

    traction: Array
    slipping: Mask
    rigid: Array
    residual: float
    iterations: int
    converged: bool
    left_bounds: bool


class CoupledOperator:
    """Elastic operator K for all three components on a box of cells, and its inverse."""

    def __init__(self, half_space: HalfSpace) -> None:
        """Prepare the operator on the box that ``half_space`` covers."""
        self.half_space = half_space
        self.shear = BoxOperator(half_space)

    def precondition(self, displacement: Array) -> Array:
        """Return K⁻¹ u ``(3, nx, ny)`` [MPa], approximately, for a ``displacement`` u [mm]."""
        return self._inverse.apply(displacement)

    @cached_property
    def _inverse(self) -> SpectralFilter:
        """Filter with the inverse symbol of the box made periodic with almost no padding."""
        half_space, shape = self.half_space, self.half_space.grid.shape
        period = fast_lengths(*shape)
        symbols = [[half_space.symbol(i, j, period) for j in ALL] for i in ALL]
        transform = half_space.transform(shape, period, len(ALL))
        return spectral_filter(transform, inverse_symbols(symbols), ALL, ALL)


def newton_on_cones(
    problem: CoupledProblem,
    operator: CoupledOperator,
    traction: Array,
    slipping: Mask,
    tolerance: float,
    max_iterations: int,
    leaves_bounds: Callable[[Mask], bool],
) -> CoupledIterate:
    """Solve ``problem`` from a ``traction`` ``(3, nx, ny)`` with the imposed resultants.

    ``slipping`` ``(nx, ny)`` are the cells that are on their circle at the start. The search stops
    when the largest residual is within ``tolerance``, when ``leaves_bounds`` is true of the
    contact, when the residual no longer falls, or after ``max_iterations`` directions.
    """
    search = _Search(problem, operator, traction, slipping)
    best, waited = np.inf, 0
    while True:
        residual = search.residual()
        best, waited = (residual, 0) if residual < best else (best, waited + 1)
        left_bounds = leaves_bounds(search.contact)
        stopped = (
            residual <= tolerance
            or left_bounds
            or waited > PATIENCE
            or search.iterations >= max_iterations
            or not np.isfinite(residual)
        )
        if stopped or not search.phase(tolerance / residual):
            return CoupledIterate(
                search.traction,
                search.slipping,
                search.rigid,
                residual,
                search.iterations,
                residual <= tolerance,
                left_bounds,
            )


class _FreeParts:
    """Free components of traction on the ``m`` cells of a contact.

    In a cell that slips, with shear along ``normal`` ``(2, m)``, the pressure and the direction of
    the shear are free; the size of the shear follows from the pressure. Tensors ``(4, m)`` have the
    components xx, xy, yy and zz.
    """

    def __init__(
        self,
        operator: CoupledOperator,
        cells: Indices,
        slips: Mask,
        follows: Array,
        normal: Array,
        curvature: Array,
        compliance: Array,
    ) -> None:
        """Set up the tensors of the free components.

        Parameters
        ----------
        operator
            Elastic operator K.
        cells
            Indices of the cells in contact ``(m,)``.
        slips
            Cells that slip ``(m,)``.
        follows
            Shear over pressure of these cells ``(2, m)``.
        normal
            Direction of their shear ``(2, m)``.
        curvature
            Curvature |Δs|/µp of these cells ``(m,)`` [mm/MPa].
        compliance
            Local compliance D ``(m,)`` [mm/MPa].
        """
        self._operator, self.cells, self.follows = operator, cells, follows
        x, y = normal
        across = np.where(slips, [y * y, -x * y, x * x], [[1.0], [0.0], [1.0]])
        cell, cell_z = (operator.half_space.self_compliance(k) for k in (X, Z))
        share, share_z = cell / (cell + curvature), cell_z / (cell_z + compliance)
        rest, rest_z = (1.0 - share) / (cell + curvature), (1.0 - share_z) / (cell_z + compliance)
        # (K + D)⁻¹ is approximately χ K⁻¹ χ plus a rest of cells that hardly interact, as in
        # BoxOperator.windows.
        self._window = np.stack([*(np.sqrt(share) * across), np.sqrt(share_z)])
        self._rest = np.stack([*(rest * across), rest_z])
        self._local = np.stack([*(curvature * across), compliance])
        self._free = np.stack([*across, np.ones_like(curvature)])

    def projected(self, fields: Array) -> Array:
        """Return the free components of ``fields`` ``(k, 3, m)``."""
        projected = np.zeros_like(fields)
        for part, field in zip(projected, fields, strict=True):
            add_product(self._free, field, part)
        return projected

    def add_local(self, displacement: Array, parts: Array) -> None:
        """Add the displacement of ``parts`` by curvature and local compliance, both ``(3, m)``."""
        add_product(self._local, parts, displacement)

    def inverted(self, displacement: Array) -> Array:
        """Return free components ``(3, m)`` that cause approximately this ``displacement``."""
        field = np.zeros((3, *self._operator.half_space.grid.shape))
        spread_product(self._window, displacement, self.cells, field.reshape(3, -1))
        field = self._operator.precondition(field)
        parts = np.zeros_like(displacement)
        gather_product(self._window, field.reshape(3, -1), self.cells, parts)
        add_product(self._rest, displacement, parts)
        return parts

    def traction(self, parts: Array) -> Array:
        """Return the traction ``(3, m)`` of free components ``parts``.

        It includes the shear that follows from the pressure in cells that slip.
        """
        traction = parts.copy()
        traction[:Z] += self.follows * parts[Z]
        return traction


class _Search:
    """State of the search: admissible tractions, displacement, sets of cells and rigid motion."""

    def __init__(
        self, problem: CoupledProblem, operator: CoupledOperator, traction: Array, slipping: Mask
    ) -> None:
        self._problem, self._operator = problem, operator
        shapes = [problem.modes.motion(np.eye(6)[k]) for k in problem.free]
        self._shapes = np.reshape(shapes, (len(shapes), 3, traction[Z].size))
        self._images = np.empty((PHASE_STEPS, traction.size))
        self._motions = np.zeros(len(shapes))
        self.iterations = 0
        self.contact, self.slipping = traction[Z] > 0.0, slipping & (traction[Z] > 0.0)
        self._changed = int(np.count_nonzero(self.contact))
        self._take(traction)
        self._motions = self._supported()
        self._relative = self._without_motion(self._moved)

    @property
    def rigid(self) -> Array:
        """Free motions ``(6,)`` found last [mm]."""
        rigid = np.zeros(6)
        rigid[list(self._problem.free)] = self._motions
        return rigid

    def residual(self) -> float:
        """Return the largest residual of the last projected traction and the last motion."""
        fields = self.traction, self._displacement, self._relative
        return coupled_residuals(self._problem, *fields).largest

    def phase(self, goal: float) -> bool:
        """Take a step on the present sets, then project the tractions.

        ``goal`` is the tolerance over the residual. False is returned if the tractions cannot be
        balanced.
        """
        self._linearise()
        share = max(STEADY if self._changed == 0 else SETTLED, ENOUGH * goal)
        step, moved = self._solve(share)
        return bool(np.all(np.isfinite(step))) and self._project(step, moved)

    # -- the linear problem of a phase ----------------------------------------------------------
    def _take(self, traction: Array) -> None:
        self.traction = traction
        self._displacement = self._problem.half_space.displacement(traction)
        moved = self._problem.relative(traction, self._displacement, np.zeros(6))
        self._moved = moved.reshape(3, -1)

    def _supported(self) -> Array:
        """Return free motions ``(k,)`` for which v does no work on the pressure."""
        shapes = self._shapes.reshape(len(self._shapes), self._moved.size)
        weighted = (self._shapes * self.traction[Z].ravel()).reshape(shapes.shape)
        products = weighted @ shapes.T
        return np.asarray(np.linalg.pinv(products, RANK_CUTOFF) @ (weighted @ self._moved.ravel()))

    def _without_motion(self, moved: Array) -> Array:
        """Return v ``(3, nx, ny)``: ``moved`` ``(3, nx ny)`` minus the free motions."""
        motion = self._problem.modes.motion(self.rigid)
        return np.asarray(moved.reshape(motion.shape) - motion)

    def _linearise(self) -> None:
        """Set up the free components, curvature and punches at the present traction."""
        friction, cells = self._problem.friction, np.flatnonzero(self.contact)
        slips = self.slipping.ravel()[cells]
        shear_x, shear_y, pressure = self.traction.reshape(3, -1)[:, cells]
        slip = self._relative.reshape(3, -1)[:Z, cells]
        # In cells without pressure so far, shear will oppose the slip, if there is friction.
        along = np.where(pressure > 0.0, [shear_x, shear_y], -slip if friction else 0.0)
        normal = np.where(slips, along / np.maximum(np.hypot(*along), TINY), 0.0)
        limit = friction * np.maximum(pressure, LEAST_PRESSURE * pressure.max()) + TINY
        curvature = np.where(slips, np.maximum(-np.sum(slip * normal, axis=0), 0.0) / limit, 0.0)
        compliance = np.broadcast_to(self._problem.compliance, self.contact.shape).ravel()[cells]
        self._normal = normal
        self._parts = _FreeParts(
            self._operator, cells, slips, friction * normal, normal, curvature, compliance
        )
        self._set_punches(pressure + LEAST_PUNCH * pressure.max())

    def _set_punches(self, weight: Array) -> None:
        """Set up free components that carry resultants: rigid motions times ``weight`` ``(m,)``."""
        parts = self._parts
        shapes = np.take(self._shapes, parts.cells, axis=2)
        conjugate = shapes.copy()
        conjugate[:, Z] += np.sum(parts.follows * shapes[:, :Z], axis=1)
        flat = len(shapes), 3 * len(weight)
        self._rigid_shapes, self._conjugate = shapes.reshape(flat), conjugate.reshape(flat)
        self._punches = parts.projected(shapes * weight).reshape(flat)
        self._gain = np.linalg.pinv(self._conjugate @ self._punches.T, RANK_CUTOFF)
        self._gain_of_motions = np.linalg.pinv(self._punches @ self._rigid_shapes.T, RANK_CUTOFF)

    def _motion_of(self, displacement: Array) -> Array:
        """Return free motions ``(k,)`` without which ``displacement`` does no work on punches."""
        return np.asarray(self._gain_of_motions @ (self._punches @ displacement.ravel()))

    def _descent(self, displacement: Array) -> tuple[Array, Array]:
        """Return the preconditioned ``displacement`` ``(3, m)``, without resultants.

        The free motions that are subtracted from the displacement first are returned as well.
        """
        motions = self._motion_of(displacement)
        relative = displacement - (motions @ self._rigid_shapes).reshape(displacement.shape)
        parts = self._parts.inverted(relative)
        carried = self._gain @ (self._conjugate @ parts.ravel())
        parts -= (carried @ self._punches).reshape(parts.shape)
        return parts, motions

    def _image(self, parts: Array) -> Array:
        """Return K t ``(3, nx ny)`` of free components ``(3, m)``, by one convolution."""
        traction = np.zeros_like(self.traction)
        traction.reshape(3, -1)[:, self._parts.cells] = self._parts.traction(parts)
        return self._problem.half_space.displacement(traction).reshape(3, -1)

    def _solve(self, share: float) -> tuple[Array, Array]:
        """Iterate GMRES until the residual has fallen to ``share`` of itself.

        The step of the traction ``(3, m)`` is returned, and v ``(3, nx ny)`` at its end, without
        the free motions.
        """
        cells = self._parts.cells
        begin, motions = self._descent(self._moved[:, cells])
        size = float(np.linalg.norm(begin))
        basis = np.empty((PHASE_STEPS + 1, begin.size))
        np.multiply(begin.ravel(), -1.0 / max(size, TINY), out=basis[0])
        all_motions = [motions]
        hessenberg = np.zeros((PHASE_STEPS + 1, PHASE_STEPS))
        wanted = size * np.eye(PHASE_STEPS + 1)[0]
        weights, k = np.zeros(0), 0
        while k < PHASE_STEPS:
            parts = basis[k].reshape(begin.shape)
            image = self._image(parts)
            self._images[k] = image.ravel()
            displacement = image[:, cells]
            self._parts.add_local(displacement, parts)
            response, motions = self._descent(displacement)
            all_motions.append(motions)
            next_one = response.ravel()
            rounding = ROUNDING * float(np.linalg.norm(next_one)) + TINY
            for i in range(k + 1):
                hessenberg[i, k] = basis[i] @ next_one
                next_one -= hessenberg[i, k] * basis[i]
            hessenberg[k + 1, k] = np.linalg.norm(next_one)
            k += 1
            if not np.isfinite(hessenberg[:, k - 1]).all():
                return np.full_like(begin, np.nan), self._moved
            matrix = hessenberg[: k + 1, :k]
            weights = np.linalg.lstsq(matrix, wanted[: k + 1])[0]
            residual = float(np.linalg.norm(wanted[: k + 1] - matrix @ weights))
            if residual <= share * size or hessenberg[k, k - 1] <= rounding:
                break
            np.multiply(next_one, 1.0 / hessenberg[k, k - 1], out=basis[k])
        self.iterations += k
        self._motions = all_motions[0] + weights @ np.array(all_motions[1:])
        step = self._parts.traction((weights @ basis[:k]).reshape(begin.shape))
        return step, self._moved + (weights @ self._images[:k]).reshape(self._moved.shape)

    # -- back to the cones ----------------------------------------------------------------------
    def _project(self, step: Array, moved: Array) -> bool:
        """Project to admissible, balanced tractions on new sets; False if there are none."""
        problem, cells = self._problem, self._parts.cells
        reached = self.traction.reshape(3, -1)[:, cells] + step
        relative = self._without_motion(moved)
        slip = relative.reshape(3, -1)[:Z, cells]
        pressed, slipped = reached[Z] > 0.0, self.slipping.ravel()[cells]
        opposed = np.sum(slip * self._normal, axis=0) < 0.0
        beyond = np.hypot(*reached[:Z]) > problem.friction * np.maximum(reached[Z], 0.0)
        slips = (np.where(slipped, opposed, beyond) | (problem.friction == 0.0)) & pressed
        trial = np.zeros_like(self.traction)
        trial.reshape(3, -1)[:, cells] = reached * pressed
        slipping = self._mask(slips)
        traction = balanced(problem, self._operator, trial, slipping)
        if traction is None:
            # Too much of the shear is fixed on circles: the balance decides which cells slip.
            slipping, slipped = np.zeros_like(slipping), np.zeros_like(slipped)
            traction = balanced(problem, self._operator, trial, slipping)
        if traction is None:
            return False
        joining = (relative[Z] < 0.0) & ~self.contact
        # Released cells are still on their circle; the balance may have moved others there.
        pushed = np.hypot(*traction[:Z]) >= problem.friction * traction[Z] * (1.0 - ROUNDING)
        contact = self._mask(pressed) | joining
        slipping |= joining | (self._mask(pressed & ~slipped) & pushed)
        changed = (contact ^ self.contact) | (contact & (slipping ^ self.slipping))
        self._changed = int(np.count_nonzero(changed))
        self.contact, self.slipping = contact, slipping
        self._take(traction)
        self._relative = self._without_motion(self._moved)
        return True

    def _mask(self, values: Mask) -> Mask:
        """Return the mask ``(nx, ny)`` with ``values`` on the cells and False elsewhere."""
        mask = np.zeros(self.contact.shape, dtype=bool)
        mask.ravel()[self._parts.cells] = values
        return mask


def balanced(
    problem: CoupledProblem, operator: CoupledOperator, traction: Array, slipping: Mask
) -> Array | None:
    """Return an admissible traction near ``traction``, with the imposed resultants, or None.

    ``traction`` ``(3, nx, ny)`` has p >= 0. The pressure is balanced first, then the shear within
    its µp, and on the circle in the cells ``slipping`` ``(nx, ny)``.
    """
    pressure = problem.normal.balance(traction[Z], problem.normal_target)
    if pressure is None:
        return None
    limit = problem.friction * pressure
    if not limit.any():
        shear: Array | None = np.zeros_like(traction[:Z])
    else:
        within = TangentialProblem(
            limit, problem.offset[:Z], problem.planar, problem.planar_target, operator.shear
        )
        shear = within.balanced(traction[:Z] * within.pressed, slipping & within.pressed)
    return None if shear is None else np.stack([*shear, pressure])
