"""The same tetrahedron as many programs write it: read, or refused with reason and remedy."""

import h5py
import numpy as np
import pytest
from scipy.io import netcdf_file

from fe_models.geometry.imported import patch, read_bodies
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import MeshError

pytestmark = pytest.mark.usefixtures("reads_here")

# Corners of 6 mm along each axis: the volume is 36 mm³, the face at z = 0 has 18 mm².
CORNERS = ((0, 0, 0), (6, 0, 0), (0, 6, 0), (0, 0, 6))
VOLUME, BASE = 36.0, 18.0
FLAT = "*NODE\n" + "".join(f"{n}, {x}, {y}, {z}\n" for n, (x, y, z) in enumerate(CORNERS, 1))
TETRA = "*ELEMENT, TYPE=C3D4, ELSET=part\n1, 1, 2, 3, 4\n"
SURFACE = "*SURFACE, NAME=base\n1, S1\n"
EDGES = "*ELEMENT, TYPE=B31, ELSET=edge\n7, 1, 2\n"
GRID = "".join(f"GRID,{n},,{x}.,{y}.,{z}.\n" for n, (x, y, z) in enumerate(CORNERS, 1))
SHELL = "CTRIA3,8,7,1,2,3\nPSHELL,7,1,.1\n"
DECK = f"SOL 101\nCEND\nBEGIN BULK\n{GRID}CTETRA,1,4,1,2,3,4\nPSOLID,4,1\n{SHELL}ENDDATA\n"
# The same volume as two tetrahedra with different properties.
HALVES = DECK.replace("CTETRA,1,4,1,2,3,4", "GRID,5,,3.,0.,0.\nCTETRA,1,4,1,5,3,4") + ""
HALVES = HALVES.replace("PSOLID,4", "CTETRA,2,5,5,2,3,4\nPSOLID,5,1\nPSOLID,4")
HALVES = HALVES.replace("CTRIA3,8,7,1,2,3", "CTRIA3,8,7,1,5,3\nCTRIA3,9,7,5,2,3")


def salome(blank="\n", units="    1.\n"):
    """Return a file of Salome in mm, with an empty group before that of a face's nodes."""
    nodes = "".join(
        f"{n:10d}{1:10d}{1:10d}{11:10d}\n{x:25.16E}{y:25.16E}{z:25.16E}\n"
        for n, (x, y, z) in enumerate(CORNERS, 1)
    )
    head = f"    -1\n   164\n{units}    -1\n    -1\n  2411\n{nodes}    -1\n    -1\n  2412\n"
    element = f"{1:10d}{111:10d}{2:10d}{1:10d}{7:10d}{4:10d}\n{1:10d}{2:10d}{3:10d}{4:10d}\n"
    empty = f"{1:10d}" + f"{0:10d}" * 7 + f"\nnothing\n{blank}"
    base = f"{2:10d}" + f"{0:10d}" * 6 + f"{3:10d}\nbase\n"
    base += (
        f"{7:10d}{1:10d}{0:10d}{0:10d}{7:10d}{2:10d}{0:10d}{0:10d}\n{7:10d}{3:10d}{0:10d}{0:10d}\n"
    )
    return f"{head}{element}    -1\n    -1\n  2467\n{empty}{base}    -1\n"


MILLIMETRES = "         5mm (milli-newton)         2\n    1.0D+03    1.0D+03    1.0D+00\n    0.\n"
MSH = (
    '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 1 "part"\n2 2 "base"\n'
    "$EndPhysicalNames\n$Nodes\n4\n"
    + "".join(f"{n} {x} {y} {z}\n" for n, (x, y, z) in enumerate(CORNERS, 1))
    + "$EndNodes\n$Elements\n2\n1 4 2 1 1 1 2 3 4\n2 2 2 2 2 1 2 3\n$EndElements\n"
)
MEDIT = (
    "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n"
    + "".join(f"{x} {y} {z} 0\n" for x, y, z in CORNERS)
    + "Tetrahedra\n1\n1 2 3 4 5\nTriangles\n1\n1 2 3 9\nEnd\n"
)
MARK = "\N{ZERO WIDTH NO-BREAK SPACE}"


