"""Sparse solves and Schur complements: with PARDISO, without it, when it errs, and iterative."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from fe_models.loads.constraints import Constraints
from fe_models.loads.rigid_motions import rigid_body_modes
from fe_models.solvers import linear_solver, memory, pardiso, superlu
from fe_models.solvers.linear_solver import (
    FactorMemoryError,
    RefinedFactors,
    SolverError,
    condense,
    factorise,
    prepare,
)
from fe_models.solvers.multigrid import MultigridSolver, softness
from fe_models.solvers.pardiso import Pardiso

SIZE = 120
# Memory allowed for factors, too little for any, so that the system is solved iteratively.
NO_MEMORY = 0.0


@pytest.fixture
def rng():
    return np.random.default_rng(1)


@pytest.fixture
def matrix(rng):
    """Return a sparse, symmetric, positive definite matrix."""
    random = sp.random(SIZE, SIZE, 0.05, random_state=rng, format="csr")
    return (random @ random.T + sp.diags(0.5 + rng.random(SIZE))).tocsr()


@pytest.fixture
def split(rng):
    """Return kept unknowns, in random order, and the others."""
    kept = rng.permutation(SIZE)[:30]
    return kept, np.setdiff1d(np.arange(SIZE), kept)


@pytest.fixture(params=["pardiso", "superlu"])
def solver(request, monkeypatch):
    if request.param == "superlu":
        monkeypatch.setattr(pardiso, "library", lambda: None)
    else:
        need_pardiso()
    return request.param


def need_pardiso():
    if pardiso.library() is None:
        pytest.skip("pypardiso is not installed here")


def held_box(box, titanium, counts, size):
    """Return stiffness and rigid motions of a box clamped at z0, and a load."""
    elastic = box(counts, (0, 0, 0), size, titanium, 1)
    constraints = Constraints(len(elastic.nodes))
    constraints.hold(elastic.boundary_nodes("z0"))
    t = constraints.transformation()
    matrix = (t.T @ elastic.stiffness @ t).tocsr()
    load = np.random.default_rng(0).standard_normal(matrix.shape[0])
    return matrix, rigid_body_modes(elastic.nodes, transformation=t), load


def dense_schur(matrix, kept, inner):
    full = matrix.toarray()
    solved = np.linalg.solve(full[np.ix_(inner, inner)], full[np.ix_(inner, kept)])
    return full[np.ix_(kept, kept)] - full[np.ix_(kept, inner)] @ solved


def condensed(matrix, kept, inner):
    """Return the condensed matrix after a check of its loads."""
    loads = np.random.default_rng(3).standard_normal((matrix.shape[0], 2)) * [1.0, 1e6]
    result, condensed_loads = condense(matrix, loads, kept)
    solved = np.linalg.solve(matrix.toarray()[np.ix_(inner, inner)], loads[inner])
    expected = loads[kept] - matrix[kept][:, inner] @ solved
    scale = np.abs(expected).max(axis=0)
    np.testing.assert_allclose(condensed_loads / scale, expected / scale, atol=1e-11)
    return result


@pytest.mark.parametrize("columns", [None, 1, 5])
def test_solutions(matrix, rng, solver, columns):
    shape = (SIZE,) if columns is None else (SIZE, columns)
    rhs = rng.standard_normal(shape)
    solution = factorise(matrix)(rhs)
    assert solution.shape == shape
    np.testing.assert_allclose(solution, np.linalg.solve(matrix.toarray(), rhs), rtol=1e-9)


@pytest.mark.parametrize("columns", [(), (3,)])
def test_solutions_in_single_precision_are_refined(matrix, rng, solver, columns):
    """Check loads of any size, also beyond the range of single precision."""
    exact = 1e50 * rng.standard_normal((SIZE, *columns))
    factors = RefinedFactors(matrix)
    np.testing.assert_allclose(factors(matrix @ exact), exact, rtol=1e-8)
    rounded = factors.rounded(matrix @ exact * 1e-50)
    error = np.abs(rounded - exact * 1e-50).max()
    assert error < 1e-4
    assert error > 1e-9 or solver != "pardiso"
    assert not factors(np.zeros((SIZE, *columns))).any()


def test_double_precision_where_refinement_fails(rng, solver):
    """Check a matrix whose condition number is beyond single precision."""
    basis, _ = np.linalg.qr(rng.standard_normal((SIZE, SIZE)))
    matrix = sp.csr_matrix((basis * np.logspace(0, -9, SIZE)) @ basis.T)
    matrix = sp.csr_matrix(0.5 * (matrix + matrix.T))
    load = matrix @ rng.standard_normal(SIZE)
    solution = RefinedFactors(matrix)(load)
    assert np.linalg.norm(matrix @ solution - load) < 1e-11 * np.linalg.norm(load)


def test_solution_that_cannot_be_refined_is_computed_in_double_precision(matrix, rng, monkeypatch):
    need_pardiso()
    factors, load = RefinedFactors(matrix), rng.standard_normal(SIZE)
    monkeypatch.setattr(factors, "_refined", lambda _: None)
    np.testing.assert_allclose(matrix @ factors(load), load, atol=1e-10)


def test_schur_complement_follows_the_order_of_the_kept_unknowns(matrix, split, solver):
    assert np.any(np.diff(split[0]) < 0)
    expected = dense_schur(matrix, *split)
    result = condensed(matrix, *split)
    np.testing.assert_allclose(result, expected, atol=1e-12 * np.abs(expected).max())


def test_schur_complement_of_a_singular_matrix(rng, split, solver):
    """Check a floating body: K is singular, K_ii is not, and constants are the null space."""
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


@pytest.mark.parametrize("inner", [1, 2, 9])
def test_hardly_anything_to_condense_away(matrix, split, inner):
    """Check a single inner unknown, with which PARDISO's analysis has crashed."""
    condensed(matrix, *split)
    few = matrix[-(inner + 2) :, -(inner + 2) :].tocsr()
    parts = np.arange(2), np.arange(2, inner + 2)
    expected = dense_schur(few, *parts)
    np.testing.assert_allclose(condensed(few, *parts), expected, rtol=1e-12)


