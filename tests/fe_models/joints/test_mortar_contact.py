"""Contact across faces whose meshes do not match."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import MeshTri

from fe_models.dovetail import dovetail_structure
from fe_models.elasticity.body import ElasticBody
from fe_models.joints.friction import FrictionalJoint
from fe_models.joints.joint import join
from fe_models.joints.mortar import frame_of_faces, mortar_interface
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import AXES, Body
from fe_models.supported_body import SupportedBody, interface_nodes
from sa_solver.types import Frame
from tests.fe_models.joints.pressed_blocks import (
    DIMENSIONS,
    HALVED,
    LINE,
    ORDERS,
    SOLVER,
    STEEL,
    SURFACE,
    TITANIUM,
    Pressed,
    block,
)


def uniform(dimension, zz, zx, zy=0.0, xx=0.0):
    """Return a uniform stress, in plane strain with its yy, and its six components."""
    yy = 0.3 * (xx + zz) if dimension == LINE else 0.0
    zy = zy if dimension == SURFACE else 0.0
    tensor = np.array([[xx, 0.0, zx], [0.0, yy, zy], [zx, zy, zz]])
    return (lambda x: tensor), np.array([xx, yy, zz, 0.0, zy, zx])


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("order", [*ORDERS, HALVED])
def test_any_uniform_stress_passes_glued_faces(dimension, order):
    """Run the patch test (Taylor & Papadopoulos 1991) for all components at once."""
    field, expected = uniform(dimension, -50.0, 10.0, -7.0, 20.0)
    pressed = Pressed(dimension, order, (STEEL, STEEL), field)
    assert len(pressed.interface.nodes_1) != len(pressed.interface.nodes_2)
    force = pressed.glued()
    traction = -field(None)[list(AXES[dimension]), 2]
    np.testing.assert_allclose(force, np.outer(pressed.areas, traction), atol=1e-9)
    for stress in pressed.stresses(force, np.zeros_like(force)):
        np.testing.assert_allclose(stress, np.tile(expected[:, None], stress.shape[1]), atol=1e-8)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("order", [*ORDERS, HALVED])
def test_uniform_pressure_passes_without_friction(dimension, order):
    """Check dissimilar bodies with free sides, which bulge and both carry the pressure."""
    pressure = 50.0
    field, expected = uniform(dimension, -pressure, 0.0)
    pressed = Pressed(dimension, order, (STEEL, TITANIUM), field)
    force, relative = pressed.rubbing(0.0)
    assert np.abs(relative[:, 0]).max() > 1e-5
    scale = pressure * pressed.areas.max()
    np.testing.assert_allclose(force[:, -1], pressure * pressed.areas, atol=SOLVER * scale)
    np.testing.assert_allclose(force[:, :-1], 0.0, atol=SOLVER * scale)
    for stress in pressed.stresses(force, relative):
        tiled = np.tile(expected[:, None], stress.shape[1])
        np.testing.assert_allclose(stress, tiled, atol=SOLVER * pressure)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("order", [*ORDERS, HALVED])
def test_uniform_shear_passes_where_faces_stick(dimension, order):
    pressure, shear = 50.0, 15.0
    field, expected = uniform(dimension, -pressure, shear)
    pressed = Pressed(dimension, order, (STEEL, STEEL), field)
    force, relative = pressed.rubbing(0.5)
    scale = pressure * pressed.areas.max()
    np.testing.assert_allclose(force[:, 0], -shear * pressed.areas, atol=SOLVER * scale)
    np.testing.assert_allclose(force[:, -1], pressure * pressed.areas, atol=SOLVER * scale)
    for stress in pressed.stresses(force, relative):
        tiled = np.tile(expected[:, None], stress.shape[1])
        np.testing.assert_allclose(stress, tiled, atol=SOLVER * pressure)


@cache
def pressed_once(dimension):
    return Pressed(dimension, 1, (STEEL, TITANIUM), uniform(dimension, -50.0, 0.0)[0])


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_forces_and_moments_on_both_faces_are_opposite(dimension):
    pressed = pressed_once(dimension)
    axes = list(AXES[dimension])
    force_2 = np.random.default_rng(0).standard_normal((len(pressed.interface), dimension))
    force_1 = -(pressed.projection.T @ force_2.ravel()).reshape(-1, dimension)
    total, moment = np.zeros(3), np.zeros(3)
    nodes = pressed.interface.nodes_1, pressed.interface.nodes_2
    for elastic, at, part in zip(pressed.elastic, nodes, (force_1, force_2), strict=True):
        spatial = np.zeros((len(part), 3))
        spatial[:, axes] = part
        total += spatial.sum(axis=0)
        moment += np.cross(elastic.nodes[at], spatial).sum(axis=0)
    np.testing.assert_allclose(total, 0.0, atol=1e-11)
    np.testing.assert_allclose(moment, 0.0, atol=1e-11)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_rigid_motions_give_no_force(dimension):
    """Check no relative displacement for both bodies together, no force for body 2 alone."""
    pressed = pressed_once(dimension)
    axes = list(AXES[dimension])
    joint = pressed.joint
    assert joint.rigid_modes == (6 if dimension == SURFACE else 3)
    points = [
        elastic.nodes[nodes]
        for elastic, nodes in zip(
            pressed.elastic, (pressed.interface.nodes_1, pressed.interface.nodes_2), strict=True
        )
    ]
    for axis in np.eye(3):
        for motion in (lambda x, a=axis: np.tile(a, (len(x), 1)), lambda x, a=axis: np.cross(a, x)):
            u_1, u_2 = (motion(x)[:, axes].ravel() for x in points)
            np.testing.assert_allclose(pressed.projection @ u_1, u_2, atol=1e-12)
            if dimension == SURFACE or not np.any(motion(points[1])[:, 1]):
                np.testing.assert_allclose(joint.stiffness @ u_2, 0.0, atol=1e-9 * joint.largest)


def bending(dimension):
    """Return σ_zz = -50 + 20 (x - 1), pure bending of the column, with its yy in plane strain."""

    def stress(x):
        zz = -50.0 + 20.0 * (x[0] - 1.0)
        zero = 0.0 * zz
        yy = 0.3 * zz if dimension == LINE else zero
        return [[zero, zero, zero], [zero, yy, zero], [zero, zero, zz]]

    return stress


def bending_errors(dimension, cells):
    """Return relative errors of the stress in both bodies and of the interface pressure."""
    pressed = Pressed(dimension, 1, (STEEL, STEEL), bending(dimension), cells, 0.0)
    force = pressed.glued()
    squares, total = 0.0, 0.0
    for elastic, stress in zip(
        pressed.elastic, pressed.stresses(force, np.zeros_like(force)), strict=True
    ):
        mesh = elastic.body.mesh
        corners = elastic.nodes[mesh.t.T]
        exact = np.array(bending(dimension)(corners.mean(axis=1).T))
        exact = exact[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
        edges = mesh.p.T[mesh.t.T]
        volume = np.abs(np.linalg.det(edges[:, 1:] - edges[:, :1]))
        squares += np.sum(volume * (stress - exact) ** 2)
        total += np.sum(volume * exact**2)
    x = pressed.interface.coordinates[:, 0]
    pressure = force[:, -1] / pressed.areas
    error = np.sqrt(pressed.areas @ (pressure - (50.0 - 20.0 * x)) ** 2 / pressed.areas.sum())
    return np.sqrt(squares / total), error / 50.0


@pytest.mark.parametrize(("dimension", "levels"), [(LINE, (4, 8, 16)), (SURFACE, (2, 4))])
def test_bending_converges(dimension, levels):
    """Check the rate of the coarser body's linear elements, no worse than matching meshes."""
    unmatched, matched = [], []
    for level in levels:
        two, three = (2 * level, level, level), (3 * level, level + 1, level)
        unmatched.append(bending_errors(dimension, (two, three)))
        matched.append(bending_errors(dimension, (two, two)))
    (stress, pressure), (matched_stress, matched_pressure) = np.transpose(
        [unmatched, matched], (0, 2, 1)
    )
    assert np.all(stress < matched_stress)
    assert np.all(pressure < 1.6 * matched_pressure)
    # On the way to 1, and to 1.5 for the pressure.
    rate = 0.9 if dimension == LINE else 0.7
    assert np.log2(stress[-2] / stress[-1]) > rate
    assert np.log2(pressure[-2] / pressure[-1]) > rate


