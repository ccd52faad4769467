"""Least squares with bounds, and the uncertainty of each parameter.

Residuals are divided by the standard deviations of the data. Where these are not known, each series
has its own, which is estimated from its residuals: s² = Σ r² / (n - p), with its n data and the p
parameters that they determine (the sum of their leverages). For several series with common
parameters the estimate is iterated until it is constant (iterated least squares of Carroll and
Ruppert 1988, *Transformation and Weighting in Regression*, chapter 2). For a single series the
covariance is the usual s² (JᵀJ)⁻¹, with the Jacobian J at the solution (Bates and Watts 1988,
*Nonlinear Regression Analysis*, chapter 2), and 95 % bounds follow from Student's distribution with
n - p degrees of freedom. For a parameter that depends on several series the degrees of freedom f
are those of Satterthwaite 1946, Biometrics 2, 110: 1/f is the sum of (share of the variance)² / f
of the series. With given standard deviations the bounds follow from the normal distribution.

Energies and rates vary over powers of ten. They are fitted as logarithms, so that their bounds are
factors. Bounds are linear at first. Each bound is then checked: the parameter is held there and all
others are fitted again. If the misfit does not rise as it should, the bound is replaced by the
point at which it does (:mod:`wear.fitting.profiles`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from sa_solver import checks
from sa_solver.errors import ConvergenceError
from sa_solver.types import Array, Mask
from wear.fitting.estimates import RANK, Estimate, checked_for_ties, estimate_at, inverse_of
from wear.fitting.problem import FitError, FitProblem
from wear.fitting.profiles import profiled
from wear.fitting.solving import pinned, solve

LEVEL = 0.95
"""Confidence level of all bounds."""

NEAR = 0.1
"""Distance from a bound, in deviations of the data, below which the bound may hold a parameter."""

PUSHED = 1e-3
"""Decrease of the misfit for a step of one deviation beyond a bound, above which the bound holds a
parameter."""

SETTLED, MOST_ROUNDS = 1e-6, 100
"""Relative change of the scatter at which its iteration ends, and most iterations."""

EXACT = 1e-12
"""Scatter of data that a model meets exactly, relative to their largest value."""

ROUNDING = 1e-9
"""Residuals of a model that meets a series exactly, relative to its largest value."""

SAME_MINIMUM = 1e-4
"""Relative difference below which costs are those of the same minimum."""


@dataclass(frozen=True)
class Fit:
    """Best fit of a problem.

    Attributes
    ----------
    problem
        Problem that was fitted.
    values
        Values of all parameters ``(p,)``, also of those that are not determined.
    estimates
        Estimates of all parameters but nuisances, which come last.
    parts
        Contributions of each series to the covariance of the fitted values ``(k, p, p)``, without
        directions that the data do not determine.
    fitted, residuals
        Data according to the model, and measured minus fitted data ``(n,)``.
    deviations, leverages
        Standard deviations and leverages of the data ``(n,)``.
    freedoms
        Degrees of freedom of each series ``(k,)``: its data minus the parameters that they
        determine.
    reached, tried
        Number of initial values that led to this solution, and of all that were tried.
    known
        Whether the standard deviations of all data were given.

    Examples
    --------
    The 95 % band of a line through the origin widens with the distance from the origin:

    >>> import numpy as np
    >>> from wear.fitting import VolumeData, VolumeLaw, fit, volume_problem
    >>> energy = np.array([1e6, 2e6, 3e6])
    >>> tests = volume_problem([VolumeData("both", energy, 1.1e-9 * energy)], VolumeLaw())
    >>> line = tests.curve(tests.data[0], np.array([1e6, 4e6]), None)
    >>> near, far = fit(tests.problem).band(line)
    >>> print(f"{far / near:.3f}")
    4.000
    """

    problem: FitProblem
    values: Array
    estimates: tuple[Estimate, ...]
    parts: Array
    fitted: Array
    residuals: Array
    deviations: Array
    leverages: Array
    freedoms: Array
    reached: int
    tried: int
    known: bool

    @property
    def covariance(self) -> Array:
        """Covariance of the fitted values ``(p, p)``, of logarithms where these are fitted."""
        return np.asarray(self.parts.sum(axis=0))

    @property
    def correlation(self) -> Array:
        """Correlation of the parameters with estimates ``(q, q)``; NaN if not determined."""
        found = np.array([estimate.determined for estimate in self.estimates])
        covariance = self.covariance[: len(found), : len(found)]
        scale = np.sqrt(np.where(found, np.diag(covariance), np.nan))
        return np.asarray(covariance / np.outer(scale, scale))

    @property
    def standardised(self) -> Array:
        """Residuals over their expected deviations ``(n,)``.

        They are 0 for data that determine a parameter alone, which any value of them would meet.
        """
        left = 1.0 - self.leverages
        alone = left < RANK
        return np.where(
            alone, 0.0, self.residuals / (self.deviations * np.sqrt(np.where(alone, 1.0, left)))
        )

    @property
    def excess(self) -> float:
        """Ratio of the scatter to the given deviations, which should be 1; NaN for none given."""
        if not self.known:
            return float("nan")
        squares = np.sum((self.residuals / self.deviations) ** 2)
        return float(np.sqrt(squares / self.freedoms.sum()))

    def product(self, first: int, second: int) -> tuple[float, float]:
        """Return the product of two parameters, and its standard deviation.

        The parameters with the indices ``first`` and ``second`` must not be logarithmic.
        """
        slopes = np.zeros(len(self.values))
        slopes[first], slopes[second] = self.values[second], self.values[first]
        variance = float(slopes @ self.covariance @ slopes)
        return float(self.values[first] * self.values[second]), float(np.sqrt(max(variance, 0.0)))

    def slopes(self, predict: Callable[[Array], Array]) -> Array:
        """Return the derivatives ``(m, p)`` of ``predict`` with respect to the fitted values.

        They are computed by central differences within the bounds, with respect to logarithms where
        these are fitted.
        """
        inner = self.problem.inner(self.values)
        steps = _steps(inner)
        columns = []
        for place, step in enumerate(steps):
            moved = np.eye(len(inner))[place] * step
            ends = [
                predict(self.problem.outer(_within(self.problem, inner + way * moved)))
                for way in (1.0, -1.0)
            ]
            lengths = [_within(self.problem, inner + way * moved)[place] for way in (1.0, -1.0)]
            columns.append((ends[0] - ends[1]) / (lengths[0] - lengths[1]))
        return np.stack(columns, axis=-1)

    def band(self, predict: Callable[[Array], Array]) -> Array:
        """Return half the width ``(m,)`` of the 95 % band of the result of ``predict``.

        The band is that of the curve itself, to first order. Data scatter about it.
        """
        slopes = self.slopes(predict)
        terms = np.maximum(np.einsum("mi,kij,mj->mk", slopes, self.parts, slopes), 0.0)
        widths = [
            np.sqrt(one.sum()) * quantile_of(one, self.problem, self.freedoms) for one in terms
        ]
        return np.array(widths)


def quantile_of(terms: Array, problem: FitProblem, freedoms: Array) -> float:
    """Return the factor from a standard deviation to its 95 % bound.

    ``terms`` ``(k,)`` are the contributions of the series to the variance, and ``freedoms``
    ``(k,)`` their degrees of freedom. Series with given deviations have no uncertain scatter.
    """
    tail, total = 0.5 * (1.0 + LEVEL), float(terms.sum())
    found = np.array([series.deviations is None for series in problem.series])
    inverse = np.sum((terms[found] / total) ** 2 / freedoms[found]) if total > 0.0 else 0.0
    return float(stdtrit(1.0 / inverse, tail) if inverse > 0.0 else ndtri(tail))


def _steps(inner: Array) -> Array:
    """Return the steps of central differences."""
    return np.asarray(np.cbrt(np.finfo(float).eps) * np.maximum(np.abs(inner), 1e-9))


def _within(problem: FitProblem, inner: Array) -> Array:
    return np.asarray(np.clip(inner, *problem.bounds))


def fit(problem: FitProblem) -> Fit:
    """Fit a problem by least squares, and estimate the uncertainty of its parameters.

    Raises FitError for data that are no more than the parameters or not finite, or for a series
    with too few data to estimate their scatter, and ConvergenceError if no initial values lead to a
    solution.

    Examples
    --------
    A slope and an intercept from four points, with the usual bounds:

    >>> import numpy as np
    >>> from wear.fitting import FitProblem, Series, FreeParameter, fit
    >>> x, y = np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.1, 2.9, 5.2, 6.8])
    >>> line = FitProblem(
    ...     unknowns=(FreeParameter("intercept"), FreeParameter("slope")),
    ...     series=(Series("y", y),),
    ...     predict=lambda values: values[0] + values[1] * x,
    ...     starts=[np.array([0.0, 1.0])],
    ... )
    >>> slope = fit(line).estimates[1]
    >>> print(f"{slope.value:.3f}, {slope.bounds[0]:.3f} to {slope.bounds[1]:.3f}")
    1.940, 1.550 to 2.330
    """
    _check(problem)
    _check_model(problem)
    best, reached = _best(problem)
    deviations, inner, jacobian = _weighted(problem, best)
    fitted = problem.predict(problem.outer(inner))
    residuals = problem.data - fitted
    held = _at_bounds(problem, inner, jacobian, -residuals / deviations)
    free = ~held
    inverse, kernel = inverse_of(jacobian * free)
    leverages = np.einsum("ij,ji->i", jacobian * free, inverse)
    wider = _wider(problem, inverse, residuals / deviations, leverages)
    inverse = inverse * wider[:, None]
    masks = [problem.places == k for k in range(len(problem.series))]
    parts = np.stack([inverse[:, here] @ inverse[:, here].T for here in masks])
    # The sum of leverages is the number of parameters that the data of a series determine.
    freedoms = np.array([here.sum() - leverages[here].sum() for here in masks])
    known = all(series.deviations is not None for series in problem.series)
    values = problem.outer(inner)
    alone = [
        estimate_at(
            *(problem, place, values, inverse, kernel, held, jacobian),
            quantile_of(parts[:, place, place], problem, freedoms),
        )
        for place in range(len(values))
    ]
    if not is_exact(problem, residuals):
        alone = profiled(problem, inner, deviations, alone, wider)
    reported = sum(not unknown.nuisance for unknown in problem.unknowns)
    covariance = parts.sum(axis=0)
    estimates = tuple(checked_for_ties(alone, place, covariance) for place in range(reported))
    return Fit(
        problem=problem,
        values=values,
        estimates=estimates,
        parts=parts,
        fitted=fitted,
        residuals=residuals,
        deviations=deviations,
        leverages=leverages,
        freedoms=freedoms,
        reached=reached,
        tried=len(problem.starts),
        known=known,
    )


def _wider(problem: FitProblem, inverse: Array, scaled: Array, leverages: Array) -> Array:
    """Return factors ``(p,)`` that widen deviations where the shares of a scatter are too small.

    The shares of a series are estimates. Where the residuals of the data that determine a parameter
    imply a larger deviation, this is used (White 1980, Econometrica 48, 817; residuals over 1 - h
    as in MacKinnon and White 1985, J. Econometrics 29, 305).
    """
    shared = np.array([series.shares is not None for series in problem.series])[problem.places]
    squares = np.where(shared, (scaled / np.maximum(1.0 - leverages, RANK)) ** 2, 1.0)
    total = np.sum(inverse**2, axis=1)
    found = np.sum(inverse**2 * squares, axis=1)
    return np.asarray(np.sqrt(np.maximum(found / np.where(total > 0.0, total, 1.0), 1.0)))


def is_exact(problem: FitProblem, residuals: Array) -> bool:
    """Return whether the model meets a series up to rounding, so that its scatter is arbitrary."""
    sizes = [np.abs(series.values).max() for series in problem.series]
    largest = [np.abs(residuals[problem.places == k]).max() for k in range(len(sizes))]
    return any(
        one <= ROUNDING * size and series.deviations is None
        for one, size, series in zip(largest, sizes, problem.series, strict=True)
    )


def _check(problem: FitProblem) -> None:
    data, free = problem.data, len(problem.unknowns)
    if not free:
        raise FitError("nothing is free; allowed: at least one free parameter")
    for series in problem.series:
        given = series.deviations
        if not np.isfinite(series.values).all():
            raise FitError(f"{series.name}: a value is not finite; allowed: finite numbers")
        if not series.values.any():
            raise FitError(f"{series.name}: all values are 0; allowed: data that are not all 0")
        if given is not None and not ((given > 0.0) & np.isfinite(given)).all():
            raise FitError(f"{series.name}: a standard deviation is not above 0; allowed: above 0")
    if len(data) <= free:
        raise FitError(
            f"{len(data)} values for {free} free parameters; allowed: more values, or fewer "
            "parameters that are free"
        )


def _check_model(problem: FitProblem) -> None:
    """Raise FitError unless the model predicts a number for each datum."""
    for start in problem.starts[:1]:
        predicted = problem.predict(start)
        shape = problem.data.shape
        checks.array("predictions", predicted, shape, error=FitError, finite=False)


# --- solving ------------------------------------------------------------------------------------


def _best(problem: FitProblem) -> tuple[Array, int]:
    """Return the best fitted values ``(p,)``, and how many initial values led to them."""
    deviations = _first_deviations(problem)
    ends = [solve(problem, problem.inner(start), deviations) for start in problem.starts]
    found = [end for end in ends if end is not None]
    if not found:
        raise ConvergenceError(
            "no start led to a solution; remedy: hold a parameter at a value, or give other bounds"
        )
    least = min(found, key=lambda end: end[1])
    floor = 0.5 * len(problem.data) * EXACT**2
    same = [cost - least[1] <= SAME_MINIMUM * least[1] + floor for _, cost, _ in found]
    return pinned(problem, least[0], least[1], deviations), sum(same)


def _first_deviations(problem: FitProblem) -> Array:
    """Return the deviations of the data ``(n,)``, or the size of a series where unknown."""
    return np.concatenate(
        [
            one.scattered(max(np.abs(one.values).max(), np.finfo(float).tiny))
            if one.deviations is None
            else one.deviations
            for one in problem.series
        ]
    )


def _weighted(problem: FitProblem, best: Array) -> tuple[Array, Array, Array]:
    """Return deviations ``(n,)`` consistent with the residuals, fitted values and Jacobian."""
    deviations = _first_deviations(problem)
    inner = best
    for _ in range(MOST_ROUNDS):
        solved = solve(problem, inner, deviations)
        if solved is None:  # pragma: no cover - the solution was finite before
            break
        inner, _, jacobian = solved
        found = _scatter(problem, inner, jacobian, deviations)
        settled = np.abs(found / deviations - 1.0).max() <= SETTLED
        jacobian = jacobian * (deviations / found)[:, None]
        deviations = found
        if settled or len(problem.series) == 1:
            return deviations, inner, jacobian
    raise ConvergenceError(
        f"the scatter of the series does not converge in {MOST_ROUNDS} iterations; remedy: give "
        "their standard deviations"
    )


def _scatter(problem: FitProblem, inner: Array, jacobian: Array, deviations: Array) -> Array:
    """Return the deviations ``(n,)`` of the data, given or estimated from the residuals."""
    residuals = problem.predict(problem.outer(inner)) - problem.data
    free = ~_at_bounds(problem, inner, jacobian, residuals / deviations)
    inverse, _ = inverse_of(jacobian * free)
    leverages = np.einsum("ij,ji->i", jacobian * free, inverse)
    found = deviations.copy()
    for place, series in enumerate(problem.series):
        if series.deviations is not None:
            continue
        here = problem.places == place
        freedom = float(here.sum() - leverages[here].sum())
        if freedom < 0.5:
            raise FitError(
                f"{series.name}: the parameters can meet all {here.sum()} values, so that their "
                "scatter is unknown; allowed: more values, or their standard deviations"
            )
        least = max(EXACT * np.abs(series.values).max(), np.finfo(float).tiny)
        squares = np.sum((residuals[here] / series.scattered(1.0)) ** 2)
        found[here] = series.scattered(max(float(np.sqrt(squares / freedom)), least))
    return found


def _at_bounds(problem: FitProblem, inner: Array, jacobian: Array, residuals: Array) -> Mask:
    """Return which parameters a bound holds ``(p,)``: near it and pushed against it by the data.

    ``residuals`` ``(n,)`` are fitted minus measured data, over the deviations.
    """
    lower, upper = problem.bounds
    lengths = np.linalg.norm(jacobian, axis=0)
    push = -(jacobian.T @ residuals)
    strong = np.abs(push) > PUSHED * lengths
    nearest = np.where(push < 0.0, inner - lower, upper - inner)
    return np.asarray(strong & (nearest <= NEAR / np.where(strong, lengths, 1.0)))