@pytest.mark.parametrize("wrong", [1.0 + 1e-6, 0.0, np.nan])
def test_wrong_solution_of_pardiso_is_caught(matrix, rng, monkeypatch, wrong):
    rhs = rng.standard_normal(SIZE)
    exact = np.linalg.solve(matrix.toarray(), rhs)
    monkeypatch.setattr(
        Pardiso, "__call__", lambda _, b: wrong * np.linalg.solve(matrix.toarray(), b)
    )
    need_pardiso()
    np.testing.assert_allclose(factorise(matrix)(rhs), exact, rtol=1e-9)


def test_a_wrong_column_is_detected_next_to_a_large_one(matrix, rng, monkeypatch):
    """Check that the residual of each right-hand side is judged by its own column."""
    need_pardiso()
    rhs = rng.standard_normal((SIZE, 2)) * [1.0, 1e12]
    exact = np.linalg.solve(matrix.toarray(), rhs)
    monkeypatch.setattr(
        Pardiso, "__call__", lambda _, b: np.linalg.solve(matrix.toarray(), b) + 1e-3
    )
    solution = factorise(matrix)(rhs)
    np.testing.assert_allclose(solution[:, 0], exact[:, 0], rtol=1e-9)


@pytest.mark.parametrize("wrong", [1.0 + 1e-6, 0.0, np.nan])
def test_wrong_schur_complement_of_pardiso_is_caught(matrix, split, monkeypatch, wrong):
    expected = dense_schur(matrix, *split)
    corrupt = expected.copy()
    corrupt[3, 7] = corrupt[7, 3] = wrong * corrupt[3, 3]
    monkeypatch.setattr(
        linear_solver, "_condense_by_pardiso", lambda _, loads, kept, limit: (corrupt, loads[kept])
    )
    result = condensed(matrix, *split)
    np.testing.assert_allclose(result, expected, atol=1e-12 * np.abs(expected).max())


def test_body_that_is_not_held(box, titanium, solver):
    """Check that six rigid motions give an error instead of a solution."""
    stiffness = box((2, 2, 2), (0, 0, 0), (1, 1, 1), titanium, 1).stiffness
    for factors in (factorise, RefinedFactors):
        with pytest.raises(SolverError, match="a body is not held"):
            factors(stiffness)


@pytest.mark.parametrize("rows", [[[1.0, 1.0], [1.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]]])
def test_singular_matrix(rows, solver):
    with pytest.raises(SolverError, match="close to singular"):
        factorise(sp.csr_matrix(np.array(rows)))


def test_too_little_memory_is_an_error_before_factorising(box, titanium, solver, monkeypatch):
    matrix, _, _ = held_box(box, titanium, (4, 4, 4), (1, 1, 1))

    def never(*_):
        raise AssertionError("factorised")

    monkeypatch.setattr(Pardiso, "factorise", never)
    monkeypatch.setattr(Pardiso, "schur", never)
    monkeypatch.setattr(superlu, "factors", never)
    with pytest.raises(FactorMemoryError, match="coarser mesh"):
        RefinedFactors(matrix, memory=1e4)
    with pytest.raises(FactorMemoryError, match="coarser mesh") as caught:
        factorise(matrix, memory=1e4)
    assert caught.value.available == 1e4
    assert caught.value.needed > 1e4
    with pytest.raises(MemoryError, match="onto 30"):
        condense(matrix, np.zeros((matrix.shape[0], 0)), np.arange(30), memory=1e4)


