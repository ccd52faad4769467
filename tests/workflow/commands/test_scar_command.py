"""Tests of ``fretscale scar`` and ``fretscale surface``: numbers from scans, scans from runs."""

import json
import warnings

import numpy as np
import pytest

from sa_solver import Grid
from sa_solver.surfaces.scans import Scan
from tests.wear.test_scar import scans
from tests.workflow.command_line import command
from workflow.case.files.scan_files import read_scan, write_scan
from workflow.case.files.table_file import read_table_file

ROUGH_WEAR = """\
title: Rough ball that wears
analysis: wear
structure:
  kind: bodies
  shape: sphere
  radius: 10 mm
  surfaces: {body_1: {file: a.sur}, body_2: {file: b.sur}}
materials: {body_1: {young: 115 GPa, poisson: 0.29}, body_2: {young: 115 GPa, poisson: 0.29}}
friction: {coefficient: 0.5}
load_path: {P: 20 N, stroke: 20 um}
contact: {grid: [40, 32], size: [0.8 mm, 0.8 mm]}
wear:
  law: energy
  cycles: 500
  body_1: {coefficient: 1e4 um^3/J}
  body_2: {coefficient: 2e4 um^3/J}
output: {figures: false, paraview: false}
"""


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """Return two scans in files of different kinds, and the volume between them."""
    folder = tmp_path_factory.mktemp("scar")
    before, after, volume, _, _ = scans(3, cells=96, noise=5e-5, missing=0.02)
    write_scan(folder / "before.sur", before)
    write_scan(folder / "after.x3p", after)
    return folder / "before.sur", folder / "after.x3p", volume


def test_two_scans_give_volume_table_map_and_figure(pair, tmp_path):
    *paths, volume = pair
    done = command("scar", *paths, "--out", tmp_path / "out")
    assert (done.exit_code, done.stderr) == (0, "")
    reported = done.stdout.splitlines()[0].split()
    assert reported[0] == "volume"
    assert abs(float(reported[1]) - 1e9 * volume) < float(reported[3]) < 0.01e9 * volume
    assert "aligned: the second lies" in done.stdout
    table = read_table_file(tmp_path / "out" / "scar.csv")
    assert float(table.cells("value")[0]) == pytest.approx(volume, rel=0.01)
    with np.load(tmp_path / "out" / "scar.npz") as fields:
        cell = fields["pitch"].prod()
        worn = fields["depth"][fields["worn"]]
        assert np.nansum(worn) * cell == pytest.approx(volume, rel=0.1)  # some points are missing
    assert (tmp_path / "out" / "scar.png").read_bytes().startswith(b"\x89PNG")
    again = command("scar", *paths, "--out", tmp_path / "out")
    assert (again.exit_code, again.stderr.count("\n")) == (2, 1)


@pytest.mark.parametrize("more", [["--worn", "0,1,2"], ["--worn", "0 N,1,2,3"]])
def test_wrong_options_are_refused_in_one_line(pair, more):
    ended = command("scar", *pair[:2], *more)
    assert ended.exit_code == 2
    (line,) = ended.stderr.splitlines()
    assert "--worn" in line


DAMAGE = {
    "points far apart.sur": (120, np.float32(1e4).tobytes()),
    "one huge height.sdf": (20_000, np.float64(1e250).tobytes()),
    "cut off.x3p": (-9, b""),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_a_damaged_scan_gives_no_numbers(pair, name, tmp_path):
    """It is refused in one line, without warnings, and NaN is no result."""
    path = tmp_path / name
    write_scan(path, read_scan(str(pair[1]), None, None))
    raw, (place, wrong) = bytearray(path.read_bytes()), DAMAGE[name]
    raw[place : place + len(wrong) if wrong else None] = wrong[: len(raw) - place]
    path.write_bytes(raw)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        ended = command("scar", pair[0], path)
    assert ended.exit_code == 2, ended.stdout
    assert len(ended.stderr.splitlines()) == 1


@pytest.mark.slow
def test_worn_surfaces_of_a_run_are_scans_of_them(tmp_path):
    """Written, read and subtracted from unworn ones, they give the volumes of the run."""
    rng, grid = np.random.default_rng(2), Grid.covering((0.9, 0.9), (120, 120))
    first = 1e-4 * rng.normal(size=grid.shape)
    write_scan(tmp_path / "a.sur", Scan(first, grid.pitch))
    write_scan(tmp_path / "b.sur", Scan(first + 0.01 * grid.x, grid.pitch))
    (tmp_path / "wear.yaml").write_text(ROUGH_WEAR, encoding="utf-8")
    out = tmp_path / "out"
    assert command("run", tmp_path / "wear.yaml", "--out", out).exit_code == 0
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    assert summary["surfaces"]["body_2"]["points"] == [120, 120]
    for body in ("1", "2"):
        for name, more in (("before.x3p", ["--unworn"]), ("after.x3p", [])):
            done = command("surface", out, tmp_path / name, "--body", body, "--force", *more)
            assert done.exit_code == 0, done.stderr
        before, after = (
            read_scan(str(tmp_path / name), None, None) for name in ("before.x3p", "after.x3p")
        )
        assert before.pitch == pytest.approx((0.02, 0.025))
        lost = (before.heights - after.heights).sum() * 0.02 * 0.025
        assert lost == pytest.approx(summary["interface"][f"volume_{body}"], rel=1e-9)
    # The upper body's form is out of it, and the lower's scan is its own surface.
    assert before.heights[0, 0] < before.heights[20, 16] - 0.01
    done = command("surface", out, tmp_path / "lower.npz", "--body", "1", "--unworn")
    assert done.exit_code == 0
    with np.load(tmp_path / "lower.npz") as lower:
        assert np.std(lower["heights"]) < 1.2e-4
    refused = command("surface", out, tmp_path / "lower.npz", "--body", "1")
    assert (refused.exit_code, "exists" in refused.stderr) == (2, True)
    other = command("surface", out, tmp_path / "x.sur", "--body", "1", "--interface", "b")
    assert "b: no such interface; allowed: interface" in other.stderr
