"""Tests of ``fretscale check --out``: the picture of the positions of contact faces."""

import numpy as np
import pytest

from tests.workflow.command_line import invoke
from tests.workflow.output.figure_checks import problems
from workflow.analyses.wear.figures.faces import figure
from workflow.analyses.wear.structures.mesh.case import MeshCase
from workflow.kinds import load_case

pytestmark = pytest.mark.usefixtures("reads_here")


def test_faces_are_drawn_where_they_are(blocks):
    """The foot of 1 mm is at the middle of the base of 2 mm, so a quarter of it is shared."""
    case = load_case(blocks)
    assert isinstance(case, MeshCase)
    drawn = figure(case.structure.mesh(None), case.title)
    drawn.canvas.draw()
    assert problems(drawn) == []
    (part,) = drawn.subfigs
    assert part.get_suptitle() == "foot: 1 mm² shared"
    over, gap = part.axes[:2]
    names = [text.get_text() for text in over.get_legend().get_texts()]
    assert names == ["Base-1, 4 mm²", "Foot-1, 1 mm²"]
    for faces, size in zip(over.collections, (2.0, 1.0), strict=True):
        corners = np.concatenate([path.vertices for path in faces.get_paths()])
        np.testing.assert_allclose(np.ptp(corners, axis=0), size)
    assert gap.collections[0].get_array().max() == 0.0


def test_check_writes_the_picture_and_says_where(blocks, tmp_path):
    out = tmp_path / "faces"
    ending = invoke("check", blocks, "--out", out)
    assert ending.exit_code == 0, ending.stderr
    assert ending.stdout.splitlines()[-1] == str(out / "contact_faces.png")
    assert (out / "contact_faces.png").stat().st_size > 10_000
    again = invoke("check", blocks, "--out", out)
    assert again.exit_code == 2
    assert "--force" in again.stderr


@pytest.mark.parametrize(
    ("case", "why"),
    [("sphere_wear", "has no meshed faces to draw"), ("rig_two_dof", "has no faces to draw")],
)
def test_no_mesh_no_faces(case, why, tmp_path):
    ending = invoke("check", f"cases/{case}.yaml", "--out", tmp_path / "faces")
    assert ending.exit_code == 2
    assert why in ending.stderr
    assert not (tmp_path / "faces").exists()
