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

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sa_solver.contact_law import unilateral
from sa_solver.half_space.preconditioner import NormalPreconditioner
from sa_solver.normal.problem import Iterate, NormalProblem, normal_residuals
from sa_solver.rigid_modes import pseudoinverse
from sa_solver.types import Array, Mask

ITERATIONS = 200
"""Directions took at most 20 on smooth contacts and 125 on the roughest; beyond this they are taken
to circle between contact sets."""

SETTLED = 0.4
"""The contact set is revised once the preconditioned residual on it has fallen by this factor.
From 0.3 up smooth contacts take the same count; at 0.1 a third more, spent on wrong sets."""

PULLING = 0.05
"""It is revised in any case once this share of its cells pulls: it is far from the right one. On
rough surfaces the search circled from 0.1 up; 0 takes a little longer."""

LOST = 0.05
"""The direction is given up where this share of the set has changed: conjugate to nothing, it made
the search wander on rough surfaces (194 directions instead of 72)."""

ROUNDING = 1e-12
"""Cells whose pressure reaches zero within this relative distance reach it together."""

PARTS = (1.0, 0.5, 0.25, 0.1, 0.03, 0.01)
"""Where the cells left by truncation cannot carry the load, it is tried after these parts of the
way since the last revision: cells leave by the dozen where one by one would take for ever."""

STALE = 0.01
"""The flat punch is recomputed once this fraction of the set has changed; until then the one at
hand, cut to the set, does as well: 0 and 0.05 take the same count within one."""


@dataclass(frozen=True)
class SearchResult:
    """The last feasible iterate, and whether it converged.

    ``left`` says that the search ended because the contact set left its bounds.
    """

    iterate: Iterate
    converged: bool
    left: bool


