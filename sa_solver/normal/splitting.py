"""Fallback solver of normal contact: Douglas-Rachford splitting on the zero-padded grid."""

from __future__ import annotations

import numpy as np

from sa_solver.contact_law import unilateral
from sa_solver.half_space.operator import NORMAL, HalfSpaceResolvent
from sa_solver.normal.problem import Iterate, NormalProblem, normal_residuals
from sa_solver.padded_splitting import PaddedSplitting, RigidResponse
from sa_solver.splitting import douglas_rachford
from sa_solver.types import Array

SPLITTING_ITERATIONS = 3000
"""Most iterations of the splitting. It usually takes 40 to 220, but 2300 where less than 1 % of the
cells carry the load."""

SPLITTING_STAGES = 4
"""Most stages with a tolerance ten times tighter each. The residual of the splitting does not bound
that of the gap, so that it is tightened until the independent residuals are met."""


def solve_by_splitting(problem: NormalProblem, start: Iterate, tolerance: float) -> Iterate:
    """Solve ``problem`` from the pressure of ``start`` and return the last iterate."""
    resolvent = HalfSpaceResolvent(problem.half_space, NORMAL)
    before = problem.half_space.count
    response = RigidResponse.of(
        resolvent, problem.modes.fields()[:, None], lambda pressure: problem.modes.sums(pressure[0])
    )
    compliance = 0.0 if problem.compliance is None else problem.compliance
    shrinkage = resolvent.shift[0] / (resolvent.shift[0] + compliance)
    splitting = PaddedSplitting(
        resolvent,
        response,
        problem.target,
        problem.height[None],
        lambda trial: unilateral(trial) * shrinkage,
    )
    problem.work[resolvent.padded_shape] += problem.half_space.count - before
    state = resolvent.padded(start.pressure[None])
    iterate, inner = start, tolerance
    for _ in range(SPLITTING_STAGES):
        result = douglas_rachford(
            splitting.elastic_step,
            splitting.local_law,
            state,
            tolerance=inner,
            max_iterations=SPLITTING_ITERATIONS,
        )
        state, inner = result.state, 0.1 * inner
        problem.work[resolvent.padded_shape] += result.iterations
        iterate = _balanced(problem, resolvent.on_grid(result.solution)[0]) or iterate
        if normal_residuals(problem, iterate).largest <= tolerance or not result.converged:
            break
    return iterate


def _balanced(problem: NormalProblem, pressure: Array) -> Iterate | None:
    """Return the balanced ``pressure`` with the rigid motion that makes Σ p g vanish by modes.

    None is returned where no balanced pressure exists.
    """
    modes = problem.modes
    balanced = modes.balance(pressure.copy(), problem.target)
    if balanced is None:
        return None
    displacement = problem.displacement(balanced)
    weighted_heights = modes.sums(balanced * (problem.height + displacement))
    rigid = np.linalg.pinv(modes.products(balanced), hermitian=True) @ weighted_heights
    return Iterate(balanced, displacement, rigid)
