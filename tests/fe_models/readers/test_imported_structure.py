"""Bodies of a user's mesh: supports, loads and contacts, symmetry planes, closed cycles."""

import numpy as np
import pytest
from skfem import MeshTet, MeshTri

from fe_models import structure
from fe_models.elasticity.body import ElasticBody
from fe_models.imported_structure import ContactPair, Support, imported_mesh, imported_structure
from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.loads.applied_loads import (
    Acceleration,
    BoundaryForce,
    Displacement,
    Pressure,
    Rotation,
)
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import Body, MeshError
from fe_models.structure import CLOSED, MOST_CYCLES
from sa_solver.types import Material
from tests.fe_models.conftest import stress_state
from tests.fe_models.imported_blocks import BODIES, block_and_pad, imported
from tests.mirrored_blocks import along, mirrored, with_faces

STEEL = Material(200e3, 0.3, 7.8e-9)
PAIR = ContactPair("foot", BODIES, ["top"], ["bottom"], np.array([1.0, 0.0, 0.0]))
MU = 0.5
Y = np.array([0.0, 1.0, 0.0])


def built(mesh, supports, loads, order=1, pair=PAIR):
    interfaces = imported_mesh(mesh, BODIES, [pair])
    return imported_structure(interfaces, mesh, (STEEL, STEEL), supports, loads, order)


def solved(joined, amplitudes, preload=None, mu=MU):
    joint = FrictionalJoint(joined.condense().resolvent(), mu)
    return joined.solve_cycle(joint, amplitudes, joined.gap(), mu, preload=preload)


@pytest.fixture
def precise(monkeypatch):
    """Solve to the last digits and always with three cycles, so that any two models compare."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-12)
    monkeypatch.setattr(structure, "CLOSED", -1.0)
    monkeypatch.setattr(structure, "MOST_CYCLES", 3)


# --- supports on a contact face -------------------------------------------------------------------

PRESSED = [Pressure("lid", 50.0), BoundaryForce("lid", np.array([60.0, 0.0, 0.0]))]
PATH = np.array([[1.0, 0.0], [1.0, 1.0], [1.0, -1.0]])


@pytest.mark.parametrize("match", [True, False])
@pytest.mark.parametrize("order", [1, 2])
def test_half_model_equals_the_full_one(order, match, precise):
    """Check a plane of symmetry through the contact, along the frame's x, with half the loads."""
    base, plane = Support("base", "xyz"), Support("plane", "normal")
    shares = PATH * [1.0, 0.5]  # Half the force acts on half the lid.
    half = built(block_and_pad(False, match), [base, plane], PRESSED, order)
    full = built(block_and_pad(True, match), [base], PRESSED, order)
    one, two = solved(half, shares, mu=0.35), solved(full, PATH, mu=0.35)
    assert one.converged
    assert two.converged
    (part,), (whole,) = one.histories, two.histories
    load = whole.loads.P.max()
    work = load * np.abs(whole.displacement).max()
    for name, scale in (("P", load), ("Qx", load), ("Edx", work)):
        values = getattr(part.loads, name), getattr(whole.loads, name)
        np.testing.assert_allclose(2.0 * values[0], values[1], atol=1e-8 * scale)
    assert whole.loads.Edx.sum() > 1e-6 * work
    places = half.mesh.bodies[1].points[part.interface.nodes_2]
    there = full.mesh.bodies[1].points[whole.interface.nodes_2]
    match_of = [int(np.argmin(np.linalg.norm(there - place, axis=1))) for place in places]
    twice = np.where(np.isclose(places[:, 1], 0.0), 2.0, 1.0)
    largest = whole.force.max()
    np.testing.assert_allclose(twice * part.force, whole.force[..., match_of], atol=1e-8 * largest)
    assert not part.force[:, 1][:, twice > 1.0].any()
    assert not part.displacement[:, 1][:, twice > 1.0].any()
    assert max(one.equilibrium.max(), two.equilibrium.max()) < 1e-9
    # Displacements and stresses of both bodies, recovered from the interface.
    fields = [
        stress_state(s, h.force[1], h.displacement[1], a)
        for s, h, a in ((half, part, shares[1]), (full, whole, PATH[1]))
    ]
    for body, mine, theirs in zip((0, 1), *fields, strict=True):
        places, there = half.mesh.bodies[body].points, full.mesh.bodies[body].points
        twins = [int(np.argmin(np.linalg.norm(there - place, axis=1))) for place in places]
        largest = np.abs(theirs.displacement).max()
        np.testing.assert_allclose(
            mine.displacement, theirs.displacement[twins], atol=1e-7 * largest
        )


