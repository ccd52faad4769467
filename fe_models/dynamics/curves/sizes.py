"""Norms of small arrays of unknowns and residuals, and frequencies as unknowns."""

from __future__ import annotations

from math import isfinite, sqrt

import numpy as np

from sa_solver.types import Array

# Largest ratio of a frequency to its reference. If Newton's method goes farther it is lost, and
# must not overflow.
MAX_FREQUENCY_RATIO = 1e3


def norm(values: Array) -> float:
    """Return the Euclidean norm of all values; for few values in a quarter of numpy's time."""
    return sqrt(np.vdot(values, values))


def relative_norm(residual: Array, size: float) -> float:
    """Return the norm of a residual over ``size``; infinite if it is not finite."""
    residual_norm = norm(residual)
    if not isfinite(residual_norm):
        return np.inf
    return residual_norm / size if residual_norm > 0.0 else 0.0


def limited_frequency(reference: float, exponent: float) -> float:
    """Return a frequency exp(exponent) times its reference, up to :data:`MAX_FREQUENCY_RATIO`."""
    limit = np.log(MAX_FREQUENCY_RATIO)
    return float(reference * np.exp(np.clip(exponent, -limit, limit)))
