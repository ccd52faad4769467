"""Approximate inverse for conjugate gradients: symmetry, exactness for periodic fields, use."""

import numpy as np
import pytest

from sa_solver.half_space.influence import Z, rectangle_influence
from sa_solver.half_space.operator import HalfSpace
from sa_solver.half_space.preconditioner import NormalPreconditioner
from sa_solver.types import ElasticPair, Grid, Material

TITANIUM = Material(115e3, 0.29)
PAIR = ElasticPair(TITANIUM, TITANIUM)
GRID = Grid((12, 7), (0.3, 0.5))
GRIDS = [GRID, Grid((9, 8), (0.1, 0.9)), Grid.line_contact(3.0, 24), Grid.line_contact(3.0, 25)]


def as_matrix(apply, grid):
    size = grid.shape[0] * grid.shape[1]
    basis = np.eye(size).reshape(size, *grid.shape)
    return np.array([apply(column).ravel() for column in basis]).T


def ramp(grid, largest):
    """Return a compliance from 0 to ``largest`` across the grid."""
    return largest * np.linspace(0.0, 1.0, grid.shape[0] * grid.shape[1]).reshape(grid.shape)


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("largest", [None, 1e-6, 1e-2])
def test_preconditioner_is_symmetric_positive_definite(grid, largest):
    """Conjugate gradients require it, with one level of compliance or several."""
    preconditioner = NormalPreconditioner(HalfSpace(grid, PAIR))
    if largest is not None:
        preconditioner.include(ramp(grid, largest))
    matrix = as_matrix(preconditioner.apply, grid)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-12 * np.abs(matrix).max())
    assert np.linalg.eigvalsh(matrix).min() > 0.0


@pytest.mark.parametrize("compliance", [None, 0.0, 1e-5])
def test_on_a_periodic_half_space_it_is_the_inverse(compliance):
    """The displacement is that of the nearest image, and the compliance is uniform.

    The lengths transform fast, so that there is no padding between the periods.
    """
    grid = Grid((12, 8), GRID.pitch)
    nearest = [
        np.fft.fftfreq(n, 1.0 / (n * d)) for n, d in zip(grid.shape, grid.pitch, strict=True)
    ]
    kernel = np.array(
        [
            [
                rectangle_influence(
                    x + 0.15 * np.array([-1, 1]), y + 0.25 * np.array([-1, 1]), PAIR, Z, Z
                )[0, 0]
                for y in nearest[1]
            ]
            for x in nearest[0]
        ]
    )
    pressure = np.random.default_rng(0).standard_normal(grid.shape)
    periodic = np.fft.ifft2(np.fft.fft2(kernel) * np.fft.fft2(pressure)).real
    preconditioner = NormalPreconditioner(HalfSpace(grid, PAIR))
    if compliance is not None:
        preconditioner.include(np.full(grid.shape, compliance))
        periodic = periodic + compliance * pressure
    recovered = preconditioner.apply(periodic)
    np.testing.assert_allclose(recovered, pressure, rtol=0, atol=1e-11)


def test_where_compliance_dominates_it_is_nearly_its_inverse():
    """1/D is interpolated linearly in ln D between three levels: the chord of a convex function."""
    compliance = np.geomspace(1.0, 100.0, 84).reshape(GRID.shape)
    preconditioner = NormalPreconditioner(HalfSpace(GRID, PAIR))
    preconditioner.include(compliance)
    ratio = compliance * preconditioner.apply(np.ones(GRID.shape))
    spacing = np.log(100.0) / 2.0
    drop = 1.0 - np.exp(-spacing)
    assert ratio.min() == pytest.approx(1.0, abs=1e-3)
    assert ratio.max() == pytest.approx(drop / spacing * np.exp(spacing / drop - 1.0), abs=1e-3)


def test_without_compliance_it_is_as_before_one_was_included():
    displacement = np.random.default_rng(1).standard_normal(GRID.shape)
    preconditioner = NormalPreconditioner(HalfSpace(GRID, PAIR))
    before = preconditioner.apply(displacement)
    preconditioner.include(ramp(GRID, 1e-2))
    assert not np.allclose(preconditioner.apply(displacement), before)
    preconditioner.include(None)
    assert np.array_equal(preconditioner.apply(displacement), before)


def test_it_needs_no_zero_padded_convolution():
    half_space = HalfSpace(GRID, PAIR)
    NormalPreconditioner(half_space).apply(np.ones(GRID.shape))
    assert half_space.count == 0


def condition(matrix):
    values = np.sort(np.linalg.eigvals(matrix).real)
    return values[-1] / values[0]


@pytest.mark.parametrize("largest", [None, 1e-4, 1e-2])
def test_it_leaves_a_condition_of_a_few(largest):
    """The condition number is 40 without compliance and thousands with it."""
    grid = Grid((20, 20), (0.1, 0.1))
    half_space = HalfSpace(grid, PAIR)
    matrix = as_matrix(half_space.normal, grid)
    preconditioner = NormalPreconditioner(half_space)
    if largest is not None:
        matrix += np.diag(ramp(grid, largest).ravel())
        preconditioner.include(ramp(grid, largest))
    preconditioned = as_matrix(preconditioner.apply, grid) @ matrix
    assert condition(matrix) > 30.0
    assert condition(preconditioned) < 10.0
