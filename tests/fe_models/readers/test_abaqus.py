"""Abaqus input files: parts, instances, surfaces and sets, and flat files."""

import meshio
import numpy as np
import pytest
from skfem import MeshTet

from fe_models.geometry.imported import patch, read_bodies
from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import MeshError
from tests.fe_models.readers.abaqus_files import ASSEMBLY, CUBES, PARTS, read


def volume(body):
    return np.abs(element_volumes(body.mesh)).sum()


@pytest.fixture
def assembled(tmp_path):
    return read(tmp_path, PARTS + ASSEMBLY)


def test_every_instance_is_a_body_with_its_part_s_numbers(assembled):
    assert list(assembled.bodies) == ["Block-1", "Block-2", "Pin-1"]
    volumes = [volume(body) for body in assembled.bodies.values()]
    np.testing.assert_allclose(volumes, [2.0, 2.0, 1.0 / 6.0], rtol=1e-12)
    numbers = [11, 12, 13, 14, 15, 16, 21, 22, 23, 24, 25, 26]
    assert assembled.node_numbers["Block-1"].tolist() == numbers
    assert assembled.node_numbers["Block-2"].tolist() == numbers
    assert assembled.node_numbers["Pin-1"].tolist() == [1, 2, 3, 4]


def test_instance_is_translated_and_then_turned(assembled):
    """Check that (x, y, z) goes to (3 + z, y, 5 - x)."""
    x, y, z = assembled.bodies["Block-1"].points.T
    expected = np.column_stack([3.0 + z, y, 5.0 - x])
    np.testing.assert_allclose(assembled.bodies["Block-2"].points, expected, atol=1e-12)
    np.testing.assert_allclose(assembled.bodies["Pin-1"].points[3], [0, 0, 2], atol=1e-12)


def test_surfaces_of_a_part_are_named_by_instance(assembled):
    one, two = assembled.bodies["Block-1"], assembled.bodies["Block-2"]
    assert set(one.mesh.boundaries) == {"Feet", "Left", "Block-1.Top", "Block-1.End"}
    assert set(two.mesh.boundaries) == {"Block-2.Top", "Block-2.End"}
    assert set(assembled.bodies["Pin-1"].mesh.boundaries) == {"Feet"}


@pytest.mark.parametrize(
    ("body", "boundary", "area", "centroid", "normal"),
    [
        ("Block-1", "Block-1.Top", 2.0, (1, 0.5, 1), (0, 0, 1)),
        ("Block-1", "Block-1.End", 1.0, (2, 0.5, 0.5), (1, 0, 0)),
        ("Block-1", "Left", 1.0, (0, 0.5, 0.5), (-1, 0, 0)),
        ("Block-1", "Feet", 2.0, (1, 0.5, 0), (0, 0, -1)),
        ("Pin-1", "Feet", 0.5, (1 / 3, 1 / 3, 1), (0, 0, -1)),
        ("Block-2", "Block-2.Top", 2.0, (4, 0.5, 4), (1, 0, 0)),
        ("Block-2", "Block-2.End", 1.0, (3.5, 0.5, 3), (0, 0, -1)),
    ],
)
def test_surfaces_are_where_they_should_be(assembled, body, boundary, area, centroid, normal):
    surface = patch(assembled.bodies[body], boundary)
    assert surface.area == pytest.approx(area, rel=1e-12)
    np.testing.assert_allclose(surface.centroid, centroid, atol=1e-12)
    np.testing.assert_allclose(surface.normal, normal, atol=1e-12)


def test_node_sets_are_those_of_each_body(assembled):
    """Check that a range means existing nodes, and that the reference point is on no body."""
    numbers = {
        body: {
            name: assembled.node_numbers[body][vertices].tolist() for name, vertices in sets.items()
        }
        for body, sets in assembled.points.items()
    }
    assert numbers == {
        "Block-1": {"Ends": [13, 23], "Block-1.Corner": [11]},
        "Block-2": {"Ends": [11], "Block-2.Corner": [11]},
        "Pin-1": {"Ends": [4], "AllOfPin": [1, 2, 3, 4]},
    }