class BoundConjugateGradients:
    """State of a search. Between revisions of the contact set the pressure on it may pull.

    ``lifted`` is the height plus the displacement: the gap but for the rigid motion. ``punch`` is a
    pressure field on the set close to that of a flat punch; times 1, y and -x it stands for the
    three rigid modes (exactly so on an ellipse). Directions are projected along these fields, and
    the rigid motion makes the gap orthogonal to them, which keeps the preconditioner symmetric.
    """

    def __init__(
        self,
        problem: NormalProblem,
        preconditioner: NormalPreconditioner,
        pressure: Array,
        displacement: Array,
        leaves: Callable[[Mask], bool],
    ) -> None:
        """From a balanced ``pressure`` >= 0 [MPa] and its ``displacement`` (K + D) p [mm].

        Both are ``(nx, ny)``. The search ends when ``leaves`` is true of a trial contact set.
        """
        self._problem, self._preconditioner = problem, preconditioner
        self._modes, self._leaves = problem.modes, leaves
        self._left = False
        self._pressure, self._lifted = pressure.copy(), problem.height + displacement
        self._gap, self._scratch = np.empty_like(pressure), np.empty_like(pressure)
        self._direction, self._residual = np.zeros_like(pressure), np.zeros_like(pressure)
        self._energy = self._settled = np.inf
        self._punch_set = np.zeros(pressure.shape, dtype=bool)
        self._take(pressure > 0.0)
        self._keep()

    def solve(self, tolerance: float) -> SearchResult:
        """Search until penetration and complementarity are within ``tolerance``.

        The resultants are met throughout. May fail to converge, since no step is forced to lower
        the energy: the result then holds the last pressure that did not pull.
        """
        directions = 0
        while not self._converged(tolerance):
            if directions == ITERATIONS or not self._advance():
                return SearchResult(self._feasible, False, self._left)
            directions += 1
        return SearchResult(self._iterate(), True, False)

    def _converged(self, tolerance: float) -> bool:
        """Penetration and complementarity within ``tolerance`` and no cell pulling."""
        # The displacement of the last revision is near enough to rule out most iterates.
        if self._pressure.min() < 0.0 or -self._gap.min() > 2.0 * tolerance * self._scale:
            return False
        return normal_residuals(self._problem, self._iterate()).largest <= tolerance

    def _iterate(self) -> Iterate:
        """The present pressure, displacement and rigid motion."""
        return Iterate(self._pressure.copy(), self._displacement(), self._rigid)

    def _advance(self) -> bool:
        """Search one direction; False where none is left."""
        residual, gradient, energy = self._gradient()
        revised = False
        if (energy <= self._settled or self._pulls()) and self._needs_revision():
            self._revise()
            if self._leaves(self._contact):
                self._left = True
                return False
            residual, gradient, energy = self._gradient()
            revised = True
        if revised or self._settled == np.inf:
            self._settled = SETTLED**2 * energy
        return self._search(residual, gradient, energy, revised)

    def _displacement(self) -> Array:
        return self._lifted - self._problem.height

    def _keep(self) -> None:
        """Remember this pressure, which nowhere pulls."""
        self._feasible = self._iterate()
        self._scale = float(self._feasible.displacement.max())

    def _gradient(self) -> tuple[Array, Array, float]:
        """Gap on the set, the pressure field it asks for, and their product (an energy)."""
        residual = self._gap * self._on_set
        gradient = self._preconditioner.apply(residual)
        self._remove_resultants(gradient)
        return residual, gradient, float(np.vdot(residual, gradient))

    def _search(self, residual: Array, gradient: Array, energy: float, revised: bool) -> bool:
        """Minimise along the conjugate direction (Polak-Ribière, never negative)."""
        change = energy - float(np.vdot(gradient, self._residual))
        # The last gap can have vanished to rounding: then there is nothing to be conjugate to.
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
        self._lifted += image
        self._residual, self._energy = residual, energy
        self._find_gap()
        return True

    def _pulls(self) -> bool:
        pulling = np.count_nonzero(self._pressure < 0.0)
        return bool(pulling > PULLING * np.count_nonzero(self._contact))

    def _needs_revision(self) -> bool:
        return bool(self._pressure.min() < 0.0 or np.any((self._gap < 0.0) > self._contact))

    def _revise(self) -> None:
        """Cells that pull leave the set, cells that interpenetrate join it."""
        before = self._contact
        contact = self._contact | (self._gap < 0.0)
        if self._pressure.min() < 0.0:
            self._truncate()
            self._take((self._pressure > 0.0) | (contact ^ self._contact))
            contact = self._contact | (self._gap < 0.0)
        self._keep()
        if not np.array_equal(contact, self._contact):
            self._take(contact)
        if np.count_nonzero(contact ^ before) > LOST * np.count_nonzero(before):
            self._direction[:] = 0.0

    def _truncate(self) -> None:
        """Cut off all cells that pull or, if the rest cannot carry the load, the first to do so."""
        problem, last = self._problem, self._feasible
        change = self._pressure - last.pressure
        for part in PARTS:
            cut = unilateral(last.pressure + part * change)
            balanced = self._modes.balance(cut, problem.target)
            if balanced is not None:
                self._pressure = balanced
                self._lifted = problem.height + problem.displacement(balanced)
                return
        falling = self._pressure < 0.0
        step = np.min(last.pressure[falling] / -change[falling])
        first = falling & (last.pressure <= -step * change * (1.0 + ROUNDING))
        self._pressure = np.where(first, 0.0, last.pressure + step * change)
        before = problem.height + last.displacement
        self._lifted = before + step * (self._lifted - before)

    def _take(self, contact: Mask) -> None:
        """Make ``contact`` the trial set, with the punch at hand cut to it unless it is stale."""
        self._contact, self._on_set = contact, contact.astype(np.float64)
        changed = np.count_nonzero(contact ^ self._punch_set)
        if changed > STALE * np.count_nonzero(contact):
            self._compute_punch()
        else:
            np.multiply(self._punch_shape, self._on_set, out=self._punch)
        self._inverse = pseudoinverse(self._modes.products(self._punch))
        self._find_gap()

    def _compute_punch(self) -> None:
        """Pressure close to that of a flat punch on the set."""
        self._punch_set = self._contact
        self._punch = unilateral(self._preconditioner.apply(self._on_set)) * self._on_set
        self._punch_shape = self._punch.copy()

    def _find_gap(self) -> None:
        """Rigid motion that makes the gap orthogonal to the punches, and that gap."""
        lifted = np.multiply(self._punch, self._lifted, out=self._scratch)
        self._rigid = self._inverse @ self._modes.sums(lifted)
        self._modes.subtract(self._lifted, self._rigid, out=self._gap)

    def _remove_resultants(self, field: Array) -> None:
        """Take from ``field`` what is off the set, and the punches that carry its resultants."""
        field *= self._on_set
        share = self._inverse @ self._modes.sums(field)
        self._modes.subtract_weighted(field, self._punch, share, self._scratch)
