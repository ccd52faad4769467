"""Meshes of users: round trips through the formats, checks, and refusals."""

import meshio
import numpy as np
import pytest
from skfem import MeshHex, MeshQuad, MeshTet, MeshTri

from fe_models.geometry.imported import describe_bodies, patch, read_bodies
from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import MeshError, write_msh
from fe_models.readers.grouped import CORNERS, pieces, simplices

pytestmark = pytest.mark.usefixtures("reads_here")

# Two boxes that touch at z = 1, and their faces there, tagged 1 to 4; neither shares nodes.
LOWER, UPPER = ((0.0, 0.0, 0.0), (2.0, 1.0, 1.0)), ((0.5, 0.0, 1.0), (1.5, 1.0, 1.5))
TAGS = {"lower": (1, 3), "upper": (2, 3), "lower_top": (3, 2), "upper_bottom": (4, 2)}
VOLUME = {"lower": 2.0, "upper": 0.5}
AREA = {"lower_top": 2.0, "upper_bottom": 1.0}
# Names in meshio of scikit-fem's elements and their facets.
KINDS = {
    MeshTet: ("tetra", "triangle"), MeshHex: ("hexahedron", "quad"), MeshTri: ("triangle", "line"),
    MeshQuad: ("quad", "line"),
}  # fmt: skip


def volume(body):
    return np.abs(element_volumes(body.mesh)).sum()


def box(kind, low, high, count=3):
    axes = [np.linspace(a, b, count) for a, b in zip(low, high, strict=True)]
    return kind.init_tensor(*axes)


def two_boxes(kind=MeshTet, tags=True):
    """Return both boxes in one file; in the plane their sections y = 0."""
    dim = kind.elem.refdom.dim()
    points, cells, facets, offset = [], [], [], 0
    for (low, high), level in ((LOWER, 1.0), (UPPER, 1.0)):
        pick = (0, 1, 2) if dim == 3 else (0, 2)
        mesh = box(kind, [low[k] for k in pick], [high[k] for k in pick])
        face = mesh.facets[:, mesh.facets_satisfying(lambda x, z=level: np.isclose(x[-1], z))]
        if kind is MeshHex:  # scikit-fem numbers the corners of a cube in another order.
            cell = mesh.t[[0, 1, 4, 2, 3, 5, 7, 6]]
        else:
            cell = mesh.t
        points.append(mesh.p.T)
        cells.append(cell.T + offset)
        facets.append(face.T + offset)
        offset += mesh.p.shape[1]
    cell_kind, facet_kind = KINDS[kind]
    blocks = [(cell_kind, block) for block in cells] + [(facet_kind, block) for block in facets]
    data = [np.full(len(block), tag) for tag, (_, block) in enumerate(blocks, start=1)]
    field = {name: np.array([tag, d - 3 + dim]) for name, (tag, d) in TAGS.items()}
    return meshio.Mesh(
        np.concatenate(points),
        blocks,
        cell_data={"gmsh:physical": data, "gmsh:geometrical": data} if tags else {},
        field_data=field if tags else {},
    )


def check_two_boxes(imported, names):
    """Check ``names`` of bodies and boundaries, and exact volumes, areas and normals."""
    lower, upper, top, bottom = names
    assert list(imported.bodies) == [lower, upper]
    assert volume(imported.bodies[lower]) == pytest.approx(2.0, rel=1e-12)
    assert volume(imported.bodies[upper]) == pytest.approx(0.5, rel=1e-12)
    for body, boundary, area, normal in ((lower, top, 2.0, 1.0), (upper, bottom, 1.0, -1.0)):
        assert list(imported.bodies[body].mesh.boundaries) == [boundary]
        surface = patch(imported.bodies[body], boundary)
        assert surface.area == pytest.approx(area, rel=1e-12)
        np.testing.assert_allclose(surface.normal, [0.0, 0.0, normal], atol=1e-12)
        np.testing.assert_allclose(surface.centroid, [1.0, 0.5, 1.0], atol=1e-12)


@pytest.mark.parametrize("file_format", ["gmsh", "gmsh22"])
@pytest.mark.parametrize("binary", [False, True])
def test_gmsh_file_with_names(tmp_path, file_format, binary):
    path = tmp_path / "boxes.msh"
    mesh = two_boxes()
    # meshio writes no groups into format 4.1, which keeps them with its entities.
    if file_format == "gmsh":
        _write_with_gmsh(path, mesh, 4.1, binary)
    else:
        mesh.write(path, file_format=file_format, binary=binary)
    check_two_boxes(read_bodies(path), TAGS)


def test_gmsh_numbers_of_nodes_are_kept(tmp_path):
    path = tmp_path / "boxes.msh"
    mesh = two_boxes()
    _write_with_gmsh(path, mesh, 4.1, False, first=101)
    imported = read_bodies(path)
    for name, body in imported.bodies.items():
        rows = imported.node_numbers[name] - 101
        np.testing.assert_allclose(mesh.points[rows], body.points, atol=1e-15)