@pytest.mark.parametrize(
    ("program", "name", "text", "body", "faces"),
    [
        ("gmsh", "a.msh", MSH, "part", ["base"]),
        ("gmsh, edited with Notepad", "a.msh", MARK + MSH, "part", ["base"]),
        ("Abaqus", "A.INP", FLAT + TETRA + SURFACE, "part", ["base"]),
        ("Mecway", "a.inp", MARK + FLAT + TETRA + SURFACE, "part", ["base"]),
        ("FreeCAD", "a.inp", FLAT + TETRA + EDGES + SURFACE, "part", ["base"]),
        ("NX", "a.dat", DECK, "4", ["7"]),
        ("Patran", "a.bdf", HALVES, "4+5", ["7"]),
        ("Femap", "a.bdf", MARK + DECK, "4", ["7"]),
        ("Salome", "a.unv", salome(units=MILLIMETRES), "body_1", ["base"]),
        ("Salome 8", "a.unv", salome("", MILLIMETRES), "body_1", ["base"]),
        ("Mmg", "a.mesh", MEDIT, "5", ["9"]),
    ],
)
def test_what_a_program_writes_is_read(tmp_path, program, name, text, body, faces):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    imported = read_bodies(path)
    assert list(imported.bodies) == [body]
    solid = imported.bodies[body]
    assert np.abs(element_volumes(solid.mesh)).sum() == pytest.approx(VOLUME, rel=1e-12)
    facets = dict(solid.mesh.boundaries or {}) | imported.set_faces[body]
    assert list(facets) == faces
    for index in facets.values():
        area = np.linalg.norm(solid.outward_of(index), axis=1).sum()
        assert area == pytest.approx(BASE, rel=1e-12)


def test_powershell_writes_utf_16(tmp_path):
    path = tmp_path / "a.bdf"
    path.write_text(DECK, encoding="utf-16")
    assert read_bodies(path).node_numbers["4"].tolist() == [1, 2, 3, 4]


def test_properties_of_one_body_are_reported(tmp_path):
    path = tmp_path / "a.bdf"
    path.write_text(HALVES, encoding="utf-8")
    assert "a.bdf: 4, 5 share nodes: one body 4+5, of one material" in read_bodies(path).unused


def test_beams_on_edges_name_these_edges(tmp_path):
    """Check beams on and off edges, and trusses, which are reported if they have a section."""
    path = tmp_path / "a.inp"
    path.write_text(FLAT + TETRA + EDGES, encoding="utf-8")
    imported = read_bodies(path)
    assert imported.node_numbers["part"][imported.points["part"]["edge"]].tolist() == [1, 2]
    assert imported.unused == ("a.inp:9: stiffness of B31, which names edges",)
    trusses = EDGES.replace("B31", "T3D2")
    path.write_text(FLAT + TETRA + trusses, encoding="utf-8")
    assert read_bodies(path).unused == ()
    path.write_text(FLAT + TETRA + trusses + "*SOLID SECTION, ELSET=edge\n1.\n", encoding="utf-8")
    assert read_bodies(path).unused == ("a.inp:9: stiffness of T3D2, which names edges",)
    path.write_text(FLAT + "5, 9., 9., 9.\n" + TETRA + EDGES.replace("1, 2", "1, 5"))
    with pytest.raises(MeshError, match=r"B31 .* is a beam"):
        read_bodies(path)


