"""Tests of ``fretscale fit`` for profiles, with closed forms and with runs of a case."""

from pathlib import Path

import fretscale
import numpy as np
import pytest
from ruamel.yaml import YAML

from tests.workflow.command_line import invoke
from workflow.analyses.wear.output.measures import middle_profiles
from workflow.fit import profiles
from workflow.fit.profile_runs import RunScar, TestRuns

CASE = """\
title: A cylinder on a flat
analysis: wear
structure: {kind: bodies, shape: cylinder, radius: 10 mm}
materials:
  body_1: {young: 115 GPa, poisson: 0.29}
  body_2: {young: 115 GPa, poisson: 0.29}
friction: {coefficient: 0.5}
load_path: {P: 50 N/mm, stroke: 10 um, increments: 1}
contact: {grid: 96, size: 1.6 mm}
wear:
  law: energy
  body_1: {coefficient: 4.95e3 um^3/J}
  body_2: {coefficient: 3e3 um^3/J}
  cycles: 1e6
  step: {kind: implicit, cycles: 1e5}
stress: {section: none, life: {parameter: none}}
"""
FIT = """\
title: A scar
fit: wear_profiles
measurements: [{file: scan.csv, case: test.yaml}]
finer: {wear.step.cycles: 5e4}
"""
PLACES, SCATTER = np.linspace(-0.7, 0.7, 120), 2e-4
# 2 E µ P s N / 3R of the conforming cylinder: b³ over the sum of both coefficients [mm^3 MPa].
RADIUS, CUBE = 10.0, 0.5**3 / 1e-8


def cylinder(total, x):
    """Return the depth of both bodies [mm]: b³ ~ coefficient, and the loss is b² - x² / 2R."""
    return np.maximum((CUBE * total) ** (2.0 / 3.0) - x**2, 0.0) / (2.0 * RADIUS)


def write_scan(path, columns, raised=5e-4, tilted=3e-4):
    """Write a scan with scatter, an offset and a tilt."""
    rng = np.random.default_rng(7)
    noise = [raised + tilted * PLACES + SCATTER * rng.standard_normal(120) for _ in columns]
    heights = [1e3 * (depth + off) for depth, off in zip(columns, noise, strict=True)]
    heading = ", ".join(["x [mm]", "depth_1 [um]", "depth_2 [um]"][: len(columns) + 1])
    rows = np.stack([PLACES, *heights], axis=1)
    np.savetxt(path, rows, delimiter=",", header=heading, comments="", fmt="%.7g")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "test.yaml").write_text(CASE, encoding="utf-8")
    (tmp_path / "fit.yaml").write_text(FIT, encoding="utf-8")
    write_scan(tmp_path / "scan.csv", [0.4 * cylinder(9e-9, PLACES - 0.05)])
    return tmp_path


class ClosedForms(TestRuns):
    """Replacement of runs by closed forms; finer ones are 3 % deeper."""

    def scars(self, wanted, finer=None, alike=True):
        assert alike
        self.made |= {str((wanted, finer))}
        x = np.linspace(-1.0, 1.0, 401)
        deeper = 1.03 if finer else 1.0
        return [
            RunScar(sum(pair), x, deeper * cylinder(sum(pair), x), 1e6, ("it is a closed form",))
            for pair in wanted
        ]


