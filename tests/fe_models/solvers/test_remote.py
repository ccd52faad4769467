"""Points tied to faces, rigidly or on average: statics, reciprocity, beams, symmetry, refusals."""

import numpy as np
import pytest
from skfem import MeshTet, MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.imported_structure import (
    ContactPair,
    Support,
    check_load,
    imported_mesh,
    imported_structure,
)
from fe_models.joints.friction import FrictionalJoint
from fe_models.loads.applied_loads import BoundaryForce, Displacement, RemoteDisplacement
from fe_models.loads.constraints import Constraints
from fe_models.loads.imposed import impose, tie_rigid
from fe_models.loads.rigid_motions import rigid_motions
from fe_models.meshes.structure_mesh import Body, MeshError
from fe_models.solvers.linear_solver import prepare
from sa_solver.types import Material
from tests.fe_models.imported_blocks import BODIES, block_and_pad, imported
from tests.marks import slow
from tests.mirrored_blocks import along, with_faces

STEEL = Material(200e3, 0.3)
NONE, ALL = np.zeros(6, bool), np.ones(6, bool)
AT = np.array([3.0, -1.0, 0.7])
IN_PLANE = [0, 2, 4]


def bar(order, dimension=3, material=STEEL):
    """Return a bar of 4 mm along x, the nodes of its left end, and its right end, a boundary."""
    x, y, z = along((0, 4, 6)), along((0, 1, 2)), along((0, 1.5, 2))
    mesh = MeshTet.init_tensor(x, y, z) if dimension == 3 else MeshTri.init_tensor(x, z)
    mesh = with_faces(mesh, {"left": (0, 0.0), "end": (0, 4.0)})
    return ElasticBody(Body("bar", mesh), material, order)


def held_at_left(elastic):
    constraints = Constraints(len(elastic.nodes), elastic.dimension)
    constraints.hold(elastic.boundary_nodes("left"))
    return constraints


def solved(elastic, constraints, forces, imposed=0.0):
    t = constraints.transformation()
    stiffness = (t.T @ elastic.stiffness @ t).tocsr()
    right = t.T @ (forces - elastic.stiffness @ (imposed + np.zeros(elastic.size)))
    return t @ prepare(stiffness)(right) + imposed


def reaction(elastic, displacement, forces=0.0, boundary="end", at=AT):
    """Return force and moment ``(6,)`` about a point that hold a boundary."""
    nodes = elastic.boundary_nodes(boundary)
    left = np.zeros((len(elastic.nodes), 3))
    residual = elastic.stiffness @ displacement - forces
    left[:, elastic.body.axes] = residual.reshape(-1, elastic.dimension)
    arms = elastic.nodes[nodes] - at
    return np.append(left[nodes].sum(axis=0), np.cross(arms, left[nodes]).sum(axis=0))


def remote(motion, rigid, free=NONE, boundary="end", at=AT):
    return RemoteDisplacement(boundary, at, np.array(motion, float), np.array(free, bool), rigid)


def moved_by(elastic, load, order_of=impose):
    constraints = held_at_left(elastic)
    imposed = order_of(constraints, elastic, load)
    return solved(elastic, constraints, np.zeros(elastic.size), imposed)


def unit_force(k, rigid, boundary="end", at=AT):
    unit = np.eye(6)[k]
    return BoundaryForce(boundary, unit[:3], at, unit[3:], rigid)


def pushed_by(elastic, load):
    constraints = held_at_left(elastic)
    if load.rigid:
        tie_rigid(constraints, elastic, load.boundary, elastic.nodes[-1])
    forces = load.forces(elastic)
    return solved(elastic, constraints, forces), forces


def mean_motion(elastic, displacement):
    """Return the mean motion of the end by least squares: the work of unit forces there."""
    return np.array([unit_force(k, False).forces(elastic) @ displacement for k in range(6)])


MODELS = [(3, 1), (3, 2), (2, 1), (2, 2)]


@pytest.mark.parametrize(("dimension", "order"), MODELS)
def test_rigid_face_moves_with_its_point(dimension, order):
    elastic = bar(order, dimension)
    motion = np.array([1e-3, 0.0, -2e-3, 0.0, 5e-4, 0.0])
    if dimension == 3:
        motion += [0, 3e-3, 0, 2e-4, 0, -4e-4]
    displacement = moved_by(elastic, remote(motion, True))
    nodes = elastic.boundary_nodes("end")
    exact = (rigid_motions(elastic.nodes[nodes] - AT, elastic.body.axes) @ motion).reshape(
        -1, dimension
    )
    found = displacement.reshape(-1, dimension)[nodes]
    np.testing.assert_allclose(found, exact, atol=1e-15)
    assert not displacement.reshape(-1, dimension)[elastic.boundary_nodes("left")].any()


