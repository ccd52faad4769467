"""Tests of a joint that follows the wear of its contact, computed before it."""

import json

import pytest

from tests.workflow.conftest import invoke
from workflow.analyses.wear.output.loop_table import read_loop_table
from workflow.case.fields import Quantity
from workflow.case.files.table_file import read_table_file

WEAR = """\
title: Ball that wears
analysis: wear
structure: {kind: bodies, shape: sphere, radius: 10 mm}
materials:
  body_1: {young: 115 GPa, poisson: 0.29}
  body_2: {young: 115 GPa, poisson: 0.29}
friction: {coefficient: 0.5}
load_path: {P: 50 N, stroke: 20 um, increments: 2}
contact: {grid: [16, 16], size: [0.6 mm, 0.6 mm]}
wear:
  law: energy
  body_1: {coefficient: 5e3 um^3/J}
  body_2: {coefficient: 5e3 um^3/J}
  cycles: 2e4
  step: {kind: implicit, cycles: 1e4}
loops: {amplitude: 10 um}
stress: {section: none, life: {parameter: none}}
output: {paraview: false, figures: false}
"""
JOINT = """\
title: Joint of the ball
analysis: time
structure: {kind: joint}
joint: {law: jenkins, normal_load: 50 N, friction: 0.1, stiffness: 1 N/um}
evolution: {file: wear.yaml}
drive: {stroke: 20 um, frequency: 10 Hz}
energies: [0 J, 5 J]
ageing: {energy: 5 J}
output: {figures: false}
"""


def run(folder, wear, joint=JOINT):
    (folder / "wear.yaml").write_text(wear, encoding="utf-8")
    (folder / "joint.yaml").write_text(joint, encoding="utf-8")
    return invoke("run", folder / "joint.yaml", "--out", folder / "out")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return the folder of a finished run."""
    folder = tmp_path_factory.mktemp("worn")
    ended = run(folder, WEAR)
    assert ended.exit_code == 0, ended.output
    return folder


def test_stiffness_and_friction_of_the_joint_are_those_of_the_worn_contact(folder):
    summary = json.loads((folder / "out" / "summary.json").read_text())
    (file,) = (folder / "out" / "wear").glob("loops_*.csv")
    table = read_loop_table(file)
    unworn, worn = summary["states"]
    assert unworn["stiffness"] == pytest.approx(table.kt[0], rel=1e-9)
    # 5 J are between the first two loops, and what is between is straight.
    share = 5e3 / table.energy[1]
    between = (1.0 - share) * table.kt[0] + share * table.kt[1]
    assert 0.0 < share < 1.0
    assert worn["stiffness"] == pytest.approx(between, rel=1e-9)
    assert worn["stiffness"] > 1.02 * unworn["stiffness"]
    assert worn["friction"] == pytest.approx(0.5, rel=1e-6)
    # A spring and slider lose 4 µP (A - µP/kt), a sphere (Mindlin 1953) 4 µP (A - 6/5 µP/kt).
    corner = 4.0 * 25.0 * 0.2 * 25.0 / table.kt[0]
    per_loop = read_table_file(file).column("energy_per_loop", Quantity("N*mm"))
    assert unworn["energy_per_cycle"] - corner == pytest.approx(per_loop[0], rel=0.005)


def test_a_run_that_was_broken_off_takes_its_finished_wear(folder):
    """The resumed run ends with the same files."""
    summary, wear = (folder / "out" / name / "summary.json" for name in ("", "wear"))
    finished, first = wear.stat().st_mtime_ns, json.loads(summary.read_text())
    summary.unlink()
    ended = run(folder, WEAR)
    assert ended.exit_code == 0, ended.output
    assert "taken from the earlier run in" in ended.output
    assert wear.stat().st_mtime_ns == finished
    assert json.loads(summary.read_text())["states"] == first["states"]
