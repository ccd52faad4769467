"""The fallback of normal contact: Douglas-Rachford splitting on the zero-padded grid."""

from __future__ import annotations

import numpy as np

from sa_solver.contact_law import unilateral
from sa_solver.half_space import NORMAL, HalfSpaceResolvent
from sa_solver.normal_problem import Iterate, NormalProblem, residuals
from sa_solver.splitting import douglas_rachford
from sa_solver.types import Array

SPLITTING_ITERATIONS = 3000
"""The splitting takes 40 to 220, but 2300 where under 1 % of the cells carry the load."""

SPLITTING_STAGES = 4
"""The splitting's own residual is no bound on the gap's: it is tightened tenfold at most this many
times, until the independent residuals are met."""


def split(problem: NormalProblem, start: Iterate, tolerance: float) -> tuple[Iterate, int]:
    """Solve ``problem`` from the pressure of ``start``: the last iterate and the iterations."""
    splitting = _Splitting(problem)
    state = splitting.padded(start.pressure)
    iterate, iterations, inner = start, 0, tolerance
    for _ in range(SPLITTING_STAGES):
        result = douglas_rachford(
            splitting.elastic_step,
            splitting.local_law,
            state,
            tolerance=inner,
            max_iterations=SPLITTING_ITERATIONS,
        )
        state, inner = result.state, 0.1 * inner
        iterations += result.iterations
        iterate = splitting.iterate(result.solution) or iterate
        if residuals(problem, iterate).largest <= tolerance or not result.converged:
            break
    return iterate, iterations


class _Splitting:
    """The two steps of the splitting, on pressures of the zero-padded grid.

    Off the grid the law is p = 0, which is what makes the circulant exact there.
    """

    def __init__(self, problem: NormalProblem) -> None:
        self._problem = problem
        self._resolvent = HalfSpaceResolvent(problem.half_space, NORMAL)
        self._shift = self._resolvent.shift
        self._height = self.padded(problem.height)
        columns = [self._resolve(self.padded(mode)) for mode in problem.modes.fields()]
        self._columns = np.array(columns).reshape(-1, *self._resolvent.padded)
        self._inverse = np.linalg.pinv(self._sums(self._columns).T)
        compliance = 0.0 if problem.compliance is None else problem.compliance
        self._yield = self._shift / (self._shift + compliance)

    def padded(self, field: Array) -> Array:
        """``field`` ``(nx, ny)`` continued by zero to the padded grid."""
        out = np.zeros(self._resolvent.padded)
        out[: field.shape[0], : field.shape[1]] = field
        return out

    def elastic_step(self, state: Array) -> Array:
        """``(K + ρ)⁻¹ (ρ s - h + rigid)`` with the rigid motion that meets the resultants."""
        pressure = self._resolve(self._shift * state - self._height)
        rigid = self._inverse @ (self._problem.target - self._sums(pressure))
        met: Array = pressure + np.tensordot(rigid, self._columns, 1)
        return met

    def local_law(self, trial: Array) -> Array:
        """``max(0, ρ y / (ρ + D))`` on the grid and 0 off it."""
        return self.padded(unilateral(self._on_grid(trial)) * self._yield)

    def iterate(self, solution: Array) -> Iterate | None:
        """Balanced pressure with the rigid motion that makes Σ p g vanish for every mode."""
        problem, modes = self._problem, self._problem.modes
        pressure = modes.balance(self._on_grid(solution).copy(), problem.target)
        if pressure is None:
            return None
        displacement = problem.displacement(pressure)
        lifted = modes.sums(pressure * (problem.height + displacement))
        rigid = np.linalg.pinv(modes.products(pressure), hermitian=True) @ lifted
        return Iterate(pressure, displacement, rigid)

    def _resolve(self, field: Array) -> Array:
        self._problem.work[self._resolvent.padded] += 1
        solved: Array = self._resolvent.solve(field[None])[0]
        return solved

    def _on_grid(self, field: Array) -> Array:
        nx, ny = self._problem.height.shape
        return field[..., :nx, :ny]

    def _sums(self, field: Array) -> Array:
        """Products with the free modes, ``(..., k)``."""
        return self._problem.modes.sums(self._on_grid(field))
