"""Elastic bodies: rigid motions, patch test, bars, loads, convergence rates, stress measures."""

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from skfem import Basis, ElementTetP1, ElementTetP2, LinearForm, MeshTet

from fe_models.elasticity.body import ElasticBody, maximum_principal
from fe_models.interface_frames import frame_rotation
from fe_models.loads.constraints import Constraints
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import Body
from fe_models.solvers.linear_solver import factorise
from sa_solver import von_mises
from sa_solver.types import Material
from tests.fe_models.joints.monolithic import whole_stiffness

ORDERS = [1, 2]
SIZE = (1.0, 2.0, 3.0)


@pytest.fixture(params=ORDERS)
def irregular(request, titanium, box):
    """Return a box with inner nodes moved at random."""
    regular = box((3, 3, 3), (0.0, 0.0, 0.0), SIZE, titanium, 1).body.mesh
    points = regular.p.copy()
    inner = np.setdiff1d(np.arange(regular.nvertices), regular.boundary_nodes())
    points[:, inner] += 0.1 * np.random.default_rng(0).standard_normal((3, len(inner)))
    mesh = MeshTet(points, regular.t).with_boundaries(regular.boundaries)
    return ElasticBody(Body("box", mesh), titanium, request.param)


def solved(elastic, constraints, load):
    t = constraints.transformation()
    return t @ factorise((t.T @ elastic.stiffness @ t).tocsr())(t.T @ load)


def test_stiffness_is_symmetric_and_positive(irregular):
    stiffness = irregular.stiffness
    scale = np.abs(stiffness).max()
    assert np.abs(stiffness - stiffness.T).max() < 1e-13 * scale
    vectors = np.random.default_rng(0).standard_normal((stiffness.shape[0], 20))
    assert np.all(np.einsum("an,an->n", vectors, stiffness @ vectors) > 0.0)


def test_stiffness_is_that_of_the_vector_form(irregular):
    expected = whole_stiffness(irregular.body.mesh, irregular.material, irregular.order)
    assert np.abs(irregular.stiffness - expected).max() < 1e-13 * np.abs(expected).max()


def test_nodes_of_a_boundary_are_those_of_its_facets_and_edges(irregular):
    mesh, boundary = irregular.body.mesh, next(iter(irregular.body.mesh.boundaries))
    element = (ElementTetP1, ElementTetP2)[irregular.order - 1]()
    expected = Basis(mesh, element).get_dofs(boundary).all()
    np.testing.assert_array_equal(irregular.boundary_nodes(boundary), np.sort(expected))


def test_frames_are_put_in_one_by_one_or_at_once():
    frames = np.linalg.qr(np.random.default_rng(0).standard_normal((4, 3, 3)))[0]
    places = np.random.default_rng(1).permutation(20)[:12]
    one_by_one, at_once = (frame_rotation(20, places, f).toarray() for f in (list(frames), frames))
    np.testing.assert_allclose(at_once, one_by_one, atol=1e-15)


def test_rigid_motions_take_no_force(irregular):
    x, y, z = irregular.nodes.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    motions = [
        (one, zero, zero), (zero, one, zero), (zero, zero, one),
        (zero, -z, y), (z, zero, -x), (-y, x, zero),
    ]  # fmt: skip
    scale = np.abs(irregular.stiffness).max()
    for motion in motions:
        u = np.stack(motion, axis=1).ravel()
        assert np.abs(irregular.stiffness @ u).max() < 1e-12 * scale * np.abs(u).max()
        assert np.abs(irregular.stress(u)).max() < 1e-12 * irregular.material.young


