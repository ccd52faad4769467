"""Structures of more than two bodies, compared with one body, springs in series, and statics."""

from itertools import pairwise

import numpy as np
import pytest
from skfem import MeshTet, MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.stress import cycle_stresses
from fe_models.geometry.imported import ImportedMesh
from fe_models.imported_structure import ContactPair, Support, imported_mesh, imported_structure
from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.loads.applied_loads import BoundaryForce, Pressure
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import Body, MeshError
from fe_models.motion import deformation, structure_motion
from fe_models.solvers.linear_solver import prepare
from sa_solver.types import Material
from tests.mirrored_blocks import along, with_faces

STEEL = Material(200e3, 0.3, 7.8e-9)
GLUED = 50.0
X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


@pytest.fixture(autouse=True)
def precise(monkeypatch):
    """Solve to the last digits, so that differences are not due to the friction solver."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-12)


def box(x, y, z):
    """Return a box of tetrahedra between coordinates, with faces named x0 ... z1."""
    return MeshTet.init_tensor(x, y, z), {
        f"{name}{end}": (axis, places[k])
        for axis, (name, places) in enumerate(zip("xyz", (x, y, z), strict=True))
        for end, k in ((0, 0), (1, -1))
    }


def imported(**boxes):
    """Return bodies of such boxes, with each face named after its body."""
    bodies = {
        name: Body(name, with_faces(mesh, {f"{name}_{f}": where for f, where in faces.items()}))
        for name, (mesh, faces) in boxes.items()
    }
    numbers = {name: np.arange(body.mesh.nvertices) for name, body in bodies.items()}
    return ImportedMesh(bodies, numbers, {name: {} for name in bodies})


def pair(name, one, two, x=X):
    """Return a contact between faces such as ``base_z1`` and ``pad_z0``."""
    bodies = one.split("_")[0], two.split("_")[0]
    return ContactPair(name, bodies, [one], [two], x)


def built(mesh, pairs, supports, loads, order=1, materials=None):
    names = list(mesh.bodies)
    joined = imported_mesh(mesh, names, pairs, supports)
    materials = [STEEL] * len(names) if materials is None else materials
    return imported_structure(joined, mesh, materials, supports, loads, order)


def marched(structure, amplitudes, mu=GLUED):
    """Return the states along a path of amplitudes, from rest."""
    joint = FrictionalJoint(structure.condense().resolvent(), mu)
    states = list(joint.march(np.atleast_2d(amplitudes), structure.gap()))
    assert all(state.converged for state in states)
    return states


def one_body(mesh, held, loads, order):
    """Return displacements of a single body under loads, clamped where ``held``."""
    elastic = ElasticBody(mesh, STEEL, order)
    constraints = Constraints(len(elastic.nodes))
    constraints.hold(elastic.boundary_nodes(held))
    t = constraints.transformation()
    forces = sum(load.forces(elastic) for load in loads)
    stiffness = (t.T @ elastic.stiffness @ t).tocsr()
    return elastic, t @ prepare(stiffness)(t.T @ forces)


STACK = {"base": (-1.0, 0.0, 2), "ring": (0.0, 0.5, 2), "pad": (0.5, 1.5, 3)}
PUSHED = np.array([120.0, 30.0, 0.0])


def stack(order, flipped=()):
    """Return three stacked blocks that stick, and the same as a single body.

    Contacts that are ``flipped`` have their upper block as body 1.
    """
    x, y = along((0, 2, 4)), along((0, 1, 2))
    mesh = imported(**{name: box(x, y, along(z)) for name, z in STACK.items()})
    faces = [("low", "base_z1", "ring_z0"), ("high", "ring_z1", "pad_z0")]
    pairs = [pair(name, *(reversed(sides) if name in flipped else sides)) for name, *sides in faces]
    loads = [Pressure("pad_z1", 400.0), BoundaryForce("pad_z1", PUSHED)]
    structure = built(mesh, pairs, [Support("base_z0", "xyz")], loads, order)
    whole, faces = box(x, y, along(*STACK.values()))
    body = Body("whole", with_faces(whole, faces))
    same = [Pressure("z1", 400.0), BoundaryForce("z1", PUSHED)]
    return structure, one_body(body, "z0", same, order)


@pytest.mark.parametrize("flipped", [(), ("high",), ("low", "high")])
def test_blocks_that_stick_are_one_body(flipped):
    """Check a held base with ring and pad held by contact, whichever is body 1."""
    structure, (elastic, exact) = stack(1, flipped)
    (state,) = marched(structure, np.ones(2))
    assert (state.force[2] > 0.0).all()
    assert np.abs(state.displacement).max() < 1e-9 * np.abs(exact).max()
    moved = deformation(structure, state.force, state.displacement, np.ones(2))
    for body, own in zip(structure.bodies, moved, strict=True):
        there = {
            tuple(p): u
            for p, u in zip(np.round(elastic.nodes, 9), exact.reshape(-1, 3), strict=True)
        }
        expected = np.array([there[tuple(p)] for p in np.round(body.elastic.nodes, 9)])
        np.testing.assert_allclose(own.reshape(-1, 3), expected, atol=1e-9 * np.abs(exact).max())
    assert structure.equilibrium_errors([state], np.ones((1, 2))).max() < 1e-9


def test_second_order_blocks_that_stick_are_nearly_one_body():
    """Check agreement up to the mesh error, since faces meet as linear fields."""
    structure, (_, exact) = stack(2)
    (state,) = marched(structure, np.ones(2))
    moved = deformation(structure, state.force, state.displacement, np.ones(2))
    largest = np.abs(exact).max()
    assert np.abs(moved[-1]).max() == pytest.approx(largest, rel=5e-3)
    assert structure.equilibrium_errors([state], np.ones((1, 2))).max() < 1e-9


def blocks_side_by_side():
    """Return two blocks on the halves of a base, pressed together above their lowest layer."""
    y, low, high = along((0, 1, 2)), along((-1, 0, 2)), along((0, 1, 3))
    mesh = imported(
        base=box(along((0, 0.9, 3), (0.9, 1.1, 1), (1.1, 2, 3)), y, low),
        left=box(along((0, 1, 3)), y, high),
        right=box(along((1, 2, 3)), y, high),
    )
    for body, name, axis, at, where in (
        ("base", "base_left", 2, 0.0, lambda p: p[0] < 0.9),
        ("base", "base_right", 2, 0.0, lambda p: p[0] > 1.1),
        ("left", "left_side", 0, 1.0, lambda p: p[2] > 1.0 / 3.0),
        ("right", "right_side", 0, 1.0, lambda p: p[2] > 1.0 / 3.0),
    ):
        part = mesh.bodies[body].mesh
        facets = part.facets_satisfying(
            lambda p, axis=axis, at=at, where=where: np.isclose(p[axis], at) & where(p)
        )
        mesh.bodies[body] = Body(body, part.with_boundaries({name: facets}))
    return mesh


def test_three_bodies_that_all_touch_each_other():
    """Check blocks side by side on a base: the left one is body 2 below and body 1 beside."""
    mesh = blocks_side_by_side()
    pairs = [
        pair("l", "base_left", "left_z0"),
        pair("r", "base_right", "right_z0"),
        pair("m", "left_side", "right_side", Z),
    ]
    loads = [
        *(Pressure(f"{name}_z1", 300.0) for name in ("left", "right")),
        Pressure("left_x0", 250.0),
        Pressure("right_x1", 250.0),
    ]
    structure = built(mesh, pairs, [Support("base_z0", "xyz")], loads)
    (state,) = marched(structure, np.ones(4), 0.3)
    resultants = structure.interface_resultants(state)
    # Statics: 300 MPa on 1 mm² each; what crosses the middle is 250 N less friction on the base.
    assert resultants[:2, 0] == pytest.approx(300.0, abs=0.3 * 250.0 + 1e-6)
    assert resultants[:2, 0].sum() == pytest.approx(600.0, rel=1e-9)
    assert resultants[2, 0] == pytest.approx(250.0 + resultants[0, 1], rel=1e-6)
    assert structure.equilibrium_errors([state], np.ones((1, 4))).max() < 1e-9
    # Displacements of all bodies agree with the contact's relative displacements.
    motion = structure_motion(
        structure, state.force[None], state.displacement[None], np.ones((1, 4)), [0]
    )
    for (one, two), (interface, nodes) in zip(motion.faces, structure.shares(), strict=True):
        np.testing.assert_allclose(
            (two - one)[0], state.displacement[:, nodes], atol=1e-12 * np.abs(two).max() + 1e-15
        )
        body = structure.bodies[interface.bodies[0]]
        own = motion.displacements[interface.bodies[0]][:, 0].reshape(-1, 3)
        at_nodes = own[interface.nodes_1] @ interface.frame.axes.T
        if interface.projection is not None:
            at_nodes = interface.projection @ at_nodes
        np.testing.assert_allclose(one[0].T, at_nodes, atol=1e-8 * np.abs(own).max())
        assert body.elastic.body.name == structure.mesh.bodies[interface.bodies[0]].name


def test_columns_are_springs_in_series():
    """Check bars of different stiffness without Poisson's effect: F = Δ / Σ (L / E A)."""
    x, y = along((0, 1, 2)), along((0, 1, 2))
    moduli, heights = (200e3, 50e3, 100e3, 70e3), (1.0, 0.5, 2.0, 1.0)
    ends = np.insert(np.cumsum(heights), 0, 0.0)
    names = [f"bar{k}" for k in range(4)]
    bars = {
        name: box(x, y, along((low, high, 2)))
        for name, (low, high) in zip(names, pairwise(ends), strict=True)
    }
    mesh = imported(**bars)
    pairs = [
        pair(f"c{k}", f"{one}_z1", f"{two}_z0") for k, (one, two) in enumerate(pairwise(names))
    ]
    materials = [Material(young, 0.0, 7.8e-9) for young in moduli]
    loads = [Pressure("bar3_z1", 100.0)]
    structure = built(mesh, pairs, [Support("bar0_z0", "xyz")], loads, 1, materials)
    (state,) = marched(structure, np.ones(1), 0.3)
    assert structure.condense().rigid_modes == 18
    np.testing.assert_allclose(structure.interface_resultants(state)[:, 0], 100.0, rtol=1e-9)
    moved = deformation(structure, state.force, state.displacement, np.ones(1))
    top = structure.bodies[3].elastic.boundary_nodes("bar3_z1")
    shortened = 100.0 * sum(length / young for length, young in zip(heights, moduli, strict=True))
    np.testing.assert_allclose(moved[3].reshape(-1, 3)[top, 2], -shortened, rtol=1e-8)
    fields = state.force[None], state.displacement[None]
    (stress,) = cycle_stresses(structure, [fields], np.ones((1, 1)), 0)
    for field in stress.fields:
        np.testing.assert_allclose(field.stress[2], -100.0, rtol=1e-6)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("over", [False, True])