def test_old_gmsh_file_with_gaps_in_its_numbers(tmp_path):
    """Check that an unnamed group is named by its number."""
    path = tmp_path / "tetrahedron.msh"
    path.write_text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
        "$Nodes\n4\n70 0 0 0\n5 1 0 0\n900 0 1 0\n31 0 0 1\n$EndNodes\n"
        "$Elements\n2\n8 4 2 12 1 70 5 900 31\n3 2 2 13 1 5 70 900\n$EndElements\n"
    )
    imported = read_bodies(path)
    assert imported.node_numbers["12"].tolist() == [5, 31, 70, 900]
    np.testing.assert_array_equal(
        imported.bodies["12"].points, [[1, 0, 0], [0, 0, 1], [0, 0, 0], [0, 1, 0]]
    )
    np.testing.assert_array_equal(patch(imported.bodies["12"], "13").normal, [0, 0, -1])


def _write_with_gmsh(path, mesh, version, binary, first=1, names=True, order=1, save_all=False):
    """Write with gmsh itself, with every block as an entity."""
    kinds = {"tetra": (3, 4), "triangle": (2, 2), "hexahedron": (3, 5), "quad": (2, 3)}
    with gmsh_model("boxes") as gmsh:
        for tag, block in enumerate(mesh.cells, start=1):
            dim, kind = kinds[block.type]
            gmsh.model.addDiscreteEntity(dim, tag)
            if dim == 3:
                nodes = np.unique(block.data)
                gmsh.model.mesh.addNodes(3, tag, nodes + first, mesh.points[nodes].ravel())
            gmsh.model.mesh.addElementsByType(tag, kind, [], (block.data + first).ravel())
        if names:
            for name, (tag, dim) in mesh.field_data.items():
                gmsh.model.addPhysicalGroup(int(dim), [int(tag)], int(tag), name)
        if order > 1:  # This renumbers the nodes.
            gmsh.model.mesh.setOrder(order)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.option.setNumber("Mesh.SaveAll", save_all)
        gmsh.write(str(path))


@pytest.mark.parametrize("version", [2.2, 4.1])
def test_second_order_gmsh_file_keeps_its_names_and_loses_its_midsides(tmp_path, version):
    path = tmp_path / "boxes.msh"
    mesh = two_boxes()
    _write_with_gmsh(path, mesh, version, False, order=2)
    imported = read_bodies(path)
    check_two_boxes(imported, TAGS)
    assert sum(body.mesh.nvertices for body in imported.bodies.values()) == len(mesh.points)


@pytest.mark.parametrize("order", [1, 2])
def test_hexahedra_of_gmsh(tmp_path, order):
    path = tmp_path / "boxes.msh"
    _write_with_gmsh(path, two_boxes(MeshHex), 4.1, False, order=order)
    imported = read_bodies(path)
    check_two_boxes(imported, TAGS)
    assert [body.mesh.nelements for body in imported.bodies.values()] == [48, 48]


def test_gmsh_file_without_groups_goes_by_its_entities(tmp_path):
    path = tmp_path / "boxes.msh"
    _write_with_gmsh(path, two_boxes(), 4.1, False, names=False)
    check_two_boxes(read_bodies(path), "1234")


def test_gmsh_file_with_elements_in_no_group_is_refused(tmp_path):
    mesh = two_boxes()
    del mesh.field_data["upper"]
    path = tmp_path / "boxes.msh"
    _write_with_gmsh(path, mesh, 4.1, False, save_all=True)
    with pytest.raises(MeshError, match="volume 2 are in no"):
        read_bodies(path)


def test_written_structure_is_read_back(coarse_mesh, tmp_path):
    path = tmp_path / "structure.msh"
    write_msh(path, coarse_mesh)
    imported = read_bodies(path)
    for body in coarse_mesh.bodies:
        read = imported.bodies[body.name]
        np.testing.assert_allclose(read.mesh.p, body.mesh.p, rtol=1e-15, atol=1e-15)
        assert set(read.mesh.boundaries) == {f"{body.name}_{name}" for name in body.mesh.boundaries}
        for name in body.mesh.boundaries:
            np.testing.assert_array_equal(read.vertices(f"{body.name}_{name}"), body.vertices(name))


@pytest.mark.parametrize("suffix", [".vtu", ".vtk", ".xdmf", ".mesh", ".bdf"])
def test_formats_without_names_go_by_numbers(tmp_path, suffix):
    mesh = two_boxes()
    del mesh.cell_data["gmsh:geometrical"]
    if suffix == ".mesh":
        mesh.cell_data["medit:ref"] = mesh.cell_data.pop("gmsh:physical")
    if suffix == ".bdf":
        mesh.cell_data["nastran:ref"] = mesh.cell_data.pop("gmsh:physical")
    path = tmp_path / f"boxes{suffix}"
    mesh.write(path)
    check_two_boxes(read_bodies(path), "1234")


