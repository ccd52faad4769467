"""Comparisons that rounding must not decide.

A symmetric contact has two equal peaks, a load that is held is the same force at every increment,
and a stroke may be a tenth of a width to the last digit. What comes out larger is then a matter of
the processor.
"""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array

SAME = 1e-6
"""Values closer than this, relative to their size, are equal: solvers leave 1e-7 or less."""


def first_largest(values: Array) -> int:
    """Place, in the flattened ``values``, of the first that is as large as the largest."""
    largest = values.max()
    return int(np.argmax(values >= largest - SAME * abs(largest)))


def exceeds(value: float, limit: float) -> bool:
    """Whether ``value`` is larger than ``limit``, both 0 or more, and not equal to it."""
    return value > limit * (1.0 + SAME)
