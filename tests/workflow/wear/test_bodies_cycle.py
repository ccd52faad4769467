"""Tests of bodies that wear under legs or a load file: the case, its loads, and its results."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.marks import slow
from tests.workflow.command_line import command
from workflow.analyses.wear import ANALYSIS
from workflow.analyses.wear.structures.bodies.case import BodiesWearCase, LineBodiesWearCase
from workflow.analyses.wear.structures.bodies.model import source_of
from workflow.analyses.wear.translation import face_contact
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.kinds import parse_case, template

AREA, LINE = template("bodies_wear"), template("line_wear")
SMALL = ["contact.grid=[24, 24]", "contact.size=[1 mm, 1 mm]", "contact.method=full"]
FORCED = "{legs: [{P: 50 N, Qx: 10 N, increments: 2}, {Qx: -10 N, increments: 4}]}"
NO_STRESS = "stress={section: none, life: {parameter: none}}"
PLAIN = [NO_STRESS, "output.figures=false", "output.paraview=false"]


def area(load_path: str, *overrides: str) -> BodiesWearCase:
    case = parse_case(AREA, "area.yaml", [*SMALL, f"load_path={load_path}", *overrides])
    assert isinstance(case, BodiesWearCase)
    return case


def run(case: BodiesWearCase | LineBodiesWearCase, folder: Path) -> dict[str, Any]:
    path = folder.with_suffix(".yaml")
    path.write_text(dump_case(case), encoding="utf-8")
    assert command("run", path, "--out", folder).exit_code == 0
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text())
    return summary


def test_legs_begin_where_the_last_one_ends() -> None:
    """A constant force needs to be given once; Qx swings between its two ends."""
    case = area(FORCED)
    assert parse_case(dump_case(case), "dump") == case
    source = source_of(case)
    (cycle,) = source.unworn()
    np.testing.assert_allclose(cycle.loads.P, 50.0)
    np.testing.assert_allclose(cycle.loads.Qx, [0.0, 10.0, 5.0, 0.0, -5.0, -10.0], atol=1e-12)
    assert not cycle.slip.any()
    assert source.peak == 1
    assert source.drive.motion == (False, False, False, True, True, True)
    free = source_of(area(FORCED.replace("]}", "], tilt: free}")))
    assert free.drive.motion == (False, False, False, False, False, True)


def test_a_file_is_the_same_path_as_legs(tmp_path: Path) -> None:
    legs = source_of(area(FORCED))
    columns = legs.unworn()[0].loads
    rows = "\n".join(f"{P},{Qx}" for P, Qx in zip(columns.P, columns.Qx, strict=True))
    (tmp_path / "cycle.csv").write_text(f"P,Qx\n{rows}\n")
    text = str(tmp_path / "case.yaml")
    case = parse_case(AREA, text, [*SMALL, "load_path={file: cycle.csv}"])
    np.testing.assert_array_equal(source_of(case).drive.values(columns), legs.drive.values(columns))


@pytest.mark.parametrize("method", ["normal", "full"])
def test_a_stroke_is_legs_of_motion(tmp_path: Path, method: str) -> None:
    """A stroke and legs back and forth about the first contact give the same worn depths."""
    legs = (
        "{legs: [{P: 50, shift_x: 25 um, shift_y: 0, increments: 2}, "
        "{shift_x: -25 um, increments: 2}]}"
    )
    settings = [f"contact.method={method}", "wear.cycles=200", "wear.step.cycles=100", *PLAIN]
    depths = {}
    for name, path in (("stroke", "{P: 50, stroke: 50 um, increments: 2}"), ("legs", legs)):
        run(area(path, *settings), tmp_path / name)
        with h5py.File(tmp_path / name / "results.h5") as file:
            depths[name] = file["surfaces/interface/00002/body_2"][()]
    # Legs begin with the way back: a cycle has no beginning, but wear steps have an order.
    scale = np.ptp(depths["stroke"] - depths["stroke"].min())
    assert scale > 0.0
    np.testing.assert_allclose(depths["legs"], depths["stroke"], atol=1e-2 * scale)


@pytest.mark.parametrize(
    ("load_path", "overrides", "named"),
    [
        ("{legs: [{P: 5, Qx: 1}], P: 5}", (), "load_path"),
        ("{legs: [{Qx: 1}]}", (), "load_path.legs"),
        ("{legs: [{P: 0, shift_x: 1 um}]}", (), "load_path"),
        (FORCED, ("contact.method=normal",), "contact.method"),
        ("{legs: [{approach: 1 um}]}", ("loops.amplitude=1 um",), "loops"),
        ("{legs: [{P: 5, shift_x: 1 mm}, {shift_x: -1 mm}]}", (), "grid"),
    ],
)
def test_wrong_load_paths_are_refused(load_path: str, overrides: tuple[str], named: str) -> None:
    with pytest.raises(CaseError, match=named):
        area(load_path, *overrides)


def test_friction_that_does_not_carry_the_force_ends_the_run(tmp_path: Path) -> None:
    """Imposed forces do not determine a sliding distance, so the run ends with a message."""
    case = area(FORCED.replace("10 N", "30 N"), *PLAIN)
    path = tmp_path / "case.yaml"
    path.write_text(dump_case(case), encoding="utf-8")
    result = command("run", path, "--out", tmp_path / "out")
    assert result.exit_code == 3
    assert "friction cannot carry Qx" in result.output


def test_a_rigid_punch_held_at_its_approach_wears_itself_free(tmp_path: Path) -> None:
    """An elastic cylinder on a rigid flat starts with Hertz's force, which then falls."""
    text = [
        "materials.body_1=rigid",
        "contact={grid: [128, 1], size: 2 mm, method: normal}",
        "load_path={legs: [{P: 50 N/mm, shift_x: 20 um}, {shift_x: -20 um}]}",
        *("wear.cycles=100", "wear.step.cycles=50", *PLAIN),
    ]
    case = parse_case(LINE, "line.yaml", text)
    assert isinstance(case, LineBodiesWearCase)
    found = run(case, tmp_path / "out")["interface"]
    modulus = 115e3 / (1.0 - 0.29**2)
    hertz = np.sqrt(50.0 * modulus / (np.pi * 10.0))
    assert found["peak_pressure"]["unworn"] == pytest.approx(hertz, rel=5e-3)
    assert found["depth_2"] > 0.0


