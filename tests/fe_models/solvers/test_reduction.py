"""Reduced models equal the full ones: exactly in statics, and up to their modes in vibration."""

import h5py
import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

from fe_models.joints.reduction import free_frequencies, load_reduced, reduce_body, save_reduced
from fe_models.loads.constraints import Constraints
from fe_models.solvers.linear_solver import SolverError
from fe_models.supported_body import SupportedBody
from sa_solver.errors import InputError
from sa_solver.types import Material

STEEL = Material(200e3, 0.3, 7.8e-9)


@pytest.fixture(scope="module")
def matrices(box):
    """Return the matrices of a free box with different sides, and one face's displacements."""
    elastic = box((3, 2, 5), (0.0, 0.0, 0.0), (3.0, 2.0, 7.0), STEEL, 1)
    nodes = elastic.body.vertices("z1")
    kept = (3 * nodes[:, None] + np.arange(3)).ravel()
    return elastic.stiffness, elastic.mass, kept


def others(size, kept):
    return np.setdiff1d(np.arange(size), kept)


def chain(element_stiffness, element_mass, elements):
    """Assemble equal elements in a row that share half of their displacements with the next."""
    shared = len(element_stiffness) // 2
    matrices = []
    for element in (element_stiffness, element_mass):
        full = np.zeros((shared * (elements + 1),) * 2)
        for start in range(0, shared * elements, shared):
            place = slice(start, start + 2 * shared)
            full[place, place] += element
        matrices.append(sp.csr_matrix(full))
    return matrices


def bar(elements, length=33.0):
    """Return a bar of linear elements with consistent mass and unit section."""
    h = length / elements
    k = STEEL.young / h * np.array([[1.0, -1.0], [-1.0, 1.0]])
    m = STEEL.density * h / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    return chain(k, m, elements)


def beam(elements, length=33.0, radius=4.0):
    """Return a round Euler beam of cubic elements, with deflection and rotation at each node."""
    h = length / elements
    section = np.pi * radius**2
    bending = STEEL.young * 0.25 * np.pi * radius**4
    k = bending / h**3 * np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
         [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]
    )  # fmt: skip
    m = STEEL.density * section * h / 420.0 * np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]]
    )  # fmt: skip
    return chain(k, m, elements)


def bar_frequencies(count, length=33.0):
    return np.arange(1, count + 1) * np.sqrt(STEEL.young / STEEL.density) / (2.0 * length)


class TestFreeFrequencies:
    def test_bar_converges_at_second_order(self):
        errors = [
            free_frequencies(*bar(elements), 4)[1:] / bar_frequencies(3) - 1.0
            for elements in (20, 40, 80)
        ]
        np.testing.assert_allclose(np.divide(errors[0], errors[1]), 4.0, rtol=0.05)
        np.testing.assert_allclose(np.divide(errors[1], errors[2]), 4.0, rtol=0.05)
        assert errors[2][0] < 1e-4

    def test_beam_has_the_roots_of_cos_cosh_1(self):
        # Blevins 1979, table 8-1: free-free beam.
        roots = np.array([4.73004074, 7.85320462, 10.9956078])
        inertia = np.sqrt(STEEL.young * 0.25 * 4.0**2 / STEEL.density)
        exact = roots**2 * inertia / (2.0 * np.pi * 33.0**2)
        frequencies = free_frequencies(*beam(40), 5)
        assert frequencies[1] < 1e-5 * frequencies[2]
        # Cubic elements: error of order (root/elements)^4.
        np.testing.assert_allclose(frequencies[2:], exact, rtol=1e-5)

    def test_dense_and_sparse_agree(self, matrices):
        stiffness, mass, _ = matrices
        sparse = free_frequencies(stiffness, mass, 12)
        dense = free_frequencies(stiffness.toarray(), mass.toarray(), 12)
        np.testing.assert_allclose(sparse[6:], dense[6:], rtol=1e-9)

    def test_six_rigid_motions(self, matrices):
        stiffness, mass, kept = matrices
        model = reduce_body(stiffness, mass, kept, 4)
        for pair in ((stiffness, mass), (model.stiffness, model.mass)):
            frequencies = free_frequencies(*pair, 7)
            assert frequencies[:6].max() < 1e-5 * frequencies[6]

    def test_more_than_there_are(self):
        with pytest.raises(ValueError, match="at least 1 and fewer"):
            free_frequencies(*bar(4), 5)


