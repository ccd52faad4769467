"""Accelerated projected gradients for shear within Coulomb's disks: slow, but sure to converge.

The problem is the minimum of a strongly convex quadratic function on a convex set. Steps against
the gradient, no longer than the inverse of the largest eigenvalue of K and each projected on the
set, therefore converge for any limits. With momentum the number of steps grows only with the square
root of the ratio of eigenvalues, roughly that of the number of cells across. Newton's method takes
ten times fewer steps, but may stall where limits differ by orders of magnitude between cells.

Sources: Nesterov 1983, Sov. Math. Dokl. 27, 372 (momentum); O'Donoghue & Candès 2015, Found.
Comput. Math. 15, 715, doi:10.1007/s10208-013-9150-3 (restarts).
"""

from __future__ import annotations

import numpy as np

from sa_solver.tangential.disk_newton import DiskSolution
from sa_solver.tangential.problem import TangentialProblem
from sa_solver.types import Array


def gradients_on_disks(
    problem: TangentialProblem, shear: Array, tolerance: float, max_iterations: int
) -> DiskSolution:
    """Solve ``problem`` from an admissible ``shear`` ``(2, nx, ny)`` with the imposed resultants.

    The iteration stops when :meth:`TangentialProblem.residual` is within ``tolerance``, or after
    ``max_iterations``. The best solution found is returned; it says whether it has converged.
    """
    operator = problem.operator
    stiffness = 1.0 / operator.largest_eigenvalue
    everywhere = problem.pressed.astype(np.float64)
    momentum, displacement = 1.0, operator.displacement(shear)
    rigid, slipping = np.zeros(len(problem.target)), problem.on_circle(shear)
    best = DiskSolution(shear, displacement, rigid, slipping, np.inf, False)
    ahead, ahead_displacement = shear, displacement
    for _ in range(max_iterations):
        trial = ahead - stiffness * (ahead_displacement + problem.offset) * everywhere
        balance = problem.balance(trial, weight=everywhere)
        if balance is None:
            break
        new, coefficients = balance
        # Momentum that would carry the shear back to where it came from is dropped.
        restart = float(np.vdot(ahead - new, new - shear)) > 0.0
        following = 1.0 if restart else 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * momentum**2))
        share = 0.0 if restart else (momentum - 1.0) / following
        new_displacement = operator.displacement(new)
        rigid = coefficients / stiffness
        residual = problem.residual(new, new_displacement, rigid)
        if residual < best.residual:
            slipping, converged = problem.on_circle(new), residual <= tolerance
            best = DiskSolution(new, new_displacement, rigid, slipping, residual, converged)
        if best.converged:
            return best
        ahead = new + share * (new - shear)
        ahead_displacement = new_displacement + share * (new_displacement - displacement)
        shear, displacement, momentum = new, new_displacement, following
    return best
