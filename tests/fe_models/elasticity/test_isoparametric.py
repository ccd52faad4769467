"""Elements with curved edges: linear fields exact, volumes, balances, Lamé's cylinder."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from skfem import MeshTet, MeshTri

from fe_models.cyclic.cuts import Cuts, Cyclic
from fe_models.elasticity.body import ElasticBody, tensors
from fe_models.elasticity.recovery import StressRecovery
from fe_models.elasticity.spin_softening import spin_softening
from fe_models.elasticity.total_lagrangian import TotalLagrangian
from fe_models.loads.constraints import Constraints
from fe_models.loads.rigid_motions import rigid_motions
from fe_models.meshes.isoparametric import facet_normals, folded
from fe_models.meshes.structure_mesh import Body, MeshError
from sa_solver.types import Material

STEEL = Material(210e3, 0.3, 7.8e-9)
GRID = np.linspace(0.0, 1.0, 3)
# The body is far from the origin, as bodies of an assembly are.
MESHES = {
    2: MeshTri.init_tensor(GRID, GRID).translated((40.0, 70.0)),
    3: MeshTet.init_tensor(GRID, GRID, GRID).translated((40.0, 70.0, -20.0)),
}


def edges(mesh):
    return mesh.edges if mesh.dim() == 3 else mesh.facets


def middles(mesh):
    return mesh.p[:, edges(mesh)].mean(axis=1).T


@pytest.fixture(params=[2, 3])
def perturbed(request):
    """Return a block with all midside nodes up to 6 % of their edges off their middle."""
    mesh = MESHES[request.param]
    mesh = mesh.with_boundaries(
        {"skin": lambda x: x[0] > 0.0, "low": lambda x: x[0] < 40.1, "high": lambda x: x[0] > 40.9}
    )
    off = np.random.default_rng(3).uniform(-0.03, 0.03, middles(mesh).shape)
    body = Body("block", mesh, midsides=middles(mesh) + off)
    assert not folded(body).any()
    return ElasticBody(body, STEEL, order=2)


def in_body(elastic):
    return elastic.nodes[:, elastic.body.axes]


def test_nodes_are_where_the_file_has_them(perturbed):
    body = perturbed.body
    np.testing.assert_array_equal(in_body(perturbed)[: body.mesh.nvertices], body.mesh.p.T)
    np.testing.assert_array_equal(in_body(perturbed)[body.mesh.nvertices :], body.midsides)


def test_rigid_motions_take_no_force(perturbed):
    motions = rigid_motions(perturbed.nodes - perturbed.nodes.mean(axis=0), perturbed.body.axes)
    force = perturbed.stiffness @ motions
    assert np.abs(force).max() < 1e-11 * abs(perturbed.stiffness).max()


def test_constant_strain_is_exact(perturbed):
    """Check uniform stress, and nodal forces that are those of its traction on the surface."""
    d = perturbed.dimension
    gradient = np.random.default_rng(1).standard_normal((d, d)) * 1e-3
    displacement = (in_body(perturbed) @ gradient.T).ravel()
    spatial = np.zeros((3, 3, 1))
    spatial[np.ix_(perturbed.body.axes, perturbed.body.axes)] = gradient[..., None]
    exact = perturbed.cauchy(spatial)
    size = np.abs(exact).max()
    np.testing.assert_allclose(
        perturbed.stress(displacement) - exact, 0.0, rtol=0, atol=1e-11 * size
    )
    recovered = StressRecovery(perturbed, np.empty(0, np.int64)).stress(displacement)
    np.testing.assert_allclose(recovered - exact, 0.0, rtol=0, atol=1e-9 * size)
    stress = tensors(exact)[..., 0]
    # A pressure is -n times it: the tensor turns n into the traction.
    normal = -perturbed.pressure_load("skin").reshape(-1, d)
    expected = normal @ stress[np.ix_(perturbed.body.axes, perturbed.body.axes)]
    force = (perturbed.stiffness @ displacement).reshape(-1, d)
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-11 * np.abs(force).max())


def test_large_rotation_takes_no_force(perturbed):
    lagrangian, d = TotalLagrangian(perturbed), perturbed.dimension
    turn = np.eye(d)
    turn[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    moved = (in_body(perturbed) @ (turn - np.eye(d)).T).ravel()
    force = lagrangian.internal_force(moved)
    assert np.abs(force).max() < 1e-10 * abs(perturbed.stiffness).max()
    tangent = lagrangian.tangent(np.zeros(perturbed.size))
    difference = abs(tangent - perturbed.stiffness).max()
    assert difference < 1e-11 * abs(perturbed.stiffness).max()


def test_pressure_all_round_balances(perturbed):
    d = perturbed.dimension
    force = perturbed.pressure_load("skin").reshape(-1, d)
    arms = in_body(perturbed) - in_body(perturbed).mean(axis=0)
    moments = np.einsum("na,nb->ab", arms, force)
    volume = perturbed.basis().dx.sum()
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-13)
    # ∫ x n dA = V 1: no moments, and the volume.
    np.testing.assert_allclose(moments, -volume * np.eye(d), atol=1e-11)


def test_weight_and_centrifugal_force_are_those_of_the_mass(perturbed):
    """Compare rotation and softening with ρ Ω² times the mass matrix on positions."""
    d = perturbed.dimension
    load = perturbed.centrifugal_load().reshape(-1, d)
    places = in_body(perturbed).copy()
    if d == 3:
        places[:, 1] = 0.0
    of_mass = (perturbed.mass @ places.ravel()).reshape(-1, d)
    np.testing.assert_allclose(load, of_mass, rtol=0, atol=1e-12 * np.abs(load).max())
    volume = perturbed.basis().dx.sum()
    total = perturbed.mass.sum() / d
    assert total == pytest.approx(STEEL.density * volume, rel=1e-13)
    softening = spin_softening(perturbed, 100.0) @ in_body(perturbed).ravel()
    np.testing.assert_allclose(softening, 1e4 * load.ravel(), atol=1e-9 * np.abs(softening).max())


def test_free_expansion_takes_no_force(perturbed):
    """Check the free expansion, (1 + ν) θ in plane strain, where it is held across."""
    strain = 1e-3
    free = (1.3 if perturbed.dimension == 2 else 1.0) * strain
    load = perturbed.thermal_load(np.full(perturbed.body.mesh.nvertices, strain))
    middle = in_body(perturbed).mean(axis=0)
    force = perturbed.stiffness @ (free * (in_body(perturbed) - middle)).ravel()
    np.testing.assert_allclose(force, load, rtol=0, atol=1e-11 * np.abs(load).max())


def circle(rings, curved, inner=10.0, outer=20.0):
    """Return a quarter of a thick-walled cylinder, with straight or circular edges."""
    r, angle = np.linspace(inner, outer, rings + 1), np.linspace(0.0, 0.5 * np.pi, rings + 1)
    mesh = MeshTri.init_tensor(r, angle)
    places = mesh.p.copy()

    def placed(polar):
        return polar[0] * np.stack([np.cos(polar[1]), np.sin(polar[1])])

    round_ = placed(middles(mesh).T).T
    named = mesh.with_boundaries(
        {
            "bore": lambda x: x[0] == inner,
            "outside": lambda x: x[0] == outer,
            "x": lambda x: x[1] == 0.0,
            "z": lambda x: x[1] == 0.5 * np.pi,
        }
    )
    body = Body("ring", replace(named, doflocs=placed(places)), midsides=round_ if curved else None)
    return ElasticBody(body, STEEL, order=2)


def lame(r, inner=10.0, outer=20.0, pressure=100.0):
    """Return radial displacement and radial and hoop stress of plane strain.

    Source: Timoshenko & Goodier, §28.
    """
    a = pressure * inner**2 / (outer**2 - inner**2)
    radial, hoop = a * (1.0 - (outer / r) ** 2), a * (1.0 + (outer / r) ** 2)
    strain = ((1.0 - 0.09) * hoop - 0.3 * 1.3 * radial) / STEEL.young
    return strain * r, radial, hoop


def expand(elastic, pressure=100.0):
    """Return the displacement of a quarter under internal pressure."""
    held = np.concatenate([2 * elastic.boundary_nodes("x") + 1, 2 * elastic.boundary_nodes("z")])
    free = np.setdiff1d(np.arange(elastic.size), held)
    load = pressure * elastic.pressure_load("bore")
    displacement = np.zeros(elastic.size)
    displacement[free] = spsolve(elastic.stiffness[free][:, free].tocsc(), load[free])
    return displacement


def lame_errors(rings, curved):
    elastic = circle(rings, curved)
    displacement = expand(elastic)
    vertices = elastic.body.mesh.nvertices
    places = in_body(elastic)[:vertices]
    r = np.linalg.norm(places, axis=1)
    radial = np.einsum("na,na->n", displacement.reshape(-1, 2)[:vertices], places) / r
    u, _, hoop = lame(r)
    mesh = elastic.body.mesh
    free = mesh.boundaries["outside"]
    stress = tensors(StressRecovery(elastic, free).stress(displacement))
    along = np.stack([-places[:, 1], np.zeros(vertices), places[:, 0]], axis=1) / r[:, None]
    found = np.einsum("na,abn,nb->n", along, stress, along)
    return np.abs(radial - u).max() / u.max(), np.abs(found - hoop).max() / hoop.max()


def rates(errors):
    """Return the powers of the element size with which errors fall between meshes."""
    return np.log2(np.array(errors)[:-1] / np.array(errors)[1:])


def test_thick_walled_cylinder():
    """Check the third order of displacement and stress, which straight edges lose.

    The largest errors over the nodes, with 32 elements through the wall, are 4e-6 and 5e-4 instead
    of 4e-4 and 1.5e-3.
    """
    sizes = (8, 16, 32)
    straight, curved = (np.array([lame_errors(n, c) for n in sizes]) for c in (False, True))
    np.testing.assert_allclose(rates(straight), 2.0, atol=0.15)
    assert rates(curved).min() > 2.6
    assert curved[-1, 0] < 4e-6 < 3e-4 < straight[-1, 0]
    assert curved[-1, 1] < 5e-4 < 1.4e-3 < straight[-1, 1]


def ball(refinements, curved):
    """Return a ball of radius 1 mm, with flat facets or midside nodes on the sphere."""
    mesh = MeshTet.init_ball(refinements).with_boundaries({"skin": lambda x: x[0] < 9.0})
    places = middles(mesh)
    outside = np.unique(mesh.f2e[:, mesh.boundary_facets()])
    places[outside] /= np.linalg.norm(places[outside], axis=1, keepdims=True)
    return ElasticBody(Body("ball", mesh, midsides=places if curved else None), STEEL, order=2)


def test_ball():
    """Check volume and area with h⁴ instead of h², radial normals, and balanced pressure."""
    errors = []
    for curved in (False, True):
        bodies = [ball(n, curved) for n in (1, 2, 3)]
        volumes = [body.basis().dx.sum() for body in bodies]
        areas = [body.boundary_weights("skin")[1].sum() for body in bodies]
        errors.append(np.array([volumes, areas]).T / [4.0 / 3.0 * np.pi, 4.0 * np.pi] - 1.0)
        for body in bodies:
            force = body.pressure_load("skin").reshape(-1, 3)
            np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-13)
            np.testing.assert_allclose(np.cross(body.nodes, force).sum(axis=0), 0.0, atol=1e-12)
    straight, curved = np.abs(errors)
    np.testing.assert_allclose(rates(straight), 2.0, atol=0.26)
    np.testing.assert_allclose(rates(curved), 4.0, atol=0.26)
    assert np.all(curved[-1] < 7e-5)
    nodes, normals = bodies[-1].boundary_normals("skin")
    np.testing.assert_allclose(normals, bodies[-1].nodes[nodes], atol=1e-3)


def test_stress_round_a_hole_without_tractions():
    """Check that normals of a coarse hole are radial: no vertex counts as a corner."""
    elastic = circle(4, curved=True)
    recovery = StressRecovery(elastic, elastic.body.mesh.boundaries["bore"])
    mean, smooth, inwards, _ = recovery._surface(elastic.body.mesh.boundaries["bore"])
    bore = elastic.body.vertices("bore")
    assert smooth[bore].all()
    assert not inwards[bore].any()
    places = elastic.body.points[bore]
    np.testing.assert_allclose(mean[bore], -places / 10.0, atol=0.05)


def test_normals_go_on_in_the_next_sector():
    """Check radial normals at a cut of a wheel; one sector alone has an error of 1e-3."""
    elastic = circle(4, curved=True)
    cyclic = Cyclic(["x"], ["z"], np.array([0.0, 1.0, 0.0]), np.zeros(3), 4)
    cuts = Cuts.of(elastic.body, cyclic)
    assert cuts.matched
    nodes, alone = elastic.boundary_normals("bore")
    radii = in_body(elastic)[nodes] / np.linalg.norm(in_body(elastic)[nodes], axis=1)[:, None]
    assert np.abs(alone + radii).max() > 1e-3
    _, normals = elastic.boundary_normals("bore", partial(cuts.whole_normals, elastic))
    np.testing.assert_allclose(normals, -radii, atol=1e-12)


def test_cuts_whose_midsides_are_no_images_are_refused():
    elastic = circle(2, curved=True)
    cyclic = Cyclic(["x"], ["z"], np.array([0.0, 1.0, 0.0]), np.zeros(3), 4)
    moved = elastic.body.midsides.copy()
    moved[elastic.body.mesh.boundaries["x"], 0] += 0.1
    body = replace(elastic.body, midsides=moved)
    cuts = Cuts.of(body, cyclic)
    with pytest.raises(MeshError, match=r"cuts .* 0\.1 mm"):
        cuts.tie(Constraints(len(elastic.nodes), 2), ElasticBody(body, STEEL, order=2))


def test_far_places_of_faces_are_found():
    """Check points with large coordinates, for which scikit-fem's search never ends."""
    elastic = ball(1, curved=True)
    far = replace(elastic.body.mesh, doflocs=1e-3 * elastic.body.mesh.p + 1e3)
    body = Body("far", far, midsides=1e-3 * elastic.body.midsides + 1e3)
    near = elastic.boundary_weights("skin")[1].sum()
    total = ElasticBody(body, STEEL, order=2).boundary_weights("skin")[1].sum()
    assert total == pytest.approx(1e-6 * near, rel=1e-8)


def test_folded_elements_are_found():
    mesh = MESHES[2]
    places = middles(mesh)
    inner = np.argmin(np.linalg.norm(mesh.facets - [[4], [1]], axis=0))
    places[inner] += 0.4
    wrong = folded(Body("block", mesh, midsides=places))
    np.testing.assert_array_equal(
        np.flatnonzero(wrong), np.flatnonzero((mesh.t2f == inner).any(axis=0))
    )


def test_facet_normals_in_the_middle_of_an_arc():
    mesh = MeshTri().with_boundaries({"top": lambda x: x[1] == 1.0})
    places = middles(mesh)
    (top,) = mesh.boundaries["top"]
    places[top] += [0.0, 0.1]
    normals = facet_normals(Body("arc", mesh, midsides=places), np.array([top]))[0]
    slope = normals[:, 0] / normals[:, 2]
    # The parabola 1 + 0.4 x (1 - x) at its ends and in its middle.
    np.testing.assert_allclose(np.sort(slope), [-0.4, 0.0, 0.4], atol=1e-14)
    assert np.all(normals[:, 2] > 0.0)
