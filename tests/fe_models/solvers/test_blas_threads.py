"""One thread of OpenBLAS for small matrices, and the previous number afterwards."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from fe_models.solvers.blas_threads import SMALL, one_thread


def _numbers() -> list[int]:
    openblas = [library for library in threadpool_info() if library["internal_api"] == "openblas"]
    return [library["num_threads"] for library in openblas]


def test_one_thread_within_and_as_many_as_before_after():
    before = _numbers()
    if not before:
        pytest.skip("NumPy and SciPy have no OpenBLAS")
    with one_thread(SMALL):
        assert _numbers() == [1] * len(before)
        with one_thread(), pytest.raises(np.linalg.LinAlgError):
            np.linalg.inv(np.zeros((2, 2)))
        assert _numbers() == [1] * len(before)
    assert _numbers() == before