def test_med_groups_go_by_their_names(tmp_path):
    """Check names of MED families, which have negative numbers on cells."""
    mesh = two_boxes()
    tags = [-values for values in mesh.cell_data["gmsh:physical"]]
    # meshio's writer requires one block per kind of element.
    mesh = meshio.Mesh(
        mesh.points,
        {kind: mesh.get_cells_type(kind) for kind in ("tetra", "triangle")},
        cell_data={"cell_tags": [np.concatenate(tags[:2]), np.concatenate(tags[2:])]},
    )
    mesh.cell_tags = {-tag: [name] for name, (tag, _) in TAGS.items()}
    mesh.point_data["point_tags"] = np.where(mesh.points[:, 2] == 1.0, 1, 0)
    mesh.point_tags = {1: ["interface"]}
    path = tmp_path / "boxes.med"
    mesh.write(path)
    imported = read_bodies(path)
    check_two_boxes(imported, TAGS)
    for body, boundary in (("lower", "lower_top"), ("upper", "upper_bottom")):
        np.testing.assert_array_equal(
            imported.points[body]["interface"], imported.bodies[body].vertices(boundary)
        )


def test_file_without_tags_has_its_pieces(tmp_path):
    mesh = two_boxes(tags=False)
    path = tmp_path / "boxes.vtu"
    mesh.write(path)
    imported = read_bodies(path)
    assert list(imported.bodies) == ["body_1", "body_2"]
    assert [volume(body) for body in imported.bodies.values()] == pytest.approx([2.0, 0.5])
    np.testing.assert_array_equal(imported.node_numbers["body_2"], 27 + np.arange(27))


@pytest.mark.parametrize("kind", [MeshTri, MeshQuad])
@pytest.mark.parametrize("plane", ["xy", "xz"])
def test_plane_mesh(tmp_path, kind, plane):
    """Check that the axes become X and Z whichever coordinate is constant."""
    mesh = two_boxes(kind)
    points = np.full((len(mesh.points), 3), 7.0)
    points[:, (0, 1) if plane == "xy" else (0, 2)] = mesh.points
    mesh.points = points
    path = tmp_path / "boxes.msh"
    mesh.write(path, file_format="gmsh22", binary=False)
    imported = read_bodies(path)
    for name, area in VOLUME.items():
        body = imported.bodies[name]
        assert isinstance(body.mesh, MeshTri)
        assert volume(body) == pytest.approx(area, rel=1e-12)
        assert body.mesh.nelements == 8
    for body, boundary, sign in (("lower", "lower_top", 1.0), ("upper", "upper_bottom", -1.0)):
        surface = patch(imported.bodies[body], boundary)
        assert surface.area == pytest.approx(AREA[boundary], rel=1e-12)
        np.testing.assert_allclose(surface.normal, [0.0, 0.0, sign], atol=1e-12)
        np.testing.assert_allclose(surface.centroid, [1.0, 0.0, 1.0], atol=1e-12)


@pytest.mark.parametrize("suffix", [".vtu", ".bdf"])
def test_hexahedra_fill_their_box_conformingly(tmp_path, suffix):
    mesh = two_boxes(MeshHex)
    mesh.cell_data = {"nastran:ref": mesh.cell_data["gmsh:physical"]}
    path = tmp_path / f"boxes{suffix}"
    mesh.write(path)
    imported = read_bodies(path)
    check_two_boxes(imported, "1234")
    for body in imported.bodies.values():
        assert body.mesh.nelements == 6 * 8
        # 2 x 2 squares of 2 triangles on each of six faces, and no boundary inside.
        assert len(body.mesh.boundary_facets()) == 48


def test_random_numbering_splits_conformingly():
    """Check that diagonals agree and the volume is that of the box for any node numbers."""
    rng = np.random.default_rng(1)
    mesh = box(MeshHex, (0.0, 0.0, 0.0), (1.0, 2.0, 3.0), 4)
    order = rng.permutation(mesh.p.shape[1])
    cells = order[mesh.t[[0, 1, 4, 2, 3, 5, 7, 6]].T]
    points = np.empty_like(mesh.p)
    points[:, order] = mesh.p
    tets = MeshTet(points, simplices("hexahedron", cells).T)
    assert tets.nelements == 6 * 27
    assert np.abs(element_volumes(tets)).sum() == pytest.approx(6.0, rel=1e-12)
    assert len(tets.boundary_facets()) == 6 * 9 * 2


