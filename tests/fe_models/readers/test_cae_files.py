"""Files as CAE programs write them: Nastran's and universal files are read, others refused."""

from itertools import product

import numpy as np
import pytest

from fe_models.geometry.imported import patch, read_bodies
from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import MeshError
from tests.fe_models.readers import cae_files

pytestmark = pytest.mark.usefixtures("reads_here")


CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def read(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_bodies(path)


def volume(body):
    return np.abs(element_volumes(body.mesh)).sum()


def numbers_of(imported, body, name):
    return imported.node_numbers[body][imported.points[body][name]].tolist()


# --- Nastran --------------------------------------------------------------------------------------

# A cube of 1 mm on another, as HyperMesh writes it, with all that a run needs.
DECK = """\
$$ HyperMesh
SOL 101
CEND
SUBCASE 1
  LOAD = 4
BEGIN BULK
$HMNAME COMP                   1"lower" 2 "steel" 4
$HMNAME PROP                   2"lower" 4
$HMNAME PROP                   3"upper" 4
$HMNAME PROP                   9"seat" 4
GRID          11        0.0     0.0     0.0
GRID          12        1.0     0.0     0.0
GRID          13        1.0     1.0     0.0
GRID          14        0.0     1.0     0.0
GRID          15        0.0     0.0     1.0
GRID          16        1.0     0.0     1.0
GRID          17        1.0     1.0     1.0
GRID          18        0.0     1.0     1.0
GRID,21,5,1.,0.,0.
GRID,22,5,1.,90.,0.
GRID,23,5,1.,180.,0.
GRID,24,5,1.,270.,0.
GRID*                 25               5             1.0             0.0*
*                    1.0
GRID*                 26               5             1.0            90.0
*                    1.0
GRID*                 27               5            1.+0           1.8+2
*                   1.-0
GRID*                 28               5          1.D+00           270.0
*                    1.0
CORD2C         5       0      .5      .5     1.0      .5      .5     2.0
             1.5      .5     1.0
CHEXA          1       2      11      12      13      14      15      16+
+             17      18
CHEXA,2,3,21,22,23,24,25,26
,27,28
CQUAD4        31       9      15      16      17      18     0.0     0.0
SPC1           1  123456      11    THRU      13
SPC1           1       3      14
SPC            1      14      12     0.0
PLOAD4         4       2    100.                              25      27
FORCE          4      26       0    -50.     0.0     0.0     1.0
BSURFS         6                               2      21      22      23
MAT1           1 210000.             0.3
PSOLID         2       1
PSOLID         3       1
PSHELL         9       1     0.1
ENDDATA
"""


def test_nastran_deck(tmp_path):
    """Check fields of all widths, continuations, cylindrical coordinates and names in comments."""
    deck = read(tmp_path, "deck.bdf", DECK)
    assert list(deck.bodies) == ["lower", "upper"]
    assert [volume(body) for body in deck.bodies.values()] == pytest.approx([1.0, 2.0])
    assert deck.node_numbers["upper"].tolist() == list(range(21, 29))
    places = [[1.5, 0.5, 2], [0.5, 1.5, 2], [-0.5, 0.5, 2], [0.5, -0.5, 2]]
    np.testing.assert_allclose(deck.bodies["upper"].points[4:], places, atol=1e-12)
    for body, name, area, normal in (
        ("lower", "seat", 1.0, 1.0),
        ("upper", "pload4_4", 2.0, 1.0),
        ("upper", "bsurfs_6", 2.0, -1.0),
    ):
        surface = patch(deck.bodies[body], name)
        assert surface.area == pytest.approx(area, rel=1e-12)
        np.testing.assert_allclose(surface.normal, [0, 0, normal], atol=1e-12)
    assert numbers_of(deck, "lower", "spc_1_xyz") == [11, 12, 13]
    assert numbers_of(deck, "lower", "spc_1_z") == [14]
    assert numbers_of(deck, "lower", "spc_1_xy") == [14]
    assert numbers_of(deck, "upper", "force_4") == [26]
    printed = "\n".join(deck.unused)
    lines = DECK.splitlines()
    for name in ("SPC1", "SPC ", "PLOAD4", "FORCE", "MAT1", "BSURFS"):
        line = next(k for k, row in enumerate(lines, 1) if row.startswith(name))
        assert f"deck.bdf:{line}: {name.strip()}: " in printed
    assert "stiffness of CQUAD4, which names faces seat" in printed


def test_nastran_numbers_name_what_has_no_name(tmp_path):
    """Check names of a property of both solids and shells, and bulk data without a header."""
    text = DECK[DECK.index("GRID ") :].replace("31       9", "31       2")
    deck = read(tmp_path, "deck.nas", text)
    assert list(deck.bodies) == ["2", "3"]
    assert "2_faces" in deck.bodies["2"].mesh.boundaries


def test_nastran_include(tmp_path):
    head, tail = DECK.split("CHEXA,2", 1)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "upper.inc").write_text("CHEXA,2" + tail)
    deck = read(tmp_path, "deck.bdf", head + "include 'parts/upper.inc'\n")
    assert list(deck.bodies) == ["lower", "upper"]
    with pytest.raises(MeshError, match=r"deck\.bdf:\d+: .*gone\.inc"):
        read(tmp_path, "deck.bdf", head + "INCLUDE gone.inc\n")


