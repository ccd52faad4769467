"""Contact faces cut by planes of symmetry, and the whole faces that they represent."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models import structure
from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.stress import stress_field
from fe_models.geometry.imported import ImportedMesh
from fe_models.imported_structure import ContactPair, Support, imported_mesh, imported_structure
from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.loads.applied_loads import BoundaryForce, Pressure
from fe_models.meshes.cut_face import WholeStress, whole_face, whole_history, whole_resultants
from fe_models.meshes.structure_mesh import Body
from sa_solver.types import Frame, Material
from tests.marks import slow
from tests.mirrored_blocks import pad_on_block

STEEL = Material(200e3, 0.3, 7.8e-9)
MU = 0.35
BASE = Support("base", "xyz")
PLANES = [Support("cut_x", "x"), Support("cut_y", "normal")]


def meshed(bodies, supports, points=None, x=(1.0, 0.0, 0.0)):
    """Return the file's content, and the two bodies with their interface."""
    named = {body.name: body for body in bodies}
    numbers = {name: np.arange(body.mesh.nvertices) for name, body in named.items()}
    imported = ImportedMesh(named, numbers, {"block": {}, "pad": {}} | (points or {}))
    pair = ContactPair("foot", ("block", "pad"), ["top"], ["bottom"], np.array(x))
    return imported, imported_mesh(imported, ("block", "pad"), [pair], supports)


def solved(planes, match, push, order):
    """Return structure and history of a cycle that presses and then pushes along x."""
    supports = [BASE, *(PLANES[axis] for axis in planes)]
    imported, mesh = meshed(pad_on_block(planes, match), supports)
    share = np.array([push * 0.5 ** len(planes), 0.0, 0.0])
    loads = [Pressure("lid", 50.0), BoundaryForce("lid", share)]
    joined = imported_structure(mesh, imported, (STEEL, STEEL), supports, loads, order)
    joint = FrictionalJoint(joined.condense().resolvent(), MU)
    path = np.array([[0.4, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, -1.0]])
    (history,) = joined.solve_cycle(joint, path, joined.gap(), MU).histories
    return joined, history


