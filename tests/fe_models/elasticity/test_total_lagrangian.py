"""Finite displacements: objectivity, closed forms, tangents, the elastica, stress stiffness."""

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse.linalg as spla
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc
from skfem import MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.total_lagrangian import TotalLagrangian, rotation_angle
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import Body
from sa_solver.types import Material

ALONG, ACROSS = np.eye(3)[0], np.eye(3)[2]


def beam(length, cells, order=2, poisson=0.0, young=1e5):
    """Return a strip 1 mm high in the plane, from X = 0 to ``length``."""
    mesh = MeshTri.init_tensor(np.linspace(0.0, length, cells + 1), np.linspace(-0.5, 0.5, 2))
    ends = {"root": lambda x: x[0] == 0.0, "tip": lambda x: np.isclose(x[0], length)}
    return ElasticBody(
        Body("beam", mesh.with_boundaries(ends)), Material(young, poisson, 1e-8), order
    )


def clamped(elastic):
    held = Constraints(len(elastic.nodes), elastic.dimension)
    held.hold(elastic.boundary_nodes("root"))
    return held.transformation()


def tip(elastic, displacement):
    """Return the mean displacement of the tip, ``(d,)``."""
    nodes, weights = elastic.boundary_weights("tip")
    return weights @ displacement.reshape(-1, elastic.dimension)[nodes] / weights.sum()


def solved(matrix, load, t):
    return t @ spla.spsolve((t.T @ matrix @ t).tocsc(), t.T @ load)


def equilibrium(finite, load, t, start):
    """Solve for dead loads by Newton's method."""
    u = start.copy()
    for _ in range(30):
        step = solved(finite.tangent(u), load - finite.internal_force(u), t)
        u += step
        if np.abs(step).max() < 1e-10 * np.abs(u).max():
            return u
    raise AssertionError("Newton's method did not converge")


@pytest.fixture(params=[(3, 1), (3, 2), (2, 1), (2, 2)], ids=lambda spec: f"{spec[0]}D-P{spec[1]}")
def elastic(request, box, titanium):
    dimension, order = request.param
    if dimension == 3:
        return box((2, 2, 2), (0.0, 0.0, 0.0), (1.0, 1.5, 2.0), titanium, order)
    return beam(3.0, 3, order, titanium.poisson, titanium.young)


def disturbed(elastic, size=0.05):
    return size * np.random.default_rng(0).standard_normal(elastic.size)


def in_axes(elastic, points):
    """Return displacements ``(size,)`` that bring the nodes to ``points`` ``(n, d)``."""
    return (points - elastic.nodes[:, elastic.body.axes]).ravel()


def turn(dimension):
    full = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    return full if dimension == 3 else Rotation.from_rotvec([0, 0, 1.3]).as_matrix()[:2, :2]


def test_undisplaced_tangent_is_the_linear_stiffness(elastic):
    """Compare assembly by node pairs with assembly by scalar forms."""
    scale = np.abs(elastic.stiffness).max()
    finite = TotalLagrangian(elastic)
    assert np.abs(finite.tangent(np.zeros(elastic.size)) - elastic.stiffness).max() < 1e-13 * scale


def test_rotation_takes_no_force(elastic):
    rotation = turn(elastic.dimension)
    u = in_axes(elastic, elastic.nodes[:, elastic.body.axes] @ rotation.T + 0.3)
    finite = TotalLagrangian(elastic)
    assert np.abs(finite.internal_force(u)).max() < 1e-12 * elastic.material.young
    assert finite.largest_strain(u) < 1e-14
    assert finite.largest_rotation(u) == pytest.approx(float(rotation_angle(rotation)), rel=1e-12)


def test_forces_turn_with_the_body(elastic):
    """Check F(R x) = R F(x), each in balance on the displaced body."""
    d, rotation = elastic.dimension, turn(elastic.dimension)
    u = disturbed(elastic)
    finite = TotalLagrangian(elastic)
    force = finite.internal_force(u).reshape(-1, d)
    points = elastic.nodes[:, elastic.body.axes] + u.reshape(-1, d)
    turned = finite.internal_force(in_axes(elastic, points @ rotation.T)).reshape(-1, d)
    scale = np.abs(force).max()
    np.testing.assert_allclose(turned, force @ rotation.T, atol=1e-11 * scale)
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-11 * scale)
    moments = np.einsum("na,nb->ab", points, force)
    np.testing.assert_allclose(moments, moments.T, atol=1e-11 * scale)


