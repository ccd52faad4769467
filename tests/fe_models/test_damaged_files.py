"""Files with letters, lines and ends missing are read, or refused in one line."""

import random

import pytest

from fe_models.geometry.imported import read_bodies
from fe_models.mesh import MeshError
from tests.fe_models.test_abaqus import ASSEMBLY, PARTS
from tests.fe_models.test_cae_files import DECK, salome

DAMAGED = 120


def damaged(text, chance):
    """The text with one line gone, repeated, cut, or with another letter in it."""
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
