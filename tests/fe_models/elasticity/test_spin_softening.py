"""Centrifugal force due to displacement: rotating bars and carried masses in closed form."""

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from skfem import MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.spin_softening import CarriedMass, carried_motion, spin_softening
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import Body
from sa_solver.types import Material

SPEED = 40.0


def test_of_the_places_it_is_the_centrifugal_load(box, titanium):
    """Check Ω² M X, for elements of both orders."""
    for order in (1, 2):
        elastic = box((2, 2, 2), (0.5, 0.0, 3.0), (1.0, 1.5, 5.0), titanium, order)
        force = spin_softening(elastic, SPEED) @ elastic.nodes.ravel()
        load = SPEED**2 * elastic.centrifugal_load()
        np.testing.assert_allclose(force, load, atol=1e-12 * np.abs(load).max())


def test_rotating_bar(box):
    """Check E u'' + ρ Ω² (r + u) = 0, held at r = 2 and free at 10.

    The solution is r + u = 2 cos k(r-2) + C sin k(r-2) with k² = ρ Ω² / E; without softening the
    same bar stretches a quarter less.
    """
    material = Material(1e5, 0.0, 1e5 * (0.1 / SPEED) ** 2)
    elastic = box((1, 1, 8), (0.0, 0.0, 2.0), (1.0, 1.0, 10.0), material, 2)
    held = Constraints(len(elastic.nodes))
    for across in np.eye(3)[:2]:
        held.slide(np.arange(len(elastic.nodes)), np.tile(across, (len(elastic.nodes), 1)))
    held.hold(elastic.boundary_nodes("z0"))
    t = held.transformation()
    matrix = elastic.stiffness - spin_softening(elastic, SPEED)
    load = SPEED**2 * elastic.centrifugal_load()
    u = (t @ spla.spsolve((t.T @ matrix @ t).tocsc(), t.T @ load)).reshape(-1, 3)[:, 2]
    k, r = 0.1, elastic.nodes[:, 2]
    slope = (1.0 + 2.0 * k * np.sin(8.0 * k)) / (k * np.cos(8.0 * k))
    exact = 2.0 * np.cos(k * (r - 2.0)) + slope * np.sin(k * (r - 2.0)) - r
    # The error of eight quadratic elements is 7e-5.
    np.testing.assert_allclose(u, exact, atol=1e-4 * exact.max())


def plane_box(titanium):
    mesh = MeshTri.init_tensor(np.linspace(-1.0, 2.0, 4), np.linspace(4.0, 6.0, 3))
    top = {"z1": lambda x: np.isclose(x[1], 6.0)}
    return ElasticBody(Body("plane", mesh.with_boundaries(top)), titanium, 1)


@pytest.fixture(params=["space", "plane"])
def elastic(request, box, titanium):
    if request.param == "plane":
        return plane_box(titanium)
    return box((3, 2, 2), (-1.0, 0.0, 4.0), (2.0, 1.5, 6.0), titanium, 2)


def test_carried_mass_moves_with_the_body(elastic):
    """Check that in a small rigid motion of the body the mass has the same motion."""
    carried = CarriedMass("z1", 1.0, np.array([0.3, 0.7, 9.0]))
    motion = carried_motion(elastic, carried)
    axes = list(elastic.body.axes)
    rng = np.random.default_rng(0)
    shift, turn = rng.standard_normal((2, 3))
    if elastic.dimension == 2:
        turn[[0, 2]] = 0.0
    u = (shift + np.cross(turn, elastic.nodes))[:, axes].ravel()
    expected = (shift + np.cross(turn, carried.centre))[axes]
    np.testing.assert_allclose(motion @ u, expected, rtol=1e-12)


def test_carried_mass_pulls_where_it_is(elastic):
    """Check that its force has the moment of m Ω² d at its centre, d across the axis."""
    mass, centre = 1e-3, np.array([0.3, 0.7, 9.0])
    bare = spin_softening(elastic, SPEED)
    loaded = spin_softening(elastic, SPEED, [CarriedMass("z1", mass, centre)])
    assert np.abs(loaded - loaded.T).max() < 1e-15 * np.abs(loaded).max()
    axes = list(elastic.body.axes)
    u = np.zeros((len(elastic.nodes), 3))
    u[:, axes] = np.array([0.01, 0.02, 0.03])[axes]
    forces = np.zeros_like(u)
    forces[:, axes] = ((loaded - bare) @ u[:, axes].ravel()).reshape(-1, len(axes))
    pull = mass * SPEED**2 * np.array([0.01, 0.0, 0.03])
    np.testing.assert_allclose(forces.sum(axis=0), pull, atol=1e-12)
    moment = np.cross(elastic.nodes, forces).sum(axis=0)
    expected = np.cross(centre, pull)
    if elastic.dimension == 2:
        expected = expected * [0.0, 1.0, 0.0]
    np.testing.assert_allclose(moment, expected, atol=1e-12)
