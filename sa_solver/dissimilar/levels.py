"""Contact of dissimilar bodies solved with initial guesses from coarser grids, in a box around it.

Both only save time: the solution is verified by a convolution on the whole grid.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from sa_solver.dissimilar.newton import (
    ROUNDING,
    CoupledIterate,
    CoupledOperator,
    balanced,
    newton_on_cones,
)
from sa_solver.dissimilar.problem import CoupledProblem
from sa_solver.half_space.active_box import Box, OnBoxes
from sa_solver.half_space.influence import Z
from sa_solver.half_space.nested_grids import GridTransfer, coarsened
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact, NormalContactError
from sa_solver.normal.state import NormalState
from sa_solver.rigid_modes import NORMAL, RigidModes
from sa_solver.types import Array, Mask

COARSE_TOLERANCE = 3e-3
"""Residual of solutions on coarser grids, whose errors are larger than this."""

COARSE_ITERATIONS = 40
"""Most directions on coarser grids: a poor initial guess is not worth more."""


class CoupledLevel:
    """Solver on one grid, with cached transforms and coarser grids.

    ``transformed`` counts the points of all padded transforms so far, of three components each.
    """

    def __init__(self, half_space: HalfSpace) -> None:
        """Prepare the solver for ``half_space``."""
        self.half_space = half_space
        self.transformed = 0.0
        self._operators = OnBoxes(half_space, CoupledOperator)

    def begin(self, problem: CoupledProblem) -> tuple[Array, Mask] | None:
        """Return an admissible, balanced traction ``(3, nx, ny)`` and the cells that slip.

        The initial guess comes from the solution on coarser grids, or from the frictionless contact
        where there are none. None is returned where there is no such traction.
        """
        return self._from_coarser(problem) or self.near(problem, self._pressed(problem))

    def near(self, problem: CoupledProblem, traction: Array) -> tuple[Array, Mask] | None:
        """Return an initial guess as :meth:`begin` does, near a ``traction`` with p >= 0.

        The cells on their circle slip.
        """
        limit = problem.friction * traction[Z]
        slipping = (np.hypot(*traction[:Z]) >= limit * (1.0 - ROUNDING)) & (traction[Z] > 0.0)
        return self._on_cones(problem, traction, slipping)

    def search(
        self,
        problem: CoupledProblem,
        guess: tuple[Array, Mask],
        tolerance: float,
        max_iterations: int,
        missed: Mask | None = None,
    ) -> CoupledIterate:
        """Search by Newton's method in a box around the contact and the cells ``missed`` so far.

        ``guess`` holds a traction and its slipping cells. The box is enlarged while the contact
        reaches its sides.
        """
        (traction, slipping), iterations = guess, 0
        pressed = traction[Z] > 0.0
        box = Box.around(pressed if missed is None else pressed | missed)
        while True:
            operator = self._operators.on(box)
            before = operator.half_space.count
            found = newton_on_cones(
                problem.cropped(box.window, operator.half_space),
                operator,
                np.ascontiguousarray(traction[:, *box.window]),
                slipping[box.window],
                tolerance,
                max_iterations - iterations,
                box.is_reached_by,
            )
            self._count(operator.half_space, operator.half_space.count - before)
            traction = np.array([box.on_whole_grid(component) for component in found.traction])
            slipping = box.on_whole_grid(found.slipping.astype(np.float64)) > 0.0
            iterations += found.iterations
            if not found.left_bounds:
                return replace(found, traction=traction, slipping=slipping, iterations=iterations)
            box = box.enlarged()

    # -- initial guesses ----------------------------------------------------------------------
    def _on_cones(
        self, problem: CoupledProblem, traction: Array, slipping: Mask
    ) -> tuple[Array, Mask] | None:
        if not traction[Z].any():
            return None
        within = balanced(problem, self._operators.whole, traction, slipping)
        return None if within is None else (within, slipping)

    def _pressed(self, problem: CoupledProblem) -> Array:
        """Return the traction without friction, or 0 if the normal problem has no solution."""
        traction = np.zeros((3, *self.half_space.grid.shape))
        try:
            state = pressed_without_friction(problem, self._normal)
        except NormalContactError:
            return traction
        traction[Z] = state.pressure
        self._count(self.half_space, state.convolutions / 3.0)
        return traction

    def _from_coarser(self, problem: CoupledProblem) -> tuple[Array, Mask] | None:
        """Return an initial guess from the next coarser grid, or None without one."""
        if self._coarser is None:
            return None
        level, transfer = self._coarser
        coarse, before = level._restricted(problem, transfer), level.transformed
        guess = level.begin(coarse)
        if guess is None:
            return None
        found = level.search(coarse, guess, COARSE_TOLERANCE, COARSE_ITERATIONS)
        self.transformed += level.transformed - before
        traction = np.array([transfer.interpolated(component) for component in found.traction])
        pressed, slipping = (
            transfer.interpolated(cells.astype(np.float64)) > 0.5
            for cells in (found.traction[Z] > 0.0, found.slipping)
        )
        # Interpolation spreads tractions to cells beyond the edge, which would cost five more
        # directions.
        return self._on_cones(problem, traction * pressed, slipping & pressed)

    def _restricted(self, fine: CoupledProblem, transfer: GridTransfer) -> CoupledProblem:
        """Return the problem ``fine`` of the next finer grid, averaged over this level's cells."""
        grid, compliance = self.half_space.grid, fine.compliance
        return replace(
            fine,
            half_space=self.half_space,
            modes=RigidModes(grid),
            offset=np.array([transfer.averaged(component) for component in fine.offset]),
            target=fine.target * (transfer.fine.cell_area / grid.cell_area),
            compliance=(
                compliance if isinstance(compliance, float) else transfer.averaged(compliance)
            ),
        )

    @cached_property
    def _coarser(self) -> tuple[CoupledLevel, GridTransfer] | None:
        coarser = coarsened(self.half_space)
        return None if coarser is None else (CoupledLevel(coarser[0]), coarser[1])

    @cached_property
    def _normal(self) -> NormalContact:
        return NormalContact(self.half_space)

    def _count(self, half_space: HalfSpace, convolutions: float) -> None:
        self.transformed += convolutions * float(np.prod(half_space.padded))


def pressed_without_friction(problem: CoupledProblem, normal: NormalContact) -> NormalState:
    """Return the normal contact of ``problem`` without friction.

    Raises NormalContactError where no pressure on the grid can be balanced.
    """
    units = problem.modes.lengths * problem.half_space.grid.cell_area
    loads = {k: float(problem.target[n] * units[k]) for n, k in enumerate(problem.free)}
    held = [0.0 if k in problem.modes.present and k not in loads else None for k in NORMAL]
    compliance = problem.compliance
    return normal.solve(
        problem.offset[Z],
        *(loads.get(k) for k in NORMAL),
        approach=held[0],
        tilt_x=held[1],
        tilt_y=held[2],
        compliance=None if isinstance(compliance, float) else compliance,
    )