def plane_block_and_pad(full):
    """Return the section of such a joint, half (X > 0) or all of it."""
    lower = MeshTri.init_tensor(along((0, 1, 4), (1, 2, 2)), along((-2, 0, 3)))
    upper = MeshTri.init_tensor(along((0, 1, 5)), along((0, 1, 3)))
    if full:
        lower, upper = mirrored(lower, 0), mirrored(upper, 0)
    lower = with_faces(lower, {"base": (1, -2.0), "top": (1, 0.0), "plane": (0, 0.0)})
    upper = with_faces(upper, {"bottom": (1, 0.0), "lid": (1, 1.0), "plane": (0, 0.0)})
    return imported(lower, upper)


def test_half_section_equals_the_full_one(precise):
    """Check a plane of symmetry across the frame's x, towards which friction acts."""
    base, plane = Support("base", "xz"), Support("plane", "x")
    loads, path = [Pressure("lid", 50.0)], np.array([[0.5], [1.0], [0.2]])
    half = built(plane_block_and_pad(False), [base, plane], loads)
    full = built(plane_block_and_pad(True), [base], loads)
    one, two = solved(half, path, mu=0.1), solved(full, path, mu=0.1)
    (part,), (whole,) = one.histories, two.histories
    np.testing.assert_allclose(2.0 * part.loads.P, whole.loads.P, rtol=1e-8)
    assert part.loads.Edx.sum() > 0.0
    np.testing.assert_allclose(
        2.0 * part.loads.Edx, whole.loads.Edx, atol=1e-8 * whole.loads.Edx.max()
    )


def test_slice_in_plane_strain(precise):
    """Check that a slice held along y stays in the plane and equals the section."""
    x = along((-2, -1, 2), (-1, 1, 12), (1, 2, 2))
    lower = MeshTet.init_tensor(x, np.array([0.0, 0.1]), along((-2, 0, 5)))
    upper = MeshTet.init_tensor(along((-1, 1, 12)), np.array([0.0, 0.1]), along((0, 1, 4)))
    ends = {"front": (1, 0.0), "back": (1, 0.1)}
    lower = with_faces(lower, {"base": (2, -2.0), "top": (2, 0.0)} | ends)
    upper = with_faces(upper, {"bottom": (2, 0.0), "lid": (2, 1.0)} | ends)
    held = [Support("base", "xyz"), Support("front", "y"), Support("back", "y")]
    path = np.array([[1.0, 0.0], [1.0, 1.0]])
    tall = [Pressure("lid", 50.0), BoundaryForce("lid", np.array([3.0, 0.0, 0.0]))]
    joined = built(imported(lower, upper), held, tall)
    assert joined.held_faces == {"foot": 1.0}
    (history,) = solved(joined, path).histories
    assert not history.force[:, 1].any()
    assert not history.displacement[:, 1].any()
    np.testing.assert_allclose(history.loads.P, 10.0, rtol=1e-9)
    np.testing.assert_allclose(history.loads.Qx, [0.0, -3.0], atol=1e-8)
    lower = MeshTri.init_tensor(x, along((-2, 0, 5)))
    upper = MeshTri.init_tensor(along((-1, 1, 12)), along((0, 1, 4)))
    section = imported(
        with_faces(lower, {"base": (1, -2.0), "top": (1, 0.0)}),
        with_faces(upper, {"bottom": (1, 0.0), "lid": (1, 1.0)}),
    )
    loads = [Pressure("lid", 50.0), BoundaryForce("lid", np.array([30.0, 0.0, 0.0]))]
    flat = built(section, [Support("base", "xz")], loads)
    (plane,) = solved(flat, path).histories
    moved = [
        lid_motion(s, stress_state(s, h.force[1], h.displacement[1], path[1])[1].displacement)
        for s, h in ((joined, history), (flat, plane))
    ]
    # Slice and section differ only in the diagonals of their meshes.
    np.testing.assert_allclose(moved[0], moved[1], atol=0.03 * np.abs(moved[1]).max())


