"""Comparisons whose outcome must not depend on rounding."""

import numpy as np
import pytest

from sa_solver.ties import exceeds, first_largest


@pytest.mark.parametrize("off", [-1e-9, 0.0, 1e-9])
@pytest.mark.parametrize("size", [1e-20, 1.0, -3.0])
def test_of_equal_peaks_the_first_is_found(off, size):
    values = np.full((3, 4), size - abs(size))
    values[1, 2], values[2, 0] = size, size * (1.0 + off)
    assert first_largest(values) == 6


def test_of_unequal_peaks_the_larger_is_found():
    assert first_largest(np.array([1.0, 1.00001, 0.5])) == 1
    assert first_largest(np.array([-1.0, -2.0, 0.0])) == 2
    assert first_largest(np.zeros(3)) == 0


def test_equal_sizes_do_not_exceed_each_other():
    assert not exceeds(1.0 + 1e-9, 1.0)
    assert exceeds(1.00001, 1.0)
    assert exceeds(1e-300, 0.0)
    assert not exceeds(0.0, 0.0)
