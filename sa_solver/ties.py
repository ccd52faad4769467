"""Comparisons whose outcome must not depend on rounding.

A symmetric contact has two equal peaks, a constant load is the same force in every increment, and a
stroke may be exactly a tenth of a width. Which of two such values comes out larger would otherwise
depend on the processor.
"""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array

SAME = 1e-6
"""Relative difference below which values count as equal: errors of solvers are 1e-7 or less."""


def first_largest(values: Array) -> int:
    """Return the index, in the flattened ``values``, of the first that equals the largest."""
    largest = values.max()
    return int(np.argmax(values >= largest - SAME * abs(largest)))


def exceeds(value: float, limit: float) -> bool:
    """Return whether ``value`` is larger than ``limit`` by more than rounding.

    Both must be 0 or more.
    """
    return value > limit * (1.0 + SAME)