@pytest.mark.parametrize(("dimension", "order"), MODELS)
def test_averaged_face_has_its_points_motion_on_average(dimension, order):
    """Check that it deforms, held by tractions that are linear over it."""
    elastic = bar(order, dimension)
    motion = np.zeros(6)
    motion[IN_PLANE] = 1e-3, -2e-3, 5e-4
    displacement = moved_by(elastic, remote(motion, False))
    np.testing.assert_allclose(mean_motion(elastic, displacement), motion, atol=1e-15)
    rigid = moved_by(elastic, remote(motion, True))
    assert np.abs(rigid - displacement).max() > 1e-6
    held = reaction(elastic, displacement)
    load = BoundaryForce("end", held[:3], AT, held[3:])
    residual = (elastic.stiffness @ displacement).reshape(-1, dimension)
    nodes = elastic.boundary_nodes("end")
    given = load.forces(elastic).reshape(-1, dimension)[nodes]
    np.testing.assert_allclose(residual[nodes], given, atol=1e-9 * np.abs(given).max())


@pytest.mark.parametrize("rigid", [True, slow(False)])
@pytest.mark.parametrize(("dimension", "order"), MODELS)
def test_forces_and_motions_of_a_point_are_reciprocal(dimension, order, rigid):
    """Check that stiffness of given motions is the inverse of the compliance under forces."""
    elastic = bar(order, dimension)
    known = list(range(6)) if dimension == 3 else IN_PLANE
    stiffness = np.stack(
        [reaction(elastic, moved_by(elastic, remote(np.eye(6)[k], rigid)))[known] for k in known]
    )
    compliance = np.stack(
        [mean_motion(elastic, pushed_by(elastic, unit_force(k, rigid))[0])[known] for k in known]
    )
    np.testing.assert_allclose(stiffness @ compliance, np.eye(len(known)), atol=1e-8)
    np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-9 * np.abs(stiffness).max())
    # Free components have no force; given ones follow from the compliance.
    free = np.ones(6, bool)
    free[[0, 4]] = False
    motion = np.array([1e-3, 0, 0, 0, 2e-4, 0])
    displacement = moved_by(elastic, remote(motion, rigid, free))
    held = reaction(elastic, displacement)[known]
    given = [known.index(0), known.index(4)]
    expected = np.zeros(len(known))
    expected[given] = np.linalg.solve(compliance[np.ix_(given, given)], [1e-3, 2e-4])
    np.testing.assert_allclose(held, expected, atol=1e-8 * np.abs(held).max())


@pytest.mark.parametrize("rigid", [True, False])
def test_slender_bar_is_a_beam(rigid):
    """Check M = E I θ / L and N = E A u / L, exact without lateral contraction."""
    elastic = bar(2, material=Material(200e3, 0.0))
    at = np.array([4.0, 0.5, 0.75])
    load = remote([2e-3, 0, 0, 0, 1e-4, 0], rigid, [0, 1, 1, 1, 0, 1], at=at)
    held = reaction(elastic, moved_by(elastic, load), at=at)
    area, inertia = 1.5, 1.5**3 / 12.0
    exact = [200e3 * area * 2e-3 / 4.0, 0, 0, 0, 200e3 * inertia * 1e-4 / 4.0, 0]
    np.testing.assert_allclose(held, exact, atol=1e-8 * max(exact))


@pytest.mark.parametrize("rigid", [True, False])
def test_force_at_a_point_is_balanced(rigid):
    """Check that the support has the same force, and its moment about any point."""
    elastic = bar(1)
    load = BoundaryForce("end", np.array([3.0, -5.0, 7.0]), AT, np.array([2.0, 0.0, -4.0]), rigid)
    displacement, forces = pushed_by(elastic, load)
    left = reaction(elastic, displacement, boundary="left")
    np.testing.assert_allclose(left, [-3, 5, -7, -2, 0, 4], atol=1e-9)
    np.testing.assert_allclose(reaction(elastic, displacement, forces), 0.0, atol=1e-9)
    nodes = elastic.boundary_nodes("end")
    face = displacement.reshape(-1, 3)[nodes]
    motions = rigid_motions(elastic.nodes[nodes] - AT)
    fit = motions @ np.linalg.lstsq(motions, face.ravel(), rcond=None)[0]
    assert (np.abs(fit - face.ravel()).max() < 1e-12 * np.abs(face).max()) == rigid


