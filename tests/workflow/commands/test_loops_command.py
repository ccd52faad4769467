"""Tests of ``fretscale loops``: a measured file gives a table and a figure, or one error line."""

import csv

import numpy as np
import pytest
from click.testing import CliRunner

from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from workflow.analyses.wear.output.loop_table import read_loop_table
from workflow.case.fields import Quantity
from workflow.case.files.table_file import read_table_file
from workflow.cli import cli

STIFFNESS, FRICTION, LOAD, STROKE = 60e3, 0.9, 60.0, 14e-3
CYCLES = 15


def invoke(*arguments):
    return CliRunner().invoke(cli, ["loops", *(str(argument) for argument in arguments)])


def record(stroke=STROKE):
    """Return time [s], displacement [mm] and force [N] of a noisy Jenkins joint at 100 Hz."""
    time = np.arange(int(CYCLES * 200 + 220)) / 20e3
    displacement = 0.5 * stroke * np.sin(2.0 * np.pi * 100.0 * time)
    law = Jenkins(STIFFNESS, FRICTION, LOAD)
    force = march_joints(law, law.rest(1), np.zeros((1, 1)), displacement[:, None, None]).force[
        :, 0, 0
    ]
    noise = np.random.default_rng(0).standard_normal((2, len(time)))
    return time, displacement + 5e-4 * stroke * noise[0], force + 0.2 * noise[1]


def written(path, headings, *columns):
    with path.open("w", newline="", encoding="utf-8") as file:
        file.write("# friction rig\n")
        writer = csv.writer(file)
        writer.writerow(headings)
        writer.writerows(zip(*columns, strict=True))
    return path


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    _, displacement, force = record()
    path = tmp_path_factory.mktemp("loops") / "measured.csv"
    headings = ["displacement [um]", "force [N]"]
    return written(path, headings, 1e3 * displacement, force)


def test_file_gives_table_and_figure(measured, tmp_path):
    out = tmp_path / "out"
    done = invoke(measured, "--normal-load", "60 N", "--out", out)
    assert (done.exit_code, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[0].split("  ")[-1].strip() == "mu"
    means = [float(word) for word in next(line for line in lines if "mean" in line).split()[1:]]
    height = STROKE - 2.0 * FRICTION * LOAD / STIFFNESS
    expected = [1e3 * STROKE, 2.0 * FRICTION * LOAD * height, 1e-3 * STIFFNESS, FRICTION]
    assert [*means[:3], means[4]] == pytest.approx(expected, rel=0.01)
    # The table is one that joint laws read.
    table = read_loop_table(out / "loops.csv")
    assert len(table.kt) == CYCLES
    assert table.kt == pytest.approx(STIFFNESS, rel=0.1)
    assert table.mu == pytest.approx(FRICTION, rel=0.01)
    assert np.allclose(table.P, LOAD, rtol=1e-12)
    assert table.energy[-1] == pytest.approx(CYCLES * expected[1], rel=0.01)
    amplitude = read_table_file(out / "loops.csv").column("amplitude", Quantity("mm"))
    assert amplitude == pytest.approx(0.5 * STROKE, rel=0.01)
    assert (out / "loops.png").read_bytes().startswith(b"\x89PNG")
    again = invoke(measured, "--normal-load", "60 N", "--out", out)
    assert (again.exit_code, again.stderr.count("\n")) == (2, 1)
    assert "--force" in again.stderr
    assert invoke(measured, "--normal-load", "60", "--out", out, "--force").exit_code == 0


def test_columns_may_have_other_names_units_and_company(measured, tmp_path):
    time, displacement, force = record()
    headings = ["run", "t [ms]", "LDV difference [mm]", "load cell [kN]", "P [N]"]
    text = ["a"] * len(time)
    load = np.full(len(time), LOAD)
    path = written(tmp_path / "b.csv", headings, text, 1e3 * time, displacement, 1e-3 * force, load)
    names = ["displacement=LDV difference", "force=load cell", "time=t", "normal_load=P"]
    options = [word for name in names for word in ("--column", name)]
    done, plain = invoke(path, *options), invoke(measured, "--normal-load", "60 N")
    assert done.exit_code == 0
    assert done.stdout == plain.stdout


def test_rising_strokes_are_reported_step_by_step(tmp_path):
    """With two cycles each of 3, 6 and 12 µm, the report accounts for all work of the record."""
    wave = np.sin(2.0 * np.pi * np.arange(400) / 200)
    motion = np.concatenate([3e-3 * wave, 6e-3 * wave, 12e-3 * wave, [0.0]])
    law = Jenkins(20e3, 0.5, 60.0)
    force = march_joints(law, law.rest(1), np.zeros((1, 1)), motion[:, None, None]).force.ravel()
    path = tmp_path / "rising.csv"
    written(path, ["displacement [um]", "force [N]"], 1e3 * motion, force)
    done = invoke(path, "--normal-load", "60 N", "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    rows = [line.split() for line in done.stdout.splitlines()]
    loops = [row for row in rows if row[0] in "12345" and row[1] in "123"]
    assert [row[1:3] for row in loops] == [
        ["1", "6"],
        ["1", "6"],
        ["2", "12"],
        ["2", "12"],
        ["3", "24"],
    ]
    means = [[float(row[1]), float(row[3])] for row in rows if row[0] == "mean"]
    assert means == pytest.approx(np.array([[1, 0.18], [2, 0.54], [3, 1.26]]), rel=1e-3)
    assert "5 closed loops of 2.7 mJ" in done.stdout
    table = read_table_file(tmp_path / "out" / "loops.csv")
    energy = table.column("energy", Quantity("N*mm"))
    # 3 and 6 µm of slip from one stroke to the next are dissipated too.
    assert energy[-1] == pytest.approx(2.7 + 30.0 * (3e-3 + 6e-3), rel=2e-3)


def test_loops_that_do_not_slide_bound_the_friction(tmp_path):
    _, displacement, force = record(stroke=1.5e-3)
    path = written(tmp_path / "c.csv", ["displacement [mm]", "force [N]"], displacement, force)
    done = invoke(path, "--normal-load", "60 N", "--out", tmp_path / "out")
    assert done.exit_code == 0
    assert "mu at least" in done.stdout
    assert "lower bound" in done.stdout
    assert "kr [N/um]" not in done.stdout
    headings = (tmp_path / "out" / "loops.csv").read_text(encoding="utf-8").splitlines()[0]
    assert "mu" not in headings
    assert "kt" in headings


GOOD = "displacement [um],force [N]\n" + "".join(f"{k % 7},{k % 5}\n" for k in range(9))


@pytest.mark.parametrize(
    ("text", "options", "named"),
    [
        ("displacement [um]\n1\n", [], "force"),
        ("displacement,displacement,force\n1,2,3\n", [], "displacement"),
        ("displacement,force\n1,2\n1,2\n", [], "displacement"),
        (GOOD, ["--normal-load", "60 mm"], "--normal-load '60 mm'"),
        (GOOD, ["--normal-load", "-3 N"], "--normal-load"),
        (GOOD, ["--column", "force=F"], "F"),
        (GOOD, ["--fast"], "--fast"),
    ],
)
def test_wrong_records_and_options_are_named_in_one_line(tmp_path, text, options, named):
    path = tmp_path / "nonsense.csv"
    path.write_text(text, encoding="utf-8")
    done = invoke(path, *options)
    assert done.exit_code == 2
    (line,) = done.stderr.splitlines()
    assert named in line