@pytest.mark.parametrize(
    ("shape", "points", "count", "volume"),
    [
        ("wedge", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 2), (1, 0, 2), (0, 1, 2)], 3, 1.0),
        ("pyramid", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 3)], 2, 1.0),
    ],
)
def test_every_numbering_of_a_wedge_and_a_pyramid_fills_it(shape, points, count, volume):
    rng = np.random.default_rng(2)
    for _ in range(20):
        order = rng.permutation(CORNERS[shape])
        moved = np.empty((len(points), 3))
        moved[order] = points
        tets = MeshTet(moved.T, simplices(shape, order[None]).T)
        assert tets.nelements == count
        assert np.abs(element_volumes(tets)).sum() == pytest.approx(volume, rel=1e-12)


def test_pieces_are_numbered_as_they_come():
    labels = pieces([("line", np.array([[7, 8], [1, 2]])), ("line", np.array([[2, 3], [8, 9]]))])
    assert [label.tolist() for label in labels] == [[0, 1], [1, 0]]


def test_description_lists_faces_with_area_and_normal(tmp_path):
    path = tmp_path / "boxes.vtu"
    two_boxes().write(path)
    lines = describe_bodies(read_bodies(path))
    assert "27 nodes, 48 tetrahedra, 2 x 1 x 1 mm, volume 2 mm³" in lines[1]
    assert "8 triangles, area 2 mm², centroid (1, 0.5, 1) mm, normal (0, 0, 1)" in lines[2]
    assert len(lines) == 5


def changed(change):
    """Return two boxes of tetrahedra after ``change``."""
    mesh = two_boxes()
    change(mesh)
    return mesh


def bond(mesh):
    mesh.cells[1].data[mesh.cells[1].data == 27] = 26
    mesh.cells[1].data[mesh.cells[1].data == 30] = 23


def repeat_element(mesh):
    mesh.cells[0].data[1] = mesh.cells[0].data[0][[1, 2, 0, 3]]


def repeat_node(mesh):
    mesh.cells[0].data[1, 2] = mesh.cells[0].data[1, 0]


def flatten(mesh):
    mesh.points[:27, 2] = 0.0


def fold(mesh):
    mesh.points[13] = [3.0, 0.5, 0.5]


def put_facet_inside(mesh):
    inner = [
        facet
        for facet in np.sort(mesh.cells[0].data[:, :3], axis=1).tolist()
        if len(set(facet) - {13}) == 2
    ]
    mesh.cells[2].data[0] = inner[0]


def put_facet_off(mesh):
    mesh.cells[2].data[0] = [0, 13, 26]


def put_facet_between(mesh):
    mesh.cells[2].data[0] = [0, 1, 27]


def tear(mesh):
    mesh.cell_data["gmsh:physical"][1][:] = 1


def lose_coordinate(mesh):
    mesh.points[3, 1] = np.nan


@pytest.mark.parametrize(
    "change",
    [
        *(bond, repeat_element, repeat_node, flatten, fold, put_facet_inside, put_facet_off),
        *(put_facet_between, tear, lose_coordinate),
    ],
)
def test_a_broken_mesh_is_refused(tmp_path, change):
    path = tmp_path / "boxes.vtu"
    changed(change).write(path)
    with pytest.raises(MeshError) as error:
        read_bodies(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_solid_and_plane_bodies_are_not_mixed(tmp_path):
    path = tmp_path / "surface.vtu"
    boxes = two_boxes()
    meshio.Mesh(boxes.points, [("triangle", boxes.cells[0].data[:, :3])]).write(path)
    with pytest.raises(MeshError, match="not in one plane"):
        read_bodies(path)


@pytest.mark.parametrize("content", [b"", b"nonsense\n" * 9, bytes(range(256)) * 9])
@pytest.mark.parametrize("ending", ["msh", "inp", "vtu", "step", "bdf", "e", "med", "unv", "xyz"])
def test_files_without_meaning_are_refused_in_one_line(tmp_path, ending, content, capfd):
    path = tmp_path / f"nonsense.{ending}"
    path.write_bytes(content)
    with pytest.raises(MeshError) as error:
        read_bodies(path, 1.0 if ending == "step" else None)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "size"),
    [("missing.msh", None), ("model.step", None), ("model.msh", 1.0), ("model.step", -1.0)],
)
def test_missing_files_and_sizes_are_refused(tmp_path, name, size):
    if not name.startswith("missing"):
        (tmp_path / name).write_text("")
    with pytest.raises(MeshError):
        read_bodies(tmp_path / name, size)


def test_nodes_that_are_not_in_the_file(tmp_path):
    cells = [("tetra", np.array([[0, 1, 2, 3], [0, 1, 2, 2**40]]))]
    path = tmp_path / "damaged.vtu"
    meshio.write(path, meshio.Mesh(np.eye(4, 3), cells))
    with pytest.raises(MeshError, match="nodes that are not in it"):
        read_bodies(path)