def test_two_loads_of_one_point_add_up():
    """Check that a rotation and a shift in two loads equal both in one load."""
    elastic = bar(1)
    for rigid in (True, False):
        constraints, imposed = held_at_left(elastic), np.zeros(elastic.size)
        for motion, given in (([1e-3, 0, 0, 0, 0, 0], 0), ([0, 0, 0, 0, 2e-4, 0], 4)):
            free = np.arange(6) != given
            imposed = imposed + impose(constraints, elastic, remote(motion, rigid, free))
        both = solved(elastic, constraints, np.zeros(elastic.size), imposed)
        free = [0, 1, 1, 1, 0, 1]
        one = moved_by(elastic, remote([1e-3, 0, 0, 0, 2e-4, 0], rigid, np.array(free, bool)))
        np.testing.assert_allclose(both, one, atol=1e-10 * np.abs(one).max())


@pytest.mark.parametrize("order", [1, 2])
def test_mean_of_a_face_is_of_its_own_nodes(order):
    """Check that rounding errors at nodes behind the face tie nothing."""
    elastic = bar(order)
    constraints = Constraints(len(elastic.nodes))
    impose(constraints, elastic, remote(np.ones(6), False))
    tied = constraints.supported
    np.testing.assert_array_equal(tied, np.sort(elastic.boundary_nodes("end")))


def test_means_of_a_rigid_face_are_its_motion():
    """Check that a motion on average of a face that a force keeps rigid is that of the face."""
    elastic = bar(2)
    motion = np.array([1e-3, 0, -2e-3, 3e-4, 1e-4, 0])
    constraints = held_at_left(elastic)
    tie_rigid(constraints, elastic, "end", AT)
    imposed = impose(constraints, elastic, remote(motion, False))
    found = solved(elastic, constraints, np.zeros(elastic.size), imposed)
    exact = moved_by(elastic, remote(motion, True))
    np.testing.assert_allclose(found, exact, atol=1e-10 * np.abs(exact).max())


def test_rigid_edge_of_nodes_on_a_line():
    """Check a plane boundary of one facet, and in space one whose own axis is no rotation."""
    constraints = Constraints(3)
    nodes = np.arange(3)
    points = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])
    constraints.follow(nodes, rigid_motions(points))
    t = constraints.transformation().toarray()
    assert t.shape == (9, 5)
    motions = rigid_motions(points)
    fit = motions @ np.linalg.lstsq(motions, t, rcond=None)[0]
    np.testing.assert_allclose(fit, t, atol=1e-14)


@pytest.mark.parametrize("first", [0, 1, 2, 3])
def test_a_mean_that_a_rigid_edge_takes_part_in(first):
    """Check that the edge is rigid and the mean is zero, whichever displacement is eliminated."""
    points = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [1.0, 0, 1.0]])
    weights = np.ones(4)
    weights[first] = 3.0
    constraints = Constraints(4)
    constraints.zero_mean(np.arange(4), weights, np.array([0.0, 0.0, 1.0]))
    constraints.follow(np.arange(3), rigid_motions(points[:3]))
    t = constraints.transformation().toarray()
    assert t.shape == (12, 5 + 3 - 1)
    np.testing.assert_allclose(weights @ t.reshape(4, 3, -1)[:, 2], 0.0, atol=1e-14)
    motions = rigid_motions(points[:3])
    fit = motions @ np.linalg.lstsq(motions, t[:9], rcond=None)[0]
    np.testing.assert_allclose(fit, t[:9], atol=1e-14)


# --- in a structure -------------------------------------------------------------------------------


def joined(imported, supports, loads, order=1):
    pair = ContactPair("foot", BODIES, ["top"], ["bottom"], np.array([1.0, 0.0, 0.0]))
    mesh = imported_mesh(imported, BODIES, [pair], supports)
    return imported_structure(mesh, imported, (STEEL, STEEL), supports, loads, order)


BASE, PLANE = Support("base", "xyz"), Support("plane", "normal")
PATH = np.array([[1.0, 0.0], [1.0, 1.0], [1.0, -1.0]])


def cycle_of(structure, path=PATH):
    joint = FrictionalJoint(structure.condense().resolvent(), 0.4)
    cycle = structure.solve_cycle(joint, path, structure.gap(), 0.4)
    assert cycle.converged
    return cycle


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("rigid", [True, False])
def test_half_model_equals_the_full_one(order, rigid):
    """Check a head that is pressed, then tilted and pushed, with symmetry across the tied face.

    The mean motion of half a face is that of the whole at the middle of the half, where odd
    components are left free; a rigid face needs no such care.
    """
    motions = [0, 0, -4e-3, 0, 0, 0], [8e-3, 0, 0, 0, -2e-4, 0]
    odd = np.array([0, 1, 0, 1, 0, 1], bool)
    cycles = []
    for whole, supports in ((False, [BASE, PLANE]), (True, [BASE])):
        at = np.array([0.0, 0.0 if whole or rigid else 0.5, 6.0])
        free = NONE if whole or rigid else odd
        loads = [remote(motion, rigid, free, "lid", at) for motion in motions]
        cycles.append(cycle_of(joined(block_and_pad(whole, False), supports, loads, order)))
    half, full = cycles
    (one,), (two,) = half.histories, full.histories
    largest = two.loads.P.max()
    for name in ("P", "Qx", "My"):
        values = getattr(one.loads, name), getattr(two.loads, name)
        np.testing.assert_allclose(2.0 * values[0], values[1], atol=1e-5 * largest)
    assert two.loads.Edx.sum() > 0.0


