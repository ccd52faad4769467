"""Tests of the comparison of finished runs: equal entries, differences, and their errors."""

import csv

import fretscale
import h5py
import numpy as np
import pytest

from sa_solver.types import Grid
from tests.workflow.command_line import command
from tests.workflow.conftest import invoke
from tests.workflow.output.test_report import QUIET, Page
from tests.workflow.scenes import BALL
from workflow.comparing import compare
from workflow.errors import UserError
from workflow.layout.declared import Layout
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.curves import curves_in
from workflow.shell.output.quantities import CurvesOf
from workflow.shell.output.results import writing

JOINT = """\
title: Spring and slider
analysis: time
structure: {kind: joint}
joint: {law: jenkins, normal_load: 100 N, friction: 0.5, stiffness: 10 N/um}
drive: {stroke: 40 um, frequency: 10 Hz}
ageing: {cycles: 1000}
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Return folders of finished runs: a ball, one with more friction, the first again, a joint."""
    folder = tmp_path_factory.mktemp("compared")
    cases = {
        "ball": (BALL, ()),
        "rough": (BALL, ("friction.coefficient=0.9",)),
        "again": (BALL.replace("Ball", "The same ball"), ()),
        "joint": (JOINT, ("output.figures=false",)),
    }
    for name, (text, overrides) in cases.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
        quiet = QUIET[1:] if name == "joint" else QUIET
        ended = command(
            "run", folder / f"{name}.yaml", "--out", folder / name, overrides=[*quiet, *overrides]
        )
        assert ended.exit_code == 0, ended.stderr
    return folder


def test_differences_beyond_the_errors_are_marked(runs):
    compared = compare([runs / "ball", runs / "rough", runs / "again"])
    assert compared.names == ["ball", "rough", "again"]
    assert compared.entries == {"friction.coefficient": ("0.7", "0.9", "0.7")}
    rows = {row.first.path.removeprefix("states.-1."): row for row in compared.rows}
    assert rows["peak_pressure"].difference(1) == pytest.approx(0.0, abs=1e-9)
    assert rows["peak_pressure"].beyond(1) is None
    first, other, _ = rows["cumulative_energy"].values
    assert rows["cumulative_energy"].difference(1) == pytest.approx(other / first - 1.0)
    # Less of the contact slips where friction is larger.
    assert rows["cumulative_energy"].difference(1) < -0.02
    assert rows["cumulative_energy"].beyond(1) is True
    assert rows["cumulative_energy"].beyond(2) is False
    assert rows["stick_radius"].difference(0) is None
    assert rows["stick_radius"].difference(2) == 0.0


