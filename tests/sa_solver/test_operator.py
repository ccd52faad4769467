"""Influence coefficients and their convolution: closed form, direct summation, symmetry."""

import numpy as np
import pytest

from sa_solver.convolution import (
    FftwTransform,
    HalfSpaceConvolution,
    HalfSpacePreconditioner,
    HalfSpaceResolvent,
    ScipyTransform,
)
from sa_solver.influence import normal_influence
from sa_solver.types import Grid

GRID = Grid((12, 7), (0.3, 0.5))
MODULUS = 62.8e3


def dense_operator(grid, modulus):
    """K as a matrix, from Love's coefficients alone."""
    x, y = (np.broadcast_to(c, grid.shape).ravel() for c in (grid.x, grid.y))
    return normal_influence(x[:, None] - x, y[:, None] - y, grid.pitch, modulus)


def test_centre_of_a_square():
    """Johnson eq. 3.26: at the centre of a square of side s, u = 4 ln(1+√2) s p / (π E*)."""
    centre = normal_influence(np.zeros(1), np.zeros(1), (1.0, 1.0), MODULUS)[0]
    assert centre == pytest.approx(4.0 * np.log(1.0 + np.sqrt(2.0)) / (np.pi * MODULUS), rel=1e-14)


def test_far_away_it_is_a_point_force():
    """Boussinesq: u = P / (π E* r); the rectangle differs by O(pitch/r)²."""
    x, y = np.array([30.0]), np.array([-40.0])
    far = normal_influence(x, y, (0.1, 0.2), MODULUS)[0]
    assert far == pytest.approx(0.02 / (np.pi * MODULUS * 50.0), rel=1e-5)


def test_finite_on_corners_and_edges():
    edge = normal_influence(np.array([0.5, 0.5, 0.0]), np.array([0.5, 0.0, 0.5]), (1.0, 1.0), 1.0)
    assert np.all(np.isfinite(edge))
    assert edge[1] == pytest.approx(edge[2], rel=1e-14)


def test_a_rectangle_is_the_sum_of_its_halves():
    x, y = np.array([0.7]), np.array([0.2])
    whole = normal_influence(x, y, (1.0, 1.0), 1.0)
    halves = sum(normal_influence(x + s, y, (0.5, 1.0), 1.0) for s in (-0.25, 0.25))
    assert whole == pytest.approx(halves, rel=1e-13)


def test_convolution_is_direct_summation():
    pressure = np.random.default_rng(1).random(GRID.shape)
    convolution = HalfSpaceConvolution(GRID, MODULUS)
    direct = (dense_operator(GRID, MODULUS) @ pressure.ravel()).reshape(GRID.shape)
    np.testing.assert_allclose(convolution.displacement(pressure), direct, rtol=1e-12)
    assert convolution.count == 1


def test_reciprocity():
    """Betti: the work of p1 on the displacement of p2 is that of p2 on that of p1."""
    rng = np.random.default_rng(2)
    first, second = rng.random((2, *GRID.shape))
    convolution = HalfSpaceConvolution(GRID, MODULUS)
    work = np.vdot(first, convolution.displacement(second))
    assert work == pytest.approx(np.vdot(second, convolution.displacement(first)), rel=1e-13)


def test_mirrored_load_gives_mirrored_displacement():
    pressure = np.random.default_rng(3).random(GRID.shape)
    convolution = HalfSpaceConvolution(GRID, MODULUS)
    mirrored = convolution.displacement(np.ascontiguousarray(pressure[::-1, ::-1]))[::-1, ::-1]
    np.testing.assert_allclose(mirrored, convolution.displacement(pressure), rtol=1e-12)


@pytest.mark.parametrize("padded", [(23, 13), (24, 14), (12, 7)])
def test_fftw_and_scipy_agree(padded):
    pytest.importorskip("pyfftw")
    rng = np.random.default_rng(4)
    field, symbol = rng.random(GRID.shape), rng.random((padded[0], padded[1] // 2 + 1))
    fftw, scipy_ = (kind(GRID.shape, padded) for kind in (FftwTransform, ScipyTransform))
    expected = scipy_.filter(field, symbol)
    np.testing.assert_allclose(fftw.filter(field, symbol), expected, rtol=0, atol=1e-13)


def test_repeated_plans_give_the_same_bits():
    pressure = np.random.default_rng(5).random(GRID.shape)
    fields = [HalfSpaceConvolution(GRID, MODULUS).displacement(pressure) for _ in range(2)]
    assert np.array_equal(*fields)


@pytest.mark.parametrize(
    "grid", [GRID, Grid((64, 64), (1.0, 1.0)), Grid((16, 128), (1.0, 0.05)), Grid((1, 9), (1, 1))]
)
def test_symbol_is_positive(grid):
    """Otherwise neither the resolvent nor the preconditioner would be positive definite."""
    assert HalfSpaceConvolution(grid, MODULUS).symbol.min() > 0.0


def test_resolvent_inverts_the_circulant():
    convolution = HalfSpaceConvolution(GRID, MODULUS)
    shift = 0.1 * convolution.symbol.max()
    resolvent = HalfSpaceResolvent(convolution, shift)
    pressure = np.random.default_rng(6).random(resolvent.padded)
    back = ScipyTransform(resolvent.padded, resolvent.padded)
    displacement = back.filter(pressure, convolution.symbol + shift)
    np.testing.assert_allclose(resolvent.solve(displacement), pressure, rtol=1e-12)


@pytest.mark.parametrize("largest", [None, 1e-6, 1e-2])
def test_preconditioner_is_symmetric_positive_definite(largest):
    """Conjugate gradients need it, with one level of compliance or several."""
    preconditioner = HalfSpacePreconditioner(GRID, MODULUS)
    if largest is not None:
        preconditioner.include(largest * np.linspace(0.0, 1.0, 84).reshape(GRID.shape))
    basis = np.eye(84).reshape(84, *GRID.shape)
    matrix = np.array([preconditioner.apply(column).ravel() for column in basis])
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-12 * np.abs(matrix).max())
    assert np.linalg.eigvalsh(matrix).min() > 0.0
