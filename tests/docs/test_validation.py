"""The table of "Validation against measurements" is current."""

import csv
import sys
from pathlib import Path

import pytest

from tests.workflow.command_line import command, runs_here

ROOT = Path(__file__).parents[2]
FIGURES = ROOT / "docs" / "figures"
PAGE = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
FAST = "output.figures=false", "output.report=false"
QUIET = *FAST, "error_budget=known"
# Fewer strips, increments and wear steps than the case has.
COARSE = "contact.grid=128", "load_path.increments=8", "wear.tolerance=5 %"


@pytest.fixture(scope="module")
def validate():
    """Return the script of the page, which is no package."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(ROOT / "docs"), *sys.path])
        import validate

        yield validate


@pytest.fixture(scope="module")
def stored():
    """Return the rows of the table by test and quantity."""
    with (FIGURES / "validation.csv").open(encoding="utf-8", newline="") as file:
        return {(row["test"], row["quantity"]): row for row in csv.DictReader(file)}


def number(text):
    """Return a value of the table and what follows "±" in it."""
    value, _, around = text.partition(" (")[0].partition(" ± ")
    return float(value), float(around or 0.0)


def test_the_page_has_all_tables_and_figures():
    for file in FIGURES.glob("validation*"):
        assert f"figures/{file.name}" in PAGE


def test_every_comparison_is_in_the_table_with_what_was_measured(validate, stored):
    entries = validate.comparisons()
    assert list(stored) == [(entry.test, entry.quantity) for entry in entries]
    for entry in entries:
        row = stored[entry.test, entry.quantity]
        assert row["measured"] == validate.number(*entry.measured)
        assert (row["kind"], row["likely cause"]) == (entry.kind, entry.cause)


def test_deviations_are_those_of_the_numbers(stored):
    for row in stored.values():
        measured, computed = number(row["measured"])[0], number(row["computed"])[0]
        deviation = float(row["deviation"].partition(" %")[0].replace("−", "-"))
        # Numbers have three digits, the deviation two.
        rounding = 0.5 * (computed / measured + 1.0) + 0.05 * abs(deviation)
        assert deviation == pytest.approx(100.0 * (computed / measured - 1.0), abs=rounding)


def test_rows_of_other_codes_are_those_of_a_run(tmp_path):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(ROOT / "docs"), *sys.path])
        import validation_codes
        from validation_results import Finished
    case = ROOT / "cases" / "validation" / "llavori_2026.yaml"
    with runs_here():
        done = command("run", case, "--out", tmp_path, overrides=[*FAST, "output.paraview=false"])
    assert done.exit_code == 0, done.stderr
    with (FIGURES / "validation_codes.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.reader(file) if row[0] in ("test", "Llavori 2026")]
    assert rows[0] == list(validation_codes.HEADINGS)
    assert rows[1:] == validation_codes.partial_slip(Finished(tmp_path))


def check(validate, stored, name, tmp_path, coarse=()):
    """Assert that a run of today finds what is in the table, within both estimates of error."""
    case = ROOT / "cases" / f"{validate.RUNS[name].case}.yaml"
    with runs_here():
        done = command("run", case, "--out", tmp_path / name, overrides=[*QUIET, *coarse])
    assert done.exit_code == 0, done.stderr
    run = validate.Finished(tmp_path / name)
    own = [entry for entry in validate.comparisons() if entry.run == name]
    assert own
    for entry in own:
        value, error = entry.computed(run)
        stated, around = number(stored[entry.test, entry.quantity]["computed"])
        assert value == pytest.approx(stated, abs=around + error + 5e-3 * stated)


def test_the_groove_of_a_ring_is_that_of_the_table(validate, stored, tmp_path):
    check(validate, stored, "cruzado_2010", tmp_path)


@pytest.mark.slow
def test_the_scar_of_a_cylinder_is_that_of_the_table(validate, stored, tmp_path):
    check(validate, stored, "mccoll_2004", tmp_path, COARSE)
