"""Tests of run-time forecasts: after the first steps of a run, and by a check before it."""

import json
import re
from math import ceil
from pathlib import Path
from typing import Any

import pytest

from tests.marks import slow
from tests.workflow.command_line import command
from workflow.analyses.wear.run_time import ExpectedSteps, steps_of
from workflow.analyses.wear.structures import structure_of
from workflow.kinds import analysis_of, load_case
from workflow.shell.forecast import Forecast, in_words
from workflow.shell.run_time import RunTime
from workflow.shell.terminal.reporter import Reporter

CASES = Path("cases")


class Clock:
    """Clock whose time the test sets."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    reported = Clock()
    monkeypatch.setattr("time.perf_counter", reported)
    monkeypatch.setattr(Forecast.__init__, "__defaults__", (reported,))
    return reported


def test_the_remaining_time_follows_from_the_share(clock: Clock) -> None:
    forecast = Forecast()
    assert forecast.left is None
    clock.now += 18.0
    forecast.reach(1.0 / 40.0)
    assert forecast.left == pytest.approx(39 * 18.0)
    forecast.reach(1.0)
    assert forecast.left == 0.0


def test_an_earlier_run_does_not_count_in_the_forecast(clock: Clock) -> None:
    """After three quarters at once and a tenth in 10 s, the last 15 % take 15 s."""
    forecast = Forecast()
    forecast.reach(0.75)
    forecast.go_on()
    assert forecast.left is None
    clock.now += 10.0
    forecast.reach(0.85)
    assert forecast.left == pytest.approx(15.0)


@pytest.mark.parametrize(
    ("seconds", "reported"), [(0.0, "a few seconds"), (17.0, "20 s"), (60.0 * 3600.0, "2 days")]
)
def test_times_are_rounded_to_one_digit(seconds: float, reported: str) -> None:
    assert in_words(seconds) == reported


def test_a_forecast_is_repeated_only_where_it_changes(clock: Clock, tmp_path: Path) -> None:
    """Of ten steps of 60 s the seventh takes ten times as long; the first does not count."""
    reporter = Reporter(tmp_path / "log", expected=RunTime(after=30.0))
    with reporter.course("wear"):
        for step in range(1, 11):
            clock.now += 600.0 if step == 7 else 60.0
            reporter.reached(step / 10.0, f"step {step}")
    reported = [line[9:] for line in (tmp_path / "log").read_text().splitlines()]
    # 9 steps of 60 s and 30 s; after the seventh 3 of 150 s and 30 s, 1440 s in place of 630.
    assert reported == ["wear, step 1: about 10 min to go", "wear, step 7: about 8 min to go"]


# --- the loops of every analysis ------------------------------------------------------------------


@pytest.fixture
def every_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make forecasts for runs of any length, from their first step on."""
    for least in ("FIRST_WORK", "FIRST_STEP", "SHORT_RUN"):
        monkeypatch.setattr(f"workflow.shell.terminal.reporter.{least}", 0.0)


SHORT = ["output.figures=false", "output.paraview=false"]


@pytest.mark.parametrize(
    ("name", "settings", "reported"),
    [
        ("cylinder_wear.yaml", ["wear.cycles=1.2e5"], r"wear, jump 1 of about 3, 4e\+04 cycles"),
        slow("sphere_normal.yaml", [], r"contact, increment \d+ of \d+"),
        slow("rig_force_75N.yaml", ["energies=[0 J]"], r"steady states, 0 J: period \d+"),
        slow("rig_hammer_7N.yaml", ["energies=[0 J]"], r"motions, 0 J"),
        slow("rig_two_dof.yaml", ["forces=[1 N]"], r"vibration, 1 N: [\d.]+ Hz"),
        slow("specimens_coarse.yaml", [], r"specimens, [\d.]+ N"),
    ],
)
def test_runs_of_every_kind_report_progress(every_step, tmp_path, name, settings, reported):
    out = tmp_path / "out"
    settings = [*settings, *(SHORT if "paraview" in (CASES / name).read_text() else SHORT[:1])]
    done = command("run", CASES / name, "--out", out, overrides=settings)
    assert done.exit_code == 0, done.stderr
    assert re.search(rf"{reported}: (about [\d.]+ \w+|a few seconds) to go", done.stderr)


