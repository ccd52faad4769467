"""Tests of ``fretscale sweep``: its file, its designs, and successful and failed runs."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from tests.workflow.command_line import AS_PROCESS, invoke, jobs_here
from tests.workflow.scenes import BALL
from workflow.runs.job import Finished
from workflow.sweep.design import SweepRun, runs_of
from workflow.sweep.schema import load_sweep
from workflow.sweep.table import SweepRow, columns_of, unit_of

PATIENCE = 120.0


@pytest.fixture(scope="module", autouse=True)
def _jobs_here():
    """Run jobs here, as a process would take longer than its run (test_runs.py has them)."""
    with jobs_here():
        yield


def write(folder, text):
    (folder / "contact.yaml").write_text(BALL, encoding="utf-8")
    path = folder / "sweep.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def runs(folder, text):
    return runs_of(load_sweep(write(folder, f"case: contact.yaml\n{text}")))


def sweep(path, out, *options):
    return invoke("sweep", path, "--out", out, *options)


def table(out):
    with (out / "sweep.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


# --- designs --------------------------------------------------------------------------------------


def test_a_grid_has_every_value_with_every_other(tmp_path):
    design = runs(
        tmp_path,
        "vary:\n"
        "  friction.coefficient: {values: [0.5, 60 %]}\n"
        "  structure.radius: {range: {from: 10 mm, to: 40 mm, count: 3, scale: log}}\n",
    )
    expected = product([0.5, "60 %"], ["10 mm", "20 mm", "40 mm"])
    assert [tuple(run.values.values()) for run in design] == list(expected)
    assert len({run.name for run in design}) == 6
    assert design[0].name == "coefficient=0.5_radius=10mm"


def test_zip_goes_in_step(tmp_path):
    text = """
vary:
  load_path.legs.1.increments: {range: {from: 2, to: 10, count: 3}}
  contact.grid: {values: [[16, 16], [32, 16], [32, 32]]}
design: zip
"""
    design = runs(tmp_path, text)
    assert [tuple(run.values.values()) for run in design] == [
        *((2, (16, 16)), (6, (32, 16)), (10, (32, 32)))
    ]
    sweep_file = load_sweep(tmp_path / "sweep.yaml")
    case = design[1].job(sweep_file).load()
    assert (case.contact.grid, case.load_path.legs[1].increments) == ((32, 16), 6)


SAMPLE = """
vary:
  friction.coefficient: {distribution: {kind: uniform, from: 0.4, to: 0.6}}
  structure.radius: {distribution: {kind: normal, mean: 10 mm, deviation: 0.5 mm}}
  materials.body_1.young: {distribution: {kind: lognormal, median: 100 GPa, factor: 1.2}}
  load_path.legs.0.P: {range: {from: 100 N, to: 10000 N, scale: log}}
  contact.history: {values: [full, auto]}
