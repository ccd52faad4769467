"""Tests of cases in time: entries, joints that wear under a stroke, commands."""

import csv
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.workflow.conftest import invoke, manifest_has_all
from tests.workflow.vibration.time_scenes import (
    AMPLITUDE,
    HAMMER,
    JOINT,
    LOOP_ENERGY,
    RIG,
    ROUNDING,
    STIFFNESS,
    refused,
    run,
)
from workflow.analyses.time.joint_model import JointModel
from workflow.errors import CaseError
from workflow.kinds import load_case, parse_case
from workflow.models.rig.joint import steady_loop

CASES = Path(__file__).parents[3] / "cases"
LAWS = ("bouc_wen", "jenkins", "uniform_iwan", "four_parameter_iwan")
# --- the case -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "override", "named"),
    [
        (JOINT, "ageing={energy: 1 J, cycles: 5}", "ageing"),
        (JOINT, "energies=[1 J, 0 J]", "energies"),
        (JOINT, "joint={law: bouc_wen, sigma: 0.2}", "joint.sigma"),
        (RIG, "structure.springs=[1]", "structure.springs"),
        (RIG, "excitation.mass=3", "excitation.mass"),
        (RIG, "integration.step=1 ms", "integration.step"),
        (RIG, "ageing={energy: 1 J}|energies=[2 J]", "energies"),
        (RIG, f"{HAMMER}|excitation.record=1 ms", "excitation.record"),
    ],
)
def test_a_wrong_case_is_refused(text, override, named):
    with pytest.raises(CaseError, match=named):
        parse_case(text, "case.yaml", override.split("|"))


@pytest.mark.parametrize("rows", ["time,force\n0,0\n0,1\n", "time,velocity\n0,0\n1,1\n"])
def test_a_wrong_record_is_refused(tmp_path, rows):
    (tmp_path / "force.csv").write_text(rows, encoding="utf-8")
    recorded = "excitation={kind: recorded, file: force.csv}"
    with pytest.raises(CaseError, match=r"force\.csv"):
        parse_case(RIG, str(tmp_path / "case.yaml"), [recorded])


# --- the joint ----------------------------------------------------------------------------------


def test_parameters_follow_the_papers():
    """Fantetti 2019, table 4.2, at 2800 J, its kp per kJ; Li 2020, table 3, test 4, at 6 kJ."""
    parameters = JointModel.of(load_case(CASES / "rig_bouc_wen.yaml")).parameters(2.8e6)
    assert parameters == pytest.approx(
        {
            "friction": 0.11 * (1.0 + 0.26 * np.log(1.3e9 * 2800.0 + 1.0)),
            "stiffness": 27.3e3 * (1.0 + 1.32 * np.exp(-150.0 / 2800.0)),
            "residual_stiffness": 0.88e3 * (1.0 + 0.24 * 2.8),
            "normal_load": 60.0,
        },
        rel=ROUNDING,
    )
    parameters = JointModel.of(load_case(CASES / "bolted_joint_test4.yaml")).parameters(6e6)
    slow, fast = np.exp(-0.3 * 6.0), np.exp(-5.0 * 6.0)
    assert parameters == pytest.approx(
        {
            "friction": 0.34 * (1.12 - 0.12 * (0.5 * slow + 0.5 * fast)),
            "stiffness": 115e3 * (1.31 - 0.31 * (0.8 * slow + 0.2 * fast)),
            "residual_stiffness": 0.0,
            "normal_load": 745.0 * (0.72 + 0.28 * slow),
        },
        rel=ROUNDING,
    )


def test_a_table_of_factors_multiplies_what_the_joint_begins_with():
    table = "evolution.friction={kind: table, energy: [0 J, 2 J], factor: [1, 3]}"
    model = JointModel.of(parse_case(JOINT, "case.yaml", [table]))
    assert model.parameters(1e3)["friction"] == pytest.approx(1.0, rel=ROUNDING)
    assert model.parameters(1e9)["friction"] == pytest.approx(1.5, rel=ROUNDING)


def test_a_table_of_loops_takes_the_place_of_friction_and_stiffness(tmp_path):
    """The table is as a wear run writes it: kt in N/mm, energy in J."""
    rows = "energy [J],P [N],kt [N/mm],mu [1]\n0,60,1e4,0.2\n2,60,3e4,0.6\n"
    (tmp_path / "loops.csv").write_text(rows, encoding="utf-8")
    case = parse_case(JOINT, str(tmp_path / "case.yaml"), ["evolution={file: loops.csv}"])
    parameters = JointModel.of(case).parameters(1e3)
    assert parameters["friction"] == pytest.approx(0.4, rel=ROUNDING)
    assert parameters["stiffness"] == pytest.approx(2e4, rel=ROUNDING)
    assert parameters["normal_load"] == 100.0


@pytest.mark.parametrize("law", LAWS)
def test_a_marched_loop_has_the_energy_of_its_law(law):
    """Its area by trapezoids agrees to second order in 720 points a cycle."""
    more = ["joint.chi=-0.5", "joint.beta=1"] if law == "four_parameter_iwan" else []
    law_of_case = JointModel.of(parse_case(JOINT, "case.yaml", [f"joint.law={law}", *more])).at(0.0)
    displacement, force, dissipated = steady_loop(law_of_case, AMPLITUDE)
    assert dissipated == pytest.approx(float(law_of_case.loop_energy(AMPLITUDE)), rel=1e-9)
    assert np.trapezoid(force, displacement) == pytest.approx(dissipated, rel=1e-4)