# --- before it begins -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "true"),
    [
        ("bolted_joint_test2", 4),
        ("cylinder_wear", 8),
        ("dovetail", 60),
        ("dovetail_2d", 15),
        ("dovetail_small", 12),
        ("line_dissimilar", 14),
        ("rig_computed_wear", 51),
        ("rig_force_75N", 9),
        ("rig_hammer_60N", 15),
        ("rig_harmonic_balance", 400),
        ("rig_reduced", 18),
        ("rig_two_dof", 50),
        ("ring_of_blades", 8),
        ("rig_wear_specimens", 170),
        ("rig_wear_vibration", 62),
        ("specimens_rig", 28),
        ("specimens_wear", 27),
        ("sphere_fretting", 6),
        ("sphere_wear", 10),
    ],
)
def test_the_estimated_run_time_has_the_right_order_of_magnitude(name: str, true: float) -> None:
    """The reference is processor seconds of shipped cases on one core, with an empty cache."""
    case = load_case(CASES / f"{name}.yaml")
    reported = analysis_of(case).run_time(case).seconds
    assert true / 5.0 < reported < 5.0 * true


@pytest.mark.parametrize(
    ("name", "finer"),
    [
        ("dovetail", "mesh.flank_nodes=[41, 45]"),
        ("dovetail", "wear.step.cycles=2000"),
        ("dovetail", "contact.grid=[512, 1024]"),
        ("cylinder_wear", "wear.step.cycles=100"),
        ("sphere_fretting", "contact.grid=[512, 512]"),
        ("rig_hammer_60N", "integration.step=1 us"),
        ("rig_harmonic_balance", "resolution.harmonics=15"),
        ("rig_wear_specimens", "wear.cycles=[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14]"),
        ("specimens_rig", "mesh.size=0.3 mm"),
    ],
)
def test_more_work_takes_longer(name: str, finer: str) -> None:
    path = CASES / f"{name}.yaml"
    case, more = load_case(path), load_case(path, [finer])
    times = [analysis_of(each).run_time(each).seconds for each in (case, more)]
    assert times[1] > 2.0 * times[0]


NO_PICTURES = "output={figures: false, paraview: false, report: false}"


def steps_expected(case: Any) -> ExpectedSteps:
    return steps_of(case, structure_of(case).extent(case))


@pytest.mark.parametrize(("cycles", "tolerance"), [(1e5, "1 %"), (1e5, "0.1 %"), (1e7, "1 %")])
def test_jumps_on_given_slips_are_counted(cycles: float, tolerance: str, tmp_path: Path) -> None:
    """The estimated number of automatic jumps is within a factor of three of the run's."""
    path, out = CASES / "cylinder_wear.yaml", tmp_path / "out"
    changes = ["wear.step={kind: implicit}", f"wear.cycles={cycles}", f"wear.tolerance={tolerance}"]
    expected = steps_expected(load_case(path, changes))
    changes += [NO_PICTURES, "error_budget=known"]
    done = command("run", path, "--out", out, overrides=changes)
    assert done.exit_code == 0, done.stderr
    jumps = json.loads((out / "summary.json").read_text("utf-8"))["jumps"]
    assert not expected.unknown
    assert jumps / 3.0 < expected.jumps < 3.0 * jumps


@pytest.mark.parametrize(
    ("settings", "jumps"),
    [
        (["wear.step.cycles=500", "wear.cycles=1e5"], 200),
        (["wear.step={kind: implicit, depth: 2 um}", "wear.stop.depth=0.1 mm"], 50),
        (["wear.step={kind: implicit, volume: 1 mm^3}", "wear.stop.volume=8 mm^3"], 8),
    ],
)
def test_jumps_of_a_given_size_are_counted(settings: list[str], jumps: int) -> None:
    expected = steps_expected(load_case(CASES / "cylinder_wear.yaml", settings))
    assert (expected.jumps, expected.unknown) == (jumps, "")


def test_check_says_for_how_many_jumps_its_time_holds() -> None:
    """The time is given for a certain number of jumps, which is reported with it."""
    path, settings = CASES / "cylinder_wear.yaml", ["wear.step={kind: implicit, depth: 2 um}"]
    expected = steps_expected(load_case(path, settings))
    assert expected.unknown
    (line,) = re.findall(
        r"^  time +(.*)$", command("check", path, overrides=settings).stdout, re.MULTILINE
    )
    assert str(ceil(expected.jumps)) in line
    assert expected.unknown in line
