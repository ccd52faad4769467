"""Cases in time: joints that wear at a stroke, and rigs that are shaken, hit or driven."""

import csv
import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.marks import slow
from tests.workflow.conftest import invoke, manifest_has_all
from workflow.analyses.time.figures import ring_down
from workflow.analyses.time.joint import steady_loop
from workflow.analyses.time.joint_model import JointModel
from workflow.analyses.time.memory import memory
from workflow.analyses.time.outcome import Contents
from workflow.chart.axes import axes_of
from workflow.errors import CaseError, UserError
from workflow.kinds import load_case, parse_case, template
from workflow.runs.verify import verify_cases

CASES = Path(__file__).parents[2] / "cases"
LAWS = ("bouc_wen", "jenkins", "uniform_iwan", "four_parameter_iwan")
# What closed forms and marched cycles leave: rounding.
ROUNDING = 1e-12

JOINT = """\
title: Spring and slider
analysis: time
structure: {kind: joint}
joint: {law: jenkins, normal_load: 100 N, friction: 0.5, stiffness: 10 N/um}
drive: {stroke: 40 um, frequency: 10 Hz}
ageing: {cycles: 1000}
output: {figures: false}
"""
# Loop of the joint: 4 µN (A - µN/kt).
LIMIT, STIFFNESS, AMPLITUDE = 50.0, 1e4, 0.02
LOOP_ENERGY = 4.0 * LIMIT * (AMPLITUDE - LIMIT / STIFFNESS)

RIG = """\
title: Rig
analysis: time
structure: {kind: rig, masses: [20 kg, 1 kg], springs: [1 N/um, 200 N/um], damping_ratio: 0.1}
joint: {law: jenkins, normal_load: 100 N, friction: 0.5, stiffness: 10 N/um}
excitation: {kind: harmonic, force: 50 N, frequency: 80 Hz}
integration: {step: 100 us}
output: {figures: false}
"""
MASS, STIFF = np.diag([0.02, 0.001]), np.array([[201e3, -200e3], [-200e3, 200e3]])
HAMMER = (
    "excitation={kind: hammer, force: 100 N, duration: 1 ms, record: 0.5 s, band: [50 Hz, 300 Hz], "
    "highest: 1 kHz}"
)


def run(folder: Path, text: str, *overrides: str):
    """The summary of a run of a case."""
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text, encoding="utf-8")
    settings = [part for override in overrides for part in ("--set", override)]
    ended = invoke("run", folder / "case.yaml", "--out", folder / "out", *settings, "--force")
    assert ended.exit_code == 0, ended.stderr
    return json.loads((folder / "out" / "summary.json").read_text(encoding="utf-8"))


def refused(folder: Path, text: str, *overrides: str) -> tuple[int, str]:
    """Exit code and message of a run that fails."""
    (folder / "case.yaml").write_text(text, encoding="utf-8")
    settings = [part for override in overrides for part in ("--set", override)]
    ended = invoke("run", folder / "case.yaml", "--out", folder / "out", *settings)
    return ended.exit_code, ended.stderr.splitlines()[-1]