@pytest.mark.parametrize("angle", [0.0, 30.0])
def test_nastran_coordinates(tmp_path, angle):
    """Check a point at (3, 60°, 40°) of a sphere, and one of a turned rectangular system."""
    turn = np.radians(angle)
    cosine, sine = np.cos(turn), np.sin(turn)
    text = (
        f"CORD2S,5,,1.,2.,3.,1.,2.,4.\n,{1 + cosine},{2 + sine},3.\n"
        f"CORD2R,6,,1.,2.,3.,1.,2.,4.\n,{1 + cosine},{2 + sine},3.\n"
        "GRID,1,5,3.,60.,40.\nGRID,2,6,1.,2.,3.\nGRID,3,,9.,0.,0.\nGRID,4,,0.,9.,0.\n"
        "CTETRA,1,1,1,2,3,4\n"
    )
    points = read(tmp_path, "deck.bdf", text).bodies["1"].points
    polar, along = np.radians(60.0), np.radians(40.0) + turn
    sphere = np.array([np.sin(polar) * np.cos(along), np.sin(polar) * np.sin(along), np.cos(polar)])
    np.testing.assert_allclose(points[0], [1, 2, 3] + 3 * sphere, atol=1e-12)
    turned = [cosine - 2 * sine, sine + 2 * cosine, 3]
    np.testing.assert_allclose(points[1], np.add([1, 2, 3], turned), atol=1e-12)


@pytest.mark.parametrize(
    ("element", "corners", "face"),
    [
        ("CTETRA,1,1,1,2,3,5", (1, 5), (1, 2, 3)),
        ("CTETRA,1,1,1,2,3,5", (2, 1), (2, 3, 5)),
        ("CPENTA,1,1,1,2,3,5,6,7", (5,), (5, 6, 7)),
        ("CPENTA,1,1,1,2,3,5,6,7", (1, 6), (1, 2, 6, 5)),
        ("CHEXA,1,1,1,2,3,4,5,6\n,7,8", (2, 7), (2, 3, 7, 6)),
    ],
)
def test_pressed_faces_of_nastran(tmp_path, element, corners, face):
    """Check PLOAD4: on a tetrahedron the second point is off the face, on a quad opposite."""
    grid = "".join(
        f"GRID,{n},,{x}.,{y}.,{z}.\n"
        for n, (x, y, z) in enumerate(
            [
                (0, 0, 0),
                (1, 0, 0),
                (1, 1, 0),
                (0, 1, 0),
                (0, 0, 1),
                (1, 0, 1),
                (1, 1, 1),
                (0, 1, 1),
            ],
            start=1,
        )
    )
    load = f"PLOAD4,4,1,9.,,,,{','.join(map(str, corners))}\n"
    deck = read(tmp_path, "deck.bdf", f"{grid}{element}\n{load}")
    body = deck.bodies["1"]
    assert deck.node_numbers["1"][body.vertices("pload4_4")].tolist() == sorted(face)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("PSOLID         3", "RBE2,50,26,123,27,28\nPSOLID         3"),
        ("PSOLID         3", "CELAS2,50,1.+6,26,1,15,1\nPSOLID         3"),
        ("PSOLID         3", "CTRIAX6,50,1,26,27,28\nPSOLID         3"),
        ("GRID,21,5", "GRID,21,8"),
        ("GRID          12", "GRID          11"),
        ("CHEXA,2,3", "CHEXA,1,3"),
        ("1.5      .5     1.0", "0.5      .5     1.5"),
        ("1.+0           1.8+2", "x              1.8+2"),
    ],
)
def test_a_nastran_entry_is_refused_with_its_line(tmp_path, old, new):
    assert old in DECK
    with pytest.raises(MeshError, match=r"deck\.bdf:\d+: "):
        read(tmp_path, "deck.bdf", DECK.replace(old, new))


