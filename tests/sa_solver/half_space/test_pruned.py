"""Transforms of columns whose second half is zero, against numpy's transforms of whole columns."""

import numpy as np
import pytest

from sa_solver.transforms.pruned import LARGE, PARTS, PrunedColumns


@pytest.mark.parametrize(
    ("length", "rows"),
    [
        (256, 128),
        (256, 100),
        (512, 256),
        (512, 129),
        (1024, 512),
        (2048, 700),
        (512, 257),
        (300, 9),
    ],
)
def test_frequencies_and_back(length: int, rows: int):
    """The content of the padding does not matter; columns that are not split are tested as well."""
    rng = np.random.default_rng(length + rows)
    shape = length, LARGE // length + 1
    spectrum = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    given = spectrum[:rows].copy()
    columns = PrunedColumns(spectrum, rows)
    spectrum[:rows] = given
    columns.forward()
    expected = np.fft.fft(given, length, axis=0)[columns.order]
    np.testing.assert_allclose(spectrum, expected, rtol=0.0, atol=1e-13 * abs(expected).max())
    columns.backward()
    np.testing.assert_allclose(spectrum[:rows] / length, given, rtol=0.0, atol=1e-14)
    whole = rows > length // 2 or length not in PARTS
    assert whole == (columns.order[1] == 1)


def test_small_spectra_stay_whole():
    spectrum = np.zeros((256, 16), complex)
    assert PrunedColumns(spectrum, 128).order[1] == 1