design: sample
samples: 400
"""


def drawn(design):
    columns = zip(*(run.values.values() for run in design), strict=True)
    return [[str(value).split()[0] for value in column] for column in columns]


def test_a_sample_is_a_latin_hypercube_of_its_distributions(tmp_path):
    """Each of n equal shares of a distribution is hit once, so means are exact to O(1/n)."""
    friction, radius, young, force, history = drawn(runs(tmp_path, SAMPLE))
    share = (np.sort(np.array(friction, float)) - 0.4) / 0.2 * 400
    assert np.all(np.abs(share - (np.arange(400) + 0.5)) <= 0.5 + 1e-2)  # six digits of 0.4
    radius = np.array(radius, float)
    assert radius.mean() == pytest.approx(10.0, abs=5e-3)
    assert radius.std() == pytest.approx(0.5, rel=1e-2)
    logs = np.log(np.array(young, float))
    assert np.median(logs) == pytest.approx(np.log(100.0), abs=1e-2)
    assert logs.std() == pytest.approx(np.log(1.2), rel=1e-2)
    decades = np.log10(np.array(force, float))
    assert np.histogram(decades, bins=[2, 2.5, 3, 3.5, 4])[0].tolist() == [100] * 4
    assert sorted(history) == ["auto"] * 200 + ["full"] * 200


def test_a_sample_is_the_same_again_and_another_with_another_seed(tmp_path):
    assert runs(tmp_path, SAMPLE) == runs(tmp_path, SAMPLE)
    assert runs(tmp_path, SAMPLE) != runs(tmp_path, f"{SAMPLE}seed: 1")


# --- mistakes -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "line", "named"),
    [
        ("case: none.yaml", 1, "case"),
        ("case: contact.yaml\n", 1, "vary"),
        ("case: contact.yaml\nvery:\n  a: {values: [1]}\n", 2, "very"),
        ("+{value: [1]}", 3, "values"),
        ("+{values: [0.5, 0.5]}", 3, "0.5"),
        ("+{values: [0.5], range: {from: 1, to: 2, count: 3}}", 3, "range"),
        ("+{range: {from: 0.1, to: 0.2}}", 3, "range.count"),
        ("+{range: {from: 1 mm, to: 2, count: 3}}", 3, "1 mm"),
        ("+{range: {from: 0, to: 2, count: 3, scale: log}}", 3, "range"),
        ("+{distribution: {kind: uniform, from: 0, to: 1}}", 3, "design: sample"),
        ("+{values: [0.5]}\nset: {friction.coefficient: 0.6}", 4, "friction.coefficient"),
        ("+{values: [0.5]}\ndesign: sample", 1, "samples"),
        ("+{values: [0.5, 0.6]}\n  title: {values: [a, b, c]}\ndesign: zip", 5, "zip of 2, 3"),
        ("+{values: [1, 2]}\n  title: {range: {from: 1, to: 2, count: 9000}}", 1, "18000"),
        # Found in the case, reported in the sweep.
        ("+{values: [0.5, -1]}", 3, "vary.friction.coefficient"),
        ("+{values: [0.5]}\nset: {contact.gird: 3}", 4, "grid"),
        ("case: contact.yaml\nvary:\n  friktion.coefficient: {values: [1]}", 3, "friktion"),
    ],
)
def test_a_wrong_sweep_is_refused_before_anything_runs(tmp_path, text, line, named):
    if text.startswith("+"):
        text = f"case: contact.yaml\nvary:\n  friction.coefficient: {text[1:]}"
    path = write(tmp_path, text)
    result = sweep(path, tmp_path / "out")
    assert result.exit_code == 2
    lines = result.stderr.splitlines()
    assert any(each.startswith(f"fretscale: {path}:{line}: ") and named in each for each in lines)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("what", ["a file", "something else"])
def test_a_folder_of_something_else_is_left_alone(tmp_path, what):
    path, out = write(tmp_path, GRID), tmp_path / "out"
    if what == "a file":
        out.write_text("mine")
    else:
        out.mkdir()
        (out / "mine").write_text("mine")
    result = sweep(path, out)
    assert result.exit_code == 2
    (reported,) = result.stderr.splitlines()
    assert reported.startswith(f"fretscale: {out}: ")


# --- runs -----------------------------------------------------------------------------------------

GRID = """\
case: contact.yaml
vary:
  load_path.legs.0.P: {values: [100 N, 400 N]}
  friction.coefficient: {range: {from: 0.6, to: 0.7, count: 2}}
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Return a sweep of four runs, of which two slide, and its exit; tests must not change it."""
    folder = tmp_path_factory.mktemp("sweep")
    path = write(folder, GRID)
    return path, folder / "out", sweep(path, folder / "out")


def test_a_failed_run_is_a_row_and_stops_nobody(done):
    _, out, result = done
    assert result.exit_code == 3
    rows = table(out)
    assert [row["load_path.legs.0.P [N]"] for row in rows] == ["100", "100", "400", "400"]
    assert [row["friction.coefficient"] for row in rows] == ["0.6", "0.7", "0.6", "0.7"]
    assert [row["status"] for row in rows] == ["failed", "failed", "done", "done"]
    assert "friction cannot carry" in rows[0]["message"]
    assert rows[0]["states.-1.peak_pressure"] == ""
    for row in rows[2:]:
        summary = json.loads((out / "runs" / row["name"] / "summary.json").read_text("utf-8"))
        assert float(row["states.-1.peak_pressure"]) == summary["states"][-1]["peak_pressure"]
        assert float(row["convolutions"]) == summary["convolutions"]
    # No pictures of the runs, unless they are asked for.
    assert not list(out.glob("runs/*/figures"))


def test_summary_has_the_spread(done):
    _, out, _ = done
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    assert summary["runs"] == 4
    assert len(summary["failed"]) == 2
    energies = [float(row["states.-1.cumulative_energy"]) for row in table(out)[2:]]
    reported = summary["found"]["states.-1.cumulative_energy"]
    assert (reported["least"], reported["largest"]) == (min(energies), max(energies))
    assert reported["median"] == pytest.approx(np.mean(energies), rel=1e-12)
    assert reported["deviation"] == pytest.approx(abs(np.diff(energies)[0]) / np.sqrt(2), rel=1e-12)


def test_figures_are_drawn_against_all_that_varies(done):
    _, out, _ = done
    names = {path.stem for path in (out / "figures").glob("*.png")}
    assert names == {"against_load_path_legs_0_P", "against_friction_coefficient"}


def test_again_runs_what_failed_and_nothing_else(done):
    path, out, _ = done
    before = {summary: summary.stat().st_mtime_ns for summary in out.glob("runs/*/summary.json")}
    text = (out / "sweep.csv").read_text("utf-8")
    again = sweep(path, out)
    assert again.exit_code == 3
    assert "2 finished before" in again.stderr
    assert {
        summary: summary.stat().st_mtime_ns for summary in out.glob("runs/*/summary.json")
    } == before
    assert (out / "sweep.csv").read_text("utf-8") == text


def test_runs_of_another_case_need_force(tmp_path):
    path = write(tmp_path, "case: contact.yaml\nvary:\n  friction.coefficient: {values: [0.7]}\n")
    assert sweep(path, tmp_path / "out").exit_code == 0
    case = tmp_path / "contact.yaml"
    case.write_text(case.read_text("utf-8").replace("radius: 10", "radius: 12"), encoding="utf-8")
    refused = sweep(path, tmp_path / "out")
    assert refused.exit_code == 2
    assert "holds a run of another case; give another folder, or --force" in refused.stderr
    pressure = float(table(tmp_path / "out")[0]["states.-1.peak_pressure"])
    assert sweep(path, tmp_path / "out", "--force").exit_code == 0
    assert float(table(tmp_path / "out")[0]["states.-1.peak_pressure"]) < pressure


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_keeps_what_is_done(tmp_path):
    """It gives one line, exit code 130, and a table; the same command completes the rest."""
    values = ", ".join(f"{400 + number} N" for number in range(6))
    path = write(
        tmp_path, f"case: contact.yaml\nvary:\n  load_path.legs.0.P: {{values: [{values}]}}\n"
    )
    out = tmp_path / "out"
    command = [sys.executable, "-c", AS_PROCESS, "sweep", path, "--out", out, "--processes", "1"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    end = time.monotonic() + PATIENCE
    while len(list(out.glob("runs/*/summary.json"))) < 2 and time.monotonic() < end:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, text = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, text
    assert text.splitlines()[-1].startswith("fretscale: interrupted")
    assert "Traceback" not in text
    kept = len(list(out.glob("runs/*/summary.json")))
    assert 1 <= len(table(out)) <= kept < 6
    again = sweep(path, out)
    assert again.exit_code == 0
    assert f"{kept} finished before" in again.stderr
    assert [row["status"] for row in table(out)] == ["done"] * 6


# --- wear runs, as their summaries are ------------------------------------------------------------


def worn(depth, line=False):
    """Return the row of a run whose body 2 wears twice as much as body 1."""
    flank = {"depth_1": depth, "depth_2": 2 * depth, "volume_1": 1.0, "volume_2": 2.0}
    flank |= {"energy": 5.0, "peak_pressure": {"unworn": 300.0, "worn": 200.0}}
    kinetics = {name: [0.0, 0.5 * flank[name], flank[name]] for name in list(flank)[:5]}
    summary = {
        "title": "Flanks",
        "per_length": line,
        "cycles": 100.0,
        "jumps": 2,
        "flank": flank,
        "kinetics": {"cycles": [0.0, 50.0, 100.0], "flank": kinetics},
        "seconds": {"a": 1.0},
        "work": {"contact_solves": 7},
    }
    run = SweepRun(f"run{depth}", {"friction.coefficient": f"{100 * depth:g} %"})
    return SweepRow(run, Finished(None, Path(), summary))


def test_columns_of_wear_runs_are_of_both_bodies_and_have_units():
    rows = [worn(0.1), worn(0.2), SweepRow(worn(0.3).run, Finished(None, Path(), None, "it broke"))]
    columns = columns_of(rows)
    np.testing.assert_allclose(columns["flank.depth"], [0.3, 0.6, np.nan], rtol=1e-15)
    np.testing.assert_array_equal(columns["flank.peak_pressure.worn"], [200.0, 200.0, np.nan])
    assert columns["work.contact_solves"][0] == 7
    assert unit_of("flank.volume", rows) == "mm^3"
    assert unit_of("flank.volume", [worn(0.1, line=True)]) == "mm^3/mm"
    run = SweepRun("pressed", {})
    pressed = Finished(run, Path("pressed"), {"loop": {"energy": 1.0}})
    assert unit_of("loop.energy", [SweepRow(run, pressed)]) == ""
    assert unit_of("flank.energy", [*rows, worn(0.1, line=True)]) == "N mm or N mm/mm"