def linear_rig(joint_stiffness: float) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness with the joint as a spring, and damping of the modes without it."""
    squares, shapes = np.linalg.eig(np.linalg.solve(MASS, STIFF))
    shapes = shapes / np.sqrt(np.einsum("im,ij,jm->m", shapes, MASS, shapes))
    moved = MASS @ shapes
    damping = moved @ np.diag(2.0 * 0.1 * np.sqrt(squares)) @ moved.T
    return STIFF + np.diag([0.0, joint_stiffness]), damping


def receptance(frequency: float, joint_stiffness: float) -> np.ndarray:
    """Displacements of both masses under 1 N on the first."""
    stiffness, damping = linear_rig(joint_stiffness)
    angular = 2.0 * np.pi * frequency
    matrix = stiffness - angular**2 * MASS + 1j * angular * damping
    return np.linalg.solve(matrix, np.array([1.0, 0.0]))


# --- the case -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "override", "words"),
    [
        (JOINT, "ageing={}", "no end given; allowed: energy or cycles"),
        (JOINT, "ageing={energy: 1 J, cycles: 5}", "both given"),
        (JOINT, "energies=[1 J, 0 J]", "not ascending"),
        (JOINT, "energies=[]", "none; allowed: one or more"),
        (JOINT, "drive.stroke=0 um", "above 0"),
        (JOINT, "joint.law=coulomb", "bouc_wen, jenkins"),
        (JOINT, "joint.chi=0", "unknown key"),
        (JOINT, "structure.kind=beam", "allowed: joint, rig, reduced"),
        (JOINT, "joint={law: bouc_wen, sigma: 0.2}", "at least 0.5"),
        (JOINT, "output.paraview=true", "nothing to show in ParaView; allowed: false"),
        (RIG, "structure.springs=[1]", "1 springs for 2 masses"),
        (RIG, "excitation.mass=3", "no such mass; allowed: 1 to 2"),
        (RIG, "integration.step=1 ms", "too long for the excitation; allowed: up to 0.000625 s"),
        (RIG, "excitation.kind=shaker", "harmonic, hammer, recorded"),
        (RIG, "ageing={energy: 1 J}|energies=[2 J]", "beyond the end"),
        (RIG, f"{HAMMER}|integration.step=20 us|ageing.energy=1 J", "with a harmonic force"),
        (RIG, f"{HAMMER}|excitation.band=[3 Hz, 2 Hz]", "not ascending"),
        (RIG, f"{HAMMER}|excitation.record=1 ms", "over with the blow"),
    ],
)
def test_a_wrong_case_is_refused(text, override, words):
    with pytest.raises(CaseError) as refusal:
        parse_case(text, "case.yaml", override.split("|"))
    assert words in str(refusal.value)


def test_evolution_of_what_the_joint_has_not_is_refused():
    contact = "joint={law: friction_contact, normal_load: 1, friction: 1, stiffness: 1, "
    overrides = [f"{contact}normal_stiffness: 1}}", "evolution.residual_stiffness={kind: table}"]
    with pytest.raises(CaseError, match="friction_contact has no residual_stiffness"):
        parse_case(RIG, "case.yaml", overrides)


def test_a_file_beside_a_factor_is_refused(tmp_path):
    (tmp_path / "loops.csv").write_text("energy,P,kt,mu\n0,1,1,1\n", encoding="utf-8")
    evolution = "evolution={file: loops.csv, friction: {kind: linear, slope: 0}}"
    with pytest.raises(CaseError, match="given beside friction"):
        parse_case(JOINT, str(tmp_path / "case.yaml"), [evolution])


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("time,force\n0,0\n0,1\n", "times that do not ascend"),
        ("time\n0\n1\n", "no column force"),
        ("time,velocity\n0,0\n1,1\n", "no column force; this file has 'time', 'velocity'"),
        ("time [ms],force [mm]\n0,0\n1,1\n", "force.csv:1: force: unit 'mm' cannot be"),
        ("time,force\n-1,0\n1,1\n", "force.csv:2: time: -1: out of range; allowed: at least 0"),
    ],
)
def test_a_wrong_record_is_refused(tmp_path, rows, words):
    (tmp_path / "force.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(CaseError) as refusal:
        parse_case(
            RIG, str(tmp_path / "case.yaml"), ["excitation={kind: recorded, file: force.csv}"]
        )
    assert words in str(refusal.value)


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
    """As a wear run writes it: kt in N/mm, energy in J."""
    rows = "energy [J],P [N],kt [N/mm],mu [1]\n0,60,1e4,0.2\n2,60,3e4,0.6\n"
    (tmp_path / "loops.csv").write_text(rows, encoding="utf-8")
    case = parse_case(JOINT, str(tmp_path / "case.yaml"), ["evolution={file: loops.csv}"])
    parameters = JointModel.of(case).parameters(1e3)
    assert parameters["friction"] == pytest.approx(0.4, rel=ROUNDING)
    assert parameters["stiffness"] == pytest.approx(2e4, rel=ROUNDING)
    assert parameters["normal_load"] == 100.0


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("energy [J/mm],P [N/mm],kt [N/mm/mm],mu [1]\n0,60,1e4,0.2\n", "per mm"),
        ("energy,P,kt\n0,60,1e4\n", "loops.csv:1: no column mu"),
    ],
)
def test_a_table_that_is_not_of_a_whole_joint_is_refused_before_the_run(tmp_path, rows, words):
    (tmp_path / "loops.csv").write_text(rows, encoding="utf-8")
    (tmp_path / "case.yaml").write_text(JOINT, encoding="utf-8")
    ended = invoke("check", tmp_path / "case.yaml", "--set", "evolution={file: loops.csv}")
    assert ended.exit_code == 2
    (line,) = ended.stderr.splitlines()
    assert "evolution.file: " in line
    assert words in line


@pytest.mark.parametrize("law", LAWS)
def test_a_marched_loop_has_the_energy_of_its_law(law):
    """And encloses it: by trapezoids, of second order in 720 points a cycle."""
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


def test_energies_that_are_not_reached_are_told(tmp_path):
    summary = run(tmp_path, JOINT, "energies=[0 J, 1 kJ]")
    assert len(summary["states"]) == 2
    assert "not reached" in summary["warnings"][0]


def test_a_joint_that_never_slides_cannot_be_aged_by_energy(tmp_path):
    code, message = refused(tmp_path, JOINT, "drive.stroke=1 um", "ageing={energy: 1 J}")
    assert code == 2
    assert "never reached" in message
    summary = run(tmp_path / "cycles", JOINT, "drive.stroke=1 um")
    assert summary["energy"] == 0.0
    assert summary["states"][-1]["energy_per_cycle"] == 0.0


def test_files_of_a_joint(tmp_path):
    """Every dataset has unit and description; tables hold the same; a second run replaces them."""
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


def test_reported_values_are_told_beside_the_computed(tmp_path):
    told = (
        "reported=[{quantity: states.-1.energy_per_cycle, value: 3 mJ, source: a test}, "
        "{quantity: states.0.colour, value: 1, source: a test}]"
    )
    summary = run(tmp_path, JOINT, told)
    assert summary["reported"][0] == {
        "quantity": "states.-1.energy_per_cycle",
        "reported": 3.0,
        "computed": pytest.approx(LOOP_ENERGY),
        "source": "a test",
    }
    assert summary["reported"][1]["computed"] is None
    log = (tmp_path / "out" / "run.log").read_text(encoding="utf-8")
    assert "mJ computed, 3 mJ reported (a test)" in log
    assert "no quantity states.0.colour" in summary["warnings"][0]


def test_a_preload_worn_to_nothing_ends_the_wear(tmp_path):
    """N = N0 (1 - E/2 J): the energy goes towards 2 J, the last loops transmit nothing."""
    wear = "evolution.normal_load={kind: linear, slope: -0.5 1/J}"
    summary = run(tmp_path, JOINT, wear, "ageing.cycles=1e6", "energies=[0 J, 1 J]")
    last = summary["states"][-1]
    assert summary["energy"] == pytest.approx(2e3, rel=1e-6)
    assert summary["energy"] <= 2e3
    assert last["normal_load"] == pytest.approx(0.0, abs=1e-3)
    assert last["extracted"]["friction"] is None or last["force"] > 0.0


def test_a_joint_that_cannot_be_is_refused(tmp_path):
    """A residual stiffness above the whole one, as the paper's slope of kp per J would have it."""
    steep = "evolution.residual_stiffness={kind: linear, slope: 1 1/J}"
    law = "joint.law=bouc_wen", "joint.residual_stiffness=5 N/um", steep, "ageing={energy: 5 J}"
    code, message = refused(tmp_path, JOINT, *law)
    assert code == 2
    assert "residual_stiffness of a Bouc-Wen joint" in message


