"""Abaqus input files that are refused: the reason, and the line."""

import pytest

from fe_models.meshes.structure_mesh import MeshError
from tests.fe_models.readers.abaqus_files import ASSEMBLY, CUBES, PARTS, read


@pytest.mark.parametrize(
    "keyword",
    [
        "*Ngen",
        "*NCOPY, change number=100, old set=A, shift",
        "*Tie, name=Glue",
        "*Equation",
        "*Model Change, remove",
        "*Node, system=C",
        "*Surface, name=X, combine=UNION",
        "*Element, type=X4R",
        "*Element, type=S4R",
        "*Element, type=CAX4R",
        "*Element, type=SPRINGA",
        "*Include, input=gone.inc",
        "*Instance, name=X, part=Gone",
        "*Part, name=block",
    ],
)
def test_a_keyword_is_refused_with_its_line(tmp_path, keyword):
    line = (PARTS + ASSEMBLY).splitlines().index("*Nset, nset=Ends") + 1
    text = (PARTS + ASSEMBLY).replace("*Nset, nset=Ends\n", keyword + "\n*Nset, nset=Ends\n")
    with pytest.raises(MeshError) as error:
        read(tmp_path, text)
    assert str(error.value).startswith(f"{tmp_path / 'model.inp'}:{line}: ")


@pytest.mark.parametrize(
    ("old", "new", "at"),
    [
        (" 7, 11, 12,", " 7, 77, 12,", " 7, 77"),
        (" 8, 12, 13,", " 7, 12, 13,", " 7, 12"),
        ("     12, ", "     11, ", "     11,           1."),
        (" 8, 12, 13, 16,", " 8, 12, 13,", " 8, 12"),
        (" 8, S4", " 8, S7", " 8, S7"),
        (" 8, S4", " 9, S4", " 9, S4"),
        ("_Top_S2, S2", "Gone, S2", "Gone, S2"),
        (" 3., 0., 5.\n", " 3., 0.\n 1.\n", " 3., 0."),
        (" 1, 1, 2, 3, 4", " 1, 1, 2, 3, x", " 1, 1, 2"),
    ],
)
def test_a_wrong_line_is_refused_with_its_number(tmp_path, old, new, at):
    text = (PARTS + ASSEMBLY).replace(old, new)
    assert text != PARTS + ASSEMBLY
    line = next(k for k, row in enumerate(text.splitlines(), start=1) if row.startswith(at))
    with pytest.raises(MeshError) as error:
        read(tmp_path, text)
    assert str(error.value).startswith(f"{tmp_path / 'model.inp'}:{line}: ")


@pytest.mark.parametrize(
    "text",
    [
        PARTS,
        PARTS + CUBES + "*Assembly\n",
        "*Part, name=None\n*End Part\n*Assembly\n*Instance, name=P, part=None\n",
        "1, 2, 3\n",
        "** nothing\n",
        CUBES + "*Nset, nset=A\n 1\n",
        CUBES + "*Surface, name=A\n7, S4\n",
        CUBES + "*Node\n1, 9., 9., 9.\n*Element, type=R3D3\n9, 11, 12, 1\n",
    ],
)
def test_an_incomplete_file_is_refused(tmp_path, text):
    with pytest.raises(MeshError, match=r"model\.inp"):
        read(tmp_path, text)
