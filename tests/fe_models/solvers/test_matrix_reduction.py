"""Models from matrices of other programs: reduced, without massless unknowns, checked."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

from fe_models.joints.reduction import free_frequencies
from fe_models.matrices import (
    ExternalMatrices,
    MatrixError,
    Unknown,
    check_definite,
    lowest_frequencies,
    on_all,
    on_retained,
    with_light_motions,
    without_massless,
)
from tests.fe_models.solvers.test_matrices import LOAD, MASS, STIFFNESS, changed, own_of


@pytest.mark.parametrize(
    ("stiffness", "mass", "words"),
    [
        (changed(STIFFNESS, 0, 0, 10.0), MASS, "an eigenvalue below zero"),
        (changed(STIFFNESS, 0, 0, -1.0), MASS, "1 x: -1 on the diagonal; allowed: above zero"),
        (STIFFNESS, np.ones((3, 3)), "has no mass; allowed: masses added there"),
        (STIFFNESS, changed(MASS, 0, 1, 1.0), "a negative mass"),
    ],
)
def test_energies_below_zero_are_refused(stiffness, mass, words):
    with pytest.raises(MatrixError) as refusal:
        check_definite(on_all(own_of(stiffness, 0.5 * (mass + mass.T))))
    assert words in str(refusal.value)


@pytest.fixture(scope="module")
def plate():
    """Return a plane plate of finite elements, with damping and a load and a free left edge."""
    from skfem import Basis, BilinearForm, ElementQuad1, ElementVector, MeshQuad
    from skfem.helpers import dot
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    mesh = MeshQuad.init_tensor(np.linspace(0.0, 40.0, 41), np.linspace(0.0, 10.0, 11))
    basis = Basis(mesh, ElementVector(ElementQuad1()))
    K = linear_elasticity(*lame_parameters(210e3, 0.3)).assemble(basis).tocsr()
    M = BilinearForm(lambda u, v, w: 7.85e-9 * dot(u, v)).assemble(basis).tocsr()
    corner = {0: "left", 40: "right"}
    numbers = np.repeat(np.arange(mesh.p.shape[1]), 2)
    x, y = mesh.p
    named = [f"{corner[x[n]]} {int(y[n]) + 1}" if x[n] in corner else str(n) for n in range(len(x))]
    unknowns = tuple(
        Unknown(named[n], "xy"[k]) for n, k in zip(numbers, [0, 1] * len(x), strict=True)
    )
    loads = np.zeros((len(unknowns), 1))
    loads[len(unknowns) // 2] = 1.0
    return ExternalMatrices(K, M, 1e-6 * K + 40.0 * M, loads, unknowns)


def edge(name):
    return [f"{name} {number}" for number in range(1, 12)]


def test_large_matrices_are_reduced(plate):
    """Check frequencies of the free plate, its mass, and damping that stays Rayleigh's."""
    full = free_frequencies(plate.stiffness, plate.mass, 10)[3:]
    errors = []
    for modes in (30, 60, 120):
        model = on_retained(plate, edge("left") + edge("right"), modes)
        errors.append(free_frequencies(model.stiffness, model.mass, 10)[3:] / full - 1.0)
    assert model.names[0] == "left 1 x"
    # From above, and by the square of the modes' highest frequency or faster.
    assert min(error.min() for error in errors) > 0.0
    assert np.all(errors[2] < errors[0] / 5.0)
    assert errors[2].max() < 3e-4
    expected = 1e-6 * model.stiffness + 40.0 * model.mass
    np.testing.assert_allclose(model.damping, expected, atol=1e-9 * np.abs(expected).max())
    assert plate.moved_mass()["x"] == pytest.approx(400.0 * 7.85e-9, rel=1e-12)
    assert check_definite(model) == 3
    reported = lowest_frequencies(plate, 4)
    np.testing.assert_allclose(reported, [0.0, 0.0, 0.0, *full[:4]], rtol=1e-9)