def test_meshes_of_their_own_carry_the_load_through(order, over):
    """Check that forces and moments cross a ring between plates with other nodes.

    The plates extend beyond the ring, be they body 1 or body 2.
    """
    y, x = along((0, 1, 3)), along((0, 2, 5))
    mesh = imported(
        base=box(along((-1, 3, 8)), along((-1, 2, 6)), along((-1, 0, 2))),
        ring=box(x, y, along((0, 0.5, 2))),
        plate=box(along((-1, 3, 7)), along((-1, 2, 5)), along((0.5, 1.5, 2))),
    )
    faces = {"low": ("base_z1", "ring_z0"), "high": ("plate_z0", "ring_z1")}
    pairs = [pair(name, *(reversed(two) if over else two)) for name, two in faces.items()]
    loads = [Pressure("plate_z1", 20.0), BoundaryForce("plate_z1", np.array([40.0, 0.0, 0.0]))]
    structure = built(mesh, pairs, [Support("base_z0", "xyz")], loads, order)
    path = np.array([[1.0, 0.0], [1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
    states = marched(structure, path, 0.6)
    for state, (_, push) in zip(states, path, strict=True):
        low, high = structure.interface_resultants(state)
        for contact in (low, high):
            np.testing.assert_allclose(contact[0], 240.0, rtol=1e-9)
            np.testing.assert_allclose(abs(contact[1]), 40.0 * abs(push), atol=1e-6)
    assert structure.equilibrium_errors(states, path).max() < 1e-9


def test_in_the_plane():
    """Check that three stacked strips that stick are one strip."""
    x = along((0, 2, 6))
    heights = {"base": (-1.0, 0.0, 2), "ring": (0.0, 0.5, 2), "pad": (0.5, 1.5, 3)}

    def strip(z):
        ends = {"z0": (1, z[0]), "z1": (1, z[-1])}
        return MeshTri.init_tensor(x, z), ends

    mesh = imported(**{name: strip(along(z)) for name, z in heights.items()})
    pairs = [pair("low", "base_z1", "ring_z0"), pair("high", "ring_z1", "pad_z0")]
    loads = [Pressure("pad_z1", 400.0), BoundaryForce("pad_z1", PUSHED * [1.0, 0.0, 1.0])]
    structure = built(mesh, pairs, [Support("base_z0", "xz")], loads)
    (state,) = marched(structure, np.ones(2))
    moved = deformation(structure, state.force, state.displacement, np.ones(2))
    whole, faces = strip(along(*heights.values()))
    elastic = ElasticBody(Body("whole", with_faces(whole, faces)), STEEL, 1)
    constraints = Constraints(len(elastic.nodes), 2)
    constraints.hold(elastic.boundary_nodes("z0"))
    t = constraints.transformation()
    forces = [Pressure("z1", 400.0), BoundaryForce("z1", PUSHED * [1.0, 0.0, 1.0])]
    load = sum(force.forces(elastic) for force in forces)
    exact = t @ prepare((t.T @ elastic.stiffness @ t).tocsr())(t.T @ load)
    assert np.abs(moved[2]).max() == pytest.approx(np.abs(exact).max(), rel=1e-9)


def test_bodies_that_nothing_holds_are_named():
    """Check that a pad is held through a ring and the base, and one beside it is not."""
    x, y = along((0, 2, 2)), along((0, 1, 2))
    mesh = imported(
        base=box(x, y, along((-1, 0, 2))),
        ring=box(x, y, along((0, 1, 2))),
        lid=box(x, y, along((5, 6, 2))),
        cap=box(x, y, along((6, 7, 2))),
    )
    pairs = [pair("low", "base_z1", "ring_z0"), pair("far", "lid_z1", "cap_z0")]
    with pytest.raises(MeshError, match="let lid and cap shift along"):
        built(mesh, pairs, [Support("base_z0", "xyz")], [Pressure("ring_z1", 1.0)])