def graded(pitch, flat, end, growth=1.25):
    """Return steps from 0 to ``end``, of one pitch up to ``flat`` and growing beyond."""
    steps = list(pitch * np.arange(round(flat / pitch) + 1))
    while steps[-1] < end:
        pitch *= growth
        steps.append(steps[-1] + pitch)
    steps[-1] = end
    return np.array(steps)


def half_planes(pitches, radius, size=10.0):
    """Return two plane rectangles, body 2 with a parabolic underside, fine at the contact."""
    elastics = []
    for number, pitch in enumerate(pitches):
        x, z = graded(pitch, 1.5, size), graded(pitch, 0.5, size)
        z = z if number else -z[::-1]
        mesh = MeshTri.init_tensor(np.append(-x[:0:-1], x), z)
        ends = {
            f"z{end}": (lambda x, value=value: np.isclose(x[1], value))
            for end, value in enumerate((z[0], z[-1]))
        }
        mesh = mesh.with_boundaries(ends)
        points = mesh.p.copy()
        if number:
            points[1] += 0.5 * points[0] ** 2 / radius * (1.0 - points[1] / size)
        elastics.append(ElasticBody(Body("half", replace(mesh, doflocs=points)), STEEL))
    return elastics


def rub(elastics, held, face, load, friction):
    """Press and rub body 2, free except for the contact; return the state and the work."""
    supports = held, Constraints(len(elastics[1].nodes), LINE)
    loads = np.zeros((elastics[0].size, 1)), load[:, None]
    bodies = [
        SupportedBody(
            elastics[k], supports[k], *interface_nodes([(face, k + 1)], elastics[k].body), loads[k]
        )
        for k in range(2)
    ]
    projection = sp.kron(face.projection, sp.identity(LINE), format="csr")
    joint = join([body.condense() for body in bodies], projection)
    (state,) = FrictionalJoint(joint.resolvent(), friction).march(np.ones((1, 1)), face.gap)
    force, relative = (v[list(AXES[LINE])].T.ravel() for v in (state.force, state.displacement))
    _, at_1 = bodies[0].respond(-projection.T @ force, np.ones(1))
    return state, load @ bodies[1].recover(projection @ at_1 + relative, force, np.ones(1))