def test_node_set_of_an_element_set_and_node_surface(tmp_path):
    seven = "*Nset, nset=Seven, elset=left ONE\n*Surface, type=NODE, name=Contact\nSeven, 1.\n"
    text = (PARTS + ASSEMBLY).replace("*End Part\n", seven + "*End Part\n", 1)
    seven = "*Nset, nset=Seven, elset=Block-2.Left one\n"
    text = text.replace("*End Assembly", seven + "*End Assembly")
    imported = read(tmp_path, text)
    expected = [11, 12, 14, 15, 21, 22, 24, 25]
    for body, name in (
        ("Block-1", "Block-1.Seven"),
        ("Block-1", "Block-1.Contact"),
        ("Block-2", "Seven"),
    ):
        numbers = imported.node_numbers[body][imported.points[body][name]]
        assert numbers.tolist() == expected


def test_independent_instance_has_its_own_mesh(tmp_path):
    """Check a mesh inside an independent instance, whose part CAE leaves empty."""
    body = PARTS[PARTS.index("*Node") : PARTS.index("*End Part")]
    text = (
        "*Part, name=Block\n*End Part\n*Assembly, name=A\n*Instance, name=B, part=Block\n"
        f" 0., 0., 4.\n{body}*End Instance\n*End Assembly\n"
    )
    imported = read(tmp_path, text)
    surface = patch(imported.bodies["B"], "Top")
    np.testing.assert_allclose(surface.centroid, [1.0, 0.5, 5.0], atol=1e-12)


def test_names_of_one_instance_need_no_prefix(tmp_path):
    text = PARTS + "*Assembly\n*Instance, name=I.1, part=Block\n*End Instance\n*End Assembly\n"
    imported = read(tmp_path, text)
    assert set(imported.bodies["I.1"].mesh.boundaries) == {"Top", "End"}


def test_included_file_is_followed_and_named(tmp_path):
    path = tmp_path / "mesh" / "nodes.inc"
    path.parent.mkdir()
    path.write_text("1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n4, 0., 0., 1.\n")
    text = "*Node\n*Include, input=mesh/nodes.inc\n*Element, type=C3D4, elset=Tip\n1, 1, 2, 3, 4\n"
    assert volume(read(tmp_path, text).bodies["Tip"]) == pytest.approx(1 / 6)
    path.write_text("1, 0., 0., 0.\n2, x, 0., 0.\n")
    with pytest.raises(MeshError, match=r"nodes\.inc:2: 'x' is not a number"):
        read(tmp_path, text)
    path.write_text("*Include, input=nodes.inc\n")
    with pytest.raises(MeshError, match=r"nodes\.inc:1: "):
        read(tmp_path, text)


UNIT = {
    "C3D4": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "C3D5": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1)],
    "C3D6": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
    "C3D8": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
             (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
    "CPE3": [(0, 0, 3), (1, 0, 3), (0, 1, 3)],
    "CPS4R": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
}  # fmt: skip
ROOT = np.sqrt(0.5)
# Outward normals of faces S1, S2, ... by the numbering in the Abaqus Elements Guide.
NORMALS = {
    "C3D4": [(0, 0, -1), (0, -1, 0), (3**-0.5,) * 3, (-1, 0, 0)],
    "C3D5": [(0, 0, -1), (0, -1, 0), (ROOT, 0, ROOT), (0, ROOT, ROOT), (-1, 0, 0)],
    "C3D6": [(0, 0, -1), (0, 0, 1), (0, -1, 0), (ROOT, ROOT, 0), (-1, 0, 0)],
    "C3D8": [(0, 0, -1), (0, 0, 1), (0, -1, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0)],
    "CPE3": [(0, 0, -1), (ROOT, 0, ROOT), (-1, 0, 0)],
    "CPS4R": [(0, 0, -1), (1, 0, 0), (0, 0, 1), (-1, 0, 0)],
}
VOLUMES = {"C3D4": 1 / 6, "C3D5": 1 / 3, "C3D6": 0.5, "C3D8": 1.0, "CPE3": 0.5, "CPS4R": 1.0}