def lid_motion(joined, displacement):
    """Return the mean displacement of body 2 at its top, along x and z."""
    top = joined.mesh.bodies[1].points[:, 2] == 1.0
    return displacement[top][:, [0, 2]].mean(axis=0)


def test_contact_faces_that_share_nodes_are_refused():
    mesh = block_and_pad(False, False)
    twice = [PAIR, ContactPair("again", BODIES, ["top"], ["bottom"], np.array([1.0, 0.0, 0.0]))]
    interfaces = imported_mesh(mesh, BODIES, twice)
    with pytest.raises(MeshError, match="foot and again"):
        imported_structure(interfaces, mesh, (STEEL, STEEL), [Support("base", "xyz")], PRESSED, 1)


@pytest.mark.parametrize(
    ("supports", "wrong"),
    [
        ([Support("base", "xyz"), Support("upper_plane", "y")], "held along the face on body"),
        ([Support("base", "xyz"), Support("bottom", "z")], "held along the contact's normal"),
        ([Support("base", "xyz"), Support("bottom", "mean_x")], "a mean over a boundary"),
        ([Support("base", "xy")], "let lower and upper"),
        ([Support("base", "xyz"), Support("nowhere", "x")], "no boundary or node set nowhere"),
    ],
)
def test_supports_that_cannot_be_are_refused(supports, wrong):
    mesh = block_and_pad(False, True)
    upper = mesh.bodies["upper"].mesh
    renamed = upper.with_boundaries({"upper_plane": upper.boundaries["plane"]})
    mesh.bodies["upper"] = Body("upper", renamed)
    with pytest.raises(MeshError, match=wrong):
        built(mesh, supports, PRESSED)


def test_plane_askew_to_the_frame_is_refused():
    askew = ContactPair("foot", BODIES, ["top"], ["bottom"], np.array([1.0, 1.0, 0.0]))
    held = [Support("base", "xyz"), Support("plane", "y")]
    with pytest.raises(MeshError, match="no axis of the contact's frame"):
        built(block_and_pad(False, True), held, PRESSED, pair=askew)


def test_displacement_imposed_on_a_contact_face_is_refused():
    moved = [Displacement("plane", np.array([0.0, 1e-3, 0.0]))]
    with pytest.raises(MeshError, match="contact face"):
        built(block_and_pad(False, True), [Support("base", "xz")], moved)


@pytest.mark.parametrize("hold", ["x", "xyz", "mean_x"])
def test_displacement_against_a_support_is_refused(hold):
    """Check that it must not override supports; supports across it are allowed."""
    moved = [Displacement("lid", np.array([1e-3, 0.0, 0.0]))]
    base = Support("base", "xyz")
    with pytest.raises(MeshError, match="imposed on lid"):
        built(block_and_pad(False, True), [base, Support("lid", hold)], moved)
    built(block_and_pad(False, True), [base, Support("lid", "yz"), Support("plane", "y")], moved)


def test_displacements_add_up_on_one_boundary_only():
    """Check the refusal where nodes of two boundaries would move twice as far."""
    mesh = block_and_pad(False, True)
    upper = mesh.bodies["upper"].mesh
    half = upper.facets_satisfying(lambda p: np.isclose(p[2], 1.0) & (p[0] < 0.0))
    mesh.bodies["upper"] = Body("upper", upper.with_boundaries({"half": half}))
    base, along_x = Support("base", "xyz"), Displacement("lid", np.array([1e-3, 0.0, 0.0]))
    with pytest.raises(MeshError, match="lid and half share nodes"):
        built(mesh, [base], [along_x, Displacement("half", np.array([1e-3, 0.0, 0.0]))])
    down = Displacement("half", np.array([0.0, 0.0, -1e-3]))
    joined = built(mesh, [base], [along_x, along_x, down])
    lid = joined.bodies[1].elastic.boundary_nodes("lid")
    imposed = joined.bodies[1].imposed.sum(axis=1).reshape(-1, 3)[lid]
    np.testing.assert_allclose(imposed[:, 0], 2e-3, rtol=1e-12)


def test_force_on_a_boundary_of_both_bodies_is_refused():
    """Check the refusal of a force that would be applied twice."""
    push = BoundaryForce("plane", np.array([0.0, 0.0, -10.0]))
    with pytest.raises(MeshError, match="lower and upper"):
        built(block_and_pad(False, True), [Support("base", "xyz")], [push])