def hertz_error(pitches, radius=100.0):
    """Return errors of the pressure under a parabola, on average and at Hertz's peak."""
    load = np.pi * STEEL.young / (8.0 * (1.0 - STEEL.poisson**2) * radius)
    elastics = half_planes(pitches, radius)
    frame = Frame(np.zeros(3), np.eye(3))
    face = mortar_interface("flat", elastics[0].body, "z1", elastics[1].body, "z0", frame)
    held = Constraints(len(elastics[0].nodes), LINE)
    held.slide(*elastics[0].boundary_normals("z0"))
    middle = np.linalg.norm(elastics[0].nodes - np.array([0.0, 0.0, -10.0]), axis=1).argmin()
    held.hold(middle[None])
    top = elastics[1].traction_load(
        "z1", lambda x: np.full_like(x[0], -load / 20.0), np.array([0.0, 0.0, 1.0])
    )
    state, _ = rub(elastics, held, face, top, 0.0)
    assert state.force[2].sum() == pytest.approx(load, rel=SOLVER)
    pressure, peak = state.force[2] / face.nodal_areas, 2.0 * load / np.pi
    hertz = peak * np.sqrt(np.maximum(1.0 - face.coordinates[:, 0] ** 2, 0.0))
    return face.nodal_areas @ np.abs(pressure - hertz) / load, pressure.max() / peak - 1.0


