"""Newton's method with truncated GMRES for pressure and shear of dissimilar bodies together.

Cells are off the contact, or stick, with all three components of traction free, or slip, where the
shear follows the pressure on the circle |q| = µp and only its direction is free. A phase of the
search keeps these sets and takes the directions to be straight tangents. The problem is then
linear: the half-space with its coupling, plus the curvature |Δs|/µp along the tangents. It is not
symmetric where shear follows pressure, so that GMRES lowers its residual, preconditioned by the
inverse 3 x 3 symbol of the half-space on the free components. Then the tractions are projected
back: cells that pull leave, cells that interpenetrate join, cells beyond their circle begin to
slip, cells whose slip would run along with the shear begin to stick, and the resultants are
restored.

No energy falls from phase to phase, because the friction limit follows the pressure: a search whose
residual no longer falls gives up and says so, and leaves the rest to :mod:`sa_solver.splitting`.

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
"""A phase ends once its preconditioned residual has fallen by this factor, by the second where no
cell has changed since the last: there what is left falls with its square."""

ENOUGH = 0.3
"""Or once it is this far within the tolerance, as far as the phase can know."""

PHASE_STEPS = 16
"""Most directions of a phase, all of which are remembered."""

LEAST_PUNCH = 1e-3
"""Share of the largest pressure added to that of each cell, as the weight of a punch."""

PATIENCE = 8
"""Phases without a lower residual after which the search gives up."""

ROUNDING = 1e-12
"""How far below its limit shear on the limit may be; and what is left of a direction that lies
among the others."""

LEAST_PRESSURE = 1e-9
"""Share of the largest pressure from which on down the curvature 1/p grows no more."""

TINY = 1e-200
"""Keeps divisions by a vanishing size finite."""


@dataclass(frozen=True)
class CoupledIterate:
    """Traction ``(3, nx, ny)`` [MPa] that obeys both bounds and has the resultants.

    ``slipping`` ``(nx, ny)`` marks cells on their circle, ``rigid`` ``(6,)`` [mm] are the free
    motions. ``left`` says that the search ended because the contact left its bounds.
    """

    traction: Array
    slipping: Mask
    rigid: Array
    residual: float
    iterations: int
    converged: bool
    left: bool


class CoupledOperator:
    """K on a box of cells, for all three components, and its approximate inverse."""

    def __init__(self, half_space: HalfSpace) -> None:
        """Plan for the box that ``half_space`` covers."""
        self.half_space = half_space
        self.shear = BoxOperator(half_space)

    def precondition(self, displacement: Array) -> Array:
        """About K⁻¹ u ``(3, nx, ny)`` [MPa] of ``displacement`` u ``(3, nx, ny)`` [mm]."""
        return self._inverse.apply(displacement)

    @cached_property
    def _inverse(self) -> SpectralFilter:
        """The inverse symbol of the box made periodic, with next to no padding."""
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
    leaves: Callable[[Mask], bool],
) -> CoupledIterate:
    """Solve ``problem`` from a ``traction`` ``(3, nx, ny)`` with the right resultants.

    ``slipping`` ``(nx, ny)`` are the cells to begin on their circle. Stops when the largest of the
    residuals is within ``tolerance``, when ``leaves`` is true of the contact, when residuals no
    longer fall, or after ``max_iterations`` directions.
    """
    search = _Search(problem, operator, traction, slipping)
    best, waited = np.inf, 0
    while True:
        residual = search.residual()
        best, waited = (residual, 0) if residual < best else (best, waited + 1)
        left = leaves(search.contact)
        stopped = (
            residual <= tolerance
            or left
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
                left,
            )


class _FreeParts:
    """The components of traction that are free, on the ``m`` cells of a contact.

    Where a cell slips along ``normal`` ``(2, m)``, what is free is its pressure, which the shear
    follows, and the direction of its shear. Tensors ``(4, m)`` are xx, xy, yy and zz.
    """

    def __init__(
        self,
        operator: CoupledOperator,
        cells: Indices,
        slips: Mask,
        follows: Array,
        normal: Array,
        bend: Array,
        yielding: Array,
    ) -> None:
        """``follows`` ``(2, m)`` is the shear over the pressure of cells where it ``slips``.

        ``bend`` ``(m,)`` is |Δs|/µp there, ``yielding`` D ``(m,)`` [mm/MPa].
        """
        self._operator, self.cells, self.follows = operator, cells, follows
        x, y = normal
        across = np.where(slips, [y * y, -x * y, x * x], [[1.0], [0.0], [1.0]])
        own, own_z = (operator.half_space.self_compliance(k) for k in (X, Z))
        taken, taken_z = own / (own + bend), own_z / (own_z + yielding)
        rest, rest_z = (1.0 - taken) / (own + bend), (1.0 - taken_z) / (own_z + yielding)
        # (K + D)⁻¹ is about χ K⁻¹ χ and a rest that hardly feels other cells: as in shear alone.
        self._window = np.stack([*(np.sqrt(taken) * across), np.sqrt(taken_z)])
        self._rest = np.stack([*(rest * across), rest_z])
        self._bend = np.stack([*(bend * across), yielding])
        self._free = np.stack([*across, np.ones_like(bend)])

    def cut(self, fields: Array) -> Array:
        """The free components of ``fields`` ``(k, 3, m)``."""
        cut = np.zeros_like(fields)
        for part, field in zip(cut, fields, strict=True):
            add_product(self._free, field, part)
        return cut

    def add_bent(self, displacement: Array, parts: Array) -> None:
        """Add what curvature and local compliance make of ``parts``, both ``(3, m)``."""
        add_product(self._bend, parts, displacement)

    def inverted(self, displacement: Array) -> Array:
        """Free components ``(3, m)`` that cause about this ``displacement`` ``(3, m)`` on them."""
        field = np.zeros((3, *self._operator.half_space.grid.shape))
        spread_product(self._window, displacement, self.cells, field.reshape(3, -1))
        field = self._operator.precondition(field)
        parts = np.zeros_like(displacement)
        gather_product(self._window, field.reshape(3, -1), self.cells, parts)
        add_product(self._rest, displacement, parts)
        return parts

    def traction(self, parts: Array) -> Array:
        """Traction ``(3, m)`` of free components: with the shear that follows the pressure."""
        traction = parts.copy()
        traction[:Z] += self.follows * parts[Z]
        return traction


class _Search:
    """State of the search: admissible tractions, their displacement, the sets and the motion."""

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
        self._turned = int(np.count_nonzero(self.contact))
        self._take(traction)
        self._motions = self._supported()
        self._relative = self._left(self._moved)

    @property
    def rigid(self) -> Array:
        """Free motions last found ``(6,)``."""
        rigid = np.zeros(6)
        rigid[list(self._problem.free)] = self._motions
        return rigid

    def residual(self) -> float:
        """The largest of the traction last projected, at the motion last found."""
        fields = self.traction, self._displacement, self._relative
        return coupled_residuals(self._problem, *fields).largest

    def phase(self, goal: float) -> bool:
        """Directions on the present sets, then a projection; False where none can be balanced.

        ``goal`` is the tolerance over the residual.
        """
        self._linearise()
        share = max(STEADY if self._turned == 0 else SETTLED, ENOUGH * goal)
        step, moved = self._solve(share)
        return bool(np.all(np.isfinite(step))) and self._project(step, moved)

    # -- the linear problem of a phase ----------------------------------------------------------
    def _take(self, traction: Array) -> None:
        self.traction = traction
        self._displacement = self._problem.half_space.displacement(traction)
        moved = self._problem.relative(traction, self._displacement, np.zeros(6))
        self._moved = moved.reshape(3, -1)

    def _supported(self) -> Array:
        """Free motions ``(k,)`` with which v does no work on the pressure."""
        shapes = self._shapes.reshape(len(self._shapes), self._moved.size)
        weighted = (self._shapes * self.traction[Z].ravel()).reshape(shapes.shape)
        products = weighted @ shapes.T
        return np.asarray(np.linalg.pinv(products, RANK_CUTOFF) @ (weighted @ self._moved.ravel()))

    def _left(self, moved: Array) -> Array:
        """``v`` ``(3, nx, ny)`` where it is ``moved`` ``(3, nx ny)`` but for the free motions."""
        motion = self._problem.modes.motion(self.rigid)
        return np.asarray(moved.reshape(motion.shape) - motion)

    def _linearise(self) -> None:
        """Free components, curvature and punches at the present traction."""
        friction, cells = self._problem.friction, np.flatnonzero(self.contact)
        slips = self.slipping.ravel()[cells]
        shear_x, shear_y, pressure = self.traction.reshape(3, -1)[:, cells]
        slip = self._relative.reshape(3, -1)[:Z, cells]
        # Where nothing presses yet, shear will oppose the slip; without friction there is none.
        along = np.where(pressure > 0.0, [shear_x, shear_y], -slip if friction else 0.0)
        normal = np.where(slips, along / np.maximum(np.hypot(*along), TINY), 0.0)
        limit = friction * np.maximum(pressure, LEAST_PRESSURE * pressure.max()) + TINY
        bend = np.where(slips, np.maximum(-np.sum(slip * normal, axis=0), 0.0) / limit, 0.0)
        yielding = np.broadcast_to(self._problem.compliance, self.contact.shape).ravel()[cells]
        self._normal = normal
        self._parts = _FreeParts(
            self._operator, cells, slips, friction * normal, normal, bend, yielding
        )
        self._set_punches(pressure + LEAST_PUNCH * pressure.max())

    def _set_punches(self, weight: Array) -> None:
        """Free components that carry the resultants: rigid motions times a ``weight`` ``(m,)``."""
        parts = self._parts
        shapes = np.take(self._shapes, parts.cells, axis=2)
        felt = shapes.copy()
        felt[:, Z] += np.sum(parts.follows * shapes[:, :Z], axis=1)
        flat = len(shapes), 3 * len(weight)
        self._rigid_shapes, self._felt = shapes.reshape(flat), felt.reshape(flat)
        self._punches = parts.cut(shapes * weight).reshape(flat)
        self._gain = np.linalg.pinv(self._felt @ self._punches.T, RANK_CUTOFF)
        self._gain_of_motions = np.linalg.pinv(self._punches @ self._rigid_shapes.T, RANK_CUTOFF)

    def _undone(self, displacement: Array) -> Array:
        """Free motions ``(k,)`` that leave a ``displacement`` ``(3, m)`` no work on punches."""
        return np.asarray(self._gain_of_motions @ (self._punches @ displacement.ravel()))

    def _descent(self, displacement: Array) -> tuple[Array, Array]:
        """What ``displacement`` ``(3, m)`` asks of the free components, without resultants.

        And the free motions taken off it first.
        """
        motions = self._undone(displacement)
        left = displacement - (motions @ self._rigid_shapes).reshape(displacement.shape)
        parts = self._parts.inverted(left)
        carried = self._gain @ (self._felt @ parts.ravel())
        parts -= (carried @ self._punches).reshape(parts.shape)
        return parts, motions

    def _image(self, parts: Array) -> Array:
        """K t ``(3, nx ny)`` of free components ``(3, m)``: one convolution."""
        traction = np.zeros_like(self.traction)
        traction.reshape(3, -1)[:, self._parts.cells] = self._parts.traction(parts)
        return self._problem.half_space.displacement(traction).reshape(3, -1)

    def _solve(self, share: float) -> tuple[Array, Array]:
        """GMRES until the residual has fallen to ``share`` of itself.

        The step of the traction ``(3, m)``, and v at its end but for the motion ``(3, nx ny)``.
        """
        cells = self._parts.cells
        begin, motions = self._descent(self._moved[:, cells])
        size = float(np.linalg.norm(begin))
        basis = np.empty((PHASE_STEPS + 1, begin.size))
        np.multiply(begin.ravel(), -1.0 / max(size, TINY), out=basis[0])
        undone = [motions]
        hessenberg = np.zeros((PHASE_STEPS + 1, PHASE_STEPS))
        wanted = size * np.eye(PHASE_STEPS + 1)[0]
        weights, k = np.zeros(0), 0
        while k < PHASE_STEPS:
            parts = basis[k].reshape(begin.shape)
            image = self._image(parts)
            self._images[k] = image.ravel()
            displacement = image[:, cells]
            self._parts.add_bent(displacement, parts)
            answer, motions = self._descent(displacement)
            undone.append(motions)
            next_one = answer.ravel()
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
            left = float(np.linalg.norm(wanted[: k + 1] - matrix @ weights))
            if left <= share * size or hessenberg[k, k - 1] <= rounding:
                break
            np.multiply(next_one, 1.0 / hessenberg[k, k - 1], out=basis[k])
        self.iterations += k
        self._motions = undone[0] + weights @ np.array(undone[1:])
        step = self._parts.traction((weights @ basis[:k]).reshape(begin.shape))
        return step, self._moved + (weights @ self._images[:k]).reshape(self._moved.shape)

    # -- back to the cones ----------------------------------------------------------------------
    def _project(self, step: Array, moved: Array) -> bool:
        """Back to admissible and balanced tractions on new sets; False where there are none."""
        problem, cells = self._problem, self._parts.cells
        reached = self.traction.reshape(3, -1)[:, cells] + step
        relative = self._left(moved)
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
            # Too much of the shear is held on circles: those that slip are left to the balance.
            slipping, slipped = np.zeros_like(slipping), np.zeros_like(slipped)
            traction = balanced(problem, self._operator, trial, slipping)
        if traction is None:
            return False
        joining = (relative[Z] < 0.0) & ~self.contact
        # Cells released are still on their circle; others the balance may have brought there.
        pushed = np.hypot(*traction[:Z]) >= problem.friction * traction[Z] * (1.0 - ROUNDING)
        contact = self._mask(pressed) | joining
        slipping |= joining | (self._mask(pressed & ~slipped) & pushed)
        changed = (contact ^ self.contact) | (contact & (slipping ^ self.slipping))
        self._turned = int(np.count_nonzero(changed))
        self.contact, self.slipping = contact, slipping
        self._take(traction)
        self._relative = self._left(self._moved)
        return True

    def _mask(self, values: Mask) -> Mask:
        """``(nx, ny)`` of what is true on the cells."""
        mask = np.zeros(self.contact.shape, dtype=bool)
        mask.ravel()[self._parts.cells] = values
        return mask


def balanced(
    problem: CoupledProblem, operator: CoupledOperator, traction: Array, slipping: Mask
) -> Array | None:
    """Admissible ``traction`` ``(3, nx, ny)`` near one of p >= 0, with the resultants; or None.

    Pressure first, then shear within its µp, on the circle where ``slipping`` ``(nx, ny)``.
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