def test_body_1_alone_may_be_held_at_the_face(precise):
    """Check that body 2 still slides over nodes that a support of body 1 holds."""
    mesh = block_and_pad(False, True)
    lower = mesh.bodies["lower"].mesh
    mesh.bodies["lower"] = Body("lower", lower.with_boundaries({"wall": lower.boundaries["plane"]}))
    joined = built(mesh, [Support("base", "xyz"), Support("wall", "y")], PRESSED)
    cycle = solved(joined, PATH * [1.0, 0.5])
    assert cycle.converged
    assert cycle.equilibrium.max() < 1e-9
    assert not joined.held_faces


# --- loads ----------------------------------------------------------------------------------------


def domed():
    """Return a box with a domed top over a flat rim, 2 x 1 x 1 below it, and a block under it."""
    upper = MeshTet.init_tensor(along((0, 2, 6)), along((0, 1, 4)), along((0, 1, 3)))
    x, y, z = upper.p
    points = upper.p.copy()
    points[2] += 0.3 * z * x * (2.0 - x) * y * (1.0 - y)
    faces = upper.facets_satisfying(lambda p: np.isclose(p[2], 1.0))
    upper = with_faces(upper, {"bottom": (2, 0.0), "side": (0, 2.0)}).with_boundaries(
        {"dome": faces}
    )
    upper = MeshTet(points, upper.t, _boundaries=upper.boundaries)
    lower = MeshTet.init_tensor(along((0, 2, 2)), along((0, 1, 2)), along((-1, 0, 2)))
    return imported(with_faces(lower, {"top": (2, 0.0), "base": (2, -1.0)}), upper)


def resultants(load, about=(0.0, 0.0, 0.0)):
    mesh = domed()
    joined = built(mesh, [Support("base", "xyz")], [load])
    force, moment = joined.bodies[1].load_resultants(np.ones(1), np.array(about))
    upper = mesh.bodies["upper"].mesh
    volumes = np.abs(element_volumes(upper))
    centre = volumes @ upper.p[:, upper.t].mean(axis=1).T / volumes.sum()
    return force, moment, volumes.sum(), centre


def test_pressure_on_a_dome_is_that_on_its_rim():
    """Check that pressure on any surface over a flat rim has the resultant -p A."""
    force, _, _, _ = resultants(Pressure("dome", 3.0))
    np.testing.assert_allclose(force, [0.0, 0.0, -6.0], atol=1e-12)


def test_force_is_spread_about_the_centroid():
    force, moment, _, _ = resultants(
        BoundaryForce("side", np.array([5.0, -7.0, 11.0])), (2.0, 0.5, 0.5)
    )
    np.testing.assert_allclose(force, [5.0, -7.0, 11.0], rtol=1e-12)
    np.testing.assert_allclose(moment, 0.0, atol=1e-12)


def test_force_at_a_point_and_moment_are_handed_on():
    """Check the exact resultants of both about the point, on one side of a dome."""
    at, force, moment = np.array([7.0, -3.0, 4.0]), np.array([5.0, -7.0, 11.0]), [20.0, 30.0, -40.0]
    given = BoundaryForce("side", force, at, np.array(moment))
    total, about, _, _ = resultants(given, at)
    np.testing.assert_allclose(total, force, rtol=1e-12)
    np.testing.assert_allclose(about, moment, rtol=1e-10)
    dome, about, _, _ = resultants(BoundaryForce("dome", 0.0 * force, moment=np.array(moment)))
    np.testing.assert_allclose(dome, 0.0, atol=1e-11)
    np.testing.assert_allclose(about, moment, rtol=1e-10)


def test_rotation_about_a_shifted_axis():
    """Check ρ V Ω² times the arm of the centre of mass, without moment about the axis."""
    axis, through, speed = np.array([1.0, 2.0, 2.0]) / 3.0, np.array([5.0, -3.0, 7.0]), 600.0
    load = Rotation(3.0 * axis, through, speed)
    force, moment, volume, centre = resultants(load, through)
    arm = centre - through
    radial = arm - axis * (axis @ arm)
    expected = STEEL.density * volume * speed**2 * radial
    np.testing.assert_allclose(force, expected, rtol=1e-10)
    assert moment @ axis == pytest.approx(0.0, abs=1e-10 * np.abs(moment).max())