@pytest.mark.parametrize("ratio", [0.7, 1.3])
def test_curved_faces_press_as_hertz_says(ratio):
    """Check a line contact of half-width 1 mm (Johnson 1985, §4.2c) by the mortar."""
    errors = [hertz_error((ratio * pitch, pitch)) for pitch in (0.25, 0.0625)]
    mean, peak = np.transpose(errors)
    assert mean[1] < 0.012
    assert np.log2(mean[0] / mean[1]) > 2.0
    assert abs(peak[1]) < 0.005


def overhang_work(below, above):
    """Return the work of a load on an overhanging block, its nodes, and those in contact."""
    lower, upper = (
        block((n, n // 2), low, high, STEEL, 1, 0.0, 0)
        for n, low, high in (
            (below, (0.0, 0.0, 0.0), (2.0, 0.0, 1.0)),
            (above, (0.8, 0.0, 1.0), (2.6, 0.0, 2.0)),
        )
    )
    frame, _ = frame_of_faces(lower.body, "z1", upper.body, "z0", np.array([1.0, 0.0, 0.0]))
    face = mortar_interface("step", lower.body, "z1", upper.body, "z0", frame)
    held = Constraints(len(lower.nodes), LINE)
    held.hold(lower.boundary_nodes("z0"))
    load = upper.traction_load(
        "z1",
        lambda x: -50.0 * np.sin(np.pi * np.clip(x[0] - 0.8, 0.0, 1.0)) ** 2,
        np.array([0.0, 0.0, 1.0]),
    )
    state, work = rub((lower, upper), held, face, load, 0.3)
    assert state.converged
    assert state.force[2].sum() == pytest.approx(-load.sum(), rel=SOLVER)
    assert len(face) < len(upper.body.vertices("z0"))
    return work


@pytest.mark.parametrize("counts", [(40, 35), (40, 26), (28, 34)])
def test_edge_inside_a_facet_presses_as_one_between_facets(counts):
    """Check a block over an edge, with and without mesh nodes at the edge."""
    matching = overhang_work(40, 36)
    assert overhang_work(*counts) == pytest.approx(matching, rel=5e-3)


@pytest.mark.slow
def test_dovetail_of_two_meshes_does_what_that_of_one_does(
    dovetail, coarse_mesh, titanium, mission, solved
):
    friction = 0.4
    disk = dovetail.mesh((9, 12), 8.0).bodies[0]
    faces = []
    for interface in coarse_mesh.interfaces:
        name, frame = interface.name, interface.frame
        face = mortar_interface(name, disk, name, coarse_mesh.bodies[1], name, frame)
        np.testing.assert_array_equal(face.nodes_2, interface.nodes_2)
        np.testing.assert_allclose(face.gap, 0.0, atol=1e-9)
        faces.append(replace(face, gap=interface.gap))
    mesh = replace(coarse_mesh, bodies=(disk, coarse_mesh.bodies[1]), interfaces=tuple(faces))
    structure = dovetail_structure(dovetail, mesh, titanium, titanium, mission, 1)
    joint = structure.condense()
    assert joint.rigid_modes == 5
    frictional = FrictionalJoint(joint.resolvent(), friction)
    cycle = structure.solve_cycle(frictional, mission.amplitudes(), structure.gap(), friction)
    assert cycle.converged
    assert cycle.equilibrium.max() < SOLVER
    for history, expected in zip(cycle.histories, solved(friction, mission).histories, strict=True):
        peak = expected.loads.P.max()
        for name in ("P", "Qx", "Qy"):
            np.testing.assert_allclose(
                getattr(history.loads, name), getattr(expected.loads, name), atol=5e-3 * peak
            )