@pytest.mark.parametrize(
    ("name", "text", "remedy"),
    [
        ("a.dat", "/batch\n/com,ANSYS\nnblock,3\n", "export it"),
        ("a.mphtxt", "", r"export it as \.inp"),
        ("a.SLDPRT", "", r"export it as \.step"),
        ("a.geo", "Box(1)={0,0,0,1,1,1};", r"gmsh -3 a\.geo -o a\.msh"),
        ("a.step", "ISO-10303-21;", "--size"),
    ],
)
def test_files_of_other_programs_are_refused_with_what_to_do(tmp_path, name, text, remedy):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MeshError, match=remedy) as error:
        read_bodies(path)
    assert str(error.value).startswith(f"{path}: ")


# --- Exodus ---------------------------------------------------------------------------------------

# A hexahedron of 2 x 3 x 4 mm with a wedge and a pyramid on it, and a separate tetrahedron.
POINTS = np.array(
    [(x, y, z) for z in (0, 4) for x, y in ((0, 0), (2, 0), (2, 3), (0, 3))]
    + [(0, 0, 6), (2, 0, 6), (-4, 1.5, 2)]
    + [(20, 0, 0), (26, 0, 0), (20, 6, 0), (20, 0, 6)],
    dtype=float,
)
BLOCKS = {
    "HEX8": [[1, 2, 3, 4, 5, 6, 7, 8]],
    "WEDGE6": [[5, 8, 9, 6, 7, 10]],
    "PYRAMID5": [[1, 5, 8, 4, 11]],
    "TETRA": [[12, 13, 14, 15]],
}
# Centroids of the sides of the elements, except those between two elements.
CENTROIDS = {
    1: {1: (1, 0, 2), 2: (2, 1.5, 2), 3: (1, 3, 2), 5: (1, 1.5, 0)},
    2: {2: (1, 1.5, 5), 3: (1, 0, 5), 4: (0, 1, 14 / 3), 5: (2, 1, 14 / 3)},
    3: {1: (-4 / 3, 0.5, 2), 2: (-4 / 3, 1.5, 10 / 3), 3: (-4 / 3, 2.5, 2),
        4: (-4 / 3, 1.5, 2 / 3)},
    4: {1: (22, 0, 2), 2: (22, 2, 2), 3: (20, 2, 2), 4: (22, 2, 0)},
}  # fmt: skip


def variables():
    """Return the variables of the file by name, and the types of the blocks."""
    found = {
        "coordx": POINTS[:, 0], "coordy": POINTS[:, 1], "coordz": POINTS[:, 2],
        "node_num_map": 100 + np.arange(1, 16), "eb_prop1": np.array([10, 20, 30, 40]),
        "eb_names": np.array([list(f"{name:<12}") for name in ("lower", "", "", "upper")], "S1"),
        "node_ns1": np.array([12, 15]), "elem_ss1": np.array([1]), "side_ss1": np.array([5]),
    }  # fmt: skip
    found |= {f"connect{n}": np.array(b) for n, b in enumerate(BLOCKS.values(), 1)}
    number = 1
    for element, sides in CENTROIDS.items():
        for side in sides:
            number += 1
            found |= {f"elem_ss{number}": np.array([element]), f"side_ss{number}": np.array([side])}
    names = ["base", *(f"{e}.{s}" for e, sides in CENTROIDS.items() for s in sides)]
    found["ss_names"] = np.array([list(f"{name:<12}".replace(" ", "\0")) for name in names], "S1")
    return found


def write_exodus(path, found, classic):
    kinds = dict(zip(("connect1", "connect2", "connect3", "connect4"), BLOCKS, strict=True))
    if not classic:
        with h5py.File(path, "w") as file:
            for name, values in found.items():
                file[name] = values
            for name, kind in kinds.items():
                file[name].attrs["elem_type"] = np.bytes_(kind)
        return
    with netcdf_file(path, "w") as file:
        for name, values in found.items():
            whole = values.astype("i4") if values.dtype.kind == "i" else values
            for axis, size in enumerate(values.shape):
                file.createDimension(f"{name}_{axis}", size)
            axes = tuple(f"{name}_{axis}" for axis in range(values.ndim))
            variable = file.createVariable(name, whole.dtype, axes)
            variable[:] = whole
            if name in kinds:
                variable.elem_type = kinds[name]


