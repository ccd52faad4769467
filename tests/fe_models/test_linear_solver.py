"""Sparse solves and Schur complements, with PARDISO, without it, and when it errs."""

import numpy as np
import pytest
import scipy.sparse as sp

from fe_models import linear_solver
from fe_models.linear_solver import SolverError, factorise, schur_complement

SIZE = 120


@pytest.fixture
def rng():
    return np.random.default_rng(1)


@pytest.fixture
def matrix(rng):
    """Sparse, symmetric, positive definite."""
    random = sp.random(SIZE, SIZE, 0.05, random_state=rng, format="csr")
    return (random @ random.T + sp.diags(0.5 + rng.random(SIZE))).tocsr()


@pytest.fixture
def split(rng):
    """Unknowns kept, in no order, and the others."""
    kept = rng.permutation(SIZE)[:30]
    return kept, np.setdiff1d(np.arange(SIZE), kept)


@pytest.fixture(params=["pardiso", "superlu"])
def solver(request, monkeypatch):
    if request.param == "superlu":
        monkeypatch.setattr(linear_solver, "_load_pardiso", lambda: None)
    elif linear_solver._load_pardiso() is None:
        pytest.skip("pypardiso is not installed here")
    return request.param


def dense_schur(matrix, kept, inner):
    full = matrix.toarray()
    solved = np.linalg.solve(full[np.ix_(inner, inner)], full[np.ix_(inner, kept)])
    return full[np.ix_(kept, kept)] - full[np.ix_(kept, inner)] @ solved


def condensed(matrix, kept, inner):
    return schur_complement(matrix, kept, inner, factorise(matrix[inner][:, inner].tocsr()))


@pytest.mark.parametrize("columns", [None, 1, 5])
def test_solutions(matrix, rng, solver, columns):
    shape = (SIZE,) if columns is None else (SIZE, columns)
    rhs = rng.standard_normal(shape)
    solution = factorise(matrix)(rhs)
    assert solution.shape == shape
    np.testing.assert_allclose(solution, np.linalg.solve(matrix.toarray(), rhs), rtol=1e-9)


def test_schur_complement_follows_the_order_of_the_kept_unknowns(matrix, split, solver):
    assert np.any(np.diff(split[0]) < 0)
    expected = dense_schur(matrix, *split)
    result = condensed(matrix, *split)
    np.testing.assert_allclose(result, expected, atol=1e-12 * np.abs(expected).max())


def test_schur_complement_of_a_singular_matrix(rng, split, solver):
    """A floating body: K is singular, K_ii is not; constants are the null space of both."""
    pairs = np.stack([np.arange(SIZE - 1), np.arange(1, SIZE)])
    pairs = np.hstack([pairs, rng.integers(0, SIZE, (2, 200))])
    difference = sp.csr_matrix(
        (np.repeat([1.0, -1.0], pairs.shape[1]), (np.tile(np.arange(pairs.shape[1]), 2),
         pairs.ravel())), shape=(pairs.shape[1], SIZE)
    )  # fmt: skip
    matrix = (difference.T @ difference).tocsr()
    result = condensed(matrix, *split)
    np.testing.assert_allclose(result, dense_schur(matrix, *split), atol=1e-11)
    np.testing.assert_allclose(result.sum(axis=1), 0.0, atol=1e-11)


def test_pardiso_does_the_work_where_it_is_installed(matrix, split, monkeypatch):
    if linear_solver._load_pardiso() is None:
        pytest.skip("pypardiso is not installed here")

    def never(*_):
        raise AssertionError("fell back")

    monkeypatch.setattr(linear_solver, "_superlu", never)
    monkeypatch.setattr(linear_solver, "_schur_by_columns", never)
    condensed(matrix, *split)


@pytest.mark.parametrize("wrong", [1.0 + 1e-6, 0.0, np.nan])
def test_wrong_solution_of_pardiso_is_caught(matrix, rng, monkeypatch, wrong):
    rhs = rng.standard_normal(SIZE)
    exact = np.linalg.solve(matrix.toarray(), rhs)
    monkeypatch.setattr(
        linear_solver, "_pardiso", lambda _: lambda b: wrong * np.linalg.solve(matrix.toarray(), b)
    )
    np.testing.assert_allclose(factorise(matrix)(rhs), exact, rtol=1e-9)


@pytest.mark.parametrize("wrong", [1.0 + 1e-6, 0.0, np.nan])
def test_wrong_schur_complement_of_pardiso_is_caught(matrix, split, monkeypatch, wrong):
    expected = dense_schur(matrix, *split)
    corrupt = expected.copy()
    corrupt[3, 7] = corrupt[7, 3] = wrong * corrupt[3, 3]
    monkeypatch.setattr(linear_solver, "_pardiso_schur", lambda *_: corrupt)
    result = condensed(matrix, *split)
    np.testing.assert_allclose(result, expected, atol=1e-12 * np.abs(expected).max())


def test_schur_complement_that_pardiso_refuses(matrix, split, monkeypatch):
    monkeypatch.setattr(linear_solver, "_pardiso_schur", lambda *_: None)
    expected = dense_schur(matrix, *split)
    result = condensed(matrix, *split)
    np.testing.assert_allclose(result, expected, atol=1e-12 * np.abs(expected).max())


def test_body_that_is_not_held(box, titanium, solver):
    """Six rigid motions: no answer, but a sentence."""
    stiffness = box((2, 2, 2), (0, 0, 0), (1, 1, 1), titanium, 1).stiffness
    with pytest.raises(SolverError, match="a body is not held"):
        factorise(stiffness)


@pytest.mark.parametrize("rows", [[[1.0, 1.0], [1.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]]])
def test_singular_matrix(rows, solver):
    with pytest.raises(SolverError, match="close to singular"):
        factorise(sp.csr_matrix(np.array(rows)))
