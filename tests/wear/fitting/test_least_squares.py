"""Least squares: textbook bounds, coverage, and parameters that are not determined."""

import numpy as np
import pytest
from scipy.stats import binom, linregress, norm, t

from wear.fitting import (
    FitError,
    FitProblem,
    FreeParameter,
    Series,
    VolumeData,
    VolumeLaw,
    fit,
    volume_problem,
)

X = np.array([0.0, 1.0, 2.0, 4.0, 7.0, 8.0])
NOISE = np.array([0.3, -0.5, 0.1, 0.4, -0.2, -0.1])


def line(values, deviations=None, x=X):
    """Return the fit of a line through ``values`` at ``x`` as a problem."""
    return FitProblem(
        (FreeParameter("start", size=10.0), FreeParameter("slope", size=10.0)),
        (Series("y", values, deviations),),
        lambda p: p[0] + p[1] * x,
        [np.array([0.0, 1.0])],
    )


def test_a_line_has_the_bounds_of_a_textbook():
    y = 3.0 + 2.0 * X + NOISE
    found, known = fit(line(y)), linregress(X, y)
    start, slope = found.estimates
    assert slope.value == pytest.approx(known.slope, rel=1e-9)
    assert slope.deviation == pytest.approx(known.stderr, rel=1e-7)
    assert start.deviation == pytest.approx(known.intercept_stderr, rel=1e-7)
    half = t.ppf(0.975, len(X) - 2) * known.stderr
    assert slope.bounds == pytest.approx([known.slope - half, known.slope + half], rel=1e-7)
    expected = -X.mean() / np.sqrt(np.mean(X**2))
    assert found.correlation[0, 1] == pytest.approx(expected, rel=1e-6)
    # The band of a line is widest at the ends; at 0 it is that of the intercept.
    widths = found.band(lambda p: p[0] + p[1] * X)
    assert widths[0] == pytest.approx(t.ppf(0.975, len(X) - 2) * start.deviation, rel=1e-6)


def test_given_deviations_weigh_and_have_normal_bounds():
    sigma = np.array([0.1, 0.1, 0.1, 1.0, 1.0, 1.0])
    found = fit(line(3.0 + 2.0 * X + NOISE, sigma))
    columns = np.stack([np.ones_like(X), X], axis=1) / sigma[:, None]
    covariance = np.linalg.inv(columns.T @ columns)
    slope = found.estimates[1]
    assert slope.deviation == pytest.approx(np.sqrt(covariance[1, 1]), rel=1e-7)
    half = slope.bounds[1] - slope.value
    assert half == pytest.approx(norm.ppf(0.975) * slope.deviation, rel=1e-7)
    # The accurate points determine the intercept of the line.
    assert found.estimates[0].shares == pytest.approx([1.0])
    assert found.estimates[0].heaviest in (0, 1)


def test_series_with_a_common_parameter_find_their_own_scatter():
    """One series is a hundred times as accurate and determines the parameter and its freedom."""
    rng = np.random.default_rng(3)
    x = np.linspace(0.0, 1.0, 20)
    exact, rough = (2.0 * x + s * rng.standard_normal(20) for s in (0.001, 0.1))
    both = FitProblem(
        (FreeParameter("slope"),),
        (Series("rough", rough), Series("exact", exact)),
        lambda p: np.tile(p[0] * x, 2),
        [np.ones(1)],
    )
    found = fit(both)
    alone = fit(
        FitProblem(both.unknowns, both.series[1:], lambda p: p[0] * x, both.starts)
    ).estimates[0]
    slope = found.estimates[0]
    assert slope.shares[1] > 0.99
    assert slope.shares.sum() == pytest.approx(1.0)
    assert slope.deviation == pytest.approx(alone.deviation, rel=0.01)
    assert np.ptp(slope.bounds) == pytest.approx(np.ptp(alone.bounds), rel=0.02)
    assert found.freedoms.sum() == pytest.approx(39.0)


def test_products_quotients_and_what_does_not_count_are_named():
    y = 2.0 * X + NOISE
    unknowns = tuple(FreeParameter(name, lower=0.0) for name in ("a", "b", "c", "d"))
    problem = FitProblem(
        unknowns,
        (Series("y", y),),
        lambda p: p[0] * p[1] / p[2] * X,
        [np.array([1.0, 3.0, 2.0, 1.0])],
    )
    a, b, c, d = fit(problem).estimates
    assert (a.caveat, b.caveat) == (
        "only its product with b counts",
        "only its product with a counts",
    )
    assert c.caveat == "only its quotient by a counts"
    assert d.caveat == "the data do not depend on it"
    assert np.isnan([one.deviation for one in (a, b, c, d)]).all()


def test_a_parameter_at_its_bound_is_reported():
    y = 1.0 - 0.5 * X
    held = FitProblem(
        (FreeParameter("start", size=1.0), FreeParameter("slope", lower=0.0)),
        (Series("y", y + NOISE),),
        lambda p: p[0] + p[1] * X,
        [np.array([0.0, 1.0])],
    )
    start, slope = fit(held).estimates
    assert slope.caveat == "at its lower bound"
    # The other parameter is estimated as without a slope: a mean.
    assert start.value == pytest.approx((y + NOISE).mean(), rel=1e-3)
    mean_error = np.std(y + NOISE, ddof=1) / np.sqrt(len(y))
    assert start.caveat or start.deviation == pytest.approx(mean_error, rel=1e-3)


def test_what_makes_no_fit_is_refused():
    with pytest.raises(FitError, match="2 values for 2 free parameters"):
        fit(line(np.ones(2), x=X[:2]))
    with pytest.raises(FitError, match="not finite"):
        fit(line(np.array([1.0, np.nan, 3.0, 0.0, 0.0, 0.0])))
    with pytest.raises(FitError, match="standard deviation is not above 0"):
        fit(line(X, np.zeros(6)))
    with pytest.raises(FitError, match="nothing is free"):
        fit(FitProblem((), (Series("y", X),), lambda p: X, [np.zeros(0)]))


def test_true_values_are_within_their_bounds_in_95_of_100_trials():
    energy, hits, rng = np.linspace(1e6, 8e6, 6), 0, np.random.default_rng(0)
    for _ in range(100):
        worn = VolumeData("both", energy, 1.5e-9 * energy + 3e-4 * rng.standard_normal(6))
        (alpha,) = fit(volume_problem([worn], VolumeLaw()).problem).estimates
        hits += alpha.bounds[0] <= 1.5e-9 <= alpha.bounds[1]
    low, high = binom.interval(0.999, 100, 0.95)
    assert low <= hits <= high
