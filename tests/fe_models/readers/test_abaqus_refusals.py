"""Abaqus input files that are refused: the reason, and the line."""

import pytest

from fe_models.meshes.structure_mesh import MeshError
from tests.fe_models.readers.abaqus_files import ASSEMBLY, CUBES, PARTS, read


@pytest.mark.parametrize(
    ("keyword", "reason"),
    [
        ("*Ngen", "makes or moves nodes"),
        ("*NCOPY, change number=100, old set=A, shift", "makes or moves nodes"),
        ("*Nfill", "makes or moves nodes"),
        ("*Elgen", "makes or moves nodes"),
        ("*System", "makes or moves nodes"),
        ("*Tie, name=Glue", "tie or constraint is not carried over"),
        ("*Equation", "tie or constraint is not carried over"),
        ("*MPC", "tie or constraint is not carried over"),
        ("* Embedded Element", "tie or constraint is not carried over"),
        ("*Model Change, remove", "changes the mesh"),
        ("*Node, system=C", "system= is not supported"),
        ("*Node, input=nodes.txt", "input= is not supported"),
        ("*Surface, name=X, combine=UNION", "combine= is not supported"),
        ("*Surface, name=X, type=CYLINDER", "surface of type CYLINDER; allowed: ELEMENT, NODE"),
        ("*Surface", "needs name=name"),
        ("*Element, type=X4R", "element type X4R; allowed: C3D4"),
        ("*Element, type=S4R", "S4R is a shell: mesh its volume with solid elements"),
        ("*Element, type=STRI3", "STRI3 is a shell: mesh"),
        ("*Element, type=SC8R", "SC8R is a continuum shell: write it as C3D8"),
        ("*Element, type=M3D4R", "M3D4R is a membrane: mesh"),
        ("*Element, type=B31OSH", "B31OSH is a beam: mesh .* or leave it out"),
        ("*Element, type=CAX4R", "CAX4R is axisymmetric, which is not computed: take a sector"),
        ("*Element, type=R2D2", "R2D2 is a rigid surface: give the body a mesh"),
        ("*Element, type=COH3D8", "COH3D8 is a layer that bonds: make one body"),
        ("*Element, type=C3D27R", "C3D27R is of a form of its own: write it as C3D20"),
        ("*Element, type=DC3D8", "DC3D8 is of heat, sound or fields: write it as the stress"),
        ("*Element, type=SPRINGA", "SPRINGA is a spring or a joint of points: leave it out"),
        ("*Element, type=MASS", "MASS is a point mass: leave it out"),
        ("*Display Body, instance=Pin-1", "no body that is computed"),
        ("*Include, input=gone.inc", "the included file gone.inc is missing"),
        ("*Instance, name=X, part=Gone", "is of part Gone; allowed: Block, Pin"),
        ("*Part, name=block", "part block is defined twice"),
        ("*Nset, nset=X, instance=Gone\n1", "no instance Gone; allowed: Block-1, Block-2, Pin-1"),
    ],
)
def test_keyword_is_refused_where_it_stands(tmp_path, keyword, reason):
    line = (PARTS + ASSEMBLY).splitlines().index("*Nset, nset=Ends") + 1
    text = (PARTS + ASSEMBLY).replace("*Nset, nset=Ends\n", keyword + "\n*Nset, nset=Ends\n")
    with pytest.raises(MeshError, match=reason) as error:
        read(tmp_path, text)
    assert str(error.value).startswith(f"{tmp_path / 'model.inp'}:{line}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "at", "message"),
    [
        (" 7, 11, 12,", " 7, 77, 12,", " 7, 77", "node 77 is not defined"),
        (" 8, 12, 13,", " 7, 12, 13,", " 7, 12", "element 7 is defined twice"),
        ("     12, ", "     11, ", "     11,           1.", "node 11 is defined twice"),
        (" 8, 12, 13, 16,", " 8, 12, 13,", " 8, 12", "7 nodes of a C3D8R; allowed: 8"),
        (" 8, 12, 13, 16,", " 8, 12, 12, 13, 16,", " 8, 12", "9 nodes of a C3D8R; allowed: 8"),
        (" 8, S4", " 8, S7", " 8, S7", "face S7 of element 8, a hexahedron; allowed: S1, S2, S3"),
        (" 8, S4", "  8", "  8", r"face \(none\) of element 8"),
        (" 8, S4", " 9, S4", " 9, S4", "the surface names number 9, which is not defined"),
        ("_Top_S2, S2", "Gone, S2", "Gone, S2", "no element set Gone; allowed: _Top_S2, Left one"),
        (" 7, 8, 1", " 7, 8, 0", " 7, 8, 0", "allowed: first number, last number, step"),
        (" 3., 0., 5.\n", " 3., 0.\n 1.\n", " 3., 0.", "allowed: a line of 3 numbers"),
        ("3., 1., 5., 90.", "3., 0., 5., 90.", " 3., 0., 5., 3.", "axis of rotation has no length"),
        (" 1, 1, 2, 3, 4", " 1, 1, 2, 3, x", " 1, 1, 2", "'x' is not a whole number"),
    ],
)
def test_wrong_line_is_refused_where_it_stands(tmp_path, old, new, at, message):
    text = PARTS + ASSEMBLY
    assert old in text
    text = text.replace(old, new)
    line = next(k for k, row in enumerate(text.splitlines(), start=1) if row.startswith(at))
    with pytest.raises(MeshError, match=message) as error:
        read(tmp_path, text)
    assert str(error.value).startswith(f"{tmp_path / 'model.inp'}:{line}: ")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PARTS, "has parts but no"),
        (PARTS + CUBES + "*Assembly\n", "outside of its parts and its assembly"),
        (
            PARTS + "*Assembly\n*Instance, name=P, part=Pin\n*End Instance\n"
            "*Element, type=C3D4\n5, 1, 2, 3, 4\n*End Assembly\n",
            "an element of the assembly",
        ),
        (
            "*Part, name=None\n*End Part\n*Assembly\n*Instance, name=P, part=None\n",
            "instance P has no elements",
        ),
        (
            PARTS.replace("*End Part\n*Part", "*Element, type=T3D2\n9, 11, 12\n*End Part\n*Part")
            + "*Assembly\n*Instance, name=B, part=Block\n*End Instance\n*End Assembly\n",
            "T3D2 is a truss: mesh its volume",
        ),
        ("*Heading\n", "has no elements"),
        ("1, 2, 3\n", "is not Abaqus input"),
        ("** nothing\n", "has no keywords"),
        (CUBES + "*Nset, nset=A\n 1\n", "node set A names number 1, which is not defined"),
        (CUBES + "*Surface, name=A\n7, S4\n", "2 of the 2 facets of boundary A are inside body"),
        (CUBES + "*Nset, nset=A\n11\n*Surface, name=A, type=NODE\nA,\n", "a node set is named A,"),
        (CUBES + "*Node\n1, 9., 9., 9.\n*Element, type=R3D3\n9, 11, 12, 1\n", "R3D3 with nodes on"),
        (
            CUBES.replace("C3D8R", "C3D8")[: CUBES.index("*Element")]
            + "*Element, type=R3D4\n1, 11, 12, 15, 14\n",
            "R3D4 is a rigid surface: give the body",
        ),
        (
            CUBES + "*Element, type=SFM3D3, elset=A\n9, 11, 12, 14\n*Surface, name=A\n7, S1\n",
            "two groups are named A: rename one",
        ),
    ],
)
def test_incomplete_file_is_refused(tmp_path, text, message):
    with pytest.raises(MeshError, match=message) as error:
        read(tmp_path, text)
    assert "\n" not in str(error.value)