@pytest.mark.parametrize("classic", [True, False], ids=["netCDF-3", "netCDF-4"])
def test_exodus(tmp_path, classic):
    """Check that blocks with shared nodes are one body, and the manual's sides by position."""
    path = tmp_path / "a.e"
    write_exodus(path, variables(), classic)
    imported = read_bodies(path)
    joined = "lower+block_20+block_30"
    assert list(imported.bodies) == [joined, "upper"]
    volumes = [np.abs(element_volumes(b.mesh)).sum() for b in imported.bodies.values()]
    assert volumes == pytest.approx([24 + 6 + 16, 36], rel=1e-12)
    for element, sides in CENTROIDS.items():
        body = imported.bodies[joined if element < 4 else "upper"]
        for side, centroid in sides.items():
            found = patch(body, f"{element}.{side}").centroid
            np.testing.assert_allclose(found, centroid, atol=1e-12)
    base = patch(imported.bodies[joined], "base")
    np.testing.assert_allclose([*base.normal, base.area], [0, 0, -1, 6], atol=1e-12)
    tips = imported.node_numbers["upper"][imported.points["upper"]["node_set_1"]]
    assert tips.tolist() == [112, 115]
    assert "one body" in imported.unused[0]


def test_shells_of_exodus_name_faces(tmp_path):
    """Check shells as blocks on the tetrahedron, and in a side set with two sides."""
    path, found = tmp_path / "a.e", variables()
    found["connect5"], found["eb_names"] = np.array([[12, 14, 13]]), found["eb_names"][:0]
    found |= {"elem_ss1": np.array([5, 4]), "side_ss1": np.array([2, 2])}
    write_exodus(path, found, classic=False)
    with h5py.File(path, "a") as file:
        file["connect5"].attrs["elem_type"] = np.bytes_("TRI3")
    imported = read_bodies(path)
    upper = imported.bodies["block_40"]
    assert patch(upper, "block_5").area == pytest.approx(18.0, rel=1e-12)
    assert patch(upper, "base").area == pytest.approx(18.0 + 18.0 * 3**0.5, rel=1e-12)
    assert imported.unused[1] == "a.e: stiffness of TRI3, which names faces or edges block_5"


@pytest.mark.parametrize(
    ("name", "value"),
    [("side_ss1", [7]), ("elem_ss1", [9]), ("connect4", [[12, 13, 14, 16]]), ("node_ns1", [0])],
)
def test_a_damaged_exodus_file_is_refused(tmp_path, name, value):
    path = tmp_path / "a.e"
    write_exodus(path, variables() | {name: np.array(value)}, classic=False)
    with pytest.raises(MeshError, match=r"a\.e: "):
        read_bodies(path)


# --- units ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("units", "size"),
    [
        ("         1  SI: Meter (newton)         2\n   1.0E+0   1.0E+0   1.0E+0\n", 1000.0),
        ("         5mm (milli-newton)         2\n   1.0D+03   1.0D+03   1.0D+00\n", 1.0),
        ("         7Inch (pound f)         2\n   39.3700787   0.22481   1.8\n", 25.4),
        ("         9USER_DEFINED         2\n   10.   1.   1.\n", 100.0),
        ("         6\n", 10.0),
    ],
)
def test_the_unit_that_a_universal_file_states_is_used(tmp_path, units, size):
    path = tmp_path / "a.unv"
    path.write_text(salome(units=units), encoding="utf-8")
    (body,) = read_bodies(path).bodies.values()
    volume = np.abs(element_volumes(body.mesh)).sum()
    assert volume == pytest.approx(VOLUME * size**3, rel=1e-12)
    (body,) = read_bodies(path, unit="mm").bodies.values()
    assert np.abs(element_volumes(body.mesh)).sum() == pytest.approx(VOLUME, rel=1e-12)