def test_a_loop_is_read_as_a_measured_one(tmp_path):
    run(tmp_path, JOINT)
    ended = invoke("loops", tmp_path / "out" / "loop_00000.csv", "--normal-load", "100 N")
    assert ended.exit_code == 0, ended.stderr
    assert f"{LOOP_ENERGY:.4g}" in ended.stdout


# --- the rig ------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [4e-4, 2e-4, 1e-4])
def test_a_stuck_rig_is_linear(tmp_path, step):
    """Amplitudes against the receptance: of second order in the step.

    Extremes among samples miss up to (ωh)²/8 of a sine, and Newmark's stiffness is off by a third
    of (ωh)²/4; near the resonance that is a few times as much.
    """
    exact = 50.0 * np.abs(receptance(80.0, 1e4))
    settings = "joint.friction=10", f"integration.step={step}", "excitation.steady=1e-9"
    state = run(tmp_path, RIG, *settings)["states"][0]
    assert state["energy_per_cycle"] == 0.0
    error = np.abs(np.array(state["amplitudes"]) / exact - 1.0).max()
    assert error < 0.25 * (2.0 * np.pi * 80.0 * step) ** 2
    squares = np.linalg.eigvals(np.linalg.solve(MASS, linear_rig(1e4)[0]))
    assert state["stuck"] == pytest.approx(np.sort(np.sqrt(squares)) / (2.0 * np.pi), rel=1e-9)


