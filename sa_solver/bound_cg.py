"""Conjugate gradients for the normal contact problem, with bounds and rigid motions.

On a trial contact set the problem is linear: conjugate gradients, preconditioned by the inverse
symbol of the half-space and projected so that every direction leaves the resultants alone. When the
residual on the set has fallen enough, cells that pull leave the set and cells that interpenetrate
join it, and the search goes on from the truncated pressure without losing its direction.

Sources: Polonsky & Keer 1999, Wear 231, 206, doi:10.1016/S0043-1648(99)00113-1 (contact set);
Vollebregt 2014, J. Comput. Phys. 257, 333, doi:10.1016/j.jcp.2013.10.005 (truncated directions,
preconditioner).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sa_solver.contact_law import unilateral
from sa_solver.convolution import HalfSpacePreconditioner
from sa_solver.normal_problem import Iterate, NormalProblem, contact_residuals
from sa_solver.rigid_modes import RANK_CUTOFF
from sa_solver.types import Array

Mask = NDArray[np.bool_]

SETTLED = 0.4
"""The contact set is revised once the preconditioned residual on it has fallen by this factor.
From 0.3 up smooth contacts take the same count; at 0.1 a third more, spent on wrong sets."""

ROUNDING = 1e-12
"""Cells whose pressure reaches zero within this relative distance reach it together."""

STALE = 0.01
"""Flat-punch pressures are recomputed once this fraction of the set has changed; until then those
at hand, cut to the set, do as well: 0 and 0.05 take the same count within one."""


@dataclass(frozen=True)
class SearchResult:
    """The last feasible iterate, how many directions were searched, and whether it converged."""

    iterate: Iterate
    iterations: int
    converged: bool


def bound_conjugate_gradients(
    problem: NormalProblem,
    preconditioner: HalfSpacePreconditioner,
    pressure: Array,
    displacement: Array,
    tolerance: float,
    max_iterations: int,
) -> SearchResult:
    """Solve ``problem`` from a balanced ``pressure`` >= 0 and its ``displacement`` (K + D) p.

    Arrays are ``(nx, ny)`` [MPa], [mm]. Stops when penetration and complementarity are within
    ``tolerance``; the resultants are met throughout. May fail to converge, since no step is
    forced to lower the energy: the result then holds the last pressure that did not pull.
    """
    search = _Search(problem, preconditioner, pressure, displacement)
    iteration = 0
    while not search.converged(tolerance):
        if iteration == max_iterations or not search.advance():
            return SearchResult(search.feasible, iteration, False)
        iteration += 1
    return SearchResult(search.feasible, iteration, True)


class _Search:
    """State of the search. Between revisions of the contact set the pressure on it may pull."""

    def __init__(
        self,
        problem: NormalProblem,
        preconditioner: HalfSpacePreconditioner,
        pressure: Array,
        displacement: Array,
    ) -> None:
        self._problem, self._preconditioner = problem, preconditioner
        self._shapes = problem.modes.shapes
        self._pressure, self._displacement = pressure, displacement
        self._direction = np.zeros_like(pressure)
        self._residual = np.zeros_like(pressure)
        self._energy = np.inf
        self._settled = np.inf
        self._contact = pressure > 0.0
        self._compute_punches()
        self._find_gap()
        self._keep()

    def converged(self, tolerance: float) -> bool:
        """Penetration and complementarity within ``tolerance`` and no cell pulling."""
        if self._pressure.min() < 0.0:
            return False
        self._keep()
        measures = contact_residuals(self._pressure, self._displacement, self._gap)
        return max(measures) <= tolerance

    def _keep(self) -> None:
        self.feasible = Iterate(self._pressure, self._displacement, self._rigid)

    def advance(self) -> bool:
        """Search one direction; False where none is left."""
        residual, gradient, energy = self._gradient()
        if energy <= self._settled and self._needs_revision():
            self._revise()
            residual, gradient, energy = self._gradient()
            self._settled = SETTLED**2 * energy
        elif self._settled == np.inf:
            self._settled = SETTLED**2 * energy
        return self._search(residual, gradient, energy)

    def _gradient(self) -> tuple[Array, Array, float]:
        """Gap on the set, the pressure field it asks for, and their product (an energy)."""
        residual = np.where(self._contact, self._gap, 0.0)
        gradient = self._without_resultants(self._preconditioner.apply(residual))
        return residual, gradient, float(np.vdot(residual, gradient))

    def _search(self, residual: Array, gradient: Array, energy: float) -> bool:
        """Minimise along the conjugate direction (Polak-Ribière, never negative)."""
        conjugacy = float(np.vdot(gradient, residual - self._residual)) / self._energy
        direction = self._without_resultants(max(0.0, conjugacy) * self._direction - gradient)
        image = self._problem.displacement(direction)
        curvature = np.vdot(direction, image)
        if not curvature > 0.0:
            return False
        step = -np.vdot(residual, direction) / curvature
        self._pressure = self._pressure + step * direction
        self._displacement = self._displacement + step * image
        self._direction, self._residual, self._energy = direction, residual, energy
        self._find_gap()
        return True

    def _needs_revision(self) -> bool:
        return bool(self._pressure.min() < 0.0 or np.any(self._gap[~self._contact] < 0.0))

    def _revise(self) -> None:
        """Cells that pull leave the set, cells that interpenetrate join it."""
        joining = ~self._contact & (self._gap < 0.0)
        if self._pressure.min() < 0.0:
            self._truncate()
            self._take((self._pressure > 0.0) | joining)
            joining = self._gap < 0.0
            self._keep()
        self._take(self._contact | joining)
        if np.count_nonzero(self._contact ^ self._punch_set) > STALE * self._contact.sum():
            self._compute_punches()
            self._find_gap()

    def _truncate(self) -> None:
        """Cut off all cells that pull or, if the rest cannot carry the load, the first to do so."""
        balanced = self._problem.modes.balance(unilateral(self._pressure), self._problem.target)
        if balanced is not None:
            self._pressure, self._displacement = balanced, self._problem.displacement(balanced)
            return
        last = self.feasible
        change = self._pressure - last.pressure
        falling = self._pressure < 0.0
        step = np.min(last.pressure[falling] / -change[falling])
        first = falling & (last.pressure <= -step * change * (1.0 + ROUNDING))
        self._pressure = np.where(first, 0.0, last.pressure + step * change)
        self._displacement = last.displacement + step * (self._displacement - last.displacement)

    def _take(self, contact: Mask) -> None:
        """Make ``contact`` the trial set, with the punch pressures at hand cut to it."""
        self._contact = contact
        self._set_punches(self._punches * contact.ravel())
        self._find_gap()

    def _compute_punches(self) -> None:
        """Pressures close to those of flat punches on the set, one per rigid mode."""
        self._punch_set = self._contact
        modes = self._shapes.reshape(3, *self._contact.shape)
        pressures = [self._preconditioner.apply(mode * self._contact) for mode in modes]
        self._set_punches((np.stack(pressures) * self._contact).reshape(3, -1))

    def _set_punches(self, punches: Array) -> None:
        self._punches = punches
        self._inverse = np.linalg.pinv(punches @ self._shapes.T, rcond=RANK_CUTOFF)

    def _find_gap(self) -> None:
        """Rigid motion that makes the gap orthogonal to the punches, and that gap."""
        lifted = self._problem.height + self._displacement
        self._rigid = self._inverse @ (self._punches @ lifted.ravel())
        self._gap = lifted - self._problem.modes.motion(self._rigid)

    def _without_resultants(self, field: Array) -> Array:
        """``field`` on the set, less the punches that carry its resultants."""
        on_set = np.where(self._contact, field, 0.0)
        sums = self._inverse.T @ (self._shapes @ on_set.ravel())
        remainder: Array = on_set - (sums @ self._punches).reshape(on_set.shape)
        return remainder
