"""How far the finest rung of a ladder is from the limit that the ladder goes to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, log

from scipy.optimize import brentq

# Orders outside are no observation but chance: values that hardly converge, or agree by accident.
LOWEST_ORDER, HIGHEST_ORDER = 0.2, 6.0


@dataclass(frozen=True)
class Convergence:
    """What the last three rungs say of the last.

    ``order`` is the observed one, None where the values do not approach a limit in one direction;
    ``error`` estimates the distance of the last value from the limit, in its unit.
    """

    order: float | None
    error: float


def richardson(
    values: Sequence[float], steps: Sequence[float], order: float, noise: float = 0.0
) -> Convergence:
    """Convergence of the last of ``values``, found with steps that go to zero.

    f(h) = f(0) + C h^p through the last three rungs gives p, and |f(h) - f(0)| at the last one with
    p or ``order``, whichever is lower (Roache 1994, doi:10.1115/1.2910291; for steps in any ratio
    Celik et al. 2008, doi:10.1115/1.2960953). Where the three have no credible order but the last
    change is the smaller one, the error is that change: values that swing have their limit between
    the last two. Otherwise it is the largest difference of the three. Changes below ``noise`` are
    none. Two rungs say no more than their difference, and a single one nothing: infinite.
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
    """p with (h1^p - h2^p) / (h2^p - h3^p) = before / after, None if there is none."""
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
