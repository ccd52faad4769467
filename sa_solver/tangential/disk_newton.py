"""Newton's method with truncated conjugate gradients for shear within Coulomb's disks.

Cells either stick, with both components of shear free, or slip on the circle |q| = µp, where only
the direction is free. A phase of the search replaces the circles by their tangents. The problem is
then linear, K plus the curvature λ = |Δs|/µp along the tangents, and preconditioned conjugate
gradients lower its residual by a fixed factor. Then the shear is projected back: cells outside
their disk begin to slip, cells whose slip has the direction of the shear begin to stick, and the
resultants are restored. The search continues with the same direction if no cell has changed. A
projection that raises the energy is partly undone, so that no cycle is possible.

Sources: Zhao, Vollebregt & Oosterlee 2016, J. Comput. Phys. (conjugate gradients with slip
directions as unknowns); Vollebregt 2014, doi:10.1016/j.jcp.2013.10.005 (truncated directions,
preconditioner). The curvature, the phases and the balance are derived here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.rigid_modes import RANK_CUTOFF
from sa_solver.tangential.problem import TangentialProblem, dot, squared
from sa_solver.transforms.passes import add_scaled, tensor_product
from sa_solver.types import Array, Mask

SETTLED = 0.3
STEADY = 0.01
"""Factors by which the preconditioned residual must fall in a phase: the first in general, the
second where the sets of cells have nearly settled. For 0.2 to 0.5 and 0.01 to 0.2 the numbers of
iterations differ by 10 %: shorter phases project more often, longer ones solve wrong sets too
accurately."""

NEARLY = 3e-4
"""Share of the pressed cells that may change between sets that have nearly settled. With 1e-4 or
1e-3 the number of convolutions is the same within 3 %; with 0 spheres of 512² cells take a sixth
more."""

ENOUGH = 0.5
"""Share of the tolerance at which a phase ends in any case, as far as the phase can estimate it."""

STALE = 0.01
"""Share of the cells that may change before the punches are recomputed. Until then the old ones,
restricted to the free components, are used. Without recomputation they would differ so much from
rigid punches close to sliding in torsion that hundreds of iterations follow."""

SLOW = 8
"""Number of steps of a phase after which the punches are recomputed as well: 2 to 4 are usual."""

PHASE_STEPS = 40
"""Most steps of a phase; the largest number seen is 15."""

BACKTRACK = 0.3
BACKTRACKS = 12
"""Factor by which a step is shortened when its projection raises the energy, and the most such
reductions."""

ROUNDING = 1e-12
"""Increase of the energy that is due to rounding, relative to the work of shear on displacement."""


@dataclass(frozen=True)
class DiskSolution:
    """Solution for the shear on a box of cells.

    Attributes
    ----------
    shear
        Shear ``(2, nx, ny)`` [MPa].
    displacement
        Elastic displacement K q ``(2, nx, ny)`` [mm].
    rigid
        Free rigid motions ``(k,)`` [mm].
    slipping
        Cells ``(nx, ny)`` on their circle.
    residual, converged
        Residual of the solution, and whether it is within the tolerance.
    """

    shear: Array
    displacement: Array
    rigid: Array
    slipping: Mask
    residual: float
    converged: bool


def newton_on_disks(
    problem: TangentialProblem, shear: Array, tolerance: float, max_iterations: int
) -> DiskSolution:
    """Solve ``problem`` from an admissible ``shear`` ``(2, nx, ny)`` with the imposed resultants.

    The search stops when :meth:`TangentialProblem.residual` is within ``tolerance``, when it
    stalls, or after ``max_iterations``. The solution says whether it has converged; its shear is
    admissible and balanced in any case.
    """
    search = _Search(problem, shear)
    while True:
        residual = search.residual()
        converged = residual <= tolerance
        if (
            converged
            or search.iterations >= max_iterations
            or not search.phase(tolerance / residual)
        ):
            return search.solution(residual, converged)


class _Tensor:
    """Field of symmetric 2 x 2 tensors, with components ``(nx, ny)``."""

    def __init__(self, xx: Array, xy: Array, yy: Array) -> None:
        self._xx, self._xy, self._yy = xx, xy, yy

    def times(self, field: Array) -> Array:
        """Return the product ``(2, nx, ny)`` with a field of that shape."""
        product = np.empty_like(field)
        tensor_product(self._xx, self._xy, self._yy, field, product)
        return product

    def weighted(self, weight: Array) -> _Tensor:
        return _Tensor(weight * self._xx, weight * self._xy, weight * self._yy)


class _Search:
    """State of the search; between projections the shear may leave its disks."""

    def __init__(self, problem: TangentialProblem, shear: Array) -> None:
        self._problem = problem
        self._shear = shear
        self._displacement = problem.operator.displacement(shear)
        self._energy = problem.energy(shear, self._displacement)
        self._slipping = problem.on_circle(shear)
        self._direction: Array | None = None
        self._last_gradient = shear
        self._last_decrement = 0.0
        self._punches = np.zeros((len(problem.target), *shear.shape))
        self._punch_set: Mask | None = None
        self._slow = False
        self._changed = int(np.count_nonzero(problem.pressed))
        self._rigid = np.zeros(len(problem.target))
        self.iterations = 0
        self._linearise(curved=False)
        self._linearise(curved=True)

    def residual(self) -> float:
        """Return the residual of the shear after the last projection."""
        return self._problem.residual(self._shear, self._displacement, self._rigid)

    def solution(self, residual: float, converged: bool) -> DiskSolution:
        return DiskSolution(
            self._shear, self._displacement, self._rigid, self._slipping, residual, converged
        )

    def phase(self, goal: float) -> bool:
        """Take conjugate gradient steps on the present sets, then project the shear.

        ``goal`` is the tolerance over the residual. False is returned if the search has stalled.
        """
        step = np.zeros_like(self._shear)
        gradient, search, decrement = self._descent()
        steady = self._changed <= NEARLY * np.count_nonzero(self._problem.pressed)
        share = max(STEADY if steady else SETTLED, ENOUGH * goal)
        settled = share * share * decrement
        for count in range(PHASE_STEPS):
            self.iterations += 1
            self._slow = count >= SLOW
            if not self._step(step, gradient, search, decrement):
                break
            gradient, search, decrement = self._descent()
            if decrement <= settled:
                break
        return self._project(step)

    # -- the linear problem of a phase ----------------------------------------------------------
    def _linearise(self, curved: bool) -> None:
        """Set up the free components, curvature, punches and rigid motion at the present shear.

        The curvature is included only if ``curved``: it depends on the slip, and therefore on the
        rigid motion found before.
        """
        problem = self._problem
        self._normal = self._shear * np.where(self._slipping, problem.per_limit, 0.0)
        normal_x, normal_y = self._normal
        stuck = problem.pressed & ~self._slipping
        across = [normal_y * normal_y, -normal_x * normal_y, normal_x * normal_x]
        self._free = _Tensor(across[0] + stuck, across[1], across[2] + stuck)
        slip = problem.slip(self._displacement, self._rigid)
        curvature = np.zeros_like(problem.limit)
        if curved:
            curvature = np.maximum(-dot(slip, self._normal), 0.0) * problem.per_limit
        tangents = _Tensor(*across)
        self._curvature = tangents.weighted(curvature)
        windows, rest = problem.operator.windows(curvature)
        self._windows = [(level, self._free.weighted(window)) for level, window in windows]
        self._rest = tangents.weighted(rest)
        self._set_punches()
        self._moved = self._displacement + problem.offset
        self._find_rigid()

    def _set_punches(self) -> None:
        """Set up shear fields that carry resultants, close to those of rigid punches."""
        before, changed = self._punch_set, True
        if before is not None:
            changed_cells = int(np.count_nonzero(self._slipping ^ before))
            stale = STALE * int(np.count_nonzero(self._problem.pressed))
            changed = changed_cells > stale or self._slow
        sources = self._problem.modes.fields() if changed else self._punches
        apply = self._inverted if changed else self._free.times
        for k, source in enumerate(sources):
            self._punches[k] = apply(source)
        if changed:
            self._punch_set = self._slipping
        matrix = np.array([self._problem.modes.sums(punch) for punch in self._punches])
        square = matrix.reshape(len(matrix), len(matrix))
        self._inverse = np.linalg.pinv(square, rcond=RANK_CUTOFF)

    def _inverted(self, displacement: Array) -> Array:
        """Return free components of shear that cause approximately this ``displacement``."""
        shear = self._rest.times(displacement)
        for level, window in self._windows:
            inner = self._problem.operator.precondition(window.times(displacement), level)
            shear += window.times(inner)
        return shear

    def _find_rigid(self) -> None:
        """Find the rigid motion that makes the gradient orthogonal to the punches."""
        flat = self._punches.reshape(len(self._punches), self._moved.size)
        self._rigid = self._inverse @ (flat @ self._moved.ravel())

    def _descent(self) -> tuple[Array, Array, float]:
        """Return the gradient, the preconditioned gradient, and their product."""
        gradient = self._moved.copy()
        self._problem.modes.add_motion(gradient, -self._rigid)
        search = self._without_resultants(self._inverted(gradient))
        return gradient, search, float(np.vdot(gradient, search))

    def _step(self, step: Array, gradient: Array, search: Array, decrement: float) -> bool:
        """Minimise along the conjugate direction (Polak-Ribière, never negative).

        The change of shear is added to ``step``. False is returned if there is no direction.
        """
        direction = -search
        if self._direction is not None:
            change = decrement - float(np.vdot(search, self._last_gradient))
            conjugacy = change / self._last_decrement
            if conjugacy > 0.0:
                add_scaled(direction, self._direction, conjugacy)
        image = self._problem.operator.displacement(direction)
        image += self._curvature.times(direction)
        curvature = float(np.vdot(direction, image))
        if not curvature > 0.0:
            return False
        length = -float(np.vdot(gradient, direction)) / curvature
        add_scaled(step, direction, length)
        add_scaled(self._moved, image, length)
        self._direction, self._last_gradient, self._last_decrement = direction, gradient, decrement
        self._find_rigid()
        return True

    def _without_resultants(self, field: Array) -> Array:
        """Return ``field`` minus the punches that carry its resultants."""
        if len(self._punches):
            shares = self._problem.modes.sums(field) @ self._inverse
            for share, punch in zip(shares, self._punches, strict=True):
                add_scaled(field, punch, -share)
        return field

    # -- back to the disks ----------------------------------------------------------------------
    def _project(self, step: Array) -> bool:
        """Project to an admissible, balanced shear of no higher energy; False if there is none."""
        problem, base = self._problem, self._shear
        rounding = ROUNDING * float(np.abs(base * self._displacement).sum())
        still_slipping = self._slipping & ~self._released(step)
        share = 1.0
        for _ in range(BACKTRACKS):
            trial = base + share * step
            beyond = squared(trial) > problem.limit * problem.limit
            slipping = still_slipping | (beyond & ~self._slipping)
            shear = problem.balanced(trial, slipping)
            if shear is not None:
                displacement = problem.operator.displacement(shear)
                energy = problem.energy(shear, displacement)
                if energy <= self._energy + rounding:
                    self._accept(shear, displacement, energy, slipping, cut=share < 1.0)
                    return True
            share *= BACKTRACK
            still_slipping = self._slipping
        return self._hold()

    def _released(self, step: Array) -> Mask:
        """Return slipping cells whose slip after ``step`` has the direction of their shear."""
        slip = self._moved - self._curvature.times(step)
        self._problem.modes.add_motion(slip, -self._rigid)
        return self._slipping & (dot(slip, self._shear + step) > 0.0)

    def _hold(self) -> bool:
        """Let all cells on their circle slip at the old shear; return False if they do already.

        Cells that were released too early push outwards, which no shorter step can correct.
        """
        on_circle = self._problem.on_circle(self._shear)
        stalled = bool(np.all(self._slipping[on_circle]))
        self._accept(self._shear, self._displacement, self._energy, on_circle, cut=True)
        return not stalled

    def _accept(
        self, shear: Array, displacement: Array, energy: float, slipping: Mask, cut: bool
    ) -> None:
        self._shear, self._displacement, self._energy = shear, displacement, energy
        self._changed = int(np.count_nonzero(self._slipping ^ slipping))
        self._slipping = slipping
        self._linearise(curved=True)
        if cut or self._changed or self._direction is None:
            self._direction = None
        else:
            self._direction = self._without_resultants(self._free.times(self._direction))