@pytest.mark.parametrize(
    ("planes", "match", "order"),
    [
        ((0, 1), False, 1),
        slow((0, 1), True, 2),
        slow((1,), False, 2),
        slow((1,), True, 1),
        slow((0,), True, 1),
    ],
)
def test_part_with_its_images_is_the_whole(planes, match, order, monkeypatch):
    """Check fields at nodes and all resultants against the same bodies meshed whole."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-12)
    monkeypatch.setattr(structure, "CLOSED", -1.0)
    monkeypatch.setattr(structure, "MOST_CYCLES", 3)
    push = 0.0 if 0 in planes else 60.0
    part, mine = solved(planes, match, push, order)
    whole, theirs = solved((), match, push, order)
    interface, mine = part.mesh.interfaces[0], whole_history(mine)
    assert interface.planes == planes
    origin = whole.mesh.interfaces[0].frame.origin
    np.testing.assert_allclose(interface.frame.origin, origin, atol=1e-14)
    there = theirs.interface.coordinates
    twins = [
        int(np.argmin(np.linalg.norm(there - xy, axis=1))) for xy in mine.interface.coordinates
    ]
    assert sorted(twins) == list(range(len(there)))
    for name in ("force", "displacement", "slip"):
        expected = getattr(theirs, name)[..., twins]
        largest = np.abs(expected).max()
        # Slips of 1e-10 mm are differences of displacements and have their rounding errors.
        within = 2e-8 * largest + 1e-14
        np.testing.assert_allclose(getattr(mine, name), expected, atol=within, err_msg=name)
    largest = np.abs(theirs.loads.resultants).max()
    np.testing.assert_allclose(mine.loads.resultants, theirs.loads.resultants, atol=1e-8 * largest)
    work = theirs.loads.P.max() * np.abs(theirs.displacement).max()
    for name in ("Edx", "Edy"):
        expected = getattr(theirs.loads, name)
        np.testing.assert_allclose(getattr(mine.loads, name), expected, atol=1e-8 * work)
    for number in (1, 2):
        one, two = mine.interface.face(number), theirs.interface.face(number)
        assert len(one) == len(two)
        assert one.nodal_areas.sum() == pytest.approx(4.0, rel=1e-12)
    # The nodes of the part come first.
    np.testing.assert_array_equal(
        mine.interface.coordinates[: len(interface)], interface.coordinates
    )


def test_resultants_of_the_whole():
    """Check two forces that are images across x, then four across x and y."""
    x, y, force = 0.7, 0.4, np.array([2.0, -3.0, 5.0])
    for planes, signs in (
        ((0,), [(1, 1), (-1, 1)]),
        ((0, 1), [(1, 1), (-1, 1), (1, -1), (-1, -1)]),
    ):
        forces = np.array([force * [a, b, 1.0] for a, b in signs]).T
        places = np.array([[x * a, y * b] for a, b in signs]).T
        every = [structure.resultants(*pair) for pair in ((forces, *places), (force, x, y))]
        interface = replace(meshed(pad_on_block((1,)), [BASE])[1].interfaces[0], planes=planes)
        np.testing.assert_allclose(whole_resultants(interface, every[1]), every[0], atol=1e-14)


def test_stress_beyond_the_plane_is_the_image_of_the_stress_before_it():
    """Check displacements of second degree, which first-order elements interpolate at nodes."""
    frame = Frame(
        np.array([0.0, 0.0, 0.5]), np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0, 0, 1]])
    )
    points = np.array([[0.3, 0.2, 0.1], [-0.3, 0.2, 0.1], [-0.6, -0.5, -0.2], [0.3, 0.5, 0.3]])

    def under(planes):
        elastic = ElasticBody(pad_on_block(planes)[1], STEEL)
        x, y, z = elastic.nodes.T
        moved = np.stack([x + y**2 + z * x, 2.0 * y * x - y * z, x * z - y**2 + z**2], axis=1)
        none = np.array([], dtype=int)
        return stress_field(elastic, 1e-4 * moved.ravel(), none, none, none)

    mesh = meshed(pad_on_block((1,)), [BASE, PLANES[1]])[1]
    # The frame's x is the global y, and the plane is across it.
    part = replace(mesh.interfaces[0], planes=(0,), frame=frame)
    part = replace(part, coordinates=part.coordinates[:, ::-1])
    found, exact = WholeStress(under((1,)), part).at(points, frame), under(()).at(points, frame)
    assert np.abs(exact).min(axis=1).max() > 0.0
    np.testing.assert_allclose(found, exact, atol=1e-7 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("planes", "supports", "found"),
    [
        ((0, 1), PLANES, (0, 1)),
        ((1,), PLANES[1:], (1,)),
        ((1,), [], ()),  # an end of the bodies
        ((1,), [Support("edge", "y")], ()),  # the face's edge, and nothing below it
        ((), [Support("middle", "y")], ()),  # bodies go on beyond
        ((1,), [PLANES[1], Support("bottom", "y")], ()),  # held all over
        ((0, 1), [PLANES[1], Support("corner", "x")], ()),  # two directions, one of them a plane's
    ],
)
def test_which_supports_are_planes_of_symmetry(planes, supports, found):
    bodies = pad_on_block(planes)
    sets = {}
    for body in bodies:
        x, y, z = body.points.T
        sets[body.name] = {
            "edge": np.flatnonzero((z == 0.0) & (y == y.min())),
            "middle": np.flatnonzero(np.isclose(y, 0.0)),
            "corner": np.flatnonzero((z == 0.0) & (y == y.min()) & (x == x.min())),
        }
    interface = meshed(bodies, [BASE, *supports], sets)[1].interfaces[0]
    assert interface.planes == found
    for axis in found:
        assert interface.coordinates[:, axis].min() == 0.0
        assert interface.frame.origin[axis] == pytest.approx(0.0, abs=1e-12)
    if not found:
        assert whole_face(interface) is interface


def test_plane_askew_to_the_contacts_axes_is_none():
    x = (1.0, 1e-4, 0.0)
    interface = meshed(pad_on_block((1,)), [BASE, PLANES[1]], x=x)[1].interfaces[0]
    assert not interface.planes


def test_plane_anywhere_with_the_digits_of_a_file():
    """Check a plane at an arbitrary level, with coordinates rounded to six digits."""
    bodies = []
    for body in pad_on_block((1,)):
        points = np.round(body.mesh.p + np.array([[10.0], [17.123457], [0.0]]), 5)
        bodies.append(Body(body.name, replace(body.mesh, doflocs=points)))
    interface = meshed(bodies, [BASE, PLANES[1]])[1].interfaces[0]
    assert interface.planes == (1,)
    assert interface.frame.origin[1] == pytest.approx(17.12346, abs=1e-9)
