"""Parameter common to several tests: which test determines it, and whether the tests agree.

The fit with one value for all tests is compared with a fit in which each test has its own value and
all other parameters stay common. The reduction of the sum of squares by the additional values, over
the remaining sum per degree of freedom, is F distributed if the tests agree (Seber & Lee 2003,
Linear Regression Analysis, section 4.3), and chi-squared where deviations are given. Both fits are
linearised about the common fit, which is exact for models that are linear in their parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, fdtrc

from sa_solver import checks
from sa_solver.types import Array, Indices
from wear.fitting.estimates import RANK, inverse_of
from wear.fitting.least_squares import Fit, is_exact
from wear.fitting.problem import FitError


@dataclass(frozen=True)
class Common:
    """Contributions of several tests to one common parameter.

    Attributes
    ----------
    name
        Name of the parameter.
    tests
        Numbers of the tests ``(m,)``.
    shares
        Shares of the tests in the variance of the parameter ``(m,)``, which add up to 1.
    own
        Value that each test alone would have ``(m,)``, with all other parameters common; NaN where
        a test does not determine it.
    deviations
        Standard deviations of these values ``(m,)``.
    chance
        Probability that tests which agree differ by this much. It is NaN where the scatter is
        unknown, where the model meets the data exactly but for rounding, or where fewer than two
        tests have a value.

    Examples
    --------
    Only the second of two tests determines the coefficient, because the first has no energy:

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
    """Return the contributions of single tests to each parameter that the data determine.

    ``tests`` ``(n,)`` is the number of the test of each datum. For parameters that are fitted as
    logarithms, the logarithms are compared. Raise FitError for tests
    that are not whole numbers, one per datum.

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
    added, freedom = each.rank - one.rank, len(residuals) - each.rank
    scatter = 1.0 if fit.known else np.sqrt(each.squares / freedom) if freedom else np.nan
    determined = ~each.undetermined[: len(numbers)]
    inner = fit.problem.inner(fit.values)[place] + each.found[: len(numbers)]
    deviations = scatter * np.linalg.norm(each.inverse[: len(numbers)], axis=1)
    if fit.problem.unknowns[place].logarithmic:
        inner = np.exp(inner)
        deviations = inner * deviations
    return Common(
        name=fit.problem.unknowns[place].name,
        tests=numbers,
        shares=shares,
        own=np.where(determined, inner, np.nan),
        deviations=np.where(determined, deviations, np.nan),
        chance=np.nan
        if is_exact(fit.problem, fit.residuals)
        else _chance(one.squares - each.squares, added, each.squares, freedom, fit.known),
    )


def _chance(reduction: float, added: int, squares: float, freedom: int, known: bool) -> float:
    """Return the probability that ``added`` needless parameters reduce the squares by this much.

    ``squares`` is the remaining sum of squares with ``freedom`` degrees of freedom; ``known`` says
    whether the deviations of the data are given.
    """
    if added < 1 or (not known and (freedom < 1 or squares <= 0.0)):
        return float("nan")
    reduction = max(reduction, 0.0)
    if known:
        return float(chdtrc(added, reduction))
    return float(fdtrc(added, freedom, reduction / added / (squares / freedom)))


class _Linear:
    """Linear least squares fit of residuals ``(n,)`` by columns ``(n, q)``.

    The results are the coefficients ``found`` ``(q,)``, the pseudoinverse ``inverse`` ``(q, n)``,
    the ``rank``, the remaining sum of ``squares``, and which coefficients are ``undetermined``
    ``(q,)`` because they are part of a direction that no residual determines.
    """

    def __init__(self, columns: Array, residuals: Array) -> None:
        self.inverse, undetermined = inverse_of(columns)
        # The determined shares of all coefficients add up to the number of determined directions.
        self.rank = round(float(np.sum(1.0 - undetermined)))
        self.found = self.inverse @ residuals
        self.squares = float(np.sum((residuals - columns @ self.found) ** 2))
        self.undetermined = undetermined > RANK