def test_a_container_leaves_less_than_its_machine(monkeypatch, tmp_path):
    machine = SimpleNamespace(available=1000 * 1024)
    monkeypatch.setattr(memory.psutil, "virtual_memory", lambda: machine)
    monkeypatch.setattr(memory, "CONTAINER", tmp_path)
    assert memory.available_bytes() == 1000 * 1024
    (tmp_path / "memory.max").write_text("max\n", encoding="ascii")
    (tmp_path / "memory.current").write_text("500000\n", encoding="ascii")
    (tmp_path / "memory.stat").write_text("anon 1\ninactive_file 100000\n", encoding="ascii")
    assert memory.available_bytes() == 1000 * 1024
    (tmp_path / "memory.max").write_text("800000\n", encoding="ascii")
    assert memory.available_bytes() == 400000


@pytest.mark.slow
@pytest.mark.parametrize(("count", "given"), [(8, 4), (2, 2), (1, None)])
def test_threads_beside_others_have_two_of_mkl_or_none_are_beside(monkeypatch, count, given):
    """A single thread of MKL beside others has crashed PARDISO, so jobs then take turns."""
    asked = []
    mkl = SimpleNamespace(
        MKL_Get_Max_Threads=lambda: count,
        MKL_Set_Num_Threads_Local=lambda share: asked.append(share) or 0,
    )
    monkeypatch.setattr(pardiso, "library", lambda: mkl)
    assert pardiso.in_parallel([lambda: "one", lambda: "two"]) == ["one", "two"]
    assert sorted(asked) == ([] if given is None else [0, 0, given, given])


def test_factors_on_two_threads_are_the_same_bit_for_bit(box, titanium):
    need_pardiso()
    mkl = pardiso.library()
    matrix, _, load = held_box(box, titanium, (20, 20, 20), (1, 1, 1))
    threads = mkl.MKL_Get_Max_Threads()
    mkl.MKL_Set_Num_Threads(2)
    try:
        solutions = {factorise(matrix)(load).tobytes() for _ in range(4)}
    finally:
        mkl.MKL_Set_Num_Threads(threads)
    assert len(solutions) == 1


GROWTH = """
import gc, os
import scipy.sparse as sp
from fe_models.solvers.pardiso import Pardiso

def resident_bytes():
    gc.collect()
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

line = sp.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(45, 45))
matrix = sp.kronsum(sp.kronsum(line, line), line).tocsr()
before = resident_bytes()
analysed = Pardiso(matrix)
announced = analysed.factor_bytes
analysed.factorise()
print((resident_bytes() - before) / announced)
"""


@pytest.mark.slow
def test_memory_that_pardiso_announces():
    """Compare with the growth of a new process, since MKL keeps memory that was released."""
    need_pardiso()
    if not Path("/proc/self/statm").exists():
        pytest.skip("the system does not tell")
    ended = subprocess.run(
        [sys.executable, "-c", GROWTH], capture_output=True, text=True, check=True
    )
    assert float(ended.stdout) == pytest.approx(1.0, rel=0.25)


@pytest.mark.parametrize("counts", [(8, 8, 8), (4, 4, 40), (2, 16, 16)])
def test_memory_estimated_for_superlu(box, titanium, counts):
    """Check a cube, a bar and a plate with very different factors: within half to three times."""
    matrix, _, _ = held_box(box, titanium, counts, counts)
    actual = superlu.BYTES_PER_ENTRY * superlu.factors(matrix).nnz
    assert 0.5 < superlu.factor_bytes(matrix) / actual < 3.0


def test_envelope_of_a_band_is_exact():
    """Check a tridiagonal matrix without fill: two entries per row and factor."""
    matrix = sp.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(SIZE, SIZE), format="csr")
    order = np.random.default_rng(0).permutation(SIZE)
    entries = superlu.factor_bytes(matrix[order][:, order].tocsr()) / superlu.BYTES_PER_ENTRY
    assert entries == 2 * (2 * SIZE - 1)