def test_the_force_of_a_held_approach_is_reported_after_wear(tmp_path: Path) -> None:
    """The force is reported for the final surfaces, although nothing slides at peak load."""
    approach = "{legs: [{approach: 1 um, shift_x: 4 um}, {shift_x: 0}, {approach: 1.2 um}]}"
    settings = ["contact.method=normal", "wear.cycles=2e4", "wear.step.cycles=1e4", *PLAIN]
    found = run(area(approach, *settings), tmp_path / "out")["interface"]["peak_load"]
    modulus = 0.5 * 115e3 / (1.0 - 0.29**2)
    hertz = 4.0 / 3.0 * modulus * np.sqrt(10.0) * 1.2e-3**1.5
    assert found["unworn"]["P"] == pytest.approx(hertz, rel=0.05)
    assert 0.0 < found["worn"]["P"] < 0.95 * found["unworn"]["P"]


@pytest.mark.slow
def test_what_forces_dissipate_only_the_half_space_knows(tmp_path: Path) -> None:
    """Slip and energies that imposed forces do not determine are left out of all output."""
    settings = ["wear.cycles=200", "wear.step.cycles=200", NO_STRESS, "output.paraview=false"]
    found = run(area(FORCED, *settings), tmp_path / "out")["interface"]
    assert found["energy_per_cycle"].keys() == {"half_space"}
    assert found["energy_per_cycle"]["half_space"] > 0.0
    assert found["by_increment"]["Edx"].keys() == {"half_space"}
    assert found["by_increment"]["Qx"].keys() == {"half_space", "structure"}
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        structure = file["structure/interface"]
        assert "slip" not in structure
        assert not {"Edx", "Edy"} & structure["load_history"].keys()
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "energy dissipated in a cycle, unworn" in page


# --- increments -----------------------------------------------------------------------------------

COARSE = "contact.grid=[16, 16]", "contact.size=[0.6 mm, 0.6 mm]"
RISING = "{legs: [{P: 80 N, Qx: 20 N}, {P: 40 N, Qx: 0 N}]}"
TURNING = "{legs: [{P: 60 N, Qx: 12 N}, {P: 40 N, Qx: -12 N}]}"


def cycle_energy(case: BodiesWearCase, parts: int = 1) -> float:
    """Return the energy that an unworn cycle dissipates, with increments in ``parts`` [N mm]."""
    source = source_of(case, parts)
    _, first = face_contact(case, source.faces[0]).contact.begin(source.unworn()[0], 1.0)
    return float(first.energy.sum())


@pytest.mark.parametrize(
    ("legs", "whole", "accuracy"), [(TURNING, 0.06, 0.05), slow(RISING, 0.5, 0.02)]
)
def test_increments_are_split_until_they_leave_the_accuracy(legs, whole, accuracy):
    """The template's increments, one per leg, have a far larger error."""
    case = area(legs, *COARSE, f"contact.accuracy={accuracy}")
    many = cycle_energy(case, 16)
    chosen, record = ANALYSIS.choose(case)
    assert isinstance(chosen, BodiesWearCase)
    assert record is not None
    assert record["met"]
    assert cycle_energy(case) > (1.0 + whole) * many
    assert cycle_energy(chosen) == pytest.approx(many, rel=accuracy)
    increments = [leg.increments for leg in chosen.load_path.legs]
    assert list(record["chosen"].values()) == increments


def test_what_should_stick_hardly_slips() -> None:
    """Q rises with P by less than µ, so nothing slips (Mindlin and Deresiewicz 1953)."""
    case = area("{legs: [{P: 80 N, Qx: 4 N}, {P: 40 N, Qx: 0 N}]}", *COARSE)
    chosen, _ = ANALYSIS.choose(case)
    assert isinstance(chosen, BodiesWearCase)
    assert cycle_energy(chosen) < 0.02 * cycle_energy(case)


def test_accuracy_and_strokes_that_slide_take_the_increments_as_they_are() -> None:
    """Sliding shear at a constant pressure has no error due to its increments."""
    for case in (
        area("{P: 50, stroke: 50 um, increments: 2}"),
        area(TURNING, "contact.accuracy=1"),
    ):
        assert ANALYSIS.choose(case) == (case, None)


@pytest.mark.slow
def test_a_run_estimates_the_error_of_the_rows_of_a_file(tmp_path: Path) -> None:
    """Rows of a file are not split, and the actual, nonzero error of the volume is reported."""
    (tmp_path / "cycle.csv").write_text("P,Qx\n60,12\n40,-12\n")
    settings = [
        *SMALL,
        *COARSE,
        "load_path={file: cycle.csv}",
        "wear.cycles=20",
        "wear.step.cycles=20",
    ]
    case = parse_case(AREA, str(tmp_path / "case.yaml"), [*settings, *PLAIN])
    assert isinstance(case, BodiesWearCase)
    found = run(case, tmp_path / "out")["interface"]
    many = cycle_energy(case, 24)
    true = found["energy"] / 20.0 / many - 1.0
    assert found["increments_error"]["energy"] == pytest.approx(true, rel=1.0)
    assert found["increments_error"]["energy"] > 0.05
