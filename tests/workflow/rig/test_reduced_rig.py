"""Tests of a reduced body as a rig: named points, and joints, masses and springs at them."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as sl

from fe_models.dynamics.excitation import HammerBlow
from fe_models.dynamics.transient.newmark import TimeStepControl
from fe_models.joints.reduction import ReducedModel, load_reduced, save_reduced
from tests.workflow.vibration.time_scenes import MASS, RIG, STIFF, refused, run
from wear.joints.law import march_joints
from workflow.analyses.rig.building import rig_model
from workflow.analyses.specimens.model import reduced_pair
from workflow.analyses.time.joint_model import JointModel
from workflow.analyses.time.rig import motion_of
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError, UserError
from workflow.kinds import load_case, parse_case
from workflow.models.rig.rig_model import RigModel
from workflow.shell.terminal.reporter import Reporter

CASES = Path(__file__).parents[3] / "cases"
# What sums over a few hundred steps leave of a balance.
ROUNDING = 1e-9
COARSE = (
    "structure.ring_nodes=4",
    "mesh={pad_elements: 2, size: 8 mm, order: 1}",
    "reduction.modes=3",
)

SPECIMEN = """\
title: Specimen
analysis: time
structure:
  kind: reduced
  file: body_2.h5
  joints: [{points: pad, direction: -z}]
  masses: [{points: ring, mass: 0.1 kg}]
  springs:
    - {points: ring, direction: x, stiffness: 1 N/um}
    - {points: ring, direction: y, stiffness: 100 N/um}
    - {points: ring, direction: z, stiffness: 100 N/um}
  damping_ratio: 0.05
  driven: {points: ring, direction: x}
  seen: {points: pad, direction: x}
joint:
  law: friction_contact
  normal_load: 90 N
  friction: 0.5
  stiffness: 20 N/um
  normal_stiffness: 30 N/um
excitation: {kind: harmonic, force: 10 N, frequency: 400 Hz}
integration: {step: 50 us}
output: {figures: false}
"""
PAD, KT, KN, LOAD = 9, 20e3, 30e3, 90.0

# The rig of the lumped tests as a reduced body of two displacements.
TWO_MASSES = ReducedModel(
    kept=np.arange(2),
    stiffness=STIFF,
    mass=MASS,
    loads=np.zeros((2, 0)),
    mode_shapes=np.zeros((2, 0)),
    frequencies=np.zeros(0),
    names=("block x", "holder x"),
)
BODY = """\
structure:
  kind: reduced
  file: two.h5
  joints: [{points: holder, direction: x}]
  damping_ratio: 0.1
  driven: {points: block, direction: x}
  seen: {points: holder, direction: x}