def test_a_load_inside_moves_what_is_retained(plate):
    """Compare statics with the full matrices, with the left edge held."""
    model = on_retained(plate, edge("left") + edge("right"), modes=0)
    free = [k for k, unknown in enumerate(plate.unknowns) if "left" not in unknown.point]
    moved = sp.linalg.spsolve(plate.stiffness[free][:, free].tocsc(), plate.loads[free, 0])
    there = {plate.unknowns[k].name: u for k, u in zip(free, moved, strict=True)}
    right = [k for k, name in enumerate(model.names) if name.startswith("right")]
    reduced = np.linalg.solve(model.stiffness[np.ix_(right, right)], model.loads[right, 0])
    expected = [there[model.names[k]] for k in right]
    np.testing.assert_allclose(reduced, expected, rtol=1e-9, atol=1e-12)


def test_reductions_that_cannot_be_are_refused(plate):
    with pytest.raises(MatrixError, match="880 displacements") as refusal:
        on_retained(plate, edge("left"), modes=5000)
    assert refusal.value.part == "modes"
    with pytest.raises(MatrixError, match="can move") as refusal:
        on_retained(replace(plate, stiffness=0.0 * plate.stiffness), edge("left"), modes=2)
    assert refusal.value.part == "retained"


def test_what_has_no_mass_follows_exactly():
    """Compare with the generalised eigenproblem, which has infinite frequencies for them."""
    mass = np.diag([2e-3, 0.0, 5e-4])
    model, dropped = without_massless(on_all(own_of(STIFFNESS, mass, loads=LOAD)))
    assert dropped == ("2 x",)
    inverses = sl.eigh(mass, STIFFNESS, eigvals_only=True)[1:]
    squares = sl.eigh(model.stiffness, model.mass, eigvals_only=True)
    np.testing.assert_allclose(squares, 1.0 / inverses[::-1], rtol=1e-12)
    # A load on it moves the others as before.
    moved = np.linalg.solve(STIFFNESS, LOAD)[[0, 2]]
    np.testing.assert_allclose(np.linalg.solve(model.stiffness, model.loads), moved, rtol=1e-12)
    _, dropped = without_massless(on_all(own_of(STIFFNESS, mass)), laden=("2 x",))
    assert dropped == ()
    damped = own_of(STIFFNESS, mass, damping=sp.csr_matrix(STIFFNESS))
    with pytest.raises(MatrixError, match="no mass but damping at 2 x"):
        without_massless(on_all(damped))


def test_motions_without_mass_are_given_a_frequency():
    """Check a mass that moves with the mean of two points: their difference has none."""
    mean = np.array([[0.5, 0.5, 0.0], [0.0, 0.0, 1.0]])
    mass = mean.T @ np.diag([2e-3, 5e-4]) @ mean
    bare = on_all(own_of(STIFFNESS, mass))
    with pytest.raises(MatrixError, match="no mass; allowed: masses"):
        check_definite(bare)
    model, light = with_light_motions(bare, 1e4)
    assert light == ("1 x",)
    np.testing.assert_array_equal(model.stiffness, STIFFNESS)
    np.testing.assert_allclose(mean @ (model.mass - mass), 0.0, atol=1e-15)
    # Its flexibility at 100 Hz is too large by the square of 100 Hz over its frequency.
    apart, angular = np.array([1.0, -1.0, 0.0]), 2.0 * np.pi * 100.0
    moved = [np.linalg.solve(STIFFNESS - angular**2 * m, apart) for m in (mass, model.mass)]
    held = apart @ STIFFNESS @ apart
    assert apart @ (moved[1] - moved[0]) == pytest.approx(4.0 / held * 1e-4, rel=0.3)
    assert with_light_motions(model, 1e4)[1] == ()


def test_what_has_neither_mass_nor_stiffness_is_not_there():
    bare = np.pad(STIFFNESS, (0, 1)), np.pad(MASS, (0, 1))
    model, dropped = without_massless(on_all(own_of(*bare)))
    assert dropped == ("3 x",)
    np.testing.assert_array_equal(model.stiffness, STIFFNESS)