class TestReduction:
    def test_matrices_are_projections_of_the_full_ones(self, matrices):
        stiffness, mass, kept = matrices
        model = reduce_body(stiffness, mass, kept, 5)
        basis = model.recover(stiffness, np.eye(len(model.stiffness)))
        for reduced, full in ((model.stiffness, stiffness), (model.mass, mass)):
            projected = basis.T @ full @ basis
            np.testing.assert_allclose(reduced, projected, atol=1e-11 * np.abs(projected).max())

    def test_static_part_is_exact(self, matrices):
        stiffness, _, kept = matrices
        model = reduce_body(stiffness, None, kept)
        full = stiffness.toarray()
        inner = others(len(full), kept)
        exact = full[np.ix_(kept, kept)] - full[np.ix_(kept, inner)] @ np.linalg.solve(
            full[np.ix_(inner, inner)], full[np.ix_(inner, kept)]
        )
        np.testing.assert_allclose(model.stiffness, exact, atol=1e-11 * np.abs(exact).max())
        np.testing.assert_array_equal(model.static_stiffness, model.stiffness)
        assert model.mass is None

    def test_order_of_kept_displacements_is_free(self, matrices):
        stiffness, mass, kept = matrices
        shuffled = np.random.default_rng(1).permutation(len(kept))
        straight, turned = (reduce_body(stiffness, mass, k, 2) for k in (kept, kept[shuffled]))
        places = np.append(shuffled, len(kept) + np.arange(2))
        for name in ("stiffness", "mass"):
            expected = getattr(straight, name)[np.ix_(places, places)]
            matrix = getattr(turned, name)
            np.testing.assert_allclose(matrix, expected, atol=1e-11 * np.abs(expected).max())

    def test_fixed_interface_modes(self, matrices):
        stiffness, mass, kept = matrices
        model = reduce_body(stiffness, mass, kept, 6)
        inner = others(stiffness.shape[0], kept)
        K, M = (matrix[inner][:, inner].toarray() for matrix in (stiffness, mass))
        values = sl.eigh(K, M, eigvals_only=True)[:6]
        np.testing.assert_allclose((2.0 * np.pi * model.frequencies) ** 2, values, rtol=1e-9)
        shapes = model.mode_shapes
        assert np.all(shapes[kept] == 0.0)
        np.testing.assert_allclose(shapes.T @ mass @ shapes, np.eye(6), atol=1e-9)

    def test_same_modes_again(self, matrices):
        first, second = (reduce_body(*matrices, 3) for _ in range(2))
        np.testing.assert_array_equal(first.mode_shapes, second.mode_shapes)

    def test_frequencies_fall_to_the_full_ones_with_more_modes(self, matrices):
        stiffness, mass, kept = matrices
        full = free_frequencies(stiffness, mass, 12)[6:]
        errors = []
        for modes in (0, 3, 10, 40):
            model = reduce_body(stiffness, mass, kept, modes)
            errors.append(free_frequencies(model.stiffness, model.mass, 12)[6:] / full - 1.0)
        # By Rayleigh-Ritz frequencies are never below the full model's, and approach them.
        assert np.all(np.array(errors) > -1e-9)
        assert np.all(np.diff(errors, axis=0) < 1e-9)
        assert errors[-1].max() < 2e-3

    def test_loads_do_the_same_work(self, matrices):
        stiffness, mass, kept = matrices
        loads = np.random.default_rng(2).standard_normal((stiffness.shape[0], 2))
        model = reduce_body(stiffness, mass, kept, 3, loads)
        basis = model.recover(stiffness, np.eye(len(model.stiffness)))
        np.testing.assert_allclose(model.loads, basis.T @ loads, atol=1e-10)

    def test_condensation_of_a_supported_body(self, box):
        elastic = box((2, 2, 3), (0.0, 0.0, 0.0), (2.0, 2.0, 3.0), STEEL, 2)
        constraints = Constraints(len(elastic.nodes))
        constraints.hold(elastic.boundary_nodes("z0"))
        constraints.average(*elastic.midsides("z1"))
        nodes = elastic.body.vertices("z1")
        loads = np.random.default_rng(3).standard_normal((3 * len(elastic.nodes), 2))
        frames = np.tile(np.eye(3), (len(nodes), 1, 1))
        condensed = SupportedBody(elastic, constraints, nodes, frames, loads).condense()
        t = constraints.transformation()
        kept = np.searchsorted(constraints.free, (3 * nodes[:, None] + np.arange(3)).ravel())
        model = reduce_body((t.T @ elastic.stiffness @ t).tocsr(), None, kept, 0, t.T @ loads)
        np.testing.assert_allclose(model.stiffness, condensed[0], rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(model.loads, condensed[1], rtol=1e-9, atol=1e-9)

    def test_lists_and_full_matrices_do_as_well(self, matrices):
        stiffness, mass, kept = matrices
        full = reduce_body(stiffness.toarray(), mass.toarray(), list(kept), 1)
        np.testing.assert_allclose(full.mass, reduce_body(stiffness, mass, kept, 1).mass)

    @pytest.mark.parametrize("kept", [[0, 0], [-1], [10**6], [0.5], [True, False], 3])
    def test_displacements_that_there_are_not(self, matrices, kept):
        with pytest.raises(InputError, match="kept displacements"):
            reduce_body(*matrices[:2], np.array(kept))

    def test_loads_that_are_masked(self, matrices):
        stiffness, mass, kept = matrices
        loads = np.ma.array(np.ones((stiffness.shape[0], 1)), mask=False)
        loads[2] = np.ma.masked
        with pytest.raises(InputError, match="masked"):
            reduce_body(stiffness, mass, kept, 0, loads)

    def test_modes_without_mass(self, matrices):
        stiffness, _, kept = matrices
        with pytest.raises(ValueError, match="mass"):
            reduce_body(stiffness, None, kept, 1)

    def test_more_modes_than_there_are(self, matrices):
        stiffness, mass, kept = matrices
        with pytest.raises(ValueError, match="at least 0 and fewer"):
            reduce_body(stiffness, mass, kept, stiffness.shape[0])

    def test_a_body_that_can_still_move(self, matrices):
        stiffness, mass, kept = matrices
        with pytest.raises(SolverError):
            reduce_body(stiffness, mass, kept[:3], 1)


class TestStored:
    @pytest.fixture
    def model(self, matrices):
        stiffness, mass, kept = matrices
        return reduce_body(stiffness, mass, kept, 2, np.ones((stiffness.shape[0], 1)))

    def test_round_trip(self, model, tmp_path):
        path = tmp_path / "body.h5"
        save_reduced(path, model)
        read = load_reduced(path)
        for name, values in vars(model).items():
            np.testing.assert_array_equal(getattr(read, name), values)
        assert list(tmp_path.iterdir()) == [path]

    def test_every_dataset_is_described(self, model, tmp_path):
        save_reduced(tmp_path / "body.h5", model)
        with h5py.File(tmp_path / "body.h5") as file:
            assert set(file) == {name for name, value in vars(model).items() if value is not None}
            assert all(file[name].attrs["unit"] for name in file)
            assert all(file[name].attrs["description"] for name in file)

    def test_static_model_has_no_mass(self, matrices, tmp_path):
        stiffness, _, kept = matrices
        save_reduced(tmp_path / "body.h5", reduce_body(stiffness, None, kept))
        assert load_reduced(tmp_path / "body.h5").mass is None
