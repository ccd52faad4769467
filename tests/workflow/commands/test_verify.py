"""Tests of ``fretscale verify`` on the small case: met expectations, and a missed one."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.workflow.output.figure_checks import problems_of_run
from workflow.cli import cli
from workflow.kinds import load_case
from workflow.runs import verify as verification
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.summary import QuantityError, required_number

CASES = Path(__file__).parents[3] / "cases"
# Provenance of a summary that no case has made.
UNTIED = {"case": {}, "input_files": {}}


def verify(path, out):
    return CliRunner().invoke(cli, ["verify", str(path), "--out", str(out)])


def quiet(text):
    """Return the case without its pictures."""
    return text.replace("figures: true", "figures: false")


VERIFIED = (
    *("bolted_joint_test4", "bolted_joint_test2", "rig_bouc_wen", "rig_reduced", "rig_force_75N"),
    *("rig_hammer_7N", "rig_hammer_60N", "sphere_normal", "sphere_fretting", "sphere_torsion"),
    *("line_bulk_stress", "line_dissimilar", "cylinder_wear", "sphere_wear"),
    *("specimens_flat", "specimens_curved"),
)


@pytest.mark.slow
@pytest.mark.parametrize("name", VERIFIED)
def test_shipped_cases_meet_their_expectations(name, tmp_path):
    """The figures of their results are complete and legible too."""
    assert verification.verify_cases((CASES / f"{name}.yaml",), tmp_path)
    assert problems_of_run(tmp_path / name) == []


@pytest.mark.slow
def test_expectations_of_the_small_case_are_met(small_path, tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(quiet(small_path.read_text("utf-8")), encoding="utf-8")
    done = verify(path, tmp_path / "out")
    assert done.exit_code == 0, (done.stdout, done.stderr)
    assert done.stdout.count(" met ") == 5
    (line,) = [line for line in done.stdout.splitlines() if "-µP" in line]
    assert re.search(r"unworn\.Qx +-31\.409 +-31\.[34]\d* +kN +0\.\d\d% +met +closed form", line)
    assert (tmp_path / "out" / "small" / "summary.json").exists()


@pytest.mark.parametrize("quantity", ["a.c", "a.b.3", "a", "on"])
def test_expectation_of_what_is_not_computed_is_named(quantity):
    summary = {"a": {"b": [1.0, 2.0]}, "on": True}
    assert required_number(summary, "a.b.-1") == 2.0
    with pytest.raises(QuantityError, match=quantity.split(".")[-1]):
        required_number(summary, quantity)


EXPECTED = """\
expect:
  - {quantity: length, value: 12 um, tolerance: 1 %, kind: earlier, source: a run}
  - {quantity: share, value: 0.5, tolerance: 1 %, kind: independent, source: another method}
  - {quantity: nothing, value: 0 um, tolerance: 0.5, kind: printed, source: a paper}
  - {quantity: sign, value: -1, tolerance: 0, kind: closed_form, source: a balance}
"""


def test_table_has_the_units_of_the_case_and_the_kind_of_each_value(
    small_path, tmp_path, monkeypatch, capsys
):
    """The error of a value 0 has its unit too: 0.4 um, where 0.5 um are allowed."""

    def run_case(case, out, force, loudness):
        out.mkdir(parents=True)
        summary = {"length": 0.0121, "share": 0.5, "nothing": 4e-4, "sign": -1.0}
        OutputFolder(out).finish(summary, UNTIED)

    monkeypatch.setattr(verification, "run_case", run_case)
    text = small_path.read_text("utf-8")
    path = tmp_path / "case.yaml"
    path.write_text(text[: text.index("\nexpect:")] + "\n" + EXPECTED, encoding="utf-8")
    assert verification.verify_cases((path,), tmp_path / "out")
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    shown = {row[0]: row[1:] for row in rows if row}
    assert shown["length"][:6] == ["12", "12.1", "um", "0.83%", "met", "earlier"]
    assert shown["share"][:6] == ["0.5", "0.5", "-", "0.00%", "met", "independent"]
    assert shown["nothing"][:6] == ["0", "0.4", "um", "4.0e-01", "met", "printed"]
    assert shown["sign"][:7] == ["-1", "-1", "-", "0.00%", "met", "closed", "form"]


@pytest.mark.usefixtures("reads_here")
def test_every_case_has_expectations():
    """The only exception is a case that provides the bodies of another one."""
    without = {path.stem for path in CASES.glob("*.yaml") if not load_case(path).expect}
    assert without == {"specimens_rig"}


def test_case_without_expectations_is_refused_before_it_runs(tmp_path):
    done = verify(CASES / "specimens_rig.yaml", tmp_path / "out")
    assert done.exit_code == 2
    (line,) = done.stderr.splitlines()
    assert "no `expect` list" in line
    assert not (tmp_path / "out").exists()
