"""Files with letters, lines or ends missing are read, or refused in one line."""

import random

import pytest

from fe_models.geometry.imported import read_bodies
from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.reader_process import read_in_subprocess
from tests.fe_models.readers.test_abaqus import ASSEMBLY, PARTS
from tests.fe_models.readers.test_cae_files import DECK, salome
from tests.fe_models.readers.test_mesh_corpus import MSH, variables, write_exodus

DAMAGED, FLIPPED = 120, 40


def damaged(text, chance):
    """Return the text with one line removed, repeated or cut, or with another letter in it."""
    lines = text.splitlines()
    at = chance.randrange(len(lines))
    letter = chance.randrange(len(lines[at]) + 1)
    match chance.randrange(4):
        case 0:
            del lines[at]
        case 1:
            lines.insert(at, chance.choice(lines))
        case 2:
            lines[at] = lines[at][:letter]
        case 3:
            lines[at] = lines[at][:letter] + chance.choice("x-.9, ") + lines[at][letter + 1 :]
    return "\n".join([*lines, ""])


@pytest.mark.parametrize(
    ("suffix", "text"), [(".bdf", DECK), (".unv", salome()), (".inp", PARTS + ASSEMBLY)]
)
def test_damaged_files_end_in_one_line(tmp_path, suffix, text):
    chance = random.Random(5)
    path, refusals = tmp_path / f"damaged{suffix}", []
    for _ in range(DAMAGED):
        path.write_text(damaged(text, chance), encoding="utf-8")
        try:
            read_bodies(path)
        except MeshError as error:
            refusals.append(str(error))
    assert all(line.startswith(str(path)) and "\n" not in line for line in refusals)
    assert 0.2 * DAMAGED < len(refusals) < DAMAGED


@pytest.mark.parametrize("classic", [True, False], ids=["netCDF-3", "netCDF-4"])
def test_flipped_bits_of_exodus_end_in_one_line(tmp_path, classic):
    chance = random.Random(7)
    whole, path, refusals = tmp_path / "whole.e", tmp_path / "damaged.e", []
    write_exodus(whole, variables(), classic)
    for _ in range(FLIPPED):
        letters = bytearray(whole.read_bytes())
        letters[chance.randrange(len(letters))] ^= 1 << chance.randrange(8)
        path.write_bytes(letters[: chance.choice([None, chance.randrange(len(letters))])])
        try:
            read_bodies(path)
        except MeshError as error:
            refusals.append(str(error))
    assert all(line.startswith(str(path)) and "\n" not in line for line in refusals)
    assert 0.2 * FLIPPED < len(refusals) < FLIPPED


def test_a_name_in_no_code_is_one_line(tmp_path):
    """Check a gmsh file with a flipped bit in a group's name, read in another process."""
    path = tmp_path / "damaged.msh"
    path.write_bytes(MSH.replace("base", "b#se").encode().replace(b"#", b"\xe1"))
    with pytest.raises(MeshError, match="has names that are not in UTF-8") as error:
        read_bodies(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_whatever_a_reader_raises_is_one_line(tmp_path):
    """Check an exception that cannot be passed between processes."""
    path = tmp_path / "a.msh"
    with pytest.raises(MeshError, match=r"a\.msh: cannot be read \(OddError: 7\): it may") as error:
        read_in_subprocess(raise_oddly, path)
    assert "\n" not in str(error.value)


class OddError(Exception):
    def __init__(self, number, _):
        super().__init__(number)


def raise_oddly(_):
    raise OddError(7, "two\nlines")