def test_tangent_is_the_derivative(elastic):
    """Check by two central differences, exact since the force is cubic in the displacement."""
    u = disturbed(elastic)
    finite = TotalLagrangian(elastic)
    tangent = finite.tangent(u)
    direction = np.random.default_rng(1).standard_normal(elastic.size)

    def difference(h):
        return (
            finite.internal_force(u + h * direction) - finite.internal_force(u - h * direction)
        ) / (2.0 * h)

    exact = (4.0 * difference(0.01) - difference(0.02)) / 3.0
    np.testing.assert_allclose(tangent @ direction, exact, atol=1e-12 * np.abs(exact).max())
    assert np.abs(tangent - tangent.T).max() < 1e-13 * np.abs(tangent).max()


@pytest.mark.parametrize("stretch", [0.7, 1.5])
def test_uniaxial_stretch(box, stretch):
    """Check the second Piola-Kirchhoff stress E (λ² - 1)/2, and the force λ times that."""
    material = Material(1e5, 0.3)
    elastic = box((2, 2, 2), (0.0, 0.0, 0.0), (1.0, 2.0, 3.0), material, 1)
    strain = 0.5 * (stretch**2 - 1.0)
    across = np.sqrt(1.0 - 2.0 * material.poisson * strain)
    u = in_axes(elastic, elastic.nodes * [across, across, stretch])
    force = TotalLagrangian(elastic).internal_force(u).reshape(-1, 3)
    end = elastic.boundary_nodes("z1")
    expected = 1.0 * 2.0 * material.young * stretch * strain
    assert force[end, 2].sum() == pytest.approx(expected, rel=1e-12)
    ends = np.union1d(end, elastic.boundary_nodes("z0"))
    np.testing.assert_allclose(force[ends][:, :2], 0.0, atol=1e-11 * abs(expected))
    np.testing.assert_allclose(np.delete(force, ends, axis=0), 0.0, atol=1e-11 * abs(expected))


def elastica(load):
    """Return the tip of a cantilever under a dead force across it, ``(along, across)``.

    It is relative to the length. ``load`` is F L²/EI; elliptic integrals are as in Bisshopp &
    Drucker 1945, doi:10.1090/qam/13360.
    """
    root = np.sqrt(load)

    def excess(m):
        return ellipk(m) - ellipkinc(np.arcsin(np.sqrt(0.5 / m)), m) - root

    m = brentq(excess, 0.5 + 1e-12, 1.0 - 1e-12)
    start = np.arcsin(np.sqrt(0.5 / m))
    across = 1.0 - 2.0 / root * (ellipe(m) - ellipeinc(start, m))
    along = np.sqrt(2.0 * (2.0 * m - 1.0)) / root - 1.0
    return along, across


def test_elastica_in_print():
    """Check F L²/EI = 1 and 10 in the table of Mattiasson 1981, doi:10.1002/nme.1620170113."""
    np.testing.assert_allclose(elastica(1.0), [-0.05643, 0.30172], atol=6e-6)
    np.testing.assert_allclose(elastica(10.0), [-0.55500, 0.81061], atol=6e-6)


def bent(load, length):
    """Return the tip of a finite element cantilever over its length, ``(along, across)``."""
    elastic = beam(length, int(0.8 * length))
    force = load * elastic.material.young / 12.0 / length**2
    full = elastic.traction_load("tip", lambda x: np.full_like(x[0], force), ACROSS)
    u = np.zeros(elastic.size)
    for share in np.linspace(0.25, 1.0, 4):
        u = equilibrium(TotalLagrangian(elastic), share * full, clamped(elastic), u)
    return tip(elastic, u) / length