def test_acceleration_pulls_backwards():
    pull = np.array([1e4, -2e4, 3e4])
    force, _, volume, _ = resultants(Acceleration(pull))
    np.testing.assert_allclose(force, -STEEL.density * volume * pull, rtol=1e-10)


def test_load_across_the_plane_is_refused():
    with pytest.raises(MeshError, match="across the plane"):
        built(
            plane_block_and_pad(True),
            [Support("base", "xz")],
            [BoundaryForce("lid", np.array([0.0, 1.0, -1.0]))],
        )


def test_moments_in_the_plane_are_about_y():
    about_x = BoundaryForce("lid", np.zeros(3), moment=np.array([1.0, 5.0, 0.0]))
    with pytest.raises(MeshError, match="a moment about x or z"):
        built(plane_block_and_pad(True), [Support("base", "xz")], [about_x])
    lid = MeshTri.init_tensor(along((-1, 1, 4)), along((0, 2, 3)))
    body = Body("pad", lid.with_boundaries({"lid": lambda x: x[1] == 2.0}))
    load = BoundaryForce("lid", np.array([3.0, 0.0, -4.0]), np.array([7.0, 0.0, 5.0]), 5.0 * Y)
    forces = load.forces(ElasticBody(body, STEEL, 2)).reshape(-1, 2)
    x, _, z = (ElasticBody(body, STEEL, 2).nodes - load.at).T
    np.testing.assert_allclose(forces.sum(axis=0), [3.0, -4.0], rtol=1e-12)
    assert z @ forces[:, 0] - x @ forces[:, 1] == pytest.approx(5.0, rel=1e-10)


@pytest.mark.parametrize("order", [1, 2])
def test_bar_in_two_pieces_is_strained(order, precise):
    """Check P = E A d / L for pieces that widen equally, held by node sets."""
    lower = MeshTet.init_tensor(along((0, 2, 2)), along((0, 1, 2)), along((0, 3, 3)))
    upper = MeshTet.init_tensor(along((0, 2, 3)), along((0, 1, 2)), along((3, 4, 2)))
    edge = (lower.p[1] == 0.0) & (lower.p[2] == 0.0)
    sets = {
        "corner": np.flatnonzero(edge & (lower.p[0] == 0.0)),
        "other": np.flatnonzero(edge & (lower.p[0] == 2.0)),
    }
    mesh = imported(
        with_faces(lower, {"top": (2, 3.0), "base": (2, 0.0)}),
        with_faces(upper, {"bottom": (2, 3.0), "lid": (2, 4.0)}),
        {"lower": sets},
    )
    supports = [Support("base", "z"), Support("corner", "xy"), Support("other", "y")]
    down = Displacement("lid", np.array([0.0, 0.0, -4e-3]))
    joined = built(mesh, supports, [down], order)
    cycle = solved(joined, np.array([[0.5], [1.0]]))
    (history,) = cycle.histories
    np.testing.assert_allclose(history.loads.P, [200.0, 400.0], rtol=1e-9)
    np.testing.assert_allclose(history.pressure[1], 200.0, rtol=1e-8)
    fields = stress_state(joined, history.force[1], history.displacement[1], np.ones(1))
    for field in fields:
        np.testing.assert_allclose(field.von_mises, 200.0, rtol=1e-8)
    top = upper.p[2] == 4.0
    np.testing.assert_allclose(fields[1].displacement[top, 2], -4e-3, rtol=1e-12)
    # The edge of the pad is nearly free to slide: the widths agree.
    width = [np.ptp(field.displacement[:, 0]) for field in fields]
    np.testing.assert_allclose(width, 0.3 * 1e-3 * 2.0, rtol=1e-8)


# --- meshes that do not match, and cycles that close slowly ---------------------------------------