"""
AS_A_BODY = RIG.replace(next(line for line in RIG.splitlines(True) if "kind: rig" in line), BODY)


@pytest.fixture(scope="module")
def coarsest(tmp_path_factory) -> Iterator[Path]:
    """Return a case of specimens with 9 pad points and 4 ring points, and a separate cache."""
    folder = tmp_path_factory.mktemp("specimens")
    path = folder / "specimens.yaml"
    path.write_text(dump_case(load_case(CASES / "specimens_coarse.yaml", COARSE)), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FRETSCALE_CACHE", str(folder / "cache"))
        yield path


@pytest.fixture(scope="module")
def body(coarsest) -> ReducedModel:
    """Return its upper specimen."""
    return reduced_pair(load_case(coarsest)).reduction.models[1]


@pytest.fixture
def specimen(body, tmp_path) -> Path:
    """Return a folder with the body."""
    save_reduced(tmp_path / "body_2.h5", body)
    return tmp_path


@pytest.fixture
def two_masses(tmp_path) -> Path:
    save_reduced(tmp_path / "two.h5", TWO_MASSES)
    return tmp_path


def rig_of(folder: Path, *overrides: str, text: str = SPECIMEN):
    """Return the rig of a case and its joints."""
    case = parse_case(text, str(folder / "case.yaml"), overrides)
    mass = getattr(case, "mass", None)
    rig = rig_model(case.structure, case.joint, mass, Reporter(folder / "run.log"))
    return rig, JointModel.of(case, rig.counts)


def row(rig: RigModel, kind: str, axis: str) -> np.ndarray:
    """Return the mean displacement of points of one kind."""
    chosen = [name.startswith(f"{kind} ") and name.endswith(f" {axis}") for name in rig.model.names]
    return np.array(chosen) / sum(chosen)


# --- points -------------------------------------------------------------------------------------


def test_points_of_a_specimen_are_where_their_names_say(body):
    """Rigid motions built from names and places need no force."""
    assert body.names[0] == "pad 1 x"
    assert body.names[-1] == "ring 4 z"
    np.testing.assert_allclose(body.places[: 3 * PAD, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(body.places[3 * PAD :, 2], 2.0, atol=1e-12)
    axis = np.array(["xyz".index(name[-1]) for name in body.names])
    for turn in np.eye(3):
        moved = np.cross(turn, body.places)[np.arange(len(axis)), axis]
        force = body.static_stiffness @ moved
        assert np.abs(force).max() < 1e-9 * np.abs(body.static_stiffness).max()


def test_names_and_places_are_stored(body, specimen):
    read = load_reduced(specimen / "body_2.h5")
    assert read.names == body.names
    np.testing.assert_array_equal(read.places, body.places)


def test_a_case_of_specimens_is_reduced_first(coarsest, specimen, body):
    """The rig equals that from the file of its run; the second time it comes from the cache."""
    setting = f"structure.file={coarsest}"
    rigs = [rig_of(specimen, *given)[0] for given in ((), (setting, "structure.body=2"))]
    for name in ("mass", "damping", "stiffness", "connection"):
        one, other = (getattr(rig.model, name) for rig in rigs)
        np.testing.assert_array_equal(one, other)
    assert "from the cache" in (specimen / "run.log").read_text(encoding="utf-8")
    with pytest.raises(CaseError, match=r"missing; allowed: .* 1 or 2"):
        rig_of(specimen, setting)


def test_directions_and_shares(specimen):
    """A friction contact under the body closes as it moves down; shares are equal."""
    rig, joint = rig_of(specimen)
    assert (rig.joints, rig.directions) == (PAD, 3)
    down = -row(rig, "pad", "z") * PAD
    np.testing.assert_array_equal((rig.model.connection @ down).reshape(PAD, 3), [[0, 0, 1]] * PAD)
    np.testing.assert_array_equal(rig.driven, row(rig, "ring", "x"))
    np.testing.assert_array_equal(rig.seen, [row(rig, "pad", "x")])
    assert joint.at(0.0).stiffness == KT / PAD
    assert joint.parameters(0.0)["normal_load"] == LOAD
    rig, _ = rig_of(specimen, "structure.joints=[{points: pad 3, against: ring 2, direction: y}]",
                    "joint={law: jenkins, normal_load: 1, friction: 1, stiffness: 1}")  # fmt: skip
    (stretch,) = rig.model.connection
    ends = {rig.model.names[place]: stretch[place] for place in np.flatnonzero(stretch)}
    assert ends == {"pad 3 y": 1.0, "ring 2 y": -1.0}


@pytest.mark.parametrize(
    "law",
    [
        "law: jenkins, residual_stiffness: 1e3",
        "law: bouc_wen, residual_stiffness: 1e3",
        "law: uniform_iwan, residual_stiffness: 1e3",
        "law: four_parameter_iwan, chi: -0.5, beta: 1",
        "law: friction_contact, normal_stiffness: 3e4",
    ],
)
def test_joints_that_move_alike_are_together_the_one_they_share(specimen, law):
    joint = f"joint={{{law}, normal_load: 90, friction: 0.5, stiffness: 2e4}}"
    case = parse_case(SPECIMEN, str(specimen / "case.yaml"), [joint])
    forces = []
    for count in (1, 4):
        each = JointModel.of(case, (count,)).at(0.0)
        path = 0.01 * np.array([1.0, -1.0, 0.5])[:, None, None] * np.ones(each.directions)
        alike = np.repeat(path, count, axis=1)
        followed = march_joints(each, each.rest(count), np.zeros(alike.shape[1:]), alike)
        forces.append((followed.force.sum(axis=1), followed.dissipated.sum(axis=1)))
    assert forces[0][1].sum() > 0.1
    for one, four in zip(*forces, strict=True):
        np.testing.assert_allclose(four, one, rtol=1e-12, atol=1e-12)


# --- limits -------------------------------------------------------------------------------------


def test_one_jenkins_joint_is_the_lumped_rig(two_masses):
    loud = "excitation.force=200 N"
    reduced = run(two_masses, AS_A_BODY, loud)
    lumped = run(two_masses / "lumped", RIG, loud)
    assert reduced["free"] == pytest.approx(lumped["free"], rel=1e-12)
    one, other = reduced["states"][0], lumped["states"][0]
    assert other["energy_per_cycle"] > 0.0
    for name in ("stroke", "energy_per_cycle", "force", "stuck", "sliding", "extracted"):
        assert one[name] == pytest.approx(other[name], rel=1e-9), name
    assert one["amplitudes"][0] == pytest.approx(other["amplitudes"][-1], rel=1e-9)


def test_a_stuck_body_is_linear(specimen, body):
    """Frequencies and the amplitude at 400 Hz agree with matrices assembled here.

    The amplitude has the error of the step in the period, as in the lumped rig.
    """
    state = run(specimen, SPECIMEN, "joint.friction=10", "excitation.steady=1e-8")["states"][0]
    axis = np.array(["xyz".find(name[-1]) for name in body.names])
    pad = np.array([name.startswith("pad") for name in body.names])
    held = np.where(pad, np.array([KT, KT, KN])[axis] / PAD, np.array([1e3, 1e5, 1e5])[axis] / 4)
    modes = len(body.stiffness) - len(axis)
    mass = body.mass + np.diag(np.pad(np.where(pad, 0.0, 1e-4 / 4), (0, modes)))
    free = body.stiffness + np.diag(np.pad(np.where(pad, 0.0, held), (0, modes)))
    stuck = body.stiffness + np.diag(np.pad(held, (0, modes)))
    frequencies = np.sqrt(sl.eigh(stuck, mass, eigvals_only=True)) / (2.0 * np.pi)
    assert state["stuck"] == pytest.approx(frequencies[:20], rel=1e-9)
    squares, shapes = sl.eigh(free, mass)
    damping = (mass @ shapes * (0.1 * np.sqrt(squares))) @ (mass @ shapes).T
    angular = 2.0 * np.pi * 400.0
    shape = np.pad(np.where(pad | (axis != 0), 0.0, 10.0 / 4), (0, modes))
    answer = np.linalg.solve(stuck - angular**2 * mass + 1j * angular * damping, shape)
    seen = abs(answer[: len(axis)][pad & (axis == 0)].mean())
    assert state["amplitudes"] == pytest.approx([seen], rel=0.5 * (angular * 50e-6) ** 2)
    assert state["energy_per_cycle"] == 0.0


@pytest.mark.parametrize("direction", ["x", "z"])
def test_energies_balance_while_the_contact_slides_and_lifts_off(specimen, direction):
    rig, joint = rig_of(specimen, f"structure.driven={{points: ring, direction: {direction}}}")
    blow = HammerBlow(rig.driven, 2000.0, 4e-4)
    motion = motion_of(rig, joint, 0.0, blow, 0.02, TimeStepControl(2e-5))
    energies = motion.energies
    brought = np.abs(np.diff(energies.excitation)).sum()
    assert np.abs(energies.missing).max() < ROUNDING * brought
    assert np.diff(energies.joints, axis=0).min() >= 0.0
    reported = rig.contact(motion)
    assert reported["largest_normal_force"] > LOAD > reported["smallest_normal_force"]
    if direction == "x":
        assert energies.joints[-1].sum() > 0.01 * brought
    else:
        assert reported["most_open"] == PAD
        assert reported["smallest_normal_force"] == 0.0
    # Coulomb's cone, at every point and time.
    force = motion.joint_force
    assert np.all(np.hypot(*force[:, :, :2].T) <= 0.5 * force[:, :, 2].T + ROUNDING * LOAD)


def test_a_preload_is_balanced_at_rest(specimen):
    rig, joint = rig_of(specimen)
    still = HammerBlow(rig.driven, 0.0, 1e-3)
    motion = motion_of(rig, joint, 0.0, still, 0.005, TimeStepControl(5e-5))
    assert np.abs(motion.displacement).max() < 1e-12
    np.testing.assert_allclose(motion.joint_force[:, :, 2], LOAD / PAD, rtol=ROUNDING)


def test_a_gap_closes(specimen):
    """It is pushed down slowly within half a second onto springs kn, from 10 µm on."""
    gap = "joint={law: friction_contact, normal_load: 0, gap: 10 um, friction: 0.5, "
    rig, joint = rig_of(specimen, gap + "stiffness: 20 N/um, normal_stiffness: 30 N/um}",
                        "structure.driven={points: pad, direction: -z}")  # fmt: skip
    push = HammerBlow(rig.driven, 2000.0, 1.0)
    motion = motion_of(rig, joint, 0.0, push, 0.5, TimeStepControl(1e-3))
    touching = motion.joint_force[:, :, 2].sum(axis=1)
    down = motion.joint_displacement[:, :, 2]
    expected = KN / PAD * np.maximum(down - 0.01, 0.0)
    np.testing.assert_allclose(motion.joint_force[:, :, 2], expected, atol=1e-6)
    assert touching[0] == 0.0
    # The contact and the holder, 100 N/µm along z, bear the push together.
    holder = -1e5 * (motion.displacement[-1] @ row(rig, "ring", "z"))
    assert touching[-1] + holder == pytest.approx(2000.0, rel=1e-3)
    assert touching[-1] > 100.0


# --- refusals -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("excitation.mass=1", "excitation.mass"),
        ("structure.joints=[]", "structure.joints"),
        ("structure.joints.0.direction=w", "structure.joints.0.direction"),
        ("joint.gap=1 um", "joint.gap"),
    ],
)
def test_a_wrong_case_is_refused(specimen, override, named):
    with pytest.raises(CaseError, match=named):
        parse_case(SPECIMEN, str(specimen / "case.yaml"), [override])


@pytest.mark.parametrize(
    "override",
    [
        "structure.driven.points=nose",
        "structure.joints.0.against=ring",
        "structure.joints.0.against=pad",
        "structure.masses.0.points=rim",
    ],
)
def test_points_that_are_not_there_are_refused(specimen, override):
    code, message = refused(specimen, SPECIMEN, override)
    assert code == 2
    assert override.partition("=")[0].partition(".")[2] in message


def test_points_of_specimens_are_known_before_they_are_meshed():
    """Their number follows from the case: nine by nine pad nodes, eight ring nodes."""
    case = str(CASES / "rig_reduced.yaml")
    with pytest.raises(CaseError, match=r"no such point; allowed: pad, pad 1 to pad 81, ring, .*"):
        load_case(case, ["structure.joints.0.points=pad 82"])
    load_case(case, ["structure.joints.0.points=pad 81", "structure.joints.0.against=ring 8"])


@pytest.mark.parametrize("missing", ["names", "mass"])
def test_files_without_names_or_mass_are_refused(two_masses, missing):
    save_reduced(two_masses / "two.h5", ReducedModel(**(vars(TWO_MASSES) | {missing: None})))
    with pytest.raises(UserError, match=missing):
        rig_of(two_masses, text=AS_A_BODY)
