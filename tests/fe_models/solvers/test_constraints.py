"""Constraints: T u_free satisfies them all, and reaches every displacement that does."""

import numpy as np
import pytest

from fe_models.loads.constraints import Constraints
from sa_solver.errors import InputError

NODES = 6


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def spans_null_space(constraints, equations):
    """Return whether the columns of T are a basis of the solutions of ``equations @ u = 0``."""
    transformation = constraints.transformation().toarray()
    free = 3 * NODES - np.linalg.matrix_rank(equations)
    assert transformation.shape == (3 * NODES, free)
    assert np.linalg.matrix_rank(transformation) == free
    np.testing.assert_allclose(equations @ transformation, 0.0, atol=1e-13)


def row(entries):
    equation = np.zeros(3 * NODES)
    for dof, value in entries.items():
        equation[dof] += value
    return equation


def test_nothing_constrained_is_the_identity():
    transformation = Constraints(NODES).transformation()
    np.testing.assert_array_equal(transformation.toarray(), np.eye(3 * NODES))


def test_hold():
    constraints = Constraints(NODES)
    constraints.hold(np.array([1, 4]))
    spans_null_space(constraints, np.eye(3 * NODES)[[3, 4, 5, 12, 13, 14]])


@pytest.mark.parametrize("nodes", [[-1], [NODES], [0.5], [True, False], "all"])
def test_nodes_that_there_are_not(nodes):
    """Check that node numbers out of range, negative ones included, are refused."""
    with pytest.raises(InputError, match="nodes"):
        Constraints(NODES).hold(nodes)


def test_slide(rng):
    constraints = Constraints(NODES)
    normals = rng.standard_normal((3, 3))
    nodes = np.array([0, 2, 5])
    constraints.slide(nodes, normals)
    spans_null_space(
        constraints,
        np.array(
            [
                row({3 * n + k: normal[k] for k in range(3)})
                for n, normal in zip(nodes, normals, strict=True)
            ]
        ),
    )


def test_zero_mean(rng):
    constraints = Constraints(NODES)
    nodes, weights = np.array([0, 1, 3, 4]), 1.0 + rng.random(4)
    direction = np.array([0.6, 0.8, 0.0])
    constraints.zero_mean(nodes, weights, direction)
    equation = row(
        {3 * n + k: w * direction[k] for n, w in zip(nodes, weights, strict=True) for k in range(3)}
    )
    spans_null_space(constraints, equation[None])


def test_average():
    """Check that a node between its parents has the linear trace."""
    constraints = Constraints(NODES)
    constraints.average(np.array([2, 5]), np.array([[0, 1], [3, 4]]))
    equations = [
        row({3 * node + k: 1.0, 3 * a + k: -0.5, 3 * b + k: -0.5})
        for node, a, b in ((2, 0, 1), (5, 3, 4))
        for k in range(3)
    ]
    spans_null_space(constraints, np.array(equations))


@pytest.mark.parametrize("slide_first", [True, False])
def test_chain_of_constraints_is_followed_to_the_end(rng, slide_first):
    """Check node 5 between 4 and 3, 4 between 0 and 1, where 0 slides and 3 is held."""
    constraints = Constraints(NODES)
    normal = rng.standard_normal((1, 3))
    steps = [
        lambda: constraints.slide(np.array([0]), normal),
        lambda: constraints.average(np.array([5, 4]), np.array([[4, 3], [0, 1]])),
    ]
    for step in steps if slide_first else steps[::-1]:
        step()
    constraints.hold(np.array([3]))
    equations = [row({k: normal[0, k] for k in range(3)})]
    for k in range(3):
        equations.append(row({15 + k: 1.0, 12 + k: -0.5, 9 + k: -0.5}))
        equations.append(row({12 + k: 1.0, k: -0.5, 3 + k: -0.5}))
        equations.append(row({9 + k: 1.0}))
    spans_null_space(constraints, np.array(equations))


def test_first_support_wins():
    """Check that a held node on a sliding face stays held."""
    constraints = Constraints(NODES)
    constraints.hold(np.array([0]))
    constraints.slide(np.array([0, 1]), np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]))
    spans_null_space(constraints, np.eye(3 * NODES)[[0, 1, 2, 4]])


@pytest.mark.parametrize("second", [[0.0, 1.0, 0.0], [0.6, 0.8, 0.0], [0.1, 0.2, 0.3]])
def test_node_on_two_planes_moves_along_their_edge(second):
    constraints = Constraints(NODES)
    planes = np.array([[1.0, 0.0, 0.0], second])
    constraints.slide(np.array([2, 2]), planes)
    spans_null_space(constraints, np.hstack([np.zeros((2, 6)), planes, np.zeros((2, 9))]))


def test_three_planes_hold_a_node(rng):
    constraints = Constraints(NODES)
    constraints.slide(np.array([0, 0, 0, 0]), rng.standard_normal((4, 3)))
    spans_null_space(constraints, np.eye(3 * NODES)[:3])


def test_mean_over_nodes_that_are_constrained_in_part(rng):
    """Check that the equation of the mean still holds."""
    constraints = Constraints(NODES)
    constraints.hold(np.array([0]))
    normal = np.array([[0.0, 0.0, 1.0]])
    constraints.slide(np.array([1]), normal)
    constraints.zero_mean(np.array([0, 1, 2]), np.array([5.0, 3.0, 1.0]), normal[0])
    equations = [*np.eye(3 * NODES)[[0, 1, 2, 5]], row({2: 5.0, 5: 3.0, 8: 1.0})]
    spans_null_space(constraints, np.array(equations))
