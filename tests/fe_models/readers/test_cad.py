"""Solids of STEP and BREP files: volumes, units, names, and faces that touch."""

import re

import numpy as np
import pytest

from fe_models.geometry.imported import describe_bodies, patch, read_bodies
from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import MeshError

pytestmark = pytest.mark.usefixtures("reads_here")


def volume(body):
    return np.abs(element_volumes(body.mesh)).sum()


@pytest.fixture(scope="module")
def write(tmp_path_factory, request):
    """Write what a function draws with gmsh's OpenCASCADE kernel; discard its output."""

    def to_file(name, draw):
        path = tmp_path_factory.mktemp("cad") / name
        with gmsh_model("cad") as gmsh:
            draw(gmsh.model.occ)
            gmsh.model.occ.synchronize()
            gmsh.write(str(path))
        return path

    return to_file


def draw_two_boxes(occ):
    """Draw two boxes of the same width, one on the other."""
    occ.addBox(0.0, 0.0, 0.0, 2.0, 1.0, 1.0)
    occ.addBox(0.0, 0.0, 1.0, 2.0, 1.0, 0.5)


def draw_bonded_boxes(occ):
    draw_two_boxes(occ)
    occ.fragment([(3, 1)], [(3, 2)])


@pytest.mark.parametrize("name", ["boxes.step", "boxes.STP", "boxes.brep"])
def test_boxes_that_touch_have_their_own_nodes(write, name):
    path = write(name.lower().replace("stp", "step"), draw_two_boxes)
    imported = read_bodies(path.rename(path.with_name(name)), 0.5)
    assert list(imported.bodies) == ["solid_1", "solid_2"]
    for body, expected in zip(imported.bodies.values(), (2.0, 1.0), strict=True):
        assert volume(body) == pytest.approx(expected, rel=1e-12)
        names = [f"{body.name}.face_{number}" for number in range(1, 7)]
        assert list(body.mesh.boundaries) == names
        patches = [patch(body, boundary) for boundary in names]
        total = 2.0 * (2.0 + expected / 2.0 * 3.0)
        assert sum(face.area for face in patches) == pytest.approx(total, rel=1e-12)
        normals = np.array([face.normal for face in patches])
        np.testing.assert_allclose(normals.sum(axis=0), 0.0, atol=1e-12)
    lower, upper = imported.bodies.values()
    shared = [
        (one, other)
        for one in lower.mesh.boundaries
        for other in upper.mesh.boundaries
        if np.allclose(patch(lower, one).centroid, patch(upper, other).centroid)
    ]
    assert len(shared) == 1
    np.testing.assert_allclose(patch(lower, shared[0][0]).normal, [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(patch(upper, shared[0][1]).normal, [0, 0, -1], atol=1e-12)
    assert not set(imported.node_numbers["solid_1"]) & set(imported.node_numbers["solid_2"])
    assert len(describe_bodies(imported)) == 1 + 14


def test_a_brep_is_in_the_unit_that_is_given(write):
    """Check boxes of 2 x 1 x 1 and 2 x 1 x 0.5 cm with elements of 5 mm."""
    path = write("boxes.brep", draw_two_boxes)
    lower, upper = read_bodies(path, 5.0, "cm").bodies.values()
    assert [volume(lower), volume(upper)] == pytest.approx([2000.0, 1000.0], rel=1e-12)
    edges = np.linalg.norm(np.diff(lower.mesh.p[:, lower.mesh.edges], axis=1)[:, 0], axis=0)
    assert np.median(edges) == pytest.approx(5.0, rel=0.4)
    with pytest.raises(MeshError, match="unit of length"):
        read_bodies(write("boxes.step", draw_two_boxes), 5.0, "cm")


def test_volume_of_a_cylinder_converges(write):
    """Check that the part of the section cut off by chords falls with the square of the size."""
    path = write("cylinder.step", lambda occ: occ.addCylinder(0, 0, 0, 0, 0, 2.0, 1.0))
    exact = 2.0 * np.pi
    errors = []
    for size in (0.4, 0.2):
        (body,) = read_bodies(path, size).bodies.values()
        errors.append(exact - volume(body))
        edges = np.linalg.norm(np.diff(body.mesh.p[:, body.mesh.edges], axis=1)[:, 0], axis=0)
        assert np.median(edges) == pytest.approx(size, rel=0.3)
    assert 0.0 < errors[1] < 0.01 * exact
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_metres_become_millimetres(write):
    path = write("box.step", lambda occ: occ.addBox(0, 0, 0, 1.0, 1.0, 1.0))
    text = path.read_text()
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    path.write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    (body,) = read_bodies(path, 500.0).bodies.values()
    assert volume(body) == pytest.approx(1e9, rel=1e-9)


@pytest.mark.parametrize(
    ("products", "names"),
    [
        (("disk", "blade"), ["disk", "blade"]),
        (("bolt", "bolt"), ["bolt_1", "bolt_2"]),
        (("disk", None), ["disk", "solid_2"]),
    ],
)
def test_solids_go_by_their_names(write, products, names):
    path = write("boxes.step", draw_two_boxes)
    text = path.read_text()
    for number, product in enumerate(products, start=1):
        if product:
            # OpenCASCADE's own name ends in the numbers of the file and of the solid.
            anonymous = rf"'Open CASCADE STEP translator [\d.]+ \d+\.{number}'"
            text, count = re.subn(anonymous, f"'{product}'", text)
            assert count
    path.write_text(text)
    imported = read_bodies(path, 1.0)
    assert list(imported.bodies) == names
    assert f"{names[1]}.face_6" in imported.bodies[names[1]].mesh.boundaries


def test_shared_face_is_refused(write):
    path = write("bonded.brep", draw_bonded_boxes)
    with pytest.raises(MeshError, match=r"solid_1 and solid_2 share"):
        read_bodies(path, 0.5)


def test_loose_faces_are_refused(write):
    path = write("face.step", lambda occ: occ.addRectangle(0, 0, 0, 1, 1))
    with pytest.raises(MeshError, match="no solids"):
        read_bodies(path, 0.5)


def test_truncated_file_is_refused(write):
    path = write("box.step", lambda occ: occ.addBox(0, 0, 0, 1, 1, 1))
    text = path.read_text()
    path.write_text(text[: len(text) // 2])
    with pytest.raises(MeshError) as error:
        read_bodies(path, 0.5)
    assert "\n" not in str(error.value)