@pytest.mark.parametrize("kind", UNIT)
def test_faces_of_every_element_are_those_of_the_manual(tmp_path, kind):
    """Check face numbers; Y of a plane file is our Z."""
    nodes = "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(UNIT[kind], start=1))
    count = len(NORMALS[kind])
    surfaces = "".join(f"*Surface, name=F{k}\nOne, S{k}\n" for k in range(1, count + 1))
    corners = ", ".join(str(k) for k in range(1, len(UNIT[kind]) + 1))
    text = f"*Node\n{nodes}*Element, type={kind}, elset=One\n1, {corners}\n{surfaces}"
    body = read(tmp_path, text).bodies["One"]
    assert volume(body) == pytest.approx(VOLUMES[kind], rel=1e-12)
    for k, normal in enumerate(NORMALS[kind], start=1):
        np.testing.assert_allclose(patch(body, f"F{k}").normal, normal, atol=1e-12)


def test_midside_nodes_are_dropped_and_lines_go_on(tmp_path):
    """Check a C3D20 over two lines, as CAE writes it."""
    corners = np.array(UNIT["C3D8"], dtype=float)
    pairs = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)]
    pairs += [(k, k + 4) for k in range(4)]
    points = np.vstack([corners, [corners[list(pair)].mean(axis=0) for pair in pairs]])
    nodes = "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(points, start=1))
    text = f"*Node, nset=All\n{nodes}*Element, type=C3D20R,\n elset=One\n"
    text += "1, 1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,\n16,17,18,19,20\n"
    imported = read(tmp_path, text)
    assert volume(imported.bodies["One"]) == pytest.approx(1.0, rel=1e-12)
    assert imported.node_numbers["One"].tolist() == list(range(1, 9))
    assert len(imported.points["One"]["All"]) == 8


def two_boxes():
    """Return boxes of tetrahedra from x = 0 to 1 and from 2 to 4, with named faces x = const."""
    points, cells, facets = [], [], []
    for low, high in ((0.0, 1.0), (2.0, 4.0)):
        mesh = MeshTet.init_tensor(np.linspace(low, high, 3), *[np.linspace(0.0, 1.0, 3)] * 2)
        left = mesh.facets_satisfying(lambda x, low=low: np.isclose(x[0], low))
        cells.append(mesh.t.T + 27 * len(points))
        facets.append(mesh.facets[:, left].T + 27 * len(points))
        points.append(mesh.p.T)
    return np.concatenate(points), cells, facets


def check_flat(imported, names):
    one, two, left, right = names
    assert set(imported.bodies) == {one, two}
    for body, boundary, size, x in ((one, left, 1.0, 0.0), (two, right, 2.0, 2.0)):
        assert volume(imported.bodies[body]) == pytest.approx(size, rel=1e-12)
        surface = patch(imported.bodies[body], boundary)
        assert surface.area == pytest.approx(1.0, rel=1e-12)
        np.testing.assert_allclose(surface.centroid, [x, 0.5, 0.5], atol=1e-12)
        np.testing.assert_allclose(surface.normal, [-1.0, 0.0, 0.0], atol=1e-12)


def test_flat_file_of_meshio(tmp_path):
    points, cells, facets = two_boxes()
    blocks = [("tetra", block) for block in cells] + [("triangle", block) for block in facets]
    names = ["disk", "blade", "foot", "root"]
    none = np.array([], dtype=int)
    sets = {
        name: [
            np.arange(len(block)) if k == block_number else none
            for k, (_, block) in enumerate(blocks)
        ]
        for block_number, name in enumerate(names)
    }
    path = tmp_path / "flat.inp"
    meshio.Mesh(points, blocks, cell_sets=sets).write(path)
    imported = read_bodies(path)
    check_flat(imported, names)
    assert imported.node_numbers["blade"].tolist() == list(range(28, 55))


