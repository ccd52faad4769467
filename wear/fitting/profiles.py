"""Bounds of a parameter where the model bends: its profile.

A parameter is held at some value and all others are fitted anew. The root of what the sum of
squares has risen by, in deviations, is z; where the model is straight z grows as the distance, and
is the quantile at the linear bound. Where it is not, the bound is the value at which z is the
quantile (Bates and Watts 1988, *Nonlinear Regression Analysis*, section 6.1). A parameter that
others can make up for altogether has no such value: it is not determined, whatever its Jacobian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sa_solver.types import Array
from wear.fitting.estimates import Estimate, width_doubt
from wear.fitting.problem import FitProblem
from wear.fitting.solving import solve

STRAIGHT = 0.1
"""Relative distance of z from the quantile up to which a bound stays."""

FOUND = 0.02
"""The same for one that is looked for."""

MOST_TRIED = 12
"""Values tried for a bound."""

LONGEST = 3.0
"""Distance of a value tried from the estimate, over that of the last."""

PRECISE = 1e-8
"""Relative tolerance of what is fitted anew: well below a part of the quantile."""


def profiled(
    problem: FitProblem,
    inner: Array,
    deviations: Array,
    estimates: Sequence[Estimate],
    wider: Array,
) -> list[Estimate]:
    """The estimates with bounds that their profiles bear out.

    ``inner`` ``(p,)`` are the best values as they are fitted, ``deviations`` ``(n,)`` those of the
    data, and ``wider`` ``(p,)`` by how much those of the estimates are more than these make them.
    What a profile passes within the quantile the data allow for the others too: where that is
    beyond their bounds these are widened, or left if the profile has no end.
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
    """The estimate at a ``place``, and all values ``(p,)`` met within the ``quantile``."""
    cloud: list[Array] = [inner]
    lower, upper = (
        _bound(problem, place, inner, deviations, bound, quantile, cloud)
        for bound in estimate.bounds
    )
    return _with_bounds(problem, place, estimate, (lower, upper)), cloud


def _with_bounds(
    problem: FitProblem, place: int, estimate: Estimate, bounds: tuple[float, float]
) -> Estimate:
    """The estimate with other bounds, and left if they are too wide."""
    if bounds == estimate.bounds:
        return estimate
    doubt = width_doubt(problem.unknowns[place], estimate.value, bounds)
    if doubt:
        return replace(estimate, doubt=doubt, deviation=np.nan, bounds=(np.nan, np.nan))
    return replace(estimate, bounds=bounds, straight=False)


def _widened(
    problem: FitProblem, place: int, found: Sequence[Estimate], clouds: Sequence[Array]
) -> Estimate:
    """The estimate at a ``place`` with what the profiles of others have passed."""
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
            doubt = f"goes with {other.name}, which is not determined"
            return replace(estimate, doubt=doubt, deviation=np.nan, bounds=(np.nan, np.nan))
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
    """One bound: the ``linear`` one if it is right, else that of the profile.

    It is that of the unknown if the profile does not rise to the quantile before, and not finite
    where nothing is found. ``cloud`` takes all values met within the quantile.
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
    """All values ``(p,)`` with one held ``at`` a fitted value, begun from those ``near``."""
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
