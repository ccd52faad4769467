"""Midside nodes of a file become those of the elements, move with bodies, or are refused."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet, MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.geometry.imported import ImportedMesh, read_bodies
from fe_models.joints.friction import FrictionalJoint
from fe_models.meshes.isoparametric import folded
from fe_models.meshes.remesh import worn_mesh
from fe_models.meshes.second_order import curvature, distance_of_midsides, set_nodes, with_midsides
from fe_models.meshes.structure_mesh import (
    Body,
    MeshError,
    StructureMesh,
    matched_interface,
    write_msh,
)
from sa_solver.types import Frame, Material
from tests.fe_models.readers.test_calculix import blocks, structure_of

STEEL = Material(210e3, 0.3)
AXES = Frame(np.zeros(3), np.eye(3))


def curved_cubes(amount=0.05):
    """Return two cubes on each other, with bent edges on the upper one except at the contact."""
    mesh = MeshTet().refined(1).with_boundaries({"contact": lambda x: x[2] == 0.0})
    lower = Body("lower", mesh.mirrored((0.0, 0.0, 1.0)))
    middle = mesh.p[:, mesh.edges].mean(axis=1).T
    bent = middle + amount * (middle[:, 2:] * np.sin(7.0 * middle) * 0.5)
    upper = Body("upper", mesh, midsides=bent)
    return StructureMesh(
        (lower, upper), (matched_interface("joint", lower, upper, "contact", AXES),)
    )


def imported(mesh, folder):
    write_msh(folder / "bodies.msh", mesh)
    return read_bodies(folder / "bodies.msh")


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Return the cubes read from a file once, since a separate process takes two seconds."""
    return imported(curved_cubes(), tmp_path_factory.mktemp("cubes"))


def same_bodies(found: ImportedMesh):
    return StructureMesh(tuple(found.bodies.values()), ())


@pytest.mark.parametrize("dimension", [2, 3])
def test_written_and_read_again(tmp_path, request, dimension):
    """Check that every node of every element is where it was, whatever gmsh's order."""
    if dimension == 3:
        mesh, found = curved_cubes(), request.getfixturevalue("found")
    else:
        flat = MeshTri().refined(1).with_boundaries({"side": lambda x: x[0] == 0.0})
        middle = flat.p[:, flat.facets].mean(axis=1).T
        mesh = StructureMesh(
            (Body("upper", flat, midsides=middle + 0.02 * np.sin(9.0 * middle)),), ()
        )
        found = imported(mesh, tmp_path)
    before = mesh.bodies[-1]
    after = with_midsides(same_bodies(found), found).bodies[-1]
    for body in (before, after):
        assert body.midsides is not None
    for one, other in zip(*(b.nodes[b.element_nodes] for b in (before, after)), strict=True):
        order = [np.lexsort(points.round(9).T) for points in (one, other)]
        np.testing.assert_allclose(one[order[0]], other[order[1]], atol=1e-12)
    reported = curvature(same_bodies(found).bodies[-1], found)
    assert reported is not None
    assert reported.edges == reported.given == len(before.midsides)


def test_bodies_with_straight_edges_stay_as_they_are(found):
    whole = found.midsides["upper"]
    middle = found.bodies["upper"].points[whole.edges].mean(axis=1)
    straight = replace(found, midsides={"upper": replace(whole, points=middle)})
    bodies = same_bodies(straight)
    assert with_midsides(bodies, straight).bodies == bodies.bodies


def test_edges_without_a_node_are_straight(found):
    whole = found.midsides["upper"]
    some = replace(whole, edges=whole.edges[:20], points=whole.points[:20])
    part = replace(found, midsides={"upper": some})
    body = with_midsides(same_bodies(found), part).bodies[1]
    edges = body.mesh.edges.T
    given = ~np.isnan(some.at(edges)[:, 0])
    assert 0 < given.sum() < len(edges)
    middle = body.points[edges].mean(axis=1)
    np.testing.assert_array_equal(body.midsides[~given], middle[~given])
    reported = curvature(body, part)
    assert (reported.given, reported.edges) == (given.sum(), len(edges))


def test_folded_elements_have_straight_edges(found):
    """Check that the folding edge is straightened, inner ones first, and others are unchanged."""
    straight = found.bodies["upper"].mesh
    surface = np.unique(straight.f2e[:, straight.boundary_facets()])
    inside = np.setdiff1d(np.arange(straight.nedges), surface)[0]
    ends, points = found.midsides["upper"].edges, found.midsides["upper"].points.copy()
    one = np.all(np.sort(ends, axis=1) == straight.edges[:, inside], axis=1)
    points[one] = straight.p[:, straight.edges[0, inside]]
    wrong = replace(found, midsides={"upper": replace(found.midsides["upper"], points=points)})
    body = with_midsides(same_bodies(found), wrong).bodies[1]
    assert not folded(body).any()
    reported = curvature(body, wrong)
    assert reported is not None
    assert 1 <= reported.straightened <= 8
    before = with_midsides(same_bodies(found), found).bodies[1]
    same = np.all(body.midsides == before.midsides, axis=1)
    assert same.sum() >= len(same) - reported.straightened
    middle = straight.p[:, straight.edges].mean(axis=1).T
    np.testing.assert_array_equal(body.midsides[inside], middle[inside])


