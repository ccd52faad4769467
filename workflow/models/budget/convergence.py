"""Error estimates from solutions of different fineness (Richardson extrapolation)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, log

from scipy.optimize import brentq

# Highest orders of convergence of depth and volume that estimates assume. The square-root end of a
# pressure keeps a grid from second order.
GRID_ORDER = MESH_ORDER = INCREMENTS_ORDER = 2.0
# An observed order outside these bounds is an accident: the values hardly converge, or agree by
# chance.
LOWEST_ORDER, HIGHEST_ORDER = 0.2, 6.0


@dataclass(frozen=True)
class Convergence:
    """Observed convergence order and estimated error of the finest solution of a series.

    ``order`` is None where the values do not approach a limit monotonically. ``error`` estimates
    the distance of the last value from the limit, in its unit.
    """

    order: float | None
    error: float


def share_of_difference(refinement: float, order: float) -> float:
    """Return the error of a solution, relative to its difference from a refined one.

    ``refinement`` is the ratio of their steps, below 1 for comparison with a coarser solution, and
    ``order`` their order of convergence.
    """
    return 1.0 / (1.0 - refinement**-order)


def richardson(
    values: Sequence[float], steps: Sequence[float], order: float, noise: float = 0.0
) -> Convergence:
    """Estimate the error of the last of ``values``, computed with ``steps`` that decrease to zero.

    The model f(h) = f(0) + C h^p through the last three values gives p. The error
    |f(h) - f(0)| at the last value uses the lower of p and ``order`` (Roache 1994,
    doi:10.1115/1.2910291; for steps in any ratio Celik et al. 2008, doi:10.1115/1.2960953).
    Without a credible order, the error is the last change if that is the smaller of the two
    changes, since oscillating values have their limit between the last two; otherwise it is the
    largest difference of the three values. Changes below ``noise`` count as zero. Two values give
    their difference as the error, a single value an infinite error.
    """
    if len(values) < 2:
        return Convergence(None, inf)
    last = abs(values[-1] - values[-2])
    if len(values) < 3:
        return Convergence(None, last)
    coarse, middle, fine = values[-3:]
    spread = max(coarse, middle, fine) - min(coarse, middle, fine)
    if spread <= noise:
        return Convergence(None, spread)
    observed = _order(coarse - middle, middle - fine, *steps[-3:])
    if observed is None:
        return Convergence(None, last if last < abs(coarse - middle) else spread)
    ratio = steps[-2] / steps[-1]
    return Convergence(observed, last / (ratio ** min(observed, order) - 1.0))


def _order(before: float, after: float, *steps: float) -> float | None:
    """Solve (h1^p - h2^p) / (h2^p - h3^p) = before / after for p; return None if impossible."""
    if after == 0.0 or before / after <= 0.0:
        return None
    wanted = log(before / after)
    h1, h2, h3 = (step / steps[-1] for step in steps)

    def excess(p: float) -> float:
        return log((h1**p - h2**p) / (h2**p - h3**p)) - wanted

    low, high = excess(LOWEST_ORDER), excess(HIGHEST_ORDER)
    if not (isfinite(low) and isfinite(high)) or low * high > 0.0:
        return None
    return float(brentq(excess, LOWEST_ORDER, HIGHEST_ORDER))
