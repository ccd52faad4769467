"""What the data say of each parameter: deviation, bounds, shares, or why it is not determined.

The estimate is a linear combination A of the data near the solution, and its variance the sum of
(A_ji σ_i)² over the data: the terms' shares tell which data decide a parameter. What no data decide
is found by the singular values of the Jacobian, columns scaled to length 1, and by bounds wider
than the parameter itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sa_solver.types import Array, Mask
from wear.fitting.problem import FitProblem, Unknown

RANK = 1e-6
"""Singular values of the Jacobian below this share of the largest are nothing: central differences
leave 1e-9 of noise in it."""

ALIKE = 1e-5
"""Columns of the Jacobian, in relative changes, that differ by no more are one: a product."""

PRODUCT, QUOTIENT = "product with", "quotient by"

DECADE = float(np.log(10.0))
"""A logarithm that is known no better than to a decade is not determined."""

FOLLOWS = 0.95
"""Correlation from which on a parameter follows another."""


@dataclass(frozen=True)
class Estimate:
    """What the data say of one parameter.

    ``name`` is that of the unknown, ``value`` what it is most likely, with its standard
    ``deviation`` and ``bounds`` of 95 %; of what is not determined these are NaN, and ``doubt``
    says why. The deviation of a ``logarithmic`` one is its value times that of the logarithm.
    ``shares`` ``(k,)`` are those of the series in its variance, which add up to 1, and ``heaviest``
    the datum with the largest share of its own, ``heaviest_share``. ``quantile`` is what the
    deviation is multiplied with for linear bounds; where the model bends within these, which
    ``straight`` then denies, bounds are those of the profile (:mod:`wear.fitting.profiles`).
    ``partner`` is the name of another of which only the product with this one counts, if any.

    Examples
    --------
    A force from friction and load, of which only the product counts:

    >>> import numpy as np
    >>> from wear.fitting import FitProblem, Series, Unknown, fit
    >>> force = FitProblem(
    ...     unknowns=(Unknown("friction", lower=0.0), Unknown("load", lower=0.0)),
    ...     series=(Series("force", np.array([30.1, 29.8, 30.0])),),
    ...     predict=lambda values: np.full(3, values[0] * values[1]),
    ...     starts=[np.array([0.5, 50.0])],
    ... )
    >>> friction, load = fit(force).estimates
    >>> print(friction.determined, "-", friction.doubt)
    False - only its product with load counts
    """

    name: str
    value: float
    deviation: float
    bounds: tuple[float, float]
    doubt: str
    shares: Array
    heaviest: int
    heaviest_share: float
    logarithmic: bool
    quantile: float
    straight: bool = True
    partner: str = ""

    @property
    def determined(self) -> bool:
        """Whether the data tell it."""
        return not self.doubt


def inverse_of(jacobian: Array) -> tuple[Array, Array]:
    """Pseudo-inverse ``(p, n)``, and shares ``(p,)`` of each parameter in what nothing decides."""
    lengths = np.linalg.norm(jacobian, axis=0)
    scale = np.where(lengths > 0.0, lengths, 1.0)
    left, singular, right = np.linalg.svd(jacobian / scale, full_matrices=False)
    told = singular > RANK * max(singular.max(), np.finfo(float).tiny)
    inverse = (right[told].T / singular[told]) @ left[:, told].T / scale[:, None]
    return inverse, np.asarray(1.0 - np.sum(right[told] ** 2, axis=0))


def estimate_at(
    problem: FitProblem,
    place: int,
    values: Array,
    inverse: Array,
    kernel: Array,
    held: Mask,
    jacobian: Array,
    quantile: float,
) -> Estimate:
    """What is known of the parameter at a ``place``."""
    unknown, terms = problem.unknowns[place], inverse[place] ** 2
    total = float(terms.sum())
    shares = np.array([terms[problem.places == k].sum() for k in range(len(problem.series))])
    value, deviation = float(values[place]), float(np.sqrt(total))
    if unknown.logarithmic:
        factor = float(np.exp(min(quantile * deviation, 700.0)))
        bounds, deviation = (value / factor, value * factor), value * deviation
    else:
        bounds = value - quantile * deviation, value + quantile * deviation
    doubt = _doubt(problem, place, values, kernel, held, jacobian)
    if not doubt:
        doubt = width_doubt(unknown, value, bounds)
    if doubt:
        deviation, bounds = np.nan, (np.nan, np.nan)
    heaviest = int(np.argmax(terms))
    products = [name for name, how in _together(problem, place, values, jacobian) if how == PRODUCT]
    return Estimate(
        name=unknown.name,
        value=value,
        deviation=deviation,
        bounds=bounds,
        doubt=doubt,
        shares=shares / total if total > 0.0 else shares,
        heaviest=heaviest,
        heaviest_share=float(terms[heaviest]) / total if total > 0.0 else 0.0,
        logarithmic=unknown.logarithmic,
        quantile=quantile,
        partner=products[0] if products and kernel[place] > ALIKE and not held[place] else "",
    )


def width_doubt(unknown: Unknown, value: float, bounds: tuple[float, float]) -> str:
    """Why bounds are too wide to tell anything, empty if they are not."""
    lower, upper = bounds
    if unknown.logarithmic:
        within = upper <= value * np.exp(DECADE) and lower >= value / np.exp(DECADE)
        return "" if within else "known no better than to a decade"
    if max(upper - value, value - lower) > max(abs(value), unknown.size):
        return "known no better than to its own size"
    return ""


def led_astray(alone: Sequence[Estimate], place: int, covariance: Array) -> Estimate:
    """The estimate at a ``place``; none where it follows one that is not determined.

    Over so wide a range the model bends, and linear bounds of what goes with it are wrong.
    """
    estimate, spread = alone[place], np.sqrt(np.diag(covariance))
    for k, other in enumerate(alone):
        tied = abs(covariance[place, k]) > FOLLOWS * spread[place] * spread[k]
        if estimate.determined and not other.determined and tied:
            doubt = f"goes with {other.name}, which is not determined"
            return replace(estimate, deviation=np.nan, bounds=(np.nan, np.nan), doubt=doubt)
    return estimate


def _doubt(
    problem: FitProblem, place: int, values: Array, kernel: Array, held: Mask, jacobian: Array
) -> str:
    """Why a parameter is not determined, empty if it is."""
    unknown = problem.unknowns[place]
    if held[place]:
        lower = values[place] - unknown.lower <= unknown.upper - values[place]
        return f"at its {'lower' if lower else 'upper'} bound"
    if kernel[place] <= ALIKE:
        return ""
    lengths = np.linalg.norm(jacobian, axis=0)
    if lengths[place] == 0.0:
        return "the data do not depend on it"
    tied = (kernel > ALIKE) & (lengths > 0.0)
    others = [problem.unknowns[k].name for k in np.flatnonzero(tied) if k != place]
    for name, how in _together(problem, place, values, jacobian):
        return f"only its {how} {name} counts"
    return f"only together with {', '.join(others)}"


def _together(
    problem: FitProblem, place: int, values: Array, jacobian: Array
) -> list[tuple[str, str]]:
    """Others of which only product or quotient with the one at a ``place`` counts, and which."""
    relative = jacobian * np.where(problem.logarithmic, 1.0, values)
    length = float(np.linalg.norm(relative[:, place]))
    pairs = []
    for k, other in enumerate(problem.unknowns):
        for sign, how in ((1.0, PRODUCT), (-1.0, QUOTIENT)):
            apart = np.linalg.norm(relative[:, place] - sign * relative[:, k])
            if k != place and length > 0.0 and apart <= ALIKE * length:
                pairs.append((other.name, how))
    return pairs