@pytest.mark.parametrize("load", [1.0, 4.0])
def test_cantilever_is_the_elastica(load):
    """Check that shear and stretch, not in the elastica, fall as (height/length)²."""
    short, long = bent(load, 25.0), bent(load, 50.0)
    np.testing.assert_allclose(long, elastica(load), atol=5e-4)
    np.testing.assert_allclose((4.0 * long - short) / 3.0, elastica(load), atol=3e-5)


def test_small_loads_are_linear(box, titanium):
    """Check that the error of the linear model grows as the square of the load."""
    elastic = box((2, 2, 3), (0.0, 0.0, 0.0), (1.0, 1.0, 3.0), titanium, 1)
    held = Constraints(len(elastic.nodes))
    held.hold(elastic.boundary_nodes("z0"))
    t, finite = held.transformation(), TotalLagrangian(elastic)
    load = elastic.traction_load("z1", lambda x: 300.0 * (1.0 + x[1]), np.array([0.6, 0.0, 0.8]))
    linear = solved(elastic.stiffness, load, t)
    errors = [
        np.abs(equilibrium(finite, share * load, t, share * linear) - share * linear).max()
        for share in (1.0, 0.5, 0.25)
    ]
    rates = np.log2(errors[:-1]) - np.log2(errors[1:])
    np.testing.assert_allclose(rates, 2.0, atol=0.1)


def test_buckling_load_of_a_column():
    """Check det(K + K_σ) = 0 at Euler's π² EI / 4 L², less the effect of shear (Engesser)."""
    length = 20.0
    elastic = beam(length, 20)
    t = clamped(elastic)
    press = elastic.traction_load("tip", lambda x: np.full_like(x[0], -1.0), ALONG)
    u = solved(elastic.stiffness, press, t)
    stiffness = (t.T @ elastic.stiffness @ t).toarray()
    stressed = (t.T @ TotalLagrangian(elastic).stress_stiffened(u) @ t).toarray()
    # (K_σ - K) φ = -(1/λ) K φ
    lowest = sl.eigh(stressed - stiffness, stiffness, eigvals_only=True, subset_by_index=[0, 0])[0]
    euler = np.pi**2 * elastic.material.young / 12.0 / (4.0 * length**2)
    shear = 5.0 / 6.0 * elastic.material.shear_modulus
    assert -1.0 / lowest == pytest.approx(euler / (1.0 + euler / shear), rel=2e-3)


def test_pulled_cantilever():
    """Check the tip of a beam under tension T: w = F/T (L - tanh(kL)/k), k² = T/EI.

    The linear stiffness does not depend on T; the stressed one agrees with the nonlinear body up to
    the stretch of the beam, here 5e-4.
    """
    length, across = 40.0, 1e-3
    elastic = beam(length, 40)
    finite, t = TotalLagrangian(elastic), clamped(elastic)
    bending = elastic.material.young / 12.0
    k = 3.0 / length
    pull = elastic.traction_load("tip", lambda x: np.full_like(x[0], k**2 * bending), ALONG)
    push = elastic.traction_load("tip", lambda x: np.full_like(x[0], across), ACROSS)
    linear = solved(elastic.stiffness, pull + push, t)
    stressed = solved(finite.stress_stiffened(linear), pull + push, t)
    nonlinear = equilibrium(finite, pull + push, t, linear)
    plain, stiffened, exact = (tip(elastic, u)[1] for u in (linear, stressed, nonlinear))
    closed = across / (k**2 * bending) * (length - np.tanh(3.0) / k)
    assert exact == pytest.approx(closed, rel=3e-3)
    assert stiffened == pytest.approx(exact, rel=1e-3)
    assert plain > 3.0 * exact


def test_rotation_angle():
    angles = np.array([0.0, 1e-9, 0.3, 2.0, np.pi])
    space = Rotation.from_rotvec(np.outer(angles, [0.6, 0.0, 0.8])).as_matrix()
    np.testing.assert_allclose(rotation_angle(space), angles, atol=1e-15)
    plane = Rotation.from_rotvec(np.outer(angles, [0.0, 0.0, 1.0])).as_matrix()[:, :2, :2]
    np.testing.assert_allclose(rotation_angle(plane), angles, atol=1e-15)