@pytest.mark.parametrize("rigid", [True, False])
def test_contact_carries_what_the_point_does(rigid):
    """Check that the contact's resultants are the force and moment at a point above the pad."""
    at = np.array([0.3, -0.2, 5.0])
    force, moment = np.array([20.0, -5.0, -200.0]), np.array([30.0, 20.0, 10.0])
    structure = joined(
        block_and_pad(True, False), [BASE], [BoundaryForce("lid", force, at, moment, rigid)]
    )
    cycle = cycle_of(structure, np.array([[1.0], [0.9]]))
    assert cycle.equilibrium.max() < 1e-7
    loads = cycle.histories[0].loads
    frame = cycle.histories[0].interface.frame
    about = np.cross(at - frame.origin, force) + moment
    found = np.array([loads.Qx[0], loads.Qy[0], loads.P[0], loads.Mx[0], loads.My[0], loads.Mz[0]])
    exact = -np.append(frame.axes @ force, frame.axes @ about)
    np.testing.assert_allclose(found, exact, atol=1e-4 * np.abs(exact).max())


def lid(motion, at=AT):
    return remote(motion, True, boundary="lid", at=at)


@pytest.mark.parametrize(
    ("supports", "loads", "wrong"),
    [
        ([Support("lid", "x")], [lid([1e-3] * 6)], "in which a support holds its nodes"),
        ([], [remote([1e-3] * 6, True, boundary="side")], "on nodes of a contact face"),
        ([], [BoundaryForce("side", np.ones(3), rigid=True)], "tied load couples nodes of a"),
        (
            [],
            [lid([1e-3, 0, 0, 0, 0, 0]), lid([0, 0, 0, 0, 1e-3, 0], 2.0 * AT)],
            "lid and lid share nodes",
        ),
        (
            [],
            [Displacement("lid", np.array([1e-3, 0, 0])), lid([0, 0, 0, 0, 0, 1e-3])],
            "or about one point",
        ),
        ([], [BoundaryForce("plane", np.ones(3), rigid=True)], "a boundary of lower and upper"),
        ([], [remote([1e-3] * 6, True, boundary="plane")], "each would be tied to it"),
    ],
)
def test_ties_that_cannot_be_are_refused(supports, loads, wrong):
    blocks = block_and_pad(True, False)
    upper = blocks.bodies["upper"].mesh
    blocks.bodies["upper"] = Body("upper", with_faces(upper, {"side": (0, 1.0)}))
    with pytest.raises(MeshError, match=wrong):
        joined(blocks, [BASE, *supports], loads)


def test_a_rotation_out_of_the_plane_is_refused():
    lower = MeshTri.init_tensor(along((-2, 2, 4)), along((-1, 0, 1)))
    upper = MeshTri.init_tensor(along((-1, 1, 2)), along((0, 1, 1)))
    blocks = imported(
        with_faces(lower, {"base": (1, -1.0), "top": (1, 0.0)}),
        with_faces(upper, {"bottom": (1, 0.0), "lid": (1, 1.0)}),
    )
    for motion, wrong in (
        ([0, 0, 0, 1e-3, 0, 0], "a rotation about x or z"),
        ([0, 1e-3, 0, 0, 0, 0], "a load acts along y"),
    ):
        with pytest.raises(MeshError, match=wrong):
            check_load(blocks, list(blocks.bodies.values()), remote(motion, True, boundary="lid"))


@pytest.mark.parametrize("rigid", [True, slow(False)])
def test_faces_of_curved_elements_follow_too(rigid):
    """Check that a rigid motion of a free body causes no strain, whatever its edges."""
    grid = np.linspace(0.0, 1.0, 3)
    mesh = with_faces(MeshTet.init_tensor(grid, grid, grid), {"end": (0, 1.0)})
    middles = mesh.p[:, mesh.edges].mean(axis=1).T
    off = np.random.default_rng(3).uniform(-0.03, 0.03, middles.shape)
    elastic = ElasticBody(Body("block", mesh, midsides=middles + off), STEEL, 2)
    constraints, motion = Constraints(len(elastic.nodes)), np.array([1e-3, 0, 2e-3, 0, 1e-4, 3e-4])
    imposed = impose(constraints, elastic, remote(motion, rigid))
    found = solved(elastic, constraints, np.zeros(elastic.size), imposed)
    exact = rigid_motions(elastic.nodes - AT) @ motion
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())