def test_a_joint_ages_by_the_energy_of_its_loops(tmp_path):
    """Without evolution every cycle is like the first, 4 µN (A - µN/kt)."""
    summary = run(tmp_path, JOINT)
    assert summary["energy"] == pytest.approx(1000.0 * LOOP_ENERGY, rel=1e-9)
    assert summary["duration"] == pytest.approx(100.0)
    (first, last) = summary["states"]
    assert (first["cycles"], last["cycles"]) == (0.0, pytest.approx(1000.0, rel=1e-9))
    assert last["energy_per_cycle"] == pytest.approx(LOOP_ENERGY, rel=ROUNDING)
    assert last["stroke"] == pytest.approx(2.0 * AMPLITUDE, rel=ROUNDING)
    assert last["extracted"]["friction"] == pytest.approx(0.5, rel=1e-9)
    assert last["extracted"]["stiffness"] == pytest.approx(STIFFNESS, rel=1e-9)
    assert summary["ageing"]["stretch"]["difference"] == pytest.approx(0.0, abs=1e-6)


def test_ageing_by_energy_ends_there(tmp_path):
    summary = run(tmp_path, JOINT, "ageing={energy: 2 J}", "energies=[0 J, 1 J, 2 J]")
    assert [state["energy"] for state in summary["states"]] == [0.0, 1e3, 2e3]
    assert summary["cycles"] == pytest.approx(2e3 / LOOP_ENERGY, rel=1e-9)


def test_a_joint_that_never_slides_cannot_be_aged_by_energy(tmp_path):
    code, message = refused(tmp_path, JOINT, "drive.stroke=1 um", "ageing={energy: 1 J}")
    assert code == 2
    assert "never reached" in message
    summary = run(tmp_path / "cycles", JOINT, "drive.stroke=1 um")
    assert summary["energy"] == 0.0
    assert summary["states"][-1]["energy_per_cycle"] == 0.0


def test_files_of_a_joint(tmp_path):
    """Datasets have unit and description; tables hold the same; a second run replaces them."""
    evolution = "evolution.friction={kind: linear, slope: 0.1 1/J}"
    run(tmp_path, JOINT, evolution, "energies=[0 J, 1 J]", "output.figures=true")
    folder = tmp_path / "out"
    with h5py.File(folder / "results.h5") as file:

        def check(name, item):
            if isinstance(item, h5py.Dataset):
                assert item.attrs["unit"], name
                assert item.attrs["description"], name

        file.visititems(check)
        loop = file["states/00001/loop"]
        assert file["states/00001"].attrs["energy"] == 1e3
        table = np.loadtxt(folder / "loop_00001.csv", delimiter=",", skiprows=1)
        np.testing.assert_allclose(table[:, 1], loop["force"][()], rtol=1e-8, atol=1e-9)
        mu = file["evolution/friction"][()]
        np.testing.assert_allclose(mu, 0.5 * (1.0 + 1e-4 * file["evolution/energy"][()]))
    with (folder / "evolution.csv").open(encoding="utf-8") as stream:
        assert next(csv.reader(stream))[:3] == [
            "energy [N mm]",
            "cycles [1]",
            "energy_per_cycle [N mm]",
        ]
    assert manifest_has_all(folder)
    assert sorted(path.name for path in (folder / "figures").iterdir()) == [
        "evolution.png",
        "loops.png",
    ]
    run(tmp_path, JOINT)
    assert len(list(folder.glob("loop_*.csv"))) == 2


def test_reported_values_stand_next_to_the_computed(tmp_path):
    reported = "reported=[{quantity: states.-1.energy_per_cycle, value: 3 mJ, source: a test}]"
    (found,) = run(tmp_path, JOINT, reported)["reported"]
    assert (found["reported"], found["computed"]) == (3.0, pytest.approx(LOOP_ENERGY))


def test_a_preload_worn_to_nothing_ends_the_wear(tmp_path):
    """With N = N0 (1 - E/2 J), energy tends to 2 J, and the last loops transmit nothing."""
    wear = "evolution.normal_load={kind: linear, slope: -0.5 1/J}"
    summary = run(tmp_path, JOINT, wear, "ageing.cycles=1e6", "energies=[0 J, 1 J]")
    last = summary["states"][-1]
    assert summary["energy"] == pytest.approx(2e3, rel=1e-6)
    assert summary["energy"] <= 2e3
    assert last["normal_load"] == pytest.approx(0.0, abs=1e-3)
    assert last["extracted"]["friction"] is None or last["force"] > 0.0


def test_a_loop_is_read_as_a_measured_one(tmp_path):
    run(tmp_path, JOINT)
    ended = invoke("loops", tmp_path / "out" / "loop_00000.csv", "--normal-load", "100 N")
    assert ended.exit_code == 0, ended.stderr
    assert f"{LOOP_ENERGY:.4g}" in ended.stdout


# --- commands -----------------------------------------------------------------------------------