def rounded_pad(cells, unmatched):
    """Return a plane pad with a cylindrical foot on a block with more nodes if ``unmatched``."""
    x = along((-2, -1, 2), (-1, 1, cells), (1, 2, 2))
    lower = MeshTri.init_tensor(x, along((-2, 0, cells)))
    count = cells if not unmatched else 3 * cells // 4
    upper = MeshTri.init_tensor(along((-1, 1, count)), along((0, 1, cells // 2)))
    points = upper.p.copy()
    points[1] += (1.0 - upper.p[1]) * upper.p[0] ** 2 / 400.0
    bottom, lid = (upper.facets_satisfying(lambda p, v=v: np.isclose(p[1], v)) for v in (0.0, 1.0))
    upper = MeshTri(points, upper.t, _boundaries={"bottom": bottom, "lid": lid})
    return imported(with_faces(lower, {"base": (1, -2.0), "top": (1, 0.0)}), upper)


def rubbed(cells, unmatched):
    """Return partial slip over most of the foot, which settles by about 0.8 per cycle."""
    loads = [Pressure("lid", 20.0), Displacement("lid", np.array([2e-3, 0.0, 0.0]))]
    preload = np.array([[0.5, 0.0], [1.0, 0.0], [1.0, 0.5], [1.0, 1.0]])
    shift = np.array([0.5, 0.0, -0.5, -1.0, -0.5, 0.0, 0.5, 1.0])
    path = np.stack([np.ones(8), shift], axis=1)
    joined = built(rounded_pad(cells, unmatched), [Support("base", "xz")], loads)
    return solved(joined, path, preload)


@pytest.mark.slow
def test_meshes_that_do_not_match_agree_with_those_that_do():
    """Compare Q and energy of partial slip up to discretisation; P follows from equilibrium."""
    differences = []
    for cells in (16, 32):
        one, two = (rubbed(cells, unmatched).histories[0].loads for unmatched in (False, True))
        np.testing.assert_allclose(two.P, one.P, rtol=1e-6)
        energies = [loads.Edx.sum() for loads in (one, two)]
        force = np.abs(two.Qx - one.Qx).max() / np.abs(one.Qx).max()
        differences.append((force, abs(energies[1] / energies[0] - 1.0)))
    # Better than first order in the size of elements.
    assert differences[1][0] < min(0.01, 0.5 * differences[0][0])
    assert differences[1][1] < min(0.02, 0.5 * differences[0][1])


def test_cycles_are_marched_until_they_close():
    cycle = rubbed(16, True)
    assert cycle.converged
    assert cycle.closure <= CLOSED
    assert 2 < cycle.cycles <= MOST_CYCLES
    assert cycle.equilibrium.max() < 1e-6


def test_cycle_that_follows_goes_as_far():
    """Check that nothing changes from the closed cycle with the same gap."""
    loads = [Pressure("lid", 20.0), Displacement("lid", np.array([1e-3, 0.0, 0.0]))]
    joined = built(rounded_pad(16, True), [Support("base", "xz")], loads)
    joint = FrictionalJoint(joined.condense().resolvent(), MU)
    path = np.stack([np.ones(8), np.sin(np.pi * np.arange(1, 9) / 4.0)], axis=1)
    first = joined.solve_cycle(joint, path, joined.gap(), MU)
    second = joined.solve_cycle(joint, path, joined.gap(), MU, after=first)
    assert 1 <= second.cycles < first.cycles
    largest = first.histories[0].force.max()
    np.testing.assert_allclose(
        second.histories[0].force, first.histories[0].force, atol=2.0 * CLOSED * largest
    )
    third = joined.solve_cycle(joint, path, joined.gap(), MU, after=second)
    assert third.cycles == max(second.cycles - 1, 1)


# --- faces in several parts -----------------------------------------------------------------------


@pytest.mark.parametrize("match", [True, False])
def test_parts_of_a_face_are_one_face(match):
    """Check that an interface of several boundaries, seams included, is that of the whole."""
    whole = block_and_pad(full=True, match=match)
    lower, upper = (whole.bodies[name].mesh for name in ("lower", "upper"))
    bottom = upper.boundaries["bottom"]
    middles = upper.p[0][upper.facets[:, bottom]].mean(axis=0)
    halves = {"left": bottom[middles < 0.0], "right": bottom[middles > 0.0]}
    parted = imported(lower, upper.with_boundaries(halves))
    pair = ContactPair("foot", BODIES, ["top"], ["right", "left"], np.array([1.0, 0.0, 0.0]))
    one, other = (
        imported_mesh(mesh, BODIES, [contact]).interfaces[0]
        for mesh, contact in ((whole, PAIR), (parted, pair))
    )
    np.testing.assert_array_equal(one.nodes_2, other.nodes_2)
    np.testing.assert_allclose(one.nodal_areas, other.nodal_areas, rtol=1e-12)
    np.testing.assert_allclose(one.gap, other.gap, atol=1e-12)
    np.testing.assert_allclose(one.frame.origin, other.frame.origin, atol=1e-12)
