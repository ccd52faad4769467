"""Estimate of each parameter: deviation, bounds, shares, or why it is not determined.

Near the solution an estimate is a linear combination A of the data. Its variance is the sum of
(A_ji σ_i)² over the data, and the shares of these terms show which data determine a parameter.
Parameters that are not determined are found by the singular values of the Jacobian, with columns
scaled to length 1, and by bounds that are wider than the parameter itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sa_solver.types import Array, Mask
from wear.fitting.problem import FitProblem, FreeParameter

RANK = 1e-6
"""Share of the largest singular value of the Jacobian below which a singular value counts as 0. The
noise of central differences is 1e-9."""

ALIKE = 1e-5
"""Relative difference below which two columns of the Jacobian, for relative changes of their
parameters, are equal: only the product of the parameters matters."""

PRODUCT, QUOTIENT = "product with", "quotient by"

DECADE = float(np.log(10.0))
"""Uncertainty of a logarithm, a decade, above which the parameter is not determined."""

FOLLOWS = 0.95
"""Correlation above which a parameter is tied to another."""


@dataclass(frozen=True)
class Estimate:
    """Estimate of one parameter.

    Attributes
    ----------
    name
        Name of the unknown.
    value
        Best value.
    deviation, bounds
        Standard deviation and 95 % bounds, NaN if the parameter is not determined. The deviation of
        a logarithmic parameter is its value times that of the logarithm.
    caveat
        Reason why the parameter is not determined, empty if it is.
    shares
        Shares of the series in the variance ``(k,)``, which add up to 1.
    heaviest, heaviest_share
        Index of the datum with the largest share, and this share.
    logarithmic
        Whether the logarithm was fitted.
    quantile
        Factor from the deviation to linear bounds.
    straight
        Whether the bounds are linear. Where the model is not linear within them, they are those of
        the profile (:mod:`wear.fitting.profiles`).
    partner
        Name of a parameter of which only the product with this one matters, if any.

    Examples
    --------
    A force from friction and load, of which only the product matters:

    >>> import numpy as np
    >>> from wear.fitting import FitProblem, Series, FreeParameter, fit
    >>> force = FitProblem(
    ...     unknowns=(FreeParameter("friction", lower=0.0), FreeParameter("load", lower=0.0)),
    ...     series=(Series("force", np.array([30.1, 29.8, 30.0])),),
    ...     predict=lambda values: np.full(3, values[0] * values[1]),
    ...     starts=[np.array([0.5, 50.0])],
    ... )
    >>> friction, load = fit(force).estimates
    >>> print(friction.determined, "-", friction.caveat)
    False - only its product with load counts
    """

    name: str
    value: float
    deviation: float
    bounds: tuple[float, float]
    caveat: str
    shares: Array
    heaviest: int
    heaviest_share: float
    logarithmic: bool
    quantile: float
    straight: bool = True
    partner: str = ""

    @property
    def determined(self) -> bool:
        """True if the data determine the parameter."""
        return not self.caveat


def inverse_of(jacobian: Array) -> tuple[Array, Array]:
    """Return the pseudoinverse ``(p, n)`` of a Jacobian, and the undetermined share ``(p,)``.

    The undetermined share of a parameter is its part in directions that the data do not determine.
    """
    lengths = np.linalg.norm(jacobian, axis=0)
    scale = np.where(lengths > 0.0, lengths, 1.0)
    left, singular, right = np.linalg.svd(jacobian / scale, full_matrices=False)
    significant = singular > RANK * max(singular.max(), np.finfo(float).tiny)
    scaled = right[significant].T / singular[significant]
    inverse = scaled @ left[:, significant].T / scale[:, None]
    return inverse, np.asarray(1.0 - np.sum(right[significant] ** 2, axis=0))


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
    """Return the estimate of the parameter with the index ``place``.

    Parameters
    ----------
    problem
        Problem that was fitted.
    place
        Index of the parameter.
    values
        Values of all parameters ``(p,)``.
    inverse, kernel
        Result of :func:`inverse_of` for the Jacobian.
    held
        Parameters that a bound holds ``(p,)``.
    jacobian
        Jacobian of the residuals over their deviations ``(n, p)``.
    quantile
        Factor from the deviation to linear bounds.
    """
    unknown, terms = problem.unknowns[place], inverse[place] ** 2
    total = float(terms.sum())
    shares = np.array([terms[problem.places == k].sum() for k in range(len(problem.series))])
    value, deviation = float(values[place]), float(np.sqrt(total))
    if unknown.logarithmic:
        factor = float(np.exp(min(quantile * deviation, 700.0)))
        bounds, deviation = (value / factor, value * factor), value * deviation
    else:
        bounds = value - quantile * deviation, value + quantile * deviation
    caveat = _why_undetermined(problem, place, values, kernel, held, jacobian)
    if not caveat:
        caveat = why_too_wide(unknown, value, bounds)
    if caveat:
        deviation, bounds = np.nan, (np.nan, np.nan)
    heaviest = int(np.argmax(terms))
    partners = _partners(problem, place, values, jacobian)
    products = [name for name, relation in partners if relation == PRODUCT]
    return Estimate(
        name=unknown.name,
        value=value,
        deviation=deviation,
        bounds=bounds,
        caveat=caveat,
        shares=shares / total if total > 0.0 else shares,
        heaviest=heaviest,
        heaviest_share=float(terms[heaviest]) / total if total > 0.0 else 0.0,
        logarithmic=unknown.logarithmic,
        quantile=quantile,
        partner=products[0] if products and kernel[place] > ALIKE and not held[place] else "",
    )


def why_too_wide(unknown: FreeParameter, value: float, bounds: tuple[float, float]) -> str:
    """Return why bounds are too wide for a determined parameter, or an empty text."""
    lower, upper = bounds
    if unknown.logarithmic:
        within = upper <= value * np.exp(DECADE) and lower >= value / np.exp(DECADE)
        return "" if within else "known no better than to a decade"
    if max(upper - value, value - lower) > max(abs(value), unknown.size):
        return "known no better than to its own size"
    return ""


def checked_for_ties(alone: Sequence[Estimate], place: int, covariance: Array) -> Estimate:
    """Return the estimate at ``place``, marked if it is tied to an undetermined parameter.

    Over the wide range of the other parameter the model is not linear, so that linear bounds of the
    tied parameter are wrong.
    """
    estimate, spread = alone[place], np.sqrt(np.diag(covariance))
    for k, other in enumerate(alone):
        tied = abs(covariance[place, k]) > FOLLOWS * spread[place] * spread[k]
        if estimate.determined and not other.determined and tied:
            caveat = f"goes with {other.name}, which is not determined"
            return replace(estimate, deviation=np.nan, bounds=(np.nan, np.nan), caveat=caveat)
    return estimate


def _why_undetermined(
    problem: FitProblem, place: int, values: Array, kernel: Array, held: Mask, jacobian: Array
) -> str:
    """Return why a parameter is not determined, or an empty text."""
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
    for name, relation in _partners(problem, place, values, jacobian):
        return f"only its {relation} {name} counts"
    return f"only together with {', '.join(others)}"


def _partners(
    problem: FitProblem, place: int, values: Array, jacobian: Array
) -> list[tuple[str, str]]:
    """Return parameters of which only the product or quotient with that at ``place`` matters.

    Each is returned with this relation.
    """
    relative = jacobian * np.where(problem.logarithmic, 1.0, values)
    length = float(np.linalg.norm(relative[:, place]))
    pairs = []
    for k, other in enumerate(problem.unknowns):
        for sign, relation in ((1.0, PRODUCT), (-1.0, QUOTIENT)):
            difference = np.linalg.norm(relative[:, place] - sign * relative[:, k])
            if k != place and length > 0.0 and difference <= ALIKE * length:
                pairs.append((other.name, relation))
    return pairs