def test_patch(irregular, titanium):
    """Check that a linear boundary displacement continues inside with constant stress."""
    gradient = 1e-3 * np.random.default_rng(1).standard_normal((3, 3))
    exact = (irregular.nodes @ gradient.T).ravel()
    names = irregular.body.mesh.boundaries
    held = np.unique(np.concatenate([irregular.boundary_nodes(name) for name in names]))
    fixed = (3 * held[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(len(exact)), fixed)
    stiffness = irregular.stiffness
    u = exact.copy()
    u[free] = spla.spsolve(
        stiffness[free][:, free].tocsc(), -(stiffness[free][:, fixed] @ exact[fixed])
    )
    np.testing.assert_allclose(u, exact, atol=1e-12 * np.abs(exact).max())
    strain = 0.5 * (gradient + gradient.T)
    shear = titanium.young / (2.0 * (1.0 + titanium.poisson))
    lame = titanium.young * titanium.poisson / (1 + titanium.poisson) / (1 - 2 * titanium.poisson)
    tensor = 2.0 * shear * strain + lame * np.trace(strain) * np.eye(3)
    voigt = tensor[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    stress = irregular.stress(u)
    np.testing.assert_allclose(stress, voigt[:, None] + 0.0 * stress, rtol=1e-9)


def on_three_planes(elastic):
    """Return constraints that hold only the planes of symmetry x = 0, y = 0, z = 0."""
    constraints = Constraints(len(elastic.nodes))
    for name in ("x0", "y0", "z0"):
        constraints.slide(*elastic.boundary_normals(name))
    return constraints


def test_bar_under_end_traction(irregular, titanium):
    """Check the linear fields u_z = σ z / E and u_x = -ν σ x / E, exact on any mesh."""
    sigma = 100.0
    load = irregular.traction_load("z1", lambda x: np.full_like(x[0], sigma), np.eye(3)[2])
    u = solved(irregular, on_three_planes(irregular), load).reshape(-1, 3)
    strain = sigma / titanium.young * np.array([-titanium.poisson, -titanium.poisson, 1.0])
    np.testing.assert_allclose(u, irregular.nodes * strain, atol=1e-12)
    stress = irregular.stress(u.ravel())
    np.testing.assert_allclose(von_mises(stress), sigma, rtol=1e-9)
    np.testing.assert_allclose(maximum_principal(stress), sigma, rtol=1e-9)


def test_spinning_bar(box):
    """Check u_z = ρ ω² (L² z / 2 - z³ / 6) / E, exact without Poisson's ratio."""
    material, length = Material(1e5, 0.0, 1e-2), 8.0
    elastic = box((1, 1, 8), (0.0, 0.0, 0.0), (1.0, 1.0, length), material, 2)
    u = solved(elastic, on_three_planes(elastic), elastic.centrifugal_load()).reshape(-1, 3)
    z = elastic.nodes[:, 2]
    exact = material.density / material.young * (0.5 * length**2 * z - z**3 / 6.0)
    np.testing.assert_allclose(u[:, 2], exact, atol=2e-4 * exact.max())


def test_cantilever(box):
    """Check Timoshenko's beam, u = F L³ / 3EI + F L / κGA, bent without locking."""
    material, length, force = Material(1e5, 0.3), 10.0, 1.0
    elastic = box((2, 2, 20), (-0.5, -0.5, 0.0), (0.5, 0.5, length), material, 2)
    held = Constraints(len(elastic.nodes))
    # The end stays plane but may contract, as in beam theory.
    held.slide(*elastic.boundary_normals("z0"))
    nodes, weights = elastic.boundary_weights("z0")
    for direction in np.eye(3)[:2]:
        held.zero_mean(nodes, weights, direction)
    side = nodes[[np.argmax(elastic.nodes[nodes, 0])]]
    held.slide(side, np.array([[0.0, 1.0, 0.0]]))
    load = elastic.traction_load("z1", lambda x: np.full_like(x[0], force), np.eye(3)[0])
    u = solved(elastic, held, load).reshape(-1, 3)
    nodes, weights = elastic.boundary_weights("z1")
    tip = weights @ u[nodes, 0] / weights.sum()
    nu = material.poisson
    shape = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)  # Cowper 1966, doi:10.1115/1.3625046
    bending = 12.0 * force * length**3 / (3.0 * material.young)
    expected = bending + force * length / (shape * material.shear_modulus)
    # Two elements across have an error of half a percent.
    assert tip == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("order", ORDERS)
def test_centrifugal_load_is_mass_times_radius(coarse_mesh, titanium, order):
    """Check that the force per ω² is ρ V r of the centre of mass, on every body."""
    for body in coarse_mesh.bodies:
        elastic = ElasticBody(body, titanium, order)
        volumes = np.abs(element_volumes(body.mesh))
        centroids = body.mesh.p[:, body.mesh.t].mean(axis=1)
        expected = titanium.density * centroids @ volumes * np.array([1.0, 0.0, 1.0])
        load = elastic.centrifugal_load().reshape(-1, 3)
        assert np.all(load[:, 1] == 0.0)
        total = load.sum(axis=0)
        np.testing.assert_allclose(total, expected, atol=1e-12 * expected[2])


def test_traction_has_its_resultants(irregular):
    """Check σ = y on z1 of 1 x 2: force ∫ y = 2, moment about x ∫ y² = 8/3."""
    load = irregular.traction_load("z1", lambda x: x[1], np.eye(3)[2]).reshape(-1, 3)
    np.testing.assert_allclose(load.sum(axis=0), [0.0, 0.0, 2.0], atol=1e-12)
    moment = np.cross(irregular.nodes, load).sum(axis=0)
    np.testing.assert_allclose(moment[0], 8.0 / 3.0, rtol=1e-12)
    assert irregular.boundary_integral("z1", lambda x: x[1]) == pytest.approx(2.0)


def test_boundary_weights_integrate(irregular):
    """Check that weights integrate x y over z1 exactly for order 2 only, and x for both."""
    nodes, weights = irregular.boundary_weights("z1")
    x, y, z = irregular.nodes[nodes].T
    np.testing.assert_allclose(z, SIZE[2])
    assert weights.sum() == pytest.approx(2.0)
    assert weights @ x == pytest.approx(1.0)
    if irregular.order == 2:
        assert weights @ (x * y) == pytest.approx(1.0)


def test_boundary_normals(irregular):
    for name, normal in (("x0", (-1, 0, 0)), ("y1", (0, 1, 0)), ("z1", (0, 0, 1))):
        nodes, normals = irregular.boundary_normals(name)
        assert set(nodes) == set(irregular.boundary_nodes(name))
        np.testing.assert_allclose(normals, np.tile(normal, (len(nodes), 1)), atol=1e-12)


def test_midsides_lie_between_their_vertices(irregular):
    middle, parents = irregular.midsides("z1")
    nodes = irregular.boundary_nodes("z1")
    assert len(middle) == len(nodes) - 16 if irregular.order == 2 else len(middle) == 0
    np.testing.assert_allclose(irregular.nodes[middle], irregular.nodes[parents].mean(axis=1))


def manufactured_error(box, order, cells):
    """Return the L2 error for u = (φ, 0, 0), φ = sin πx sin πy sin πz on the unit cube.

    All faces are held.
    """
    material = Material(1.0, 0.3)
    elastic = box((cells,) * 3, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), material, order)
    lame, shear, pi = material.lame, material.shear_modulus, np.pi

    def force(x, axis):
        s, c = np.sin(pi * x), np.cos(pi * x)
        # -div σ = -(λ + G) grad(∂φ/∂x) - G Δu
        if axis == 0:
            return (lame + 4.0 * shear) * pi**2 * s[0] * s[1] * s[2]
        other = 3 - axis
        return -(lame + shear) * pi**2 * c[0] * c[axis] * s[other]

    element = {1: ElementTetP1, 2: ElementTetP2}[order]()
    basis = Basis(elastic.body.mesh, element, intorder=6)
    load = np.stack(
        [
            LinearForm(lambda v, w, axis=axis: force(w.x, axis) * v).assemble(basis)
            for axis in range(3)
        ],
        axis=1,
    ).ravel()
    held = Constraints(len(elastic.nodes))
    for name in elastic.body.mesh.boundaries:
        held.hold(elastic.boundary_nodes(name))
    u = solved(elastic, held, load).reshape(-1, 3)
    x = np.asarray(basis.global_coordinates())
    exact = [np.prod(np.sin(pi * x), axis=0), 0.0, 0.0]
    return np.sqrt(
        sum(
            np.sum((np.asarray(basis.interpolate(np.ascontiguousarray(c))) - e) ** 2 * basis.dx)
            for c, e in zip(u.T, exact, strict=True)
        )
    )


