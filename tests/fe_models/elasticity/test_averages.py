"""Combinations of displacements that change no mean: complete, orthonormal and sparse."""

import numpy as np
import pytest

from fe_models.loads.averages import GROUP, leaving_means
from fe_models.loads.constraints import Constraints
from fe_models.loads.rigid_motions import rigid_motions


@pytest.mark.parametrize("nodes", [2, 7, 60, 250])
def test_all_combinations_that_leave_the_means(nodes):
    rng = np.random.default_rng(nodes)
    points = rng.random((nodes, 3)) * [3.0, 2.0, 0.0]
    weights = np.repeat(rng.random(nodes), 3)
    means = (rigid_motions(points - [5.0, 1.0, 2.0]) * weights[:, None]).T
    basis = leaving_means(means, np.repeat(points, 3, axis=0))
    rank = np.linalg.matrix_rank(means)
    assert basis.shape == (3 * nodes, 3 * nodes - rank)
    gram = (basis.T @ basis).toarray()
    np.testing.assert_allclose(gram, np.eye(len(gram)), atol=1e-12)
    np.testing.assert_allclose(means @ basis, 0.0, atol=1e-11)
    levels = max(0, np.ceil(np.log2(3 * nodes / GROUP)))
    assert basis.nnz <= 3 * nodes * (GROUP + 6 * levels + 6)


def test_equal_means_count_once():
    points = np.random.default_rng(0).random((40, 3))
    means = np.random.default_rng(1).random((2, 40))
    means = np.append(means, means.sum(axis=0, keepdims=True), axis=0)
    basis = leaving_means(means, points)
    assert basis.shape == (40, 38)
    np.testing.assert_allclose(means @ basis, 0.0, atol=1e-13)


def test_constraints_next_to_means():
    """Check means with held and rigid nodes before, and sliding ones after.

    The means stay zero, and the free displacements are found again.
    """
    rng = np.random.default_rng(2)
    points = rng.random((50, 3))
    constraints = Constraints(50)
    constraints.hold(np.arange(5))
    constraints.follow(np.arange(10, 20), rigid_motions(points[10:20]))
    forces = rng.random((2, 150))
    constraints.no_work(forces, points)
    constraints.slide(np.array([7]), np.array([[1.0, 2.0, 3.0]]))
    t = constraints.transformation()
    assert t.shape == (150, 150 - 15 - 2 - 1 - 24)
    np.testing.assert_allclose(forces @ t, 0.0, atol=1e-12)
    assert not t[:15].nnz
    np.testing.assert_allclose([1.0, 2.0, 3.0] @ t[21:24], 0.0, atol=1e-13)
    motions = rigid_motions(points[10:20])
    moved = t[30:60].toarray()
    fit = motions @ np.linalg.lstsq(motions, moved, rcond=None)[0]
    np.testing.assert_allclose(fit, moved, atol=1e-12)
    assert np.linalg.matrix_rank(t.toarray()) == t.shape[1]
    free = rng.random(t.shape[1])
    if not np.isin(21 + np.arange(3), constraints.free).all():
        np.testing.assert_allclose(
            constraints.transformation() @ constraints.values(t @ free), t @ free
        )


def test_free_displacements_of_what_constraints_allow():
    rng = np.random.default_rng(3)
    constraints = Constraints(50)
    constraints.hold(np.arange(5))
    constraints.no_work(rng.random((3, 150)), rng.random((50, 3)))
    t = constraints.transformation()
    free = rng.random((t.shape[1], 2))
    np.testing.assert_allclose(constraints.values(t @ free), free, atol=1e-13)