def test_a_sliding_rig_dissipates_what_its_loop_encloses(tmp_path):
    state = run(tmp_path, RIG, "excitation.force=200 N")["states"][0]
    amplitude = 0.5 * state["stroke"]
    assert amplitude > 2.0 * LIMIT / STIFFNESS
    assert state["energy_per_cycle"] == pytest.approx(
        4.0 * LIMIT * (amplitude - LIMIT / STIFFNESS), rel=1e-3
    )
    assert state["extracted"]["friction"] == pytest.approx(0.5, rel=1e-3)


def test_a_rig_without_steady_state_fails(tmp_path):
    code, message = refused(tmp_path, RIG, "excitation.periods=3")
    assert code == 3
    assert "no steady state at 0 J after 3 cycles" in message


def test_a_rig_ages_in_steady_states(tmp_path):
    """Without evolution all steady states are the same: cycles are energy over that of one."""
    loud = "excitation.force=200 N"
    summary = run(tmp_path, RIG, loud, "ageing={energy: 1 J, tolerance: 1e-3}", "energies=[0 J]")
    each = summary["states"][0]["energy_per_cycle"]
    assert summary["cycles"] == pytest.approx(1e3 / each, rel=1e-3)
    assert [state["energy"] for state in summary["states"]] == [0.0, 1e3]


def test_a_blow_shows_the_frequency_response_of_a_stuck_rig(tmp_path):
    """Against the exact accelerance, but for the step: the peak lies within one line."""
    summary = run(tmp_path, RIG, HAMMER, "joint.friction=10", "integration.step=50 us")
    state = summary["states"][0]
    assert abs(state["first_frequency"] - state["stuck"][0]) <= state["resolution"]
    assert "change" not in summary
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        group = file["states/00000/frequency_response"]
        frequency, magnitude = group["frequency"][()], group["magnitude"][()]
    for hertz in (40.0, 100.0, 200.0, 800.0):
        exact = (2.0 * np.pi * hertz) ** 2 * abs(receptance(hertz, 1e4)[1])
        place = int(np.argmin(np.abs(frequency - hertz)))
        assert frequency[place] == pytest.approx(hertz, rel=1e-3)
        assert magnitude[place] == pytest.approx(exact, rel=0.02)
    # Damping of the first mode, whose shape the joint changes: from its complex eigenvalue.
    stiffness, damping = linear_rig(1e4)
    bottom = [-np.linalg.solve(MASS, stiffness), -np.linalg.solve(MASS, damping)]
    roots = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], bottom]))
    first = roots[np.argmin(np.abs(roots))]
    largest = state["ring_down"]["largest"]
    assert largest["damping_ratio"] == pytest.approx(-first.real / abs(first), rel=0.02)
    assert largest["frequency"] == pytest.approx(abs(first.imag) / (2.0 * np.pi), rel=2e-3)


def test_states_without_a_ring_down_are_in_its_figure(tmp_path):
    """Of a motion that was over at once the picture shows the motion."""
    time = np.linspace(0.0, 1.0, 50)
    moved = np.exp(-5.0 * time) * np.cos(60.0 * time)
    with h5py.File(tmp_path / "results.h5", "w") as file:
        file.attrs["seen"] = ["m1"]
        for name in ("00000", "00001"):
            state = file.create_group(f"states/{name}")
            state.attrs.update(energy=1e3 * float(name), stuck=[50.0])
            state["motion/time"], state["motion/displacement"] = time, moved[:, None]
        for name in ("amplitude", "frequency", "damping_ratio"):
            file[f"states/00001/ring_down/{name}"] = 1.0 + time
        groups = {"motion": ("00000", "00001"), "ring_down": ("00001",)}
        drawn = ring_down(file, Contents(groups, (), aged=False))
    history, softened, damping = drawn.get_axes()
    labels = [line.get_label() for line in history.get_lines()]
    assert labels == ["unworn: stuck 50 Hz, no ring-down", "1 J: stuck 50 Hz"]
    assert len(softened.get_lines()) == len(damping.get_lines()) == 1


@pytest.mark.slow
def test_wear_changes_the_response_to_a_blow(tmp_path):
    """E is frozen in each record; figures of what there is are drawn."""
    evolution = "evolution.stiffness={kind: table, energy: [0 J, 1 J], factor: [1, 2]}"
    summary = run(
        tmp_path,
        RIG,
        HAMMER,
        evolution,
        "energies=[0 J, 1 J]",
        "integration.step=50 us",
        "output.figures=true",
    )
    assert summary["change"]["first_frequency"] == 1.0
    assert [state["stiffness"] for state in summary["states"]] == [1e4, 2e4]
    names = {path.stem for path in (tmp_path / "out" / "figures").iterdir()}
    assert {"frequency_response", "ring_down", "evolution"} <= names
    assert (tmp_path / "out" / "ring_down_00001.csv").exists()
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        assert file.attrs["seen"].tolist() == ["m1", "m2"]


