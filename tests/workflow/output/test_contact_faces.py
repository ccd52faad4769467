"""Tests of ``fretscale check --out``: the picture of the positions of contact faces."""

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


def test_check_writes_the_picture_and_prints_its_path(blocks, tmp_path):
    out = tmp_path / "faces"
    ending = invoke("check", blocks, "--out", out)
    assert ending.exit_code == 0, ending.stderr
    assert ending.stdout.splitlines()[-1] == str(out / "contact_faces.png")
    assert (out / "contact_faces.png").stat().st_size > 10_000
    again = invoke("check", blocks, "--out", out)
    assert again.exit_code == 2
    assert "--force" in again.stderr