def test_nastran_plane(tmp_path):
    """Check that shells alone in a plane are bodies in plane strain, which is reported."""
    points, cells = cae_files.mixed_plate()
    text = "".join(f"GRID,{n},,{x},{y},0.\n" for n, (x, y, _) in enumerate(points, 1))
    number = 0
    for shape, block in cells.items():
        for cell in block + 1:
            number += 1
            kind = "CQUAD4" if shape == "quad" else "CTRIA3"
            text += f"{kind},{number},4,{','.join(map(str, cell))}\n"
    plate = read(tmp_path, "plate.bdf", text)
    assert volume(plate.bodies["4"]) == pytest.approx(4.0)
    assert plate.unused == ("plate.bdf:10: CQUAD4: bodies in the plane are in plane strain",)


# --- universal files ------------------------------------------------------------------------------


def group(number, name, kind, members):
    """Return a group as Salome writes it, two members to a line."""
    rows = [f"{kind:10d}{member:10d}{0:10d}{0:10d}" for member in members]
    lines = ["".join(rows[k : k + 2]) for k in range(0, len(rows), 2)]
    head = "".join(f"{v:10d}" for v in (number, 0, 0, 0, 0, 0, 0, len(members)))
    return "\n".join([head, name, *lines, ""])


def salome(groups=True):
    """Return two hexahedra of 1 mm, 1 mm apart, with shells 11 and 12 on their facing sides."""
    points = np.array([*CUBE, *((x, y, z + 2) for x, y, z in CUBE)], dtype=float)
    cells = {"hexahedron": np.arange(16).reshape(2, 8)}
    text = cae_files.universal(points, cells).rstrip("\n").removesuffix("    -1")
    for number, nodes in ((11, (5, 6, 7, 8)), (12, (9, 10, 11, 12))):
        text += "".join(f"{v:10d}" for v in (number, 94, 1, 1, 7, 4)) + "\n"
        text += "".join(f"{v:10d}" for v in nodes) + "\n"
    text += f"{'13':>10}{'21':>10}{1:10d}{1:10d}{7:10d}{2:10d}\n{0:10d}{1:10d}{1:10d}\n"
    text += f"{1:10d}{2:10d}\n    -1\n"
    units = "    -1\n   164\n         1  SI: Meter (newton)         2\n"
    units += "    1.0000000000000000E+0    1.0000000000000000E+0    1.0000000000000000E+0\n"
    units += "    2.7314999999999998E+2\n    -1\n"
    if not groups:
        return units + text
    named = [
        group(1, "lower", 8, [1]), group(2, "upper", 8, [2]), group(3, "top", 8, [11]),
        group(4, "foot", 8, [12]), group(5, "edge", 8, [13]), group(6, "corners", 7, [13, 15, 16]),
    ]  # fmt: skip
    return units + text + "    -1\n  2467\n" + "".join(named) + "    -1\n"