@pytest.mark.parametrize("named", [True, False])
def test_flat_file_of_gmsh(tmp_path, named):
    points, cells, facets = two_boxes()
    path = tmp_path / "flat.inp"
    with gmsh_model("flat") as gmsh:
        for tag, (tets, triangles) in enumerate(zip(cells, facets, strict=True), start=1):
            nodes = np.unique(tets)
            gmsh.model.addDiscreteEntity(3, tag)
            gmsh.model.addDiscreteEntity(2, tag)
            gmsh.model.mesh.addNodes(3, tag, nodes + 1, points[nodes].ravel())
            gmsh.model.mesh.addElementsByType(tag, 4, [], tets.ravel() + 1)
            gmsh.model.mesh.addElementsByType(tag, 2, [], triangles.ravel() + 1)
            if named:
                gmsh.model.addPhysicalGroup(3, [tag], name=f"body{tag}")
                gmsh.model.addPhysicalGroup(2, [tag], name=f"face{tag}")
        gmsh.write(str(path))
    imported = read_bodies(path)
    if named:
        check_flat(imported, ["body1", "body2", "face1", "face2"])
    else:
        check_flat(imported, ["Volume1", "Volume2", "Surface1", "Surface2"])


def test_names_are_read_in_utf_8(tmp_path):
    path = tmp_path / "model.inp"
    path.write_text(CUBES.replace("type=C3D8R", "type=C3D8R, elset=Fuß"), encoding="utf-8")
    assert list(read_bodies(path).bodies) == ["Fuß"]


def test_empty_set_of_an_instance_adds_nothing(tmp_path):
    text = (PARTS + ASSEMBLY).replace("*End Part", "*Nset, nset=Empty\n*End Part", 1)
    text = text.replace(" Pin-1.4, Block", " Pin-1.4, , Block-1.Empty, Block")
    points = read(tmp_path, text).points
    assert {body for body in points if "Ends" in points[body]} == {"Block-1", "Block-2", "Pin-1"}


def test_flat_file_without_sets(tmp_path):
    assert list(read(tmp_path, CUBES).bodies) == ["body_1"]


def test_edges_next_to_solids_are_a_node_set(tmp_path):
    text = CUBES + "*Element, type=T3D2, elset=Edge\n20, 11, 12\n21, 12, 13\n"
    imported = read(tmp_path, text)
    numbers = imported.node_numbers["body_1"][imported.points["body_1"]["Edge"]]
    assert numbers.tolist() == [11, 12, 13]


def test_plane_part(tmp_path):
    """Check a part with two coordinates per node, of which the second is our Z."""
    text = (
        "*Part, name=Sheet\n*Node\n1, 0., 0.\n2, 2., 0.\n3, 2., 1.\n4, 0., 1.\n"
        "*Element, type=CPE4R\n1, 1, 2, 3, 4\n*Surface, name=Top\n1, S3\n*End Part\n"
        "*Assembly\n*Instance, name=A, part=Sheet\n*End Instance\n"
        "*Instance, name=B, part=Sheet\n 0., 1.\n 0., 1., 0., 0., 1., 1., 90.\n*End Instance\n"
        "*End Assembly\n"
    )
    imported = read(tmp_path, text)
    assert [volume(body) for body in imported.bodies.values()] == pytest.approx([2.0, 2.0])
    np.testing.assert_allclose(patch(imported.bodies["A"], "A.Top").centroid, [1, 0, 1])
    turned = patch(imported.bodies["B"], "B.Top")
    np.testing.assert_allclose(turned.centroid, [-1, 0, 2], atol=1e-12)
    np.testing.assert_allclose(turned.normal, [-1, 0, 0], atol=1e-12)


def test_bonded_sets_of_a_flat_file_are_refused(tmp_path):
    """Check that bonded sets are refused unless one set holds both."""
    sets = "*Elset, elset=A\n7\n*Elset, elset=B\n8\n"
    with pytest.raises(MeshError, match="sets A, B share nodes"):
        read(tmp_path, CUBES + sets)
    assert list(read(tmp_path, CUBES + sets + "*Elset, elset=Both\nA, B\n").bodies) == ["Both"]