def test_coefficients_of_both_bodies_come_back_through_closed_forms(folder, monkeypatch):
    """The case starts with other coefficients; the large change by finer runs is reported.

    Scars that are 3 % deeper give α 3 % too large, except for the influence of height and width:
    the mean of b² - x² is 2/3 b², and so is its derivative by ln α.
    """
    monkeypatch.setattr(profiles, "TestRuns", ClosedForms)
    whole = cylinder(9e-9, PLACES)
    write_scan(folder / "scan.csv", [0.4 * whole, 0.6 * whole], 0.0, 0.0)
    text = FIT.replace("case: test.yaml", "case: test.yaml, aligned: true")
    (folder / "fit.yaml").write_text(text, encoding="utf-8")
    found = fretscale.fit(folder / "fit.yaml", folder / "out")
    for body, true in (("body_1", 3600.0), ("body_2", 5400.0)):
        path = f"wear.{body}.coefficient"
        assert found[path].lower < true < found[path].upper
        assert found[path].deviation < 0.02 * true
        errors = found.summary["runs"]["relative_errors"][path]
        assert abs(errors["for_want_of_runs"]) < 0.1 * found[path].deviation / true
        assert errors["by_finer"] == pytest.approx(-0.03, rel=0.1)
        assert any(
            d.startswith(f"{path}: finer runs change it by") for d in found.plausibility_warnings
        )
    assert any("it is a closed form" in caveat for caveat in found.plausibility_warnings)
    assert found.summary["runs"]["made"] <= 5
    section = YAML(typ="safe", pure=True).load(found.section)["wear"]
    assert list(section) == ["law", "body_1", "body_2"]


@pytest.mark.parametrize(
    ("file", "old", "new", "named"),
    [
        ("scan.csv", "x [mm]", "x", "scan.csv:1: 'x'"),
        ("scan.csv", "depth_1 [um]", "depth_1 [MPa]", "scan.csv:1: depth_1"),
        ("scan.csv", "\n-0.6882353", "\n-0.8", "scan.csv:3: x"),
        ("fit.yaml", "finer: {wear.step.cycles: 5e4}", "finer: {}", "fit.yaml:4: finer"),
        ("fit.yaml", "case: test.yaml", "case: no.yaml", "no.yaml"),
        ("test.yaml", "4.95e3 um^3/J", "0 um^3/J", "measurements.0.case"),
        ("test.yaml", "analysis: wear", "analysis: weir", "test.yaml:2: analysis"),
    ],
)
def test_wrong_files_are_refused_with_their_place(folder, file, old, new, named):
    text = (folder / file).read_text("utf-8")
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1), encoding="utf-8")
    done = invoke("fit", folder / "fit.yaml", "--out", folder / "out")
    assert done.exit_code == 2, done.stderr
    assert named in done.stderr


@pytest.mark.slow
def test_a_coefficient_comes_back_through_runs_which_are_taken_up(folder):
    """The scar has other steps and another grid; a second call repeats no run."""
    case = fretscale.load_case(
        folder / "test.yaml",
        wear__body_1__coefficient="5e3 um^3/J",
        wear__step__cycles=2e4,
        contact__grid=160,
        output__figures=False,
        output__paraview=False,
    )
    fretscale.run(case, folder / "truth", quiet=True)
    x, depth, _ = middle_profiles(folder / "truth", ["interface"])["interface"]
    write_scan(folder / "scan.csv", [np.interp(PLACES - 0.05, x, depth)])
    path = "wear.body_1.coefficient"
    found = fretscale.fit(folder / "fit.yaml", folder / "out")
    assert found[path].lower < 5e3 < found[path].upper
    assert found[path].deviation < 100.0
    errors = found.summary["runs"]["relative_errors"][path]
    assert abs(errors["by_finer"]) < 2e-3
    assert all(
        caveat.startswith("the runs: interface") and "12 cells" in caveat
        for caveat in found.plausibility_warnings
    )
    assert found["profile.shift"].lower < 50.0 < found["profile.shift"].upper
    section = YAML(typ="safe", pure=True).load(found.section)["wear"]
    assert section["body_2"] == {"coefficient": "3000 um^3/J"}
    results = list(Path(folder / "out").glob("runs/*/results.h5"))
    assert len(results) == found.summary["runs"]["made"]
    before = [file.stat().st_mtime_ns for file in results]
    again = fretscale.fit(folder / "fit.yaml", folder / "out", force=True)
    assert again[path] == found[path]
    assert [file.stat().st_mtime_ns for file in results] == before