def test_torn_edges_are_refused(found):
    points = found.midsides["upper"].points.copy()
    ends = np.sort(found.midsides["upper"].edges, axis=1)
    _, first, count = np.unique(ends, axis=0, return_index=True, return_counts=True)
    points[first[np.argmax(count)]] += 1e-3
    torn = replace(found, midsides={"upper": replace(found.midsides["upper"], points=points)})
    with pytest.raises(MeshError, match="1 edges of body upper"):
        with_midsides(same_bodies(found), torn)


def test_faces_whose_midsides_are_apart_give_a_warning():
    mesh = curved_cubes()
    assert distance_of_midsides(mesh.interfaces[0], mesh.bodies) == 0.0
    lower, upper = mesh.bodies
    moved = replace(upper, midsides=upper.midsides + np.array([0.0, 0.0, 1e-3]))
    assert distance_of_midsides(mesh.interfaces[0], (lower, moved)) == pytest.approx(1e-3)


def test_worn_bodies_keep_their_bulges():
    """Check that midside nodes move with the mean of their ends, on the face and inside."""
    mesh = curved_cubes()
    face = mesh.interfaces[0]
    depth = 0.05 * (1.0 + face.coordinates[:, 0])
    worn = worn_mesh(mesh, [(np.zeros(len(face)), depth)])
    before, after = mesh.bodies[1], worn.bodies[1]
    ends = before.mesh.edges
    moved = (after.mesh.p - before.mesh.p)[:, ends].mean(axis=1).T
    np.testing.assert_allclose(after.midsides - before.midsides, moved, atol=1e-14)
    volumes = [ElasticBody(b, STEEL, 2).basis().dx.sum() for b in (before, after)]
    # The face moves by 0.075 mm on average over 1 mm²; bent edges move with it.
    assert volumes[0] - volumes[1] == pytest.approx(0.075, rel=0.02)
    with pytest.raises(MeshError, match="crushes elements"):
        worn_mesh(mesh, [(np.zeros(len(face)), np.full(len(face), 0.47))])


def test_node_sets_have_their_midside_nodes(tmp_path):
    """Check listed midside nodes or, without any, those of facets with all corners in the set."""
    file = tmp_path / "wedge.inp"
    corners = "*NODE\n1, 0, 0, 0\n2, 2, 0, 0\n3, 0, 2, 0\n4, 0, 0, 2\n"
    middle = "5, 1, 0, 0\n6, 1, 1, 0\n7, 0, 1, 0\n8, 0, 0, 1\n9, 1, 0, 1\n10, 0, 1, 1\n"
    second = "*ELEMENT, TYPE=C3D10, ELSET=wedge\n1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10\n"
    file.write_text(corners + middle + second + "*NSET, NSET=held\n1, 2, 3, 5, 6\n")
    found = read_bodies(file)
    elastic = ElasticBody(found.bodies["wedge"], STEEL, 2)
    held = elastic.nodes[set_nodes(elastic, found, "held")]
    expected = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0, 0], [1, 1, 0]]
    assert {tuple(point) for point in held} == {tuple(map(float, point)) for point in expected}
    first = "*ELEMENT, TYPE=C3D4, ELSET=wedge\n1, 1, 2, 3, 4\n"
    file.write_text(corners + first + "*NSET, NSET=held\n1, 2, 3\n")
    found = read_bodies(file)
    elastic = ElasticBody(found.bodies["wedge"], STEEL, 2)
    held = elastic.nodes[set_nodes(elastic, found, "held")]
    assert len(held) == 6
    np.testing.assert_array_equal(held[:, 2], 0.0)
    straight = ElasticBody(found.bodies["wedge"], STEEL)
    np.testing.assert_array_equal(set_nodes(straight, found, "held"), [0, 1, 2])


HEXAHEDRON = """*NODE
1, 0, 0, 0
2, 2, 0, 0
3, 2, 2, 0
4, 0, 2, 0
5, 0, 0, 2
6, 2, 0, 2
7, 2, 2, 2
8, 0, 2, 2
9, 1, 0, 0
10, 2, 1, 0
11, 1, 2, 0
12, 0, 1, 0
13, 1, 0, 2.2
14, 2, 1, 2.2
15, 1, 2, 2.2
16, 0, 1, 2.2
17, 0, 0, 1
18, 2, 0, 1
19, 2, 2, 1
20, 0, 2, 1
*ELEMENT, TYPE=C3D20R, ELSET=brick
"""


def test_a_brick_is_split_into_curved_tetrahedra(tmp_path):
    """Check that diagonals follow its twenty nodes: the volume is that of the brick."""
    file = tmp_path / "brick.inp"
    cells = "1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15,\n16, 17, 18, 19, 20\n"
    file.write_text(HEXAHEDRON + cells)
    found = read_bodies(file)
    body = with_midsides(same_bodies(found), found).bodies[0]
    volume = ElasticBody(body, STEEL, 2).basis().dx.sum()
    # Serendipity: the top is at 2 + 0.2 (N_13 + ... + N_16), whose mean is 4/3 of its area.
    assert volume == pytest.approx(8.0 + 0.2 * 4.0 * 4.0 / 3.0, rel=1e-3)


@pytest.mark.parametrize("matching", [True, False])
def test_curved_faces_bear_what_is_applied(matching):
    """Check tractions on the bent face instead of its corners, a difference of 0.3 %."""
    bodies = blocks(2, curved=True, matching=matching)
    structure = structure_of(bodies, matching)
    joint = FrictionalJoint(structure.condense().resolvent(), friction=0.9)
    states = list(joint.march(np.ones((1, 1)), structure.gap()))
    assert states[0].converged
    assert structure.equilibrium_errors(states, np.ones((1, 1))) < 1e-7
