"""``fretscale verify`` on the small case: its expectations are met, and a wrong one is missed."""

import re

import pytest
from click.testing import CliRunner

from workflow.cli import cli
from workflow.errors import UserError
from workflow.runs import verify as verification
from workflow.shell.folder import OutputFolder
from workflow.shell.summary import QuantityError, required_number


def verify(path, out):
    return CliRunner().invoke(cli, ["verify", str(path), "--out", str(out)])


def quiet(text):
    """The case without its pictures."""
    return text.replace("figures: true", "figures: false")


@pytest.mark.slow
def test_expectations_of_the_small_case_are_met(small_path, tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(quiet(small_path.read_text("utf-8")), encoding="utf-8")
    done = verify(path, tmp_path / "out")
    assert done.exit_code == 0, (done.stdout, done.stderr)
    assert done.stdout.count(" met ") == 5
    assert "intrados.peak_load.unworn.P" in done.stdout
    assert "closed form -µP" in done.stdout
    assert (tmp_path / "out" / "small" / "summary.json").exists()


@pytest.mark.slow
def test_wrong_expectation_is_missed(small_path, tmp_path):
    text = quiet(small_path.read_text("utf-8")).replace("value: -31.409 kN", "value: -32 kN")
    path = tmp_path / "small.yaml"
    path.write_text(text, encoding="utf-8")
    done = verify(path, tmp_path / "out")
    assert done.exit_code == 1, (done.stdout, done.stderr)
    (line,) = [line for line in done.stdout.splitlines() if "MISSED" in line]
    assert re.search(r"unworn\.Qx +-32000 +-313\d\d.* 2\.\d\d% +MISSED", line)


@pytest.mark.parametrize(
    ("quantity", "words"),
    [
        ("a.c", "no quantity a.c in summary.json (c is missing)"),
        ("a.b.3", "(3 is missing)"),
        ("a.b.-3", "(-3 is missing)"),
        ("a", "a is not a number"),
        ("on", "on is not a number"),
        ("a.b.1.c", "(c is missing)"),
    ],
)
def test_expectation_of_what_is_not_computed_is_named(quantity, words):
    summary = {"a": {"b": [1.0, 2.0]}, "on": True}
    assert required_number(summary, "a.b.-1") == 2.0
    with pytest.raises(QuantityError) as refusal:
        required_number(summary, quantity)
    assert words in str(refusal.value)


def test_case_is_named_that_expects_what_is_not_computed(small_path, tmp_path, monkeypatch):
    def run_case(case, out, force):
        out.mkdir(parents=True)
        OutputFolder(out).write_summary({})

    monkeypatch.setattr(verification, "run_case", run_case)
    with pytest.raises(UserError, match=r"\.yaml: expect: no quantity "):
        verification.verify_cases((small_path,), tmp_path)


def test_case_without_expectations_is_refused_before_it_runs(dovetail_path, tmp_path):
    done = verify(dovetail_path, tmp_path / "out")
    assert done.exit_code == 2
    (line,) = done.stderr.splitlines()
    assert "no `expect` list" in line
    assert not (tmp_path / "out").exists()