def test_universal_file_of_salome(tmp_path):
    """Check a file in metres, the unit that it states."""
    mesh = read(tmp_path, "blocks.unv", salome())
    assert list(mesh.bodies) == ["lower", "upper"]
    for body, name, height, normal in (("lower", "top", 1e3, 1.0), ("upper", "foot", 2e3, -1.0)):
        surface = patch(mesh.bodies[body], name)
        np.testing.assert_allclose(surface.centroid, [500, 500, height], atol=1e-9)
        np.testing.assert_allclose(surface.normal, [0, 0, normal], atol=1e-12)
    assert numbers_of(mesh, "lower", "edge") == [1, 2]
    assert numbers_of(mesh, "upper", "corners") == [13, 15, 16]
    assert mesh.unused == ()
    assert str(mesh.unit) == "in m, as blocks.unv:2 says, converted to mm"


def test_universal_file_without_groups(tmp_path):
    loads = "    -1\n   790\n         1         1\nLoads\n    -1\n"
    mesh = read(tmp_path, "blocks.unv", salome(groups=False) + loads)
    assert list(mesh.bodies) == ["body_1", "body_2"]
    line = salome(groups=False).count("\n") + 2
    assert mesh.unused == (f"blocks.unv:{line}: dataset 790, loads",)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("  2412\n", "   780\n"),
        ("        12        94", "        12       122"),
        ("        12        94", "        12       777"),
        ("        12        94", "        11        94"),
        ("         8        12", "         8        99"),
        ("         9        10        11        12\n", ""),
    ],
)
def test_a_universal_file_is_refused_with_its_line(tmp_path, old, new):
    assert old in salome()
    with pytest.raises(MeshError, match=r"blocks\.unv:"):
        read(tmp_path, "blocks.unv", salome().replace(old, new))


# --- the same mesh from one mesher in four formats ------------------------------------------------


@pytest.mark.parametrize(("shape", "order"), list(product(("tet", "hex", "wedge"), (1, 2))))
def test_gmsh_writes_what_is_read(tmp_path, shape, order):
    """Check that gmsh's own, Abaqus', Nastran's and universal files give the same mesh."""
    with gmsh_model("blocks") as gmsh:
        occ, bodies = gmsh.model.occ, []
        for left in (0.0, 3.0):
            if shape == "tet":
                bodies.append(occ.addBox(left, 0, 0, 2, 1, 1))
                continue
            base = occ.addRectangle(left, 0, 0, 2, 1)
            extruded = occ.extrude([(2, base)], 0, 0, 1, numElements=[2], recombine=True)
            bodies += [tag for dimension, tag in extruded if dimension == 3]
        occ.synchronize()
        for number, body in enumerate(bodies, start=1):
            faces = gmsh.model.getBoundary([(3, body)], oriented=False)
            edges = gmsh.model.getBoundary([faces[0]], oriented=False)
            for name, dimension, tag in (
                ("block", 3, body), ("face", 2, faces[0][1]), ("edge", 1, edges[0][1])
            ):  # fmt: skip
                gmsh.model.addPhysicalGroup(dimension, [tag], name=f"{name}{number}")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.6)
        gmsh.option.setNumber("Mesh.RecombineAll", shape == "hex")
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        for suffix in ("msh", "unv", "bdf", "inp"):
            gmsh.write(str(tmp_path / f"blocks.{suffix}"))
    reference = read_bodies(tmp_path / "blocks.msh")
    for suffix in ("unv", "bdf", "inp"):
        imported = read_bodies(tmp_path / f"blocks.{suffix}")
        for (name, body), (own, other) in zip(
            reference.bodies.items(), imported.bodies.items(), strict=True
        ):
            assert suffix == "bdf" or own == name  # It has numbers as names.
            assert volume(other) == pytest.approx(volume(body), rel=1e-6)
            (face,) = body.mesh.boundaries
            faces = [patch(other, boundary) for boundary in other.mesh.boundaries]
            assert faces
            for found in faces:
                np.testing.assert_allclose(found.centroid, patch(body, face).centroid, atol=1e-5)
            assert len(reference.points[name]) == 1 <= len(imported.points[own])
            assert (own in imported.midsides) == (order == 2)


# --- files that nothing here reads ----------------------------------------------------------------


@pytest.mark.parametrize("ending", ["cdb", "odb", "iges", "rst"])
def test_other_formats_are_refused_with_what_to_export(tmp_path, ending):
    with pytest.raises(MeshError, match="export it"):
        read(tmp_path, f"model.{ending}", "anything")
