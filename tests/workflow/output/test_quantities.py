"""Main results of every analysis exist as numbers, in the units of its datasets."""

import json
import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from sa_solver import LoadHistory
from tests.marks import slow
from tests.workflow.command_line import command
from tests.workflow.rig.test_friction_rig import SPECIMENS
from tests.workflow.scenes import BALL, RIG_OF_THESIS, ROLLER_LOADS, ROLLER_WEAR
from tests.workflow.shell.test_kills import PADS_THAT_WEAR
from tests.workflow.vibration.time_scenes import JOINT
from workflow.analyses.wear.output.quantities import _load_ranges
from workflow.analyses.wear.worn.worn_structure import load_ranges
from workflow.case.text.readable import readable
from workflow.case.text.typeset import number, typeset, unparted
from workflow.case.units import to_base
from workflow.kinds import ANALYSES, analyses, analysis_of, load_case
from workflow.messages.warning_kinds import kinds_in
from workflow.report.page import html, unbroken
from workflow.report.run_page import run_page
from workflow.report.writing import report_data_of, write_report
from workflow.shell.output.summary import required_number

QUIET = ("output.figures=false", "output.paraview=false")
VIBRATION = (
    RIG_OF_THESIS
    + """\
title: Slider that shakes
analysis: vibration
joint: {law: jenkins, normal_load: 60 N, friction: 0.88, stiffness: 45 N/um}
forces: [30 N]
frequencies: [90 Hz, 130 Hz]
resolution: {harmonics: 1, samples: 64}
"""
)
# A small case of every analysis, with the files that it names.
CASES_OF = {
    "contact": BALL,
    "time": JOINT,
    "vibration": VIBRATION,
    "wear": ROLLER_WEAR,
    "specimens": SPECIMENS,
    "vibration_wear": PADS_THAT_WEAR,
}
QUICK = "contact", "vibration"
# Number of quantities that a reader takes in at a glance.
MOST_LEADING = 8


def run(folder: Path, text: str, *overrides: str) -> Path:
    """Return the folder of a finished run."""
    files = {"case.yaml": text, "loads.csv": ROLLER_LOADS, "specimens.yaml": SPECIMENS}
    for name, content in files.items():
        (folder / name).write_text(content, encoding="utf-8")
    ended = command(
        "run", folder / "case.yaml", "--out", folder / "out", overrides=[*QUIET, *overrides]
    )
    assert ended.exit_code == 0, ended.stderr
    return folder / "out"


def units_of(results: Path) -> dict[str, set[str]]:
    """Return units of all datasets of a file, by the last part of their names."""
    units: dict[str, set[str]] = {}

    def collect(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            units.setdefault(name.rpartition("/")[2], set()).add(str(item.attrs["unit"]))

    with h5py.File(results) as file:
        file.visititems(collect)
    return units


@pytest.mark.parametrize("name", [n if n in QUICK else slow(n) for n in CASES_OF])
def test_main_results_are_numbers_in_the_units_of_the_results(tmp_path, name):
    out = run(tmp_path, CASES_OF[name])
    case, summary = load_case(out / "case.yaml"), json.loads((out / "summary.json").read_text())
    assert analysis_of(case).name == name
    quantities = analysis_of(case).quantities(case, summary)
    assert len(quantities) >= 4
    leading = [quantity for quantity in quantities if quantity.leading]
    assert 0 < len({quantity.name for quantity in leading}) <= MOST_LEADING
    text = run_page(report_data_of(out, figures=False))
    top = text.partition("<nav>")[0]
    assert html(unparted(typeset(case.question))) in top
    links = set(re.findall(r'href="#([^"]+)"', text))
    assert {kind.code for kind in kinds_in(summary["warnings"])} <= links
    assert links <= set(re.findall(r' id="([^"]+)"', text))
    for quantity in leading:
        value = required_number(summary, quantity.path)
        shown = readable(value, quantity.unit, quantity.error, quantity.everyday)
        assert html(quantity.name) in top
        assert unbroken(number(str(shown))) in top
    assert len({q.path for q in quantities}) == len({(q.group, q.name) for q in quantities})
    units, compared = units_of(out / "results.h5"), 0
    for quantity in quantities:
        required_number(summary, quantity.path)
        assert quantity.error is None or (quantity.error >= 0.0 and quantity.error_of)
        if quantity.everyday:
            to_base(f"1 {quantity.everyday}", quantity.unit)
        dataset = quantity.path.rpartition(".")[2]
        if dataset in units:
            assert quantity.unit in units[dataset], quantity
            compared += 1
    assert compared
    if name not in QUICK:
        page = write_report(out).read_text("utf-8")
        assert all(html(quantity.name) in page for quantity in quantities)
        assert page.count("<figure ") > 1


def test_every_analysis_has_its_case_here():
    assert {analysis.name for analysis in analyses()} == set(CASES_OF) == set(ANALYSES)


def test_load_ranges_have_their_increments():
    """Nothing acts along x at the increment of the largest P, where results are reported."""
    zero, sliding = np.zeros(4), np.zeros(4, dtype=bool)
    force, across = np.array([4e3, 3e3, 3e3, 3e3]), np.array([0.0, -1e3, 0.0, 500.0])
    ranges = load_ranges(LoadHistory(force, across, *[zero] * 6, sliding))
    assert ranges["P"] == {"least": 3e3, "least_at": 2, "largest": 4e3, "largest_at": 1}
    assert ranges["Qx"] == {"least": -1e3, "least_at": 2, "largest": 500.0, "largest_at": 4}
    summary = {"per_length": False, "left": {"load_range": {"unworn": ranges, "worn": ranges}}}
    found = {q.name: q for q in _load_ranges(summary, "left")}
    assert {name.split()[3] for name in found} == {"Qx"}
    assert found["least tangential force Qx in a cycle, unworn"].where == "increment 2"