def test_command_writes_text_table_page_and_curves(runs, tmp_path):
    out = tmp_path / "out"
    command = ["compare", runs / "ball", runs / "rough", "--out", out]
    ended = invoke(*command)
    assert ended.exit_code == 0, ended.stderr
    (line,) = [line for line in ended.stdout.splitlines() if "friction.coefficient" in line]
    assert line.split() == ["friction.coefficient", "0.7", "0.9"]
    assert any(
        "energy dissipated so far" in text and text.endswith("!")
        for text in map(str.rstrip, ended.stdout.splitlines())
    )
    assert OutputFolder(out, "comparison").manifest.keys() > {"compare.csv", "compare.html"}
    assert len(list((out / "curves").glob("*.png"))) == 4
    with (out / "compare.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["path"]: row for row in csv.DictReader(file)}
    energy = rows["states.-1.cumulative_energy"]
    assert energy["unit"] == "N mm"
    assert float(energy["rough, difference"]) == pytest.approx(
        float(energy["rough"]) / float(energy["ball"]) - 1.0
    )
    assert energy["rough, exceeds errors"] == "True"
    page = Page((out / "compare.html").read_text("utf-8"))
    assert "script" not in page.tags
    assert len(page.images) == 4
    assert "friction.coefficient" in page.reported["Differences of their cases"]
    again = invoke(*command)
    assert (again.exit_code, "exists; give another folder, or --force" in again.stderr) == (2, True)


def test_an_output_that_cannot_be_written_is_refused_before_anything_is_shown(runs, tmp_path):
    file = tmp_path / "file"
    file.write_text("not a folder", encoding="utf-8")
    refused = invoke("compare", runs / "ball", runs / "rough", "--out", file)
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert file.read_text("utf-8") == "not a folder"


def test_a_program_compares_as_the_command_does(runs, tmp_path):
    balls = fretscale.compare(runs / "ball", fretscale.open(runs / "rough"), str(runs / "again"))
    assert balls.names == ("ball", "rough", "again")
    assert balls.entries == {"friction.coefficient": ("0.7", "0.9", "0.7")}
    energy = balls["energy dissipated so far"]
    first, other, same = energy.values
    assert (energy.unit, same) == ("N mm", first)
    assert energy.differences == (None, pytest.approx(other / first - 1.0), 0.0)
    assert energy.beyond == (None, True, False)
    assert energy == balls["after the last increment, energy dissipated so far"]
    with pytest.raises(KeyError, match=r"nothing: "):
        balls["nothing"]
    ended = invoke("compare", runs / "ball", runs / "rough", runs / "again")
    assert [line.rstrip() for line in ended.stdout.splitlines()] == repr(balls).splitlines()
    table = balls.pandas()
    assert table.loc[(energy.of, energy.name), "rough, difference"] == energy.differences[1]
    page = balls.report(tmp_path / "compared")
    assert Page(page.read_text("utf-8")).images
    assert page.with_name("compare.csv").exists()
    with pytest.raises(fretscale.UserError, match="exists; give another folder"):
        balls.report(tmp_path / "compared")


def test_values_in_different_units_are_not_compared(runs, tmp_path):
    """The forces of a cylinder are per length."""
    line = BALL.replace("sphere, radius: 10 mm", "cylinder, radius: 10 mm")
    line = line.replace("[16, 16], size: [1 mm, 1 mm]", "64, size: 1 mm")
    line = line.replace("400 N", "400 N/mm")
    (tmp_path / "line.yaml").write_text(line.replace("210 N,", "150 N/mm,"), encoding="utf-8")
    ended = command("run", tmp_path / "line.yaml", "--out", tmp_path / "line", overrides=QUIET)
    assert ended.exit_code == 0, ended.stderr
    found = [
        r for r in compare([runs / "ball", tmp_path / "line"]).rows if r.first.path[-2:] == ".P"
    ]
    assert [row.first.unit for row in found] == ["N", "N/mm"]
    assert [[value is None for value in row.values] for row in found] == [
        [False, True],
        [True, False],
    ]


def test_what_cannot_be_compared_is_refused_in_a_line(runs, tmp_path):
    with pytest.raises(UserError, match=r"allowed: bodies, line"):
        compare([runs / "ball", runs / "joint"])
    with pytest.raises(UserError, match="two or more folders"):
        compare([runs / "ball", runs / "." / "ball"])
    with pytest.raises(UserError, match="two or more folders"):
        compare([runs / "ball"])
    with pytest.raises(UserError, match="no run of fretscale here"):
        compare([runs / "ball", tmp_path])


def test_curves_are_found_by_patterns(tmp_path):
    """Patterns find any group, the last numbered one, the last column, the middle of a field."""
    layout = Layout.read(
        """
responses/<response>/loops/<loop>
    force | N | point kind | pulled
    displacement | mm | point kind | moved
grid/<face>
    x | mm | x | along
    y | mm | y | across
contact/<face>/<jump>
    pressure | MPa | x y | pressed
""",
        x="grid/<face>",
        y="grid/<face>",
    )
    with writing(tmp_path / "results.h5", layout) as writer:
        for force, name in ((10.0, "00000"), (30.0, "00001")):
            writer.put(f"responses/{name}", {}, force=force)
            for number in (2, 10):
                values = np.column_stack([np.zeros(3), np.full(3, number)])
                loop = {"force": values, "displacement": values}
                writer.put(f"responses/{name}/loops/{number:05d}", loop)
        writer.put_grid("grid/face", Grid((4, 3), (1.0, 2.0)))
        writer.put("contact/face/00007", {"pressure": np.arange(12).reshape(4, 3)})
    with h5py.File(tmp_path / "results.h5") as file:
        at = "responses/*/loops/-1"
        loops = CurvesOf("loop", f"{at}/displacement", "force")
        found = list(curves_in(file, loops))
        assert [curve.title for curve in found] == ["loop, under 10 N", "loop, under 30 N"]
        assert found[0].y.tolist() == [10.0, 10.0, 10.0]
        (profile,) = curves_in(file, CurvesOf("p", "contact/*/-1/pressure"))
        assert (profile.title, profile.y.tolist()) == ("p, face", [1, 4, 7, 10])
        assert profile.x.tolist() == [-1.5, -0.5, 0.5, 1.5]
        assert list(curves_in(file, CurvesOf("none", "loops/*/-1/force"))) == []