@pytest.mark.parametrize(("order", "cells", "rate"), [(1, (6, 12), 2.0), (2, (3, 6), 3.0)])
def test_convergence_rate(box, order, cells, rate):
    """Check that the L2 error falls as h² for linear and as h³ for quadratic elements."""
    errors = [manufactured_error(box, order, n) for n in cells]
    measured = np.log2(errors[0] / errors[1])
    assert rate - 0.35 < measured < rate + 0.5


def tensor_components(tensor):
    return tensor[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]][:, None]


@pytest.mark.parametrize(
    ("tensor", "mises", "principal"),
    [
        (np.diag([200.0, 0.0, 0.0]), 200.0, 200.0),
        (np.diag([-200.0, 0.0, 0.0]), 200.0, 0.0),
        (np.diag([50.0, 50.0, 50.0]), 0.0, 50.0),
        (np.array([[0.0, 7.0, 0.0], [7.0, 0.0, 0.0], [0.0, 0.0, 0.0]]), 7.0 * np.sqrt(3.0), 7.0),
    ],
)
def test_stress_measures(tensor, mises, principal):
    """Check uniaxial, hydrostatic and pure shear stress, also rotated in space."""
    rotation, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))
    for state in (tensor, rotation @ tensor @ rotation.T):
        voigt = tensor_components(state)
        assert von_mises(voigt)[0] == pytest.approx(mises, abs=1e-10)
        assert maximum_principal(voigt)[0] == pytest.approx(principal, abs=1e-10)
