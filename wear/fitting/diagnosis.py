"""Plausibility warnings from residuals: trends, outliers, two groups, files that disagree.

The bounds of a fit are valid for data that scatter independently about the model. Each test here
raises about one false alarm in a thousand fits of such data.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import chdtri, fdtrc, ndtri, stdtrit

from sa_solver import checks
from sa_solver.types import Array, Indices, Mask
from wear.fitting.least_squares import Fit
from wear.fitting.problem import FitError

ALARM = 1e-3
"""Rate of false alarms of a test for valid data."""

FEWEST = 6
"""Least number of data of a series for the tests."""

SAMPLES, SEED = 4000, 0
"""Number and seed of the normal samples with which a split into two groups is compared."""

SMALLEST_GROUP = 0.1
"""Least share of the data in the smaller of two groups, which has at least two data: fewer are
outliers."""


@dataclass(frozen=True)
class FitWarning:
    """Plausibility warning about the data of a series: a ``text``, and indices of the ``data``."""

    series: str
    text: str
    data: tuple[int, ...] = ()


def diagnose(fit: Fit, order: Array, files: Indices | None = None) -> list[FitWarning]:
    """Return plausibility warnings from the residuals of a fit.

    ``order`` ``(n,)`` is the quantity by which the data of each series are sorted, such as their
    energy. ``files`` ``(n,)`` is the number of the file of each datum. Raise FitError
    for other shapes.

    Examples
    --------
    Volumes of two materials fitted by one line have two groups of residuals:

    >>> import numpy as np
    >>> from wear.fitting import VolumeData, VolumeLaw, diagnose, fit, volume_problem
    >>> energy = np.linspace(1e6, 8e6, 16)
    >>> coefficient = np.where(np.arange(16) % 4 < 2, 1e-9, 2e-9)
    >>> mixed = VolumeData("both", energy, coefficient * energy)
    >>> found = fit(volume_problem([mixed], VolumeLaw()).problem)
    >>> for warning in diagnose(found, energy):
    ...     print(warning.text.partition(":")[0])
    residuals are of two groups, 8 and 8
    """
    warnings = []
    residuals = fit.standardised
    order = checks.array("order of the data", order, residuals.shape, error=FitError)
    if files is not None:
        files = checks.places("files", files, np.iinfo(np.int64).max, FitError)
        if files.shape != residuals.shape:
            raise FitError(f"files of shape {files.shape}; allowed: one of each datum")
    for place, series in enumerate(fit.problem.series):
        here = np.flatnonzero(fit.problem.places == place)
        if len(here) < FEWEST or fit.freedoms[place] < FEWEST // 2 or _is_exact(fit, here):
            continue
        found = _of_series(fit, place, residuals, order, files)
        warnings += [FitWarning(series.name, text, tuple(map(int, data))) for text, data in found]
    freedom = float(fit.freedoms.sum())
    if fit.known and freedom * fit.excess**2 > chdtri(freedom, ALARM):
        text = f"data scatter {fit.excess:.2g} times as much as their standard deviations say"
        warnings.append(
            FitWarning("", f"{text}: the model, or these, are wrong, and the bounds too small")
        )
    return warnings


def _is_exact(fit: Fit, here: Indices) -> bool:
    """Return whether the model meets the data up to rounding."""
    size = np.abs(fit.problem.data[here]).max()
    return bool(np.abs(fit.residuals[here]).max() <= 1e-9 * size)


def _of_series(
    fit: Fit, place: int, residuals: Array, order: Array, files: Indices | None
) -> list[tuple[str, Indices]]:
    found, here = [], np.flatnonzero(fit.problem.places == place)
    groups = _two_groups(residuals[here], fit.fitted[here])
    if groups is not None:
        sizes = f"{len(groups) - np.count_nonzero(groups)} and {np.count_nonzero(groups)}"
        text = f"residuals are of two groups, {sizes}: data of two materials or tests in one?"
        found.append((text, here[groups]))
    elif len(outliers := here[_are_outliers(fit, place, residuals[here])]):
        found.append(("far from all others: outliers?", outliers))
    sorted_here = here[np.argsort(order[here], kind="stable")]
    if groups is None and _goes_in_waves(residuals[sorted_here]):
        text = (
            "residuals go in waves: the function does not follow the data, or these are not "
            "independent; bounds are too small"
        )
        found.append((text, here[:0]))
    if groups is None and _scatter_grows(residuals[here], fit.fitted[here]):
        text = "scatter grows with the value: give standard deviations that do, or bounds are wrong"
        found.append((text, here[:0]))
    if files is not None and _files_differ(residuals[here], files[here]):
        found.append(("files lie apart from each other by more than their scatter", here[:0]))
    return found


def _two_groups(residuals: Array, fitted: Array) -> Mask | None:
    """Return which residuals are in the upper of two groups, or None if there are no two groups.

    The residuals are tested as they are, and over the fitted values, which finds two slopes. The
    share of the sum of squares that remains within the groups is compared with normal samples.
    """
    for values in (residuals, residuals / np.where(fitted == 0.0, np.inf, fitted)):
        ratio, limit = _best_split(values[None, :])
        if ratio[0] < _smallest_split(len(values)):
            upper: Mask = values > limit[0]
            return upper
    return None


@cache
def _smallest_split(count: int) -> float:
    """Return the share within two groups below which :data:`ALARM` of normal samples are.

    The samples have ``count`` values each.
    """
    samples = np.random.default_rng(SEED).standard_normal((SAMPLES, count))
    return float(np.quantile(_best_split(samples)[0], ALARM))


def _best_split(values: Array) -> tuple[Array, Array]:
    """Return the least share of the sum of squares within two groups, and the limit between them.

    Both are ``(m,)`` for samples ``(m, n)``. Each group has a share of :data:`SMALLEST_GROUP` or
    more of the values.
    """
    ordered = np.sort(values - values.mean(axis=1, keepdims=True), axis=1)
    count = ordered.shape[1]
    smallest = max(2, round(SMALLEST_GROUP * count))
    below = np.cumsum(ordered, axis=1)[:, smallest - 1 : count - smallest]
    sizes = np.arange(smallest, count - smallest + 1)
    # The sum of squares between groups with the means m and -m n1/n2.
    between = below**2 * count / (sizes * (count - sizes))
    best = between.argmax(axis=1)
    rows = np.arange(len(ordered))
    total = np.sum(ordered**2, axis=1)
    place = best + smallest - 1
    limit = 0.5 * (ordered[rows, place] + ordered[rows, place + 1]) + values.mean(axis=1)
    return 1.0 - between[rows, best] / np.where(total > 0.0, total, 1.0), limit


def _are_outliers(fit: Fit, place: int, values: Array) -> Mask:
    """Return which residuals would occur at most once in a thousand fits.

    The scatter is estimated without the residual itself.
    """
    freedom = float(fit.freedoms[place])
    if fit.problem.series[place].deviations is None:
        rest = np.maximum(freedom - values**2, 1e-9)
        values = values * np.sqrt((freedom - 1.0) / rest)
    level = 1.0 - 0.5 * ALARM / len(values)
    limit = ndtri(level) if fit.known else stdtrit(freedom - 1.0, level)
    return np.asarray(np.abs(values) > limit)


def _goes_in_waves(residuals: Array) -> bool:
    """Return whether neighbours are correlated (von Neumann 1941, Ann. Math. Stat. 12, 367)."""
    count = len(residuals)
    ratio = np.sum(np.diff(residuals) ** 2) / np.sum(residuals**2)
    spread = np.sqrt(4.0 * (count - 2.0) / (count**2 - 1.0))
    return bool((2.0 - ratio) / spread > ndtri(1.0 - ALARM))


def _scatter_grows(residuals: Array, fitted: Array) -> bool:
    """Return whether large values scatter more.

    The test is Spearman's rank correlation of the values with the size of the residuals.
    """
    count = len(residuals)
    ranks = [np.argsort(np.argsort(np.abs(one), kind="stable")) for one in (residuals, fitted)]
    correlation = np.corrcoef(ranks[0], ranks[1])[0, 1]
    return bool(correlation * np.sqrt(count - 1.0) > ndtri(1.0 - ALARM))


def _files_differ(residuals: Array, files: Indices) -> bool:
    """Return whether the means of files differ by more than the scatter within them (F test)."""
    names, numbers = np.unique(files, return_inverse=True)
    count, groups = len(residuals), len(names)
    if groups < 2 or count <= groups:
        return False
    sizes = np.bincount(numbers)
    means = np.bincount(numbers, residuals) / sizes
    between = np.sum(sizes * (means - residuals.mean()) ** 2) / (groups - 1)
    within = np.sum((residuals - means[numbers]) ** 2) / (count - groups)
    if within == 0.0:
        return bool(between > 0.0)
    return bool(fdtrc(groups - 1, count - groups, between / within) < ALARM)
