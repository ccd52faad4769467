"""Exact steps of a linear structure x' = A x + b f under forces that change linearly in a step.

    x_end = e x + W0 f_start + W1 f_end,   e = exp(hA),
    W1 = h φ2(hA) b,   W0 = h (φ1 - φ2)(hA) b,   φ1(z) = (e^z - 1)/z,   φ2(z) = (e^z - 1 - z)/z²

(Al-Mohy and Higham 2011, doi:10.1137/100788860, section 2, for these functions). They are summed as
series of a short step, which is then doubled again and again,

    φ2(2z) = (φ1(z)² + 2 φ2(z))/4,   φ1(2z) = (e^z + 1) φ1(z)/2,   e^2z = (e^z)²,

so that steps of h, h/4, h/16, ... come at the price of one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array

# Norm of hA up to which the series is summed, and its terms: what is left out is rounding.
SHORT, TERMS = 0.5, 13
# Each level halves a step twice.
SPLIT = 4


@dataclass(frozen=True)
class LinearSteps:
    """Of ``s`` structures steps h, h/4, h/16, ... of ``l`` levels.

    ``forward`` ``(s, l, k, k)`` e, ``by_start`` and ``by_end`` ``(s, l, k, m)`` W0 and W1.
    """

    forward: Array
    by_start: Array
    by_end: Array


def linear_steps(rates: Array, inputs: Array, longest: float, levels: int) -> LinearSteps:
    """Steps of so many levels, the first the ``longest`` [s], of structures A = ``rates``
    ``(s, k, k)`` and b = ``inputs`` ``(k, m)``."""
    shortest = longest / SPLIT ** (levels - 1)
    needed = shortest * float(np.abs(rates).sum(axis=2).max())
    extra = max(0, int(np.ceil(np.log2(needed / SHORT)))) if needed > SHORT else 0
    one = np.eye(rates.shape[1])
    scaled = rates * (shortest / 2.0**extra)
    second = np.broadcast_to(one / TERMS, scaled.shape)
    for term in range(TERMS - 1, 1, -1):
        # Horner's rule on φ2 = 1/2! + z/3! + ...
        second = (one + scaled @ second) / term
    first = one + scaled @ second
    whole = one + scaled @ first
    forward, by_start, by_end = [], [], []
    for doubling in range(extra + 2 * (levels - 1) + 1):
        beyond = doubling - extra
        if beyond >= 0 and beyond % 2 == 0:
            length = shortest * 2.0**beyond
            of_end = length * (second @ inputs)
            forward.append(whole)
            by_start.append(length * (first @ inputs) - of_end)
            by_end.append(of_end)
        second = 0.25 * (first @ first + 2.0 * second)
        first = 0.5 * (whole @ first + first)
        whole = whole @ whole
    return LinearSteps(*(np.stack(each[::-1], axis=1) for each in (forward, by_start, by_end)))