@pytest.mark.slow
def test_iterations_hardly_grow_with_rigid_motions(box, titanium):
    """Check three meshes of a slender box: constant within three, else four to eight times more."""
    with_motions, without = [], []
    for cells in (4, 6, 9):
        matrix, modes, load = held_box(box, titanium, (cells, cells, 3 * cells), (1, 1, 3))
        for counts, soft in ((with_motions, modes), (without, None)):
            solution = MultigridSolver(matrix, soft).solve(load, 1e-10, 500)
            assert solution.converged
            assert solution.residual < 1e-9
            counts.append(solution.iterations)
    assert max(with_motions) <= 20
    assert max(with_motions) - min(with_motions) <= 3
    assert without[-1] > 1.5 * without[0]
    assert without[-1] > 4 * with_motions[-1]


@pytest.mark.parametrize("columns", [None, 2])
def test_iterated_solution_is_the_direct_one(box, titanium, columns, monkeypatch):
    monkeypatch.setattr(linear_solver, "ITERATED", 1e-12)
    matrix, modes, load = held_box(box, titanium, (4, 4, 8), (1, 1, 2))
    rhs = load if columns is None else np.stack([load, load[::-1]], axis=1)
    exact = factorise(matrix)(rhs)
    solution = prepare(matrix, modes, NO_MEMORY)(rhs)
    assert solution.shape == rhs.shape
    np.testing.assert_allclose(solution, exact, atol=1e-9 * np.abs(exact).max())


def test_iterations_are_the_same_bit_for_bit(box, titanium):
    matrix, modes, load = held_box(box, titanium, (3, 3, 6), (1, 1, 2))
    np.random.seed(3)  # noqa: NPY002
    expected = np.random.random()  # noqa: NPY002
    np.random.seed(3)  # noqa: NPY002
    first = MultigridSolver(matrix, modes).solve(load, 1e-10, 100).solution
    assert np.random.random() == expected  # noqa: NPY002
    second = MultigridSolver(matrix, modes).solve(load, 1e-10, 100).solution
    np.testing.assert_array_equal(first, second)


def test_auto_iterates_when_factors_do_not_fit(box, titanium, monkeypatch):
    matrix, modes, load = held_box(box, titanium, (3, 3, 6), (1, 1, 2))
    exact = np.linalg.solve(matrix.toarray(), load)
    solution = prepare(matrix, modes, memory=1e4)(load)
    np.testing.assert_allclose(solution, exact, atol=1e-7 * np.abs(exact).max())

    def never(*_):
        raise AssertionError("iterated")

    monkeypatch.setattr(linear_solver, "MultigridSolver", never)
    prepare(matrix, modes)(load)


def test_iterations_that_do_not_converge_are_an_error(box, titanium, monkeypatch):
    monkeypatch.setattr(linear_solver, "MOST_ITERATIONS", 2)
    matrix, modes, load = held_box(box, titanium, (3, 3, 6), (1, 1, 2))
    solve = prepare(matrix, modes, NO_MEMORY)
    with pytest.raises(SolverError, match="after 2 iterations"):
        solve(load)


def test_nothing_loads_the_body(box, titanium):
    matrix, modes, load = held_box(box, titanium, (2, 2, 2), (1, 1, 1))
    solution = prepare(matrix, modes, NO_MEMORY)(0.0 * load)
    np.testing.assert_array_equal(solution, 0.0)


@pytest.mark.parametrize("memory", [None, NO_MEMORY])
def test_floating_body_whichever_way_it_is_solved(box, titanium, memory):
    elastic = box((2, 2, 2), (0, 0, 0), (1, 1, 1), titanium, 1)
    with pytest.raises(SolverError, match="a body is not held"):
        prepare(elastic.stiffness, rigid_body_modes(elastic.nodes), memory)


def test_rigid_motions_take_no_energy_and_follow_the_constraints(box, titanium):
    elastic = box((2, 2, 3), (5, 6, 7), (8, 7, 9), titanium, 1)
    modes = rigid_body_modes(elastic.nodes)
    scale = np.abs(elastic.stiffness).max()
    assert np.abs(elastic.stiffness @ modes).max() < 1e-12 * scale
    assert np.linalg.matrix_rank(modes) == 6
    # The energy of the motions is small enough for the solver to detect a free body.
    assert abs(softness(elastic.stiffness, modes)) * linear_solver.GROWTH_LIMIT < 1.0
    # On a slide with a slanted normal the motions along it remain, exactly.
    constraints = Constraints(len(elastic.nodes))
    slanted = np.array([0.6, 0.0, 0.8])
    nodes = elastic.boundary_nodes("z0")
    constraints.slide(nodes, np.tile(slanted, (len(nodes), 1)))
    t = constraints.transformation()
    along = modes[:, :3] @ np.array([0.8, 0.0, -0.6])
    reduced = rigid_body_modes(elastic.nodes, transformation=t)
    np.testing.assert_allclose(t @ (reduced[:, :3] @ [0.8, 0.0, -0.6]), along, atol=1e-10)
