"""Conjugate gradients for the normal contact problem, with bounds and rigid motions.

On a trial contact set the problem is linear. It is solved by conjugate gradients, preconditioned by
the inverse symbol of the half-space and projected so that no direction changes the resultants. When
the residual on the set has fallen enough, cells in tension leave the set and cells that
interpenetrate join it. The search continues from the truncated pressure without losing its
direction.

Sources: Polonsky & Keer 1999, Wear 231, 206, doi:10.1016/S0043-1648(99)00113-1 (contact set);
Vollebregt 2014, J. Comput. Phys. 257, 333, doi:10.1016/j.jcp.2013.10.005 (truncated directions,
preconditioner).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sa_solver.contact_law import unilateral
from sa_solver.half_space.preconditioner import NormalPreconditioner
from sa_solver.normal.problem import Iterate, NormalProblem, normal_residuals
from sa_solver.rigid_modes import pseudoinverse
from sa_solver.types import Array, Mask

ITERATIONS = 200
"""Most directions of a search. Smooth contacts took at most 20 and the roughest 125; a longer
search is assumed to cycle between contact sets."""

SETTLED = 0.4
"""Factor by which the preconditioned residual on a contact set must fall before the set is revised.
From 0.3 up smooth contacts take the same number of directions; with 0.1 a third more, because wrong
sets are solved too accurately."""

PULLING = 0.05
"""Share of cells in tension above which the set is revised in any case, because it is far from the
solution. On rough surfaces the search cycled with 0.1 or more; 0 takes slightly longer."""

LOST = 0.05
"""Share of cells of the set that may change before the direction is reset. A direction that is no
longer conjugate slowed the search on rough surfaces (194 directions instead of 72)."""

ROUNDING = 1e-12
"""Relative distance within which the pressures of several cells reach zero together."""

PARTS = (1.0, 0.5, 0.25, 0.1, 0.03, 0.01)
"""Parts of the change since the last revision that are tried one after the other, where the cells
that remain after truncation cannot carry the load. Dropping many cells at once is much faster than
dropping one by one."""

STALE = 0.01
"""Share of the set that may change before the flat punch is recomputed. Until then the old one,
restricted to the set, is used; 0 and 0.05 take the same number of directions within one."""


@dataclass(frozen=True)
class SearchResult:
    """Last feasible iterate of a search, and whether it has converged.

    ``left_bounds`` says that the search ended because the contact set left its bounds.
    """

    iterate: Iterate
    converged: bool
    left_bounds: bool


class BoundConjugateGradients:
    """Search by conjugate gradients.

    Between revisions of the contact set the pressure on it may be negative. The private attribute
    ``_deformed_height`` is the height plus the displacement, that is the gap without the rigid
    motion. ``_punch`` is a pressure field on the set, close to that of a flat punch. Multiplied by
    1, y and -x it represents the three rigid modes (exactly on an ellipse). Directions are
    projected along these fields, and the rigid motion makes the gap orthogonal to them, which keeps
    the preconditioner symmetric.
    """

    def __init__(
        self,
        problem: NormalProblem,
        preconditioner: NormalPreconditioner,
        pressure: Array,
        displacement: Array,
        leaves_bounds: Callable[[Mask], bool],
    ) -> None:
        """Start from a balanced ``pressure`` >= 0 [MPa] and its ``displacement`` (K + D) p [mm].

        Both are ``(nx, ny)``. The search ends when ``leaves_bounds`` is true of a contact set.
        """
        self._problem, self._preconditioner = problem, preconditioner
        self._modes, self._leaves_bounds = problem.modes, leaves_bounds
        self._left_bounds = False
        self._pressure, self._deformed_height = pressure.copy(), problem.height + displacement
        self._gap, self._scratch = np.empty_like(pressure), np.empty_like(pressure)
        self._direction, self._residual = np.zeros_like(pressure), np.zeros_like(pressure)
        self._energy = self._settled = np.inf
        self._punch_set = np.zeros(pressure.shape, dtype=bool)
        self._set_contact(pressure > 0.0)
        self._store_feasible()

    def solve(self, tolerance: float) -> SearchResult:
        """Search until penetration and complementarity are within ``tolerance``.

        The resultants are met in every step. The search may fail to converge, because no step is
        forced to lower the energy. The result then holds the last pressure that was nowhere
        negative.
        """
        directions = 0
        while not self._converged(tolerance):
            if directions == ITERATIONS or not self._advance():
                return SearchResult(self._feasible, False, self._left_bounds)
            directions += 1
        return SearchResult(self._iterate(), True, False)

    def _converged(self, tolerance: float) -> bool:
        """Return whether the residuals are within ``tolerance`` and no pressure is negative."""
        # The scale of the last revision is accurate enough to rule out most iterates. On a periodic
        # grid that scale is 0 at first, under a uniform pressure.
        deepest = 2.0 * tolerance * (self._scale or np.inf)
        if self._pressure.min() < 0.0 or -self._gap.min() > deepest:
            return False
        return normal_residuals(self._problem, self._iterate()).largest <= tolerance

    def _iterate(self) -> Iterate:
        """Return the present pressure, displacement and rigid motion."""
        return Iterate(self._pressure.copy(), self._displacement(), self._rigid)

    def _advance(self) -> bool:
        """Search along one direction; return False if there is none."""
        residual, gradient, energy = self._gradient()
        revised = False
        if (energy <= self._settled or self._pulls()) and self._needs_revision():
            self._revise()
            if self._leaves_bounds(self._contact):
                self._left_bounds = True
                return False
            residual, gradient, energy = self._gradient()
            revised = True
        if revised or self._settled == np.inf:
            self._settled = SETTLED**2 * energy
        return self._search(residual, gradient, energy, revised)

    def _displacement(self) -> Array:
        return self._deformed_height - self._problem.height

    def _store_feasible(self) -> None:
        """Store the present iterate, whose pressure is nowhere negative."""
        self._feasible = self._iterate()
        self._scale = float(self._feasible.displacement.max())

    def _gradient(self) -> tuple[Array, Array, float]:
        """Return the gap on the set, its preconditioned field, and their product (an energy)."""
        residual = self._gap * self._on_set
        gradient = self._preconditioner.apply(residual)
        self._remove_resultants(gradient)
        return residual, gradient, float(np.vdot(residual, gradient))

    def _search(self, residual: Array, gradient: Array, energy: float, revised: bool) -> bool:
        """Minimise along the conjugate direction (Polak-Ribière, never negative)."""
        change = energy - float(np.vdot(gradient, self._residual))
        # If the last gap vanished to rounding, there is no direction to be conjugate to.
        self._direction *= max(0.0, change / self._energy) if self._energy > 0.0 else 0.0
        self._direction -= gradient
        if revised:
            self._remove_resultants(self._direction)
        image = self._problem.displacement(self._direction)
        curvature = float(np.vdot(self._direction, image))
        if not curvature > 0.0:
            return False
        step = -float(np.vdot(residual, self._direction)) / curvature
        self._pressure += np.multiply(self._direction, step, out=self._scratch)
        image *= step
        self._deformed_height += image
        self._residual, self._energy = residual, energy
        self._find_gap()
        return True

    def _pulls(self) -> bool:
        pulling = np.count_nonzero(self._pressure < 0.0)
        return bool(pulling > PULLING * np.count_nonzero(self._contact))

    def _needs_revision(self) -> bool:
        return bool(self._pressure.min() < 0.0 or np.any((self._gap < 0.0) > self._contact))

    def _revise(self) -> None:
        """Remove cells in tension from the set and add cells that interpenetrate."""
        before = self._contact
        contact = self._contact | (self._gap < 0.0)
        if self._pressure.min() < 0.0:
            self._truncate()
            self._set_contact((self._pressure > 0.0) | (contact ^ self._contact))
            contact = self._contact | (self._gap < 0.0)
        self._store_feasible()
        if not np.array_equal(contact, self._contact):
            self._set_contact(contact)
        if np.count_nonzero(contact ^ before) > LOST * np.count_nonzero(before):
            self._direction[:] = 0.0

    def _truncate(self) -> None:
        """Remove all cells in tension or, if the rest cannot carry the load, the first of them."""
        problem, last = self._problem, self._feasible
        change = self._pressure - last.pressure
        for part in PARTS:
            cut = unilateral(last.pressure + part * change)
            balanced = self._modes.balance(cut, problem.target)
            if balanced is not None:
                self._pressure = balanced
                self._deformed_height = problem.height + problem.displacement(balanced)
                return
        falling = self._pressure < 0.0
        step = np.min(last.pressure[falling] / -change[falling])
        first = falling & (last.pressure <= -step * change * (1.0 + ROUNDING))
        self._pressure = np.where(first, 0.0, last.pressure + step * change)
        before = problem.height + last.displacement
        self._deformed_height = before + step * (self._deformed_height - before)

    def _set_contact(self, contact: Mask) -> None:
        """Make ``contact`` the trial set, and restrict or recompute the flat punch."""
        self._contact, self._on_set = contact, contact.astype(np.float64)
        changed = np.count_nonzero(contact ^ self._punch_set)
        if changed > STALE * np.count_nonzero(contact):
            self._compute_punch()
        else:
            np.multiply(self._punch_shape, self._on_set, out=self._punch)
        self._inverse = pseudoinverse(self._modes.products(self._punch))
        self._find_gap()

    def _compute_punch(self) -> None:
        """Compute a pressure close to that of a flat punch on the set."""
        self._punch_set = self._contact
        self._punch = unilateral(self._preconditioner.apply(self._on_set)) * self._on_set
        self._punch_shape = self._punch.copy()

    def _find_gap(self) -> None:
        """Find the rigid motion that makes the gap orthogonal to the punches, and this gap."""
        deformed_height = np.multiply(self._punch, self._deformed_height, out=self._scratch)
        self._rigid = self._inverse @ self._modes.sums(deformed_height)
        self._modes.subtract(self._deformed_height, self._rigid, out=self._gap)

    def _remove_resultants(self, field: Array) -> None:
        """Set ``field`` to 0 off the set and subtract punches that carry its resultants."""
        field *= self._on_set
        share = self._inverse @ self._modes.sums(field)
        self._modes.subtract_weighted(field, self._punch, share, self._scratch)
