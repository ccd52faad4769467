"""Bounds of a parameter of a nonlinear model, by its profile.

The parameter is held at a value and all others are fitted again. Let z be the square root of the
increase of the sum of squares, in deviations. For a linear model z is proportional to the distance
from the estimate and equals the quantile at the linear bound. For a nonlinear model the bound is
the value at which z equals the quantile (Bates and Watts 1988, *Nonlinear Regression Analysis*,
section 6.1). If other parameters can compensate for any change of a parameter there is no such
value: the parameter is not determined, whatever its Jacobian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sa_solver.types import Array
from wear.fitting.estimates import Estimate, why_too_wide
from wear.fitting.problem import FitProblem
from wear.fitting.solving import solve

STRAIGHT = 0.1
"""Relative difference of z and the quantile up to which the linear bound is kept."""

FOUND = 0.02
"""Relative difference of z and the quantile at which the search for another bound ends."""

MOST_TRIED = 12
"""Most values tried for a bound."""

LONGEST = 3.0
"""Largest ratio of the distances of two successive values from the estimate."""

PRECISE = 1e-8
"""Relative tolerance of the repeated fits, well below the tolerance of z."""


def profiled(
    problem: FitProblem,
    inner: Array,
    deviations: Array,
    estimates: Sequence[Estimate],
    wider: Array,
) -> list[Estimate]:
    """Return the estimates with bounds that agree with their profiles.

    The values of other parameters on a profile within the quantile are also consistent with the
    data. Where they are beyond the bounds of these parameters, the bounds are widened; if the
    profile has no end, the parameters are not determined.

    Parameters
    ----------
    problem
        Problem that was fitted.
    inner
        Best fitted values ``(p,)``.
    deviations
        Standard deviations of the data ``(n,)``.
    estimates
        Estimates with linear bounds.
    wider
        Factors ``(p,)`` by which the deviations of the estimates are wider than these imply.
    """
    found, clouds = [], []
    for place, estimate in enumerate(estimates):
        checked, cloud = estimate, [inner]
        if estimate.determined and not problem.unknowns[place].nuisance:
            quantile = float(estimate.quantile * wider[place])
            checked, cloud = _profiled(problem, place, inner, deviations, estimate, quantile)
        found.append(checked)
        clouds.append(np.array([problem.outer(values) for values in cloud]))
    return [_widened(problem, place, found, clouds) for place in range(len(found))]


def _profiled(
    problem: FitProblem,
    place: int,
    inner: Array,
    deviations: Array,
    estimate: Estimate,
    quantile: float,
) -> tuple[Estimate, list[Array]]:
    """Return the estimate at ``place`` with profile bounds.

    All values ``(p,)`` met within the ``quantile`` are returned as well.
    """
    cloud: list[Array] = [inner]
    lower, upper = (
        _bound(problem, place, inner, deviations, bound, quantile, cloud)
        for bound in estimate.bounds
    )
    return _with_bounds(problem, place, estimate, (lower, upper)), cloud


def _with_bounds(
    problem: FitProblem, place: int, estimate: Estimate, bounds: tuple[float, float]
) -> Estimate:
    """Return the estimate with other bounds, marked as undetermined if they are too wide."""
    if bounds == estimate.bounds:
        return estimate
    caveat = why_too_wide(problem.unknowns[place], estimate.value, bounds)
    if caveat:
        return replace(estimate, caveat=caveat, deviation=np.nan, bounds=(np.nan, np.nan))
    return replace(estimate, bounds=bounds, straight=False)


def _widened(
    problem: FitProblem, place: int, found: Sequence[Estimate], clouds: Sequence[Array]
) -> Estimate:
    """Return the estimate at ``place`` with bounds that include its values on other profiles."""
    estimate = found[place]
    for other, cloud in zip(found, clouds, strict=True):
        if not estimate.determined or other is found[place]:
            continue
        lower, upper = estimate.bounds
        room = STRAIGHT * (upper - lower)
        least, most = float(cloud[:, place].min()), float(cloud[:, place].max())
        if least >= lower - room and most <= upper + room:
            continue
        if not other.determined:
            caveat = f"goes with {other.name}, which is not determined"
            return replace(estimate, caveat=caveat, deviation=np.nan, bounds=(np.nan, np.nan))
        estimate = _with_bounds(problem, place, estimate, (min(lower, least), max(upper, most)))
    return estimate


def _bound(
    problem: FitProblem,
    place: int,
    inner: Array,
    deviations: Array,
    linear: float,
    quantile: float,
    cloud: list[Array],
) -> float:
    """Return one bound: the ``linear`` one if it is right, otherwise that of the profile.

    If the profile does not rise to the quantile within the bounds of the unknown, its bound is
    returned; if the search fails, the result is infinite. All values met within the quantile are
    added to ``cloud``.
    """
    unknown, best = problem.unknowns[place], inner[place]
    least = _squares(problem, inner, deviations)
    at = float(np.log(linear) if unknown.logarithmic else linear)
    others, side = inner, np.sign(at - best)
    limit = float(problem.bounds[1 if side > 0.0 else 0][place])
    for tried in range(MOST_TRIED):
        at = limit if side * (at - limit) > 0.0 else at
        others = _refitted(problem, place, at, others, deviations)
        z = float(np.sqrt(max(_squares(problem, others, deviations) - least, 0.0)))
        if z <= (1.0 + FOUND) * quantile:
            cloud.append(others)
        if abs(z - quantile) <= (FOUND if tried else STRAIGHT) * quantile:
            return _outer(unknown.logarithmic, at) if tried else linear
        if at == limit and z < quantile:
            return _outer(unknown.logarithmic, at)
        at = best + (at - best) * min(quantile / max(z, quantile / LONGEST), LONGEST)
    return float(side * np.inf)


def _outer(logarithmic: bool, at: float) -> float:
    return float(np.exp(at)) if logarithmic else float(at)


def _squares(problem: FitProblem, inner: Array, deviations: Array) -> float:
    residuals = (problem.predict(problem.outer(inner)) - problem.data) / deviations
    return float(residuals @ residuals)


def _refitted(problem: FitProblem, place: int, at: float, near: Array, deviations: Array) -> Array:
    """Return all fitted values ``(p,)`` with one held at the value ``at``.

    The fit starts from the values ``near``.
    """
    value = problem.outer(np.insert(np.delete(near, place), place, at))[place]
    others = problem.unknowns[:place] + problem.unknowns[place + 1 :]
    if not others:
        return np.array([at])
    held = FitProblem(
        others,
        problem.series,
        lambda values: problem.predict(np.insert(values, place, value)),
        (),
    )
    solved = solve(held, np.delete(near, place), deviations, PRECISE)
    found = np.delete(near, place) if solved is None else solved[0]
    return np.asarray(np.insert(found, place, at))
