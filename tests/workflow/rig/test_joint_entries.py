"""Tests of joints with separate laws: in a row of masses, on a body, steady and in time."""

from math import copysign
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.linalg as sl
from matplotlib import rc_context

from fe_models.dynamics.curves.forced_response import along_force
from fe_models.dynamics.excitation import CombinedForces, HarmonicForce
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from fe_models.joints.reduction import ReducedModel, save_reduced
from tests.workflow.command_line import command
from tests.workflow.output.figure_checks import problems
from workflow.analyses.rig.building import rig_model
from workflow.analyses.rig.structure import own_laws
from workflow.analyses.time.joint_model import JointModel
from workflow.analyses.vibration.figures.shares import joint_states
from workflow.analyses.vibration.model import structure_numbers, vibration_model
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.errors import UserError
from workflow.kinds import load_case, parse_case, template
from workflow.models.vibration.structure import VibratingStructure
from workflow.pictures.style import STYLE
from workflow.shell.terminal.reporter import Reporter

SLIDER = "{law: jenkins, normal_load: 20 N, friction: 0.5, stiffness: 3 N/um}"
STOP = "{law: elastic_stop, stiffness: 5 N/um, gap: 10 um}"
HARDENS = "{law: polynomial_spring, stiffness: 0.5 N/um, cubic: 1e6 N/mm^3}"
CASE = f"""\
title: A slider between two masses and a stop
analysis: vibration
structure:
  kind: rig
  masses: [2 kg, 1 kg]
  springs: [1 N/um, 2 N/um]
  joints:
    - {{points: m2, against: m1, joint: {SLIDER}}}
    - {{points: m2, joint: {STOP}}}
  damping_ratio: 0.05
forces: [5 N, 40 N]
frequencies: [50 Hz, 400 Hz]
resolution: {{harmonics: {list(range(32))}, samples: 1024}}
output: {{figures: false}}
"""
LIMIT, KT, STIFF, GAP = 10.0, 3e3, 5e3, 0.01
MASSES, SPRINGS = np.diag([2e-3, 1e-3]), np.array([[3e3, -2e3], [-2e3, 2e3]])


def model_of(folder: Path, text: str, *overrides: str) -> VibratingStructure:
    case = parse_case(text, str(folder / "case.yaml"), overrides)
    return vibration_model(case, Reporter(folder / "run.log")).structure


def central_differences(damping, force, frequency, steps=1000, periods=30):
    """Return both masses in the last of many periods, by an explicit method and plain laws."""
    step = 1.0 / (steps * frequency)
    inverse = np.linalg.inv(MASSES / step**2 + damping / (2.0 * step)).tolist()
    back = (MASSES / step**2 - damping / (2.0 * step)).tolist()
    inner = (2.0 * MASSES / step**2 - SPRINGS).tolist()
    drive = force * np.sin(2.0 * np.pi * np.arange(steps) / steps)
    a, b, a0, b0, stretch, kept = 0.0, 0.0, 0.0, 0.0, 0.0, []
    for number in range(periods * steps):
        stretch += (b - a) - (b0 - a0)
        if abs(stretch) > LIMIT / KT:
            stretch = copysign(LIMIT / KT, stretch)
        slides, pushed = KT * stretch, STIFF * max(b - GAP, 0.0)
        loads = drive[number % steps] + slides, -slides - pushed
        right = [
            loads[i] + inner[i][0] * a + inner[i][1] * b - back[i][0] * a0 - back[i][1] * b0
            for i in range(2)
        ]
        if number >= (periods - 1) * steps:
            kept.append((a, b))
        a0, b0 = a, b
        a, b = (inverse[i][0] * right[0] + inverse[i][1] * right[1] for i in range(2))
    return np.array(kept)


