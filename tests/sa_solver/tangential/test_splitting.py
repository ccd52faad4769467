"""Contact laws, and the splitting against independent solvers of small dense problems."""

import itertools
from functools import partial

import numpy as np
import pytest

from sa_solver.contact_law import coulomb, project_on_disk, unilateral
from sa_solver.splitting import AndersonMemory, douglas_rachford


def test_unilateral_pressure():
    assert np.array_equal(unilateral(np.array([-1.0, 0.0, 2.0])), [0.0, 0.0, 2.0])


def test_shear_is_scaled_back_along_its_direction():
    shear = np.array([[3.0, 0.3, 0.0, 1.0], [4.0, 0.4, 0.0, 0.0]])
    out = project_on_disk(shear, np.array([1.0, 1.0, 0.0, -1.0]))
    np.testing.assert_allclose(out, [[0.6, 0.3, 0.0, 0.0], [0.8, 0.4, 0.0, 0.0]], rtol=1e-15)


def test_projection_is_the_nearest_point():
    """None of many points of the disk is nearer."""
    rng = np.random.default_rng(0)
    shear, limit = 3.0 * rng.standard_normal((2, 50)), rng.random(50)
    nearest = np.linalg.norm(shear - project_on_disk(shear, limit), axis=0)
    for angle in np.linspace(0.0, 2.0 * np.pi, 100):
        other = limit * np.array([[np.cos(angle)], [np.sin(angle)]])
        assert np.all(np.linalg.norm(shear - other, axis=0) >= nearest - 1e-12)


def test_coulomb_separates_where_pressure_pulls():
    out = coulomb(np.array([[2.0, 2.0], [0.0, 0.0], [1.0, -1.0]]), 0.5)
    np.testing.assert_allclose(out, [[0.5, 0.0], [0.0, 0.0], [1.0, 0.0]])


def linear_complementarity(size, seed):
    """Return a random positive definite LCP: w = A z + q, z >= 0, w >= 0, z w = 0."""
    rng = np.random.default_rng(seed)
    factor = rng.standard_normal((size, size))
    return factor @ factor.T + 0.1 * np.eye(size), rng.standard_normal(size)


def enumerated(matrix, vector):
    """Return the unique solution, by trying every set of positive unknowns."""
    size = len(vector)
    for positive in itertools.product([False, True], repeat=size):
        mask = np.array(positive)
        z = np.zeros(size)
        z[mask] = np.linalg.solve(matrix[np.ix_(mask, mask)], -vector[mask])
        if z.min() >= 0.0 and (matrix @ z + vector)[~mask].min(initial=0.0) >= 0.0:
            return z
    raise AssertionError("no solution")


def unaccelerated(_, state, residual):
    """Return the next state of the splitting without acceleration."""
    return state + residual


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("accelerated", [False, True])
def test_small_complementarity_problem(seed, accelerated, monkeypatch):
    if not accelerated:
        monkeypatch.setattr(AndersonMemory, "next_state", unaccelerated)
    matrix, vector = linear_complementarity(8, seed)
    shift = np.sqrt(np.linalg.eigvalsh(matrix)[[0, -1]].prod())
    inverse = np.linalg.inv(matrix + shift * np.eye(8))
    result = douglas_rachford(
        lambda s: inverse @ (shift * s - vector),
        unilateral,
        np.zeros(8),
        tolerance=1e-11,
        max_iterations=20000,
    )
    assert result.converged
    np.testing.assert_allclose(result.solution, enumerated(matrix, vector), atol=1e-8)
    np.testing.assert_allclose(result.solution, result.elastic, atol=1e-8)


def test_acceleration_pays_and_a_warm_start_ends_at_once(monkeypatch):
    matrix, vector = linear_complementarity(60, 7)
    shift = np.sqrt(np.linalg.eigvalsh(matrix)[[0, -1]].prod())
    inverse = np.linalg.inv(matrix + shift * np.eye(60))

    def solve(start):
        return douglas_rachford(
            lambda s: (inverse @ (shift * s.ravel() - vector)).reshape(s.shape),
            unilateral,
            start,
            max_iterations=5000,
        )

    accelerated = solve(np.zeros((6, 10)))
    assert solve(accelerated.state).iterations == 1
    monkeypatch.setattr(AndersonMemory, "next_state", unaccelerated)
    assert accelerated.iterations < 0.5 * solve(np.zeros((6, 10))).iterations


def test_a_step_in_single_precision_ends_exact():
    """A step with changes since its refresh takes as many iterations and ends without error."""
    matrix, vector = linear_complementarity(60, 7)
    shift = np.sqrt(np.linalg.eigvalsh(matrix)[[0, -1]].prod())
    inverse = np.linalg.inv(matrix + shift * np.eye(60))
    known, rounded = np.zeros((2, 60)), inverse.astype(np.float32)
    refreshed = []

    def refresh(state):
        known[:] = state, inverse @ state
        refreshed.append(state)

    def near(state):
        image = known[1] + rounded @ (state - known[0]).astype(np.float32)
        return shift * image - inverse @ vector

    def exact(state):
        return inverse @ (shift * state - vector)

    solve = partial(douglas_rachford, local_law=unilateral, start=np.zeros(60), tolerance=1e-11)
    result, expected = solve(near, refresh=refresh), solve(exact)
    assert result.converged
    assert result.iterations <= 1.1 * expected.iterations
    assert 3 <= len(refreshed) <= 6
    np.testing.assert_allclose(result.elastic, exact(result.state), rtol=0, atol=1e-14)
    np.testing.assert_allclose(result.solution, expected.solution, rtol=0, atol=1e-9)


def test_failure_is_reported():
    matrix, vector = linear_complementarity(8, 0)
    inverse = np.linalg.inv(matrix + np.eye(8))
    result = douglas_rachford(
        lambda s: inverse @ (s - vector), unilateral, np.zeros(8), max_iterations=3
    )
    assert not result.converged
    assert result.residual > 1e-8
    assert result.iterations == 3


def test_free_motion_is_no_solution():
    """A constant residual moves the state on and is never taken for a small one."""
    push = np.full(5, 1e-3)
    result = douglas_rachford(lambda s: s - push, lambda trial: trial + 1.3 * push, np.zeros(5))
    assert not result.converged
    assert result.residual > 0.0
    assert np.abs(result.state).max() < 1.0


def test_what_is_thrown_far_off_has_not_converged():
    """A free body under a load is so far off that its steps are lost in its digits."""
    load = 1.0
    result = douglas_rachford(
        lambda s: s - load, lambda t: t, np.array([1e17]), scale=1.0, tolerance=1e-8
    )
    assert not result.converged
    assert result.residual == np.inf
