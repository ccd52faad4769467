"""Tests of wear up to a given depth, as of a coating, or without any: the end of a run."""

import json

import pytest
from click.testing import CliRunner

from tests.workflow.command_line import runs_here
from workflow.cli import cli

CASE = """\
title: Ball worn through its coating
analysis: wear
structure:
  kind: resultants
  file: loads.csv
  size: [2 mm, 2 mm]
  gap: {shape: paraboloid, radius_x: 100 mm, radius_y: 100 mm}
materials:
  body_1: {young: 115 GPa, poisson: 0.29}
  body_2: {young: 115 GPa, poisson: 0.29}
friction: {coefficient: 0.4}
contact: {grid: [16, 16], method: full, tolerance: 1e-8}
wear:
  law: energy
  cycles: 6e4
  step: {kind: implicit, cycles: 2e4}
  body_1: {coefficient: 1e4 um^3/J}
  body_2: {coefficient: 1e4 um^3/J}
stress: {section: none, life: {parameter: none}}
output: {paraview: false, figures: false}
"""
# Pressed, slid back and forth, apart.
SLIDES = """\
P, Qx, Qy, Mx, My, Mz, Edx, Edy
100, 40, 0, 0, 0, 0, 0.5, 0
100, -40, 0, 0, 0, 0, 1.0, 0
0, 0, 0, 0, 0, 0, 0, 0
"""
STICKS = """\
P, Qx, Qy, Mx, My, Mz, Edx, Edy
50, 0, 0, 0, 0, 0, 0, 0
100, 0, 0, 0, 0, 0, 0, 0
0, 0, 0, 0, 0, 0, 0, 0
"""
REACHED, NOT_REACHED = 0.3e-3, 30e-3
"""Depths of one body [mm]: a third and thirty times what the cycles of the case wear, about."""


def run(folder, loads, *overrides):
    (folder / "loads.csv").write_text(loads, encoding="utf-8")
    case = folder / "case.yaml"
    case.write_text(CASE, encoding="utf-8")
    settings = [part for entry in overrides for part in ("--set", entry)]
    with runs_here():
        done = CliRunner().invoke(cli, ["run", str(case), "--out", str(folder / "out"), *settings])
    assert done.exit_code == 0, done.stderr
    text = (folder / "out" / "summary.json").read_text("utf-8")
    assert "NaN" not in text
    return json.loads(text)


@pytest.mark.slow
@pytest.mark.parametrize(
    "step",
    [
        "{kind: implicit, cycles: 2e4}",
        "{kind: explicit, cycles: 2e4}",
        "{kind: implicit, depth: 1 um}",
        "{kind: second_order, cycles: 2e4}",
        "{kind: implicit, volume: 0.001 mm^3}",
    ],
)
def test_a_run_ends_at_its_depth_and_not_a_step_beyond(tmp_path, step):
    """The last step is shortened, so that the depth is met within a hundredth."""
    summary = run(tmp_path, SLIDES, f"wear.stop.depth={REACHED}", f"wear.step={step}")
    depth = max(summary["interface"]["depth_1"], summary["interface"]["depth_2"])
    assert depth == pytest.approx(REACHED, rel=0.01)
    assert summary["cycles"] < 6e4
    volume = summary["interface"]["volume_1"] + summary["interface"]["volume_2"]
    # 1e4 µm³/J on each body.
    assert volume == pytest.approx(2.0 * 1e-8 * summary["interface"]["energy"], rel=1e-9)


@pytest.mark.slow
def test_a_run_ends_at_its_volume(tmp_path):
    stop = 2e-4
    summary = run(tmp_path, SLIDES, f"wear.stop.volume={stop}")
    volume = summary["interface"]["volume_1"] + summary["interface"]["volume_2"]
    assert volume == pytest.approx(stop, rel=0.01)
    assert summary["cycles"] < 6e4


@pytest.mark.slow
def test_a_depth_out_of_reach_ends_with_the_cycles(tmp_path):
    summary = run(tmp_path, SLIDES, f"wear.stop.depth={NOT_REACHED}")
    assert summary["cycles"] == pytest.approx(6e4)
    assert REACHED < summary["interface"]["depth_1"] < NOT_REACHED


def test_a_contact_that_does_not_slip_wears_nothing_and_ends(tmp_path):
    """Pressing similar bodies moves no point along the surface: no energy, depth or rates."""
    step = "wear.step={kind: implicit, depth: 1 um}"
    summary = run(tmp_path, STICKS, f"wear.stop.depth={REACHED}", step)
    interface = summary["interface"]
    assert summary["cycles"] == pytest.approx(6e4)
    assert interface["depth_1"] == interface["depth_2"] == 0.0
    assert interface["volume_1"] == interface["energy"] == 0.0
