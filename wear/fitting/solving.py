"""From a start to the nearest least squares: scipy's trust regions, with bounds."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from sa_solver.types import Array
from wear.fitting.problem import FitProblem

TOLERANCE = 1e-12
"""Of the solver, relative: the solution is then exact beside any bound of it."""

AT_BOUND = 1e-3
"""Of its size, or of its range: a parameter so near to a bound may well be at it."""

ROUGH = 1e-10
"""Tolerance from which on one-sided differences are good enough."""


def solve(
    problem: FitProblem, start: Array, deviations: Array, tolerance: float = TOLERANCE
) -> tuple[Array, float, Array] | None:
    """Where one start leads: fitted values ``(p,)``, cost, Jacobian ``(n, p)`` of the residuals.

    None where it leads to what is not finite.
    """
    lower, upper = problem.bounds

    def residuals(inner: Array) -> Array:
        return np.asarray((problem.predict(problem.outer(inner)) - problem.data) / deviations)

    inner = np.clip(start, lower, upper)
    if not np.isfinite(residuals(inner)).all():
        return None
    try:
        # Steps too far, which the solver takes back.
        with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
            solved = least_squares(
                residuals,
                inner,
                jac="3-point" if tolerance < ROUGH else "2-point",
                bounds=(lower, upper),
                x_scale=_sizes(problem, inner),
                ftol=tolerance,
                xtol=tolerance,
                gtol=tolerance,
            )
    except (ValueError, np.linalg.LinAlgError):  # a Jacobian that is not finite
        return None
    return solved.x, float(solved.cost), solved.jac


def pinned(problem: FitProblem, inner: Array, cost: float, deviations: Array) -> Array:
    """Return fitted values ``(p,)`` with those nearly at a bound put there, if it costs no more.

    The solver comes to a bound from within, ever more slowly: of data that a model meets exactly,
    with a parameter at its bound, it leaves more than rounding does.
    """
    lower, upper = problem.bounds
    near = AT_BOUND * np.minimum(_sizes(problem, inner), upper - lower)
    moved = np.where(inner - lower < near, lower, np.where(upper - inner < near, upper, inner))
    free = moved == inner
    if free.all() or not free.any():
        return inner
    whole = problem.outer(moved)

    def predict(values: Array) -> Array:
        given = whole.copy()
        given[free] = values
        return problem.predict(given)

    unknowns = tuple(one for one, let in zip(problem.unknowns, free, strict=True) if let)
    solved = solve(FitProblem(unknowns, problem.series, predict, ()), inner[free], deviations)
    if solved is None or solved[1] > cost:
        return inner
    moved[free] = solved[0]
    return moved


def _sizes(problem: FitProblem, inner: Array) -> Array:
    """What a change of a parameter is measured by ``(p,)``."""
    sizes = np.maximum(np.abs(inner), [unknown.size for unknown in problem.unknowns])
    return np.where(problem.logarithmic | (sizes == 0.0), 1.0, sizes)
