"""Solution of a least squares problem from initial values, by scipy's bounded trust regions."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from sa_solver.types import Array
from wear.fitting.problem import FitProblem

TOLERANCE = 1e-12
"""Relative tolerance of the solver: its error is negligible compared with confidence bounds."""

AT_BOUND = 1e-3
"""Distance of a parameter from a bound, relative to its size and its range, within which it may be
at the bound."""

ROUGH = 1e-10
"""Tolerance above which one-sided differences are accurate enough."""


def solve(
    problem: FitProblem, start: Array, deviations: Array, tolerance: float = TOLERANCE
) -> tuple[Array, float, Array] | None:
    """Solve ``problem`` from initial fitted values ``start`` ``(p,)``.

    ``deviations`` ``(n,)`` are those of the data. The fitted values ``(p,)``, the cost and the
    Jacobian ``(n, p)`` of the residuals are returned, or None if something is not finite.
    """
    lower, upper = problem.bounds

    def residuals(inner: Array) -> Array:
        return np.asarray((problem.predict(problem.outer(inner)) - problem.data) / deviations)

    inner = np.clip(start, lower, upper)
    if not np.isfinite(residuals(inner)).all():
        return None
    try:
        # Steps that are too long overflow, and the solver takes them back.
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
    except (ValueError, np.linalg.LinAlgError):  # The Jacobian is not finite.
        return None
    return solved.x, float(solved.cost), solved.jac


def pinned(problem: FitProblem, inner: Array, cost: float, deviations: Array) -> Array:
    """Return fitted values ``(p,)`` with those close to a bound set to it, if it costs no more.

    The solver approaches a bound from inside, more and more slowly. For data that the model meets
    exactly with a parameter at its bound, the remaining error would be larger than rounding.
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
    """Return the sizes ``(p,)`` to which changes of the parameters are relative."""
    sizes = np.maximum(np.abs(inner), [unknown.size for unknown in problem.unknowns])
    return np.where(problem.logarithmic | (sizes == 0.0), 1.0, sizes)
