"""Exact time steps of a linear structure x' = A x + b f under piecewise linear forces.

    x_end = e x + W0 f_start + W1 f_end,   e = exp(hA),
    W1 = h φ2(hA) b,   W0 = h (φ1 - φ2)(hA) b,   φ1(z) = (e^z - 1)/z,   φ2(z) = (e^z - 1 - z)/z²

(Al-Mohy and Higham 2011, doi:10.1137/100788860, section 2, for these functions). A series gives
them for a short step, which is then doubled repeatedly,

    φ2(2z) = (φ1(z)² + 2 φ2(z))/4,   φ1(2z) = (e^z + 1) φ1(z)/2,   e^2z = (e^z)²,

so that steps of h, h/4, h/16, ... together cost as much as one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array

# Norm of hA up to which the series is summed, and number of its terms: the rest is below rounding.
SERIES_NORM, TERMS = 0.5, 13
# Ratio of the step lengths of two levels: two halvings.
SPLIT = 4


@dataclass(frozen=True)
class LinearSteps:
    """Exact steps of ``s`` structures for ``l`` step lengths h, h/4, h/16, ...

    ``forward`` ``(s, l, k, k)`` is e; ``by_start`` and ``by_end`` ``(s, l, k, m)`` are W0 and W1.
    """

    forward: Array
    by_start: Array
    by_end: Array


def linear_steps(rates: Array, inputs: Array, longest: float, levels: int) -> LinearSteps:
    """Return exact steps of structures for a sequence of step lengths.

    Parameters
    ----------
    rates
        Matrices A ``(s, k, k)`` of ``s`` structures [1/s].
    inputs
        Matrix b ``(k, m)``.
    longest
        Longest step [s].
    levels
        Number of step lengths, each a quarter of the one before.
    """
    shortest = longest / SPLIT ** (levels - 1)
    largest_norm = shortest * float(np.abs(rates).sum(axis=2).max())
    extra_doublings = (
        max(0, int(np.ceil(np.log2(largest_norm / SERIES_NORM))))
        if largest_norm > SERIES_NORM
        else 0
    )
    identity = np.eye(rates.shape[1])
    scaled = rates * (shortest / 2.0**extra_doublings)
    phi2 = np.broadcast_to(identity / TERMS, scaled.shape)
    for term in range(TERMS - 1, 1, -1):
        # Horner's rule on φ2 = 1/2! + z/3! + ...
        phi2 = (identity + scaled @ phi2) / term
    phi1 = identity + scaled @ phi2
    exponential = identity + scaled @ phi1
    forward, by_start, by_end = [], [], []
    for doubling in range(extra_doublings + 2 * (levels - 1) + 1):
        level_doublings = doubling - extra_doublings
        if level_doublings >= 0 and level_doublings % 2 == 0:
            length = shortest * 2.0**level_doublings
            end_weights = length * (phi2 @ inputs)
            forward.append(exponential)
            by_start.append(length * (phi1 @ inputs) - end_weights)
            by_end.append(end_weights)
        phi2 = 0.25 * (phi1 @ phi1 + 2.0 * phi2)
        phi1 = 0.5 * (exponential @ phi1 + phi1)
        exponential = exponential @ exponential
    return LinearSteps(*(np.stack(each[::-1], axis=1) for each in (forward, by_start, by_end)))