@pytest.mark.slow
def test_a_recorded_blow_moves_the_rig_as_a_hammer_does(tmp_path):
    """Sampled 50 times: the second order of a polygon leaves 1e-3."""
    times = np.linspace(0.0, 1e-3, 51)
    rows = [f"{time},{100.0 * np.sin(np.pi * time / 1e-3)}" for time in times]
    folder = tmp_path / "recorded"
    folder.mkdir()
    (folder / "force.csv").write_text("\n".join(["time,force", *rows, "0.05,0"]), encoding="utf-8")
    step = "integration.step=20 us"
    recorded = run(folder, RIG, "excitation={kind: recorded, file: force.csv}", step)
    hit = run(tmp_path / "hammer", RIG, HAMMER, step)
    motions = []
    for kind in ("recorded", "hammer"):
        with h5py.File(tmp_path / kind / "out" / "results.h5") as file:
            motions.append(file["states/00000/motion/displacement"][:2000])
    largest = np.abs(motions[1]).max()
    np.testing.assert_allclose(motions[0], motions[1], atol=1e-3 * largest)
    assert recorded["states"][0]["dissipated"] == pytest.approx(
        hit["states"][0]["dissipated"], rel=5e-3, abs=1e-12
    )


@pytest.mark.parametrize("kind", ["joint", slow("rig")])
def test_what_new_writes_wears_without_a_warning(tmp_path, kind):
    """All energies that it asks for are reached, and friction has risen between them."""
    summary = run(tmp_path, template(kind), "output.figures=false")
    assert summary["warnings"] == []
    assert [state["energy"] for state in summary["states"]][:2] == [0.0, 1e6]
    assert summary["states"][1]["friction"] > 2.0 * summary["states"][0]["friction"]


# --- commands -----------------------------------------------------------------------------------


def test_what_can_be_charted(tmp_path):
    """The step of a rig; of a joint alone nothing, whose jumps are as good as asked for."""
    path = tmp_path / "case.yaml"
    path.write_text(RIG, encoding="utf-8")
    assert {axis.name for axis in axes_of(path, [], [])} == {"step"}
    with pytest.raises(UserError, match="does not apply to this case; allowed: step"):
        axes_of(path, [], ["grid"])
    path.write_text(JOINT, encoding="utf-8")
    with pytest.raises(UserError, match="nothing of a case of this kind can be charted"):
        axes_of(path, [], [])


@pytest.mark.slow
def test_a_chart_of_the_step(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(RIG, encoding="utf-8")
    loud = ("--set", "excitation.force=200 N", "--quantity", "states.0.stroke")
    ended = invoke("chart", path, "--out", tmp_path / "chart", *loud)
    assert ended.exit_code == 0, ended.stderr


def test_memory_grows_with_what_is_recorded(monkeypatch, tmp_path):
    short, long = (
        parse_case(RIG, "case.yaml", [HAMMER, "integration.step=1 us", f"excitation.record={time}"])
        for time in (1, 100)
    )
    assert memory(long).required > 10.0 * memory(short).required / 2.0
    monkeypatch.setattr("workflow.shell.memory._available_bytes", lambda: 1e9)
    overrides = HAMMER, "integration.step=1 us", "excitation.record=100"
    code, message = refused(tmp_path, RIG, *overrides)
    assert code == 4
    assert "raise integration.step" in message


def test_a_finished_run_is_not_resumed_and_one_that_kept_nothing_starts_again(tmp_path):
    run(tmp_path, JOINT)
    assert "nothing to do" in invoke("resume", tmp_path / "out").stdout
    (tmp_path / "out" / "summary.json").unlink()
    ended = invoke("resume", tmp_path / "out")
    assert ended.exit_code == 2
    assert "its manifest.json does not list its files" in ended.stderr


@pytest.mark.parametrize(
    "name", [slow("rig_bouc_wen"), slow("bolted_joint_test2"), "bolted_joint_test4"]
)
def test_papers_joints_are_verified(tmp_path, name):
    assert verify_cases((CASES / f"{name}.yaml",), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rig_force_75N", "rig_hammer_7N", "rig_hammer_60N"])
def test_papers_rigs_are_verified(tmp_path, name):
    assert verify_cases((CASES / f"{name}.yaml",), tmp_path)