def test_two_laws_are_the_motion_of_an_explicit_method(tmp_path):
    """The slider slips and the stop is hit; Newmark's method with the same laws agrees too."""
    model = model_of(tmp_path, CASE)
    motion = model.problem.solve(110.0, 40.0)
    assert motion.converged
    slips, apart = (motion.cycle.states == 1).mean(axis=0)[0], (motion.cycle.states == 2).mean(0)[1]
    assert slips > 0.2
    assert 0.5 < apart < 0.95
    steps = 1000
    expected = central_differences(model.rig.model.damping, 40.0, 110.0, steps)
    size = np.abs(expected).max()
    np.testing.assert_allclose(motion.displacement(steps), expected, atol=3e-4 * size)
    force = HarmonicForce(model.rig.driven, 40.0, 110.0)
    control = TimeStepControl(1.0 / (250 * 110.0))
    marched = integrate(
        model.rig.model, model.law, CombinedForces((force,)), 25 / 110.0, control
    ).displacement[-251:-1]
    np.testing.assert_allclose(marched, motion.displacement(250), atol=4e-3 * size)


def test_a_stop_is_grazed_while_a_slider_slips(tmp_path):
    """Below grazing the motion is that without the stop, which begins to push at the gap."""
    model = model_of(tmp_path, CASE)
    without = model_of(
        tmp_path, CASE, f"structure.joints=[{{points: m2, against: m1, joint: {SLIDER}}}]"
    )
    branch = along_force(model.problem, 60.0, (2.0, 40.0))
    assert not branch.message
    reached = np.array([motion.displacement(1024)[:, 1].max() for motion in branch.solutions])
    below = [m for m, far in zip(branch.solutions, reached, strict=True) if far < GAP]
    above = [m for m, far in zip(branch.solutions, reached, strict=True) if far > GAP]
    assert below
    assert above
    for motion in below[:: max(len(below) // 3, 1)]:
        free = without.problem.solve(60.0, motion.force)
        np.testing.assert_allclose(motion.motion, free.motion, atol=1e-9 * GAP)
    # The first that touches goes on where the last that does not has been.
    grazing = reached[len(below) - 1 : len(below) + 1]
    assert grazing[0] < GAP < grazing[1]
    last = above[-1]
    expected = central_differences(model.rig.model.damping, last.force, 60.0)
    np.testing.assert_allclose(
        last.displacement(1000), expected, atol=5e-4 * np.abs(expected).max()
    )


def test_masses_that_do_not_meet_move_as_each_alone(tmp_path):
    """One has a slider, the other a hardening spring, in one case and in two."""
    apart = [
        "structure.masses=[2 kg, 1 kg]",
        "structure.springs=[1 N/um, 0 N/um]",
        f"structure.joints=[{{points: m1, joint: {SLIDER}}}, {{points: m2, joint: {HARDENS}}}]",
        "structure.damping={dashpots: [{points: m2, coefficient: 50 N*s/m}]}",
        "forces=null",
        "excitation={forces: [{points: m1, amplitude: 20 N}, {points: m2, amplitude: 10 N}]}",
        "resolution={harmonics: 3, samples: 256}",
    ]
    motion = model_of(tmp_path, CASE, *apart).problem.solve(115.0, 1.0)
    assert motion.converged
    slides = model_of(
        *(tmp_path, CASE, "structure.masses=[2 kg]", "structure.springs=[1 N/um]"),
        *("structure.joints=[]", f"joint={SLIDER}", apart[-1]),
    ).problem.solve(115.0, 20.0)
    alone = f"structure.joints=[{{points: m2, joint: {HARDENS}}}]"
    driven = "excitation={forces: [{points: m2, amplitude: 10 N}]}"
    hardens = model_of(tmp_path, CASE, *apart, alone, driven).problem.solve(115.0, 1.0)
    np.testing.assert_allclose(motion.motion[:, 0], slides.motion[:, 0], atol=1e-10)
    np.testing.assert_allclose(motion.motion[:, 1], hardens.motion[:, 1], atol=1e-10)
    assert slides.cycle.dissipated[0] > 0.1
    np.testing.assert_allclose(
        motion.cycle.dissipated, [slides.cycle.dissipated[0], 0.0], rtol=1e-8
    )


def test_a_run_reports_the_state_of_each_joint(tmp_path):
    """Table, results and figure report each joint; the loop is that of the requested entry."""
    settings = [
        *("frequencies=[100 Hz, 130 Hz]", "resolution={harmonics: [0, 1, 2, 3], samples: 64}"),
        *("loops={frequency: 110 Hz, joints: 1}", "stability=none", "forces=[40 N]"),
    ]
    (tmp_path / "case.yaml").write_text(CASE, encoding="utf-8")
    ended = command("run", tmp_path / "case.yaml", "--out", tmp_path / "out", overrides=settings)
    assert ended.exit_code == 0, ended.output
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        assert file.attrs["law"] == "jenkins, elastic_stop"
        response = file["responses/00000"]
        slip, apart = response["nodes/slip"][()], response["nodes/separated"][()]
        np.testing.assert_allclose(slip.mean(axis=1), response["slip"], atol=1e-12)
        assert slip[:, 0].max() > 0.2
        assert not slip[:, 1].any()
        assert not apart[:, 0].any()
        lost = response["nodes/energy"][()]
        np.testing.assert_allclose(lost.sum(axis=1), response["energy_per_cycle"], rtol=1e-12)
        loop = response["loops/00000"]
        assert np.ptp(loop["force"]) == pytest.approx(2.0 * LIMIT)
        assert loop.attrs["stiffness"] == pytest.approx(KT)
        table = np.loadtxt(tmp_path / "out" / "joints_00000.csv", delimiter=",", skiprows=1)
        columns = np.column_stack([response["frequency"], slip, apart, lost])
        np.testing.assert_allclose(table, columns, rtol=1e-8)
        with rc_context(STYLE):
            figure = joint_states(file, VibrationContents(("00000",), (), False, False, joints=2))
            figure.canvas.draw()
        assert not problems(figure)
        _, slider, stop = figure.axes
        assert slider.get_ylabel().startswith("m2 - m1")
        # From the bottom up: it sticks, slips, is apart.
        tops = [part.get_paths()[0].vertices[:, 1].max() for part in stop.collections]
        sticks = 100.0 * (1.0 - slip - apart)
        np.testing.assert_allclose(tops, [sticks[:, 1].max(), sticks[:, 1].max(), 100.0], atol=1.0)


# --- a body and a mass beside it ----------------------------------------------------------------

POINTS = [f"{point} {axis}" for point in ("block", "holder") for axis in "xyz"]
BODY = ReducedModel(
    kept=np.arange(6),
    stiffness=np.kron(SPRINGS, np.diag([1.0, 2.0, 3.0])),
    mass=np.kron(MASSES, np.eye(3)),
    loads=np.zeros((6, 0)),
    mode_shapes=np.zeros((6, 0)),
    frequencies=np.zeros(0),
    names=tuple(POINTS),
)
CONTACT = (
    "{law: friction_contact, normal_load: 30 N, friction: 0.4, stiffness: 2 N/um, "
    "normal_stiffness: 4 N/um}"
)
ON_BODY = f"""\
title: A damper on a body
analysis: vibration
structure:
  kind: reduced
  file: body.h5
  further_masses: [{{name: damper, mass: 0.5 kg, directions: xyz}}]
  joints:
    - {{points: damper, against: holder, direction: -z, joint: {CONTACT}}}
    - {{points: block, direction: x, joint: {STOP}}}
  springs:
    - {{points: damper, direction: x, stiffness: 0.3 N/um}}
    - {{points: damper, direction: y, stiffness: 0.4 N/um}}
    - {{points: damper, direction: z, stiffness: 0.5 N/um}}
  damping_ratio: 0.02
  driven: {{points: block, direction: x}}
  seen: {{points: damper, direction: x}}
forces: [10 N]
frequencies: [50 Hz, 400 Hz]
resolution: {{harmonics: [0, 1, 2, 3, 4, 5], samples: 128}}
"""


@pytest.fixture
def body(tmp_path) -> Path:
    save_reduced(tmp_path / "body.h5", BODY)
    return tmp_path


def test_a_further_mass_is_held_by_joints_and_springs(body):
    """The linear limits are those of matrices assembled by hand."""
    model = model_of(body, ON_BODY)
    rig = model.rig
    assert rig.counts == [1, 1]
    np.testing.assert_array_equal(rig.contacts, [True, False])
    mass = sl.block_diag(BODY.mass, 5e-4 * np.eye(3))
    stiff = sl.block_diag(BODY.stiffness, np.diag([300.0, 400.0, 500.0]))
    apart = np.sqrt(sl.eigh(stiff, mass, eigvals_only=True)) / (2.0 * np.pi)
    for axis, spring in enumerate((2e3, 2e3, 4e3)):
        row = np.zeros(9)
        row[6 + axis], row[3 + axis] = 1.0, -1.0
        stiff += spring * np.outer(row, row)
    # The stop is open at rest.
    held = np.sqrt(sl.eigh(stiff, mass, eigvals_only=True)) / (2.0 * np.pi)
    reported = structure_numbers(model)
    np.testing.assert_allclose(reported["free"], apart, rtol=1e-10)
    np.testing.assert_allclose(reported["stuck"], held, rtol=1e-10)
    assert model.problem.solve(90.0, 10.0).converged


def test_a_body_with_a_damper_is_a_row_of_three_masses(body):
    """The motion along x is the same, reported under the damper's name."""
    damper = f"{{points: damper, against: holder, direction: x, joint: {SLIDER}}}"
    on_body = model_of(
        body,
        ON_BODY,
        "structure.further_masses=[{name: damper, mass: 0.5 kg, directions: x}]",
        "structure.springs=[{points: damper, direction: x, stiffness: 0.3 N/um}]",
        f"structure.joints=[{damper}, {{points: block, direction: x, joint: {STOP}}}]",
        "structure.damping_ratio=0",
        "structure.damping={dashpots: [{points: damper, against: block, coefficient: 90 N*s/m}]}",
    ).problem.solve(90.0, 10.0)
    row = model_of(
        body,
        CASE,
        "structure.masses=[2 kg, 1 kg, 0.5 kg]",
        "structure.springs=[1 N/um, 2 N/um, 0 N/um]",
        f"structure.joints=[{{points: m3, against: m2, joint: {SLIDER}}}, "
        f"{{points: m1, joint: {STOP}}}, {{points: m3, joint: {{law: polynomial_spring, "
        "stiffness: 0.3 N/um}}]",
        "structure.damping_ratio=0",
        "structure.damping={dashpots: [{points: m3, against: m1, coefficient: 90 N*s/m}]}",
        "resolution={harmonics: [0, 1, 2, 3, 4, 5], samples: 128}",
    ).problem.solve(90.0, 10.0)
    along = [0, 3, 6]
    np.testing.assert_allclose(on_body.motion[:, along], row.motion, atol=1e-11)


def test_a_damper_on_own_matrices_under_a_load(tmp_path):
    """It is the same row of three masses; the matrices' load does not act on the third."""
    load = np.array([[1.0], [0.0]])
    np.savez(tmp_path / "two.npz", K=SPRINGS, M=MASSES, F=load)
    (tmp_path / "unknowns.csv").write_text("point,direction\nblock,x\nholder,x\n", "utf-8")
    own = f"""\
title: A damper on matrices
analysis: vibration
structure:
  kind: matrices
  matrices: {{file: two.npz, unknowns: unknowns.csv, units: {{length: mm, force: N}}}}
  further_masses: [{{name: damper, mass: 0.5 kg, directions: x}}]
  joints:
    - {{points: damper, against: holder, direction: x, joint: {SLIDER}}}
    - {{points: damper, direction: x, joint: {HARDENS}}}
  damping_ratio: 0.03
  driven: {{load: 1}}
  seen: {{points: damper, direction: x}}
forces: [10 N]
frequencies: [50 Hz, 400 Hz]
resolution: {{harmonics: 3, samples: 64}}
"""
    row = (
        "structure.masses=[2 kg, 1 kg, 0.5 kg]",
        "structure.springs=[1 N/um, 2 N/um, 0 N/um]",
        f"structure.joints=[{{points: m3, against: m2, joint: {SLIDER}}}, "
        f"{{points: m3, joint: {HARDENS}}}]",
        "structure.damping_ratio=0.03",
        "resolution={harmonics: 3, samples: 64}",
    )
    found, expected = (
        model_of(tmp_path, text, *overrides).problem.solve(90.0, 10.0)
        for text, overrides in ((own, ()), (CASE, row))
    )
    assert found.converged
    np.testing.assert_allclose(found.motion, expected.motion, atol=1e-11)


# --- in time ------------------------------------------------------------------------------------


def test_in_time_those_of_their_own_stay_as_they_are(tmp_path):
    """Only the shared joint of the case evolves, with the energy of its own joints."""
    text = CASE.replace("analysis: vibration", "analysis: time").partition("forces:")[0]
    text = text.replace(f", joint: {SLIDER}", "") + (
        f"joint: {SLIDER}\nevolution: {{friction: {{kind: linear, slope: 1 1/J}}}}\n"
        "excitation: {kind: harmonic, force: 40 N, frequency: 110 Hz}\n"
        "integration: {step: 20 us}\n"
    )
    case = parse_case(text, str(tmp_path / "case.yaml"), ())
    rig = rig_model(case.structure, case.joint, None, Reporter(tmp_path / "run.log"))
    np.testing.assert_array_equal(rig.shared, [True, False])
    law = JointModel.of(case, rig.counts, own_laws(case.structure)).at(1e3)
    assert law.groups[0].law.friction == pytest.approx(1.0)
    assert law.groups[1].law.gap == GAP


# --- what cannot be -----------------------------------------------------------------------------


def test_a_row_has_the_joint_of_the_case_behind_its_last_mass(tmp_path):
    """It is added to joints with separate laws, unless no law is shared."""
    beside = model_of(tmp_path, CASE, f"joint={HARDENS}")
    np.testing.assert_array_equal(beside.rig.model.connection, [[-1, 1], [0, 1], [0, 1]])
    assert [group.law.stiffness for group in beside.law.groups] == [KT, STIFF, 500.0]
    alone = model_of(tmp_path, CASE)
    np.testing.assert_array_equal(alone.rig.model.connection, [[-1, 1], [0, 1]])


@pytest.mark.parametrize(
    ("override", "key"),
    [
        ("structure.joints=[]", "joint"),
        ("structure.joints.0.points=m3", "structure.joints.0.points"),
        ("structure.joints.0.against=m2", "structure.joints.0.against"),
        ("structure.joints.1.direction=y", "structure.joints.1.direction"),
        (f"structure.joints.1.joint={CONTACT}", "structure.joints.1.joint.law"),
        ("loops={frequency: 90 Hz, joints: 3}", "loops.joints"),
    ],
)
def test_wrong_joints_in_a_row_are_named(tmp_path, override, key):
    with pytest.raises(UserError, match=key):
        parse_case(CASE, str(tmp_path / "case.yaml"), [override])


def test_a_contact_that_wears_is_alone():
    """Further joints are refused, and the template offers none."""
    assert "joints" not in template("vibration_wear")
    cases = Path(__file__).parents[3] / "cases"
    joints = f"structure.joints=[{{points: m2, joint: {STOP}}}]"
    with pytest.raises(UserError, match=r"structure\.joints"):
        load_case(cases / "rig_wear_vibration.yaml", [joints])
