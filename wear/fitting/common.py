"""A parameter common to several tests: which of them decides it, and whether they agree on it.

The fit with one value for all tests is held against that in which each test has a value of its own
and all other parameters stay common: what the sum of squares loses by the further values, over what
is left of it for each degree of freedom, is F distributed where the tests agree (Seber & Lee 2003,
Linear Regression Analysis, section 4.3), and chi-squared where deviations are given. Both are
linear about the common fit: exact for what is linear in its parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, fdtrc

from sa_solver import checks
from sa_solver.types import Array, Indices
from wear.fitting.estimates import RANK
from wear.fitting.least_squares import Fit, is_exact
from wear.fitting.problem import FitError


@dataclass(frozen=True)
class Common:
    """One parameter, its ``name``, over several ``tests`` ``(m,)``, their numbers.

    ``shares`` ``(m,)`` are those of the tests in its variance, which add up to 1. ``own`` ``(m,)``
    is the value that each test alone would have, all other parameters common, with its standard
    ``deviations`` ``(m,)``; NaN where a test does not tell. ``chance`` is that of tests that agree
    to lie so far apart; NaN where nothing tells their scatter, where the
    model meets the data but for rounding, or where fewer than two have a value.

    Examples
    --------
    The second of two tests alone tells the coefficient, since the first has no energy:

    >>> import numpy as np
    >>> from wear.fitting import VolumeData, VolumeLaw, common_over, fit, volume_problem
    >>> tests = VolumeData("both", 1e6 * np.array([0.0, 1.0, 2.0]), 1e-3 * np.array([0.0, 1.1, 2]))
    >>> found = fit(volume_problem([tests], VolumeLaw()).problem)
    >>> (coefficient,) = common_over(found, np.array([0, 1, 1]))
    >>> print(coefficient.name, coefficient.shares, np.isnan(coefficient.own))
    both.coefficient [0. 1.] [ True False]
    """

    name: str
    tests: Indices
    shares: Array
    own: Array
    deviations: Array
    chance: float


def common_over(fit: Fit, tests: Indices) -> list[Common]:
    """What single tests say of each parameter that the data determine.

    ``tests`` ``(n,)`` is the number of the test that each datum is of. Logarithms are compared
    where these are fitted. Raises FitError for tests that are not whole numbers, one per datum.

    Examples
    --------
    Two tests, of which the second has twice the wear coefficient of the first:

    >>> import numpy as np
    >>> from wear.fitting import VolumeData, VolumeLaw, common_over, fit, volume_problem
    >>> energy = 1e6 * np.array([1.0, 2.0, 3.0, 1.0, 2.0, 3.0])
    >>> volume = 1e-3 * np.array([1.01, 1.99, 3.0, 2.01, 3.99, 6.0])
    >>> found = fit(volume_problem([VolumeData("both", energy, volume)], VolumeLaw()).problem)
    >>> (coefficient,) = common_over(found, np.array([0, 0, 0, 1, 1, 1]))
    >>> print((1e12 * coefficient.own).round(), coefficient.shares, coefficient.chance < 1e-6)
    [ 999. 1999.] [0.5 0.5] True
    """
    slopes = fit.slopes(fit.problem.predict) / fit.deviations[:, None]
    residuals = fit.residuals / fit.deviations
    tests = checks.places("tests", tests, np.iinfo(np.int64).max, FitError)
    if tests.shape != residuals.shape:
        raise FitError(
            f"tests of shape {tests.shape}; allowed: one of each of {residuals.size} data"
        )
    numbers = np.unique(tests)
    return [
        _common(fit, place, slopes, residuals, tests, numbers)
        for place, estimate in enumerate(fit.estimates)
        if estimate.determined
    ]


def _common(
    fit: Fit, place: int, slopes: Array, residuals: Array, tests: Indices, numbers: Indices
) -> Common:
    alone = np.where(tests[:, None] == numbers, slopes[:, place, None], 0.0)
    one = _Linear(slopes, residuals)
    each = _Linear(np.concatenate([alone, np.delete(slopes, place, axis=1)], axis=1), residuals)
    weights = one.inverse[place] ** 2
    shares = np.array([weights[tests == number].sum() for number in numbers]) / weights.sum()
    further, left = each.rank - one.rank, len(residuals) - each.rank
    scatter = 1.0 if fit.known else np.sqrt(each.squares / left) if left else np.nan
    told = ~each.open[: len(numbers)]
    inner = fit.problem.inner(fit.values)[place] + each.found[: len(numbers)]
    deviations = scatter * np.linalg.norm(each.inverse[: len(numbers)], axis=1)
    if fit.problem.unknowns[place].logarithmic:
        inner = np.exp(inner)
        deviations = inner * deviations
    return Common(
        name=fit.problem.unknowns[place].name,
        tests=numbers,
        shares=shares,
        own=np.where(told, inner, np.nan),
        deviations=np.where(told, deviations, np.nan),
        chance=np.nan
        if is_exact(fit.problem, fit.residuals)
        else _chance(one.squares - each.squares, further, each.squares, left, fit.known),
    )


def _chance(gained: float, further: int, squares: float, left: int, known: bool) -> float:
    """Of a sum of squares to fall by so much with ``further`` parameters that nothing needs."""
    if further < 1 or (not known and (left < 1 or squares <= 0.0)):
        return float("nan")
    gained = max(gained, 0.0)
    if known:
        return float(chdtrc(further, gained))
    return float(fdtrc(further, left, gained / further / (squares / left)))


class _Linear:
    """Linear least squares of residuals ``(n,)`` by columns ``(n, q)``.

    ``found`` ``(q,)``, ``inverse`` ``(q, n)``, the ``rank``, the sum of ``squares`` that is left,
    and what is ``open`` ``(q,)``: part of a direction that nothing decides.
    """

    def __init__(self, columns: Array, residuals: Array) -> None:
        lengths = np.linalg.norm(columns, axis=0)
        lengths = np.where(lengths > 0.0, lengths, 1.0)
        left, values, right = np.linalg.svd(columns / lengths, full_matrices=False)
        some = values > RANK * values[0]
        self.rank = int(some.sum())
        self.inverse = (right[some].T / values[some]) @ left[:, some].T / lengths[:, None]
        self.found = self.inverse @ residuals
        self.squares = float(np.sum((residuals - columns @ self.found) ** 2))
        # Fewer data than columns leave directions that the economic form does not list.
        seen = np.sum(right[some] ** 2, axis=0)
        self.open = 1.0 - seen > RANK
