"""Transforms of zero-padded fields: FFTW, numpy and direct circular convolution agree."""

import subprocess
import sys

import numpy as np
import pytest

from sa_solver.transforms.padded import SpectralFilter, Transform

SHAPE = (12, 7)
PADDED = [(23, 13), (24, 14), (12, 7)]
ROUNDING = 1e-13


def kernel_and_symbol(padded, odd, rng):
    """Return a periodic kernel, even or odd along each axis, and its symbol without factors i."""
    kernel = rng.standard_normal(padded)
    for axis, sign in enumerate(-1.0 if o else 1.0 for o in odd):
        mirrored = np.roll(np.flip(kernel, axis), 1, axis)
        kernel = 0.5 * (kernel + sign * mirrored)
    spectrum = np.fft.rfft2(kernel)
    return kernel, -spectrum.imag if odd[0] != odd[1] else spectrum.real


def circular_convolution(kernel, field):
    """Return the circular convolution by direct summation, on the cells of the field."""
    total = np.zeros(kernel.shape)
    for (i, j), value in np.ndenumerate(field):
        total += value * np.roll(kernel, (i, j), (0, 1))
    return total[: field.shape[0], : field.shape[1]]


@pytest.mark.parametrize("padded", PADDED)
def test_forward_is_the_dft_and_backward_its_inverse(padded):
    fields = np.random.default_rng(0).standard_normal((3, *SHAPE))
    transform = Transform(SHAPE, padded, 3)
    for component, field in enumerate(fields):
        transform.forward(field, component)
    for component, field in enumerate(fields):
        spectrum = np.fft.rfft2(field, padded)
        np.testing.assert_allclose(transform.spectra[component], spectrum, atol=ROUNDING * 84)
    for component in (1, 0, 2):
        back = np.full(SHAPE, np.nan)
        transform.backward(component, back)
        np.testing.assert_allclose(back, fields[component], rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("padded", PADDED)
@pytest.mark.parametrize(("inputs", "outputs"), [(1, 1), (2, 2), (3, 3), (1, 2), (2, 1)])
def test_a_filter_multiplies_spectra_as_numpy_does(padded, inputs, outputs):
    rng = np.random.default_rng(4)
    fields = rng.random((inputs, *SHAPE))
    symbols = rng.random((outputs, inputs, padded[0], padded[1] // 2 + 1))
    result = SpectralFilter(Transform(SHAPE, padded, max(inputs, outputs)), symbols).apply(fields)
    product = np.einsum("oixy,ixy->oxy", symbols, np.fft.rfft2(fields, padded))
    expected = np.fft.irfft2(product, padded)[:, : SHAPE[0], : SHAPE[1]]
    assert result.shape == (outputs, *SHAPE)
    np.testing.assert_allclose(result, expected, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("padded", PADDED)
def test_a_filter_is_a_circular_convolution_of_all_components(padded):
    """Two even components, and one that couples to them through odd kernels."""
    rng = np.random.default_rng(7)
    odd = [[(0, 0), (1, 1), (1, 0)], [(1, 1), (0, 0), (0, 1)], [(1, 0), (0, 1), (0, 0)]]
    kernels, symbols = zip(
        *(zip(*(kernel_and_symbol(padded, o, rng) for o in row), strict=True) for row in odd),
        strict=True,
    )
    fields = rng.standard_normal((3, *SHAPE))
    # In units of i, outputs 0 and 1 have symbols S/i for input 2, and output 2 has S i for them.
    signs = np.array([[1, 1, 1], [1, 1, 1], [-1, -1, 1]])
    expected = np.array(
        [
            sum(
                sign * circular_convolution(kernel, field)
                for sign, kernel, field in zip(*row, fields, strict=True)
            )
            for row in zip(signs, kernels, strict=True)
        ]
    )
    filter_ = SpectralFilter(Transform(SHAPE, padded, 3), symbols, ((2,), (2,)))
    np.testing.assert_allclose(filter_.apply(fields), expected, rtol=0, atol=1e-11)


def test_a_symbol_that_serves_twice_is_that_of_both_places():
    rng = np.random.default_rng(8)
    fields, (a, b, d) = rng.random((2, *SHAPE)), rng.random((3, 24, 8))
    once, apart = (
        SpectralFilter(Transform(SHAPE, (24, 14), 2), [[a, b], [other, d]]).apply(fields)
        for other in (b, b.copy())
    )
    assert np.array_equal(once, apart)


@pytest.mark.parametrize("components", [1, 3])
def test_repeated_plans_and_calls_give_the_same_bits(components):
    rng = np.random.default_rng(5)
    fields, symbols = rng.random((components, *SHAPE)), rng.random((components, components, 24, 8))
    results = []
    for _ in range(2):
        filter_ = SpectralFilter(Transform(SHAPE, (24, 14), components), symbols)
        results += [filter_.apply(fields), filter_.apply(fields)]
    assert all(np.array_equal(results[0], other) for other in results[1:])


def test_a_filter_leaves_its_input_and_earlier_output_alone():
    rng = np.random.default_rng(6)
    fields, symbol = rng.random((2, 1, *SHAPE)), rng.random((24, 8))
    filter_ = SpectralFilter(Transform(SHAPE, (24, 14)), [[symbol]])
    given, output = fields.copy(), filter_.apply(fields[0])
    kept = output.copy()
    filter_.apply(fields[1])
    assert np.array_equal(fields, given)
    assert np.array_equal(output, kept)


@pytest.mark.parametrize("before", ["", "from fe_models.solvers.pardiso import library; library()"])
def test_a_transform_is_that_of_fftw_whatever_is_loaded_before_it(before):
    """The functions of the same names in MKL have a different rounding."""
    shape, padded = (100, 30), (256, 64)
    code = f"""{before}
import sys
import numpy as np
from sa_solver.transforms.padded import Transform
transform = Transform({shape}, {padded})
transform.forward(np.random.default_rng(0).standard_normal({shape}), 0)
sys.stdout.buffer.write(transform.spectra[0].tobytes())
"""
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout
    transform = Transform(shape, padded)
    transform.forward(np.random.default_rng(0).standard_normal(shape), 0)
    assert output == transform.spectra[0].tobytes()
