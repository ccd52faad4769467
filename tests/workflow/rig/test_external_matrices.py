"""Tests of matrices as the structure of a rig: the built-in rig as reference, and refusals."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from tests.conftest import CASES
from tests.workflow.command_line import command
from tests.workflow.rig.test_reduced_rig import TWO_MASSES
from tests.workflow.vibration.time_scenes import MASS, STIFF, run
from workflow.analyses.rig.bodies import matrix_body
from workflow.analyses.rig.building import rig_model
from workflow.case.plausibility import plausibility_warnings_of
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError, UserError
from workflow.kinds import load_case, parse_case
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.terminal.reporter import Reporter

STRUCTURE = """\
structure:
  kind: matrices
  matrices: {file: two.npz, unknowns: unknowns.csv, units: {length: mm, force: N}}
  joints: [{points: holder, direction: x}]
  damping_ratio: 0.1
  driven: {points: block, direction: x}
  seen: {points: holder, direction: x}
"""
LUMPED = """\
structure: {kind: rig, masses: [20 kg, 1 kg], springs: [1 N/um, 200 N/um], damping_ratio: 0.1}
"""
REST = """\
title: Two masses
analysis: vibration
joint: {law: jenkins, normal_load: 100 N, friction: 0.5, stiffness: 10 N/um}
forces: [50 N]
frequencies: [57 Hz, 62 Hz]
resolution: {harmonics: 3}
output: {figures: false, report: false}
"""
OWN, RIG = STRUCTURE + REST, LUMPED + REST
IN_METRES = "structure.matrices.units={length: m, force: kN}"
ROWS = "point,direction\nblock,x\nholder,x\n"


@pytest.fixture
def two(tmp_path) -> Path:
    """Return a folder with the two masses of the lumped rig, and a load on the first of them."""
    np.savez(tmp_path / "two.npz", K=STIFF, M=MASS, F=np.array([[1.0], [0.0]]))
    (tmp_path / "unknowns.csv").write_text(ROWS, encoding="utf-8")
    return tmp_path


def rig_of(folder: Path, *overrides: str, text: str = OWN):
    case = parse_case(text, str(folder / "case.yaml"), overrides)
    return rig_model(case.structure, case.joint, None, Reporter(folder / "run.log"))


def reported(folder: Path, *overrides: str, text: str = OWN) -> str:
    """Return the line that refuses a case."""
    with pytest.raises(CaseError) as refusal:
        parse_case(text, str(folder / "case.yaml"), overrides)
    (line,) = str(refusal.value).splitlines()
    assert "allowed: " in line
    return line


# --- the same structure -------------------------------------------------------------------------


def test_two_masses_answer_as_the_rig_that_is_built_in(two):
    """A Jenkins joint by harmonic balance, with the force given by points and by a load."""
    lumped = run(two / "lumped", RIG)["responses"][0]
    assert lumped["energy_per_cycle"] > 0.0
    for ways in ((), ("structure.driven={load: 1}",)):
        own = run(two, OWN, *ways)["responses"][0]
        for name in ("resonance", "amplitude", "energy_per_cycle", "receptance"):
            assert own[name] == pytest.approx(lumped[name], rel=1e-9), name


def test_units_are_those_of_the_files(two):
    """K in kN/m, M in t and reversed rows give the same rig."""
    np.savez(two / "two.npz", K=STIFF[::-1, ::-1], M=MASS[::-1, ::-1])
    (two / "unknowns.csv").write_text("point,direction\nholder,x\nblock,x\n", encoding="utf-8")
    rig = rig_of(two, IN_METRES)
    assert rig.model.names == ("holder x", "block x")
    np.testing.assert_allclose(rig.model.stiffness[::-1, ::-1], STIFF, rtol=1e-12)
    np.testing.assert_allclose(rig.model.mass[::-1, ::-1], MASS, rtol=1e-12)
    np.testing.assert_array_equal(rig.driven, [0.0, 1.0])


def test_damping_comes_to_that_of_the_modes(two):
    np.savez(two / "two.npz", K=STIFF, M=MASS, C=1e-4 * STIFF)
    damped, without = rig_of(two), rig_of(two, "structure.matrices.file=two.npz")
    np.testing.assert_array_equal(damped.model.damping, without.model.damping)
    np.savez(two / "two.npz", K=STIFF, M=MASS)
    without = rig_of(two)
    difference = damped.model.damping - without.model.damping
    np.testing.assert_allclose(difference, 1e-4 * STIFF, rtol=1e-9)


def test_what_a_specimens_run_leaves_is_read_as_matrices(two):
    """``reduced`` and ``matrices`` of one file give the same rig, with its modes as modes."""
    from fe_models.joints.reduction import save_reduced

    save_reduced(two / "body.h5", TWO_MASSES)
    own = rig_of(two, "structure.matrices={file: body.h5, units: {length: mm, force: N}}")
    built_in = STRUCTURE.replace("kind: matrices", "kind: reduced").replace(
        "matrices: {file: two.npz, unknowns: unknowns.csv, units: {length: mm, force: N}}",
        "file: body.h5",
    )
    reduced = rig_of(two, text=built_in + REST)
    for name in ("mass", "damping", "stiffness", "connection"):
        np.testing.assert_array_equal(getattr(own.model, name), getattr(reduced.model, name))


@pytest.mark.slow
def test_exported_bodies_come_back_in_every_format(tmp_path, monkeypatch):
    """A run of specimens writes its bodies; a rig on each file answers as on ``body_2.h5``."""
    monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path / "cache"))
    coarse = (
        "structure.ring_nodes=4",
        "mesh={pad_elements: 2, size: 8 mm, order: 1}",
        "reduction.modes=3",
        "load_path.normal_forces=[60 N]",
        "wear.cycles=1000",
        "expect=[]",
        "output={figures: false, report: false, paraview: false, matrices: [npz, mat, mtx]}",
    )
    specimens = dump_case(load_case(CASES / "specimens_coarse.yaml", coarse))
    run(tmp_path / "specimens", specimens)
    bodies = tmp_path / "specimens" / "out" / "reduced"
    text = (CASES / "rig_reduced.yaml").read_text(encoding="utf-8").partition("assumed:")[0]
    text = text.replace("  body: 2\n", "")
    settings = "output={figures: false, report: false}", "excitation.record=0.02 s"
    file = "file: specimens_coarse.yaml"
    expected = run(tmp_path / "h5", text.replace(file, f"file: {bodies}/body_2.h5"), *settings)
    parts = ("stiffness", "mass", "unknowns")
    ending = {"stiffness": "mtx", "mass": "mtx", "unknowns": "csv"}
    apart = ", ".join(f"{part}: {bodies}/body_2_{part}.{ending[part]}" for part in parts)
    for files in (f"file: {bodies}/body_2.npz", f"file: {bodies}/body_2.mat", apart):
        own = f"matrices: {{{files}, units: {{length: mm, force: N}}}}"
        summary = run(
            tmp_path / "own", text.replace("kind: reduced", "kind: matrices").replace(file, own),
            *settings,
        )  # fmt: skip
        assert summary["free"] == pytest.approx(expected["free"], rel=1e-10)
        one, other = summary["states"][0], expected["states"][0]
        assert one["first_frequency"] == pytest.approx(other["first_frequency"], rel=1e-10)
        assert one["stuck"] == pytest.approx(other["stuck"], rel=1e-10)


# --- large matrices -----------------------------------------------------------------------------


def row_of(two: Path, count: int) -> str:
    """Write a row of ``count`` masses, fixed at one end, as sparse matrices in two files."""
    diagonals = [-np.ones(count - 1), 2.0 * np.ones(count), -np.ones(count - 1)]
    sp.save_npz(two / "k.npz", 1e5 * sp.diags(diagonals, [-1, 0, 1], format="csr"))
    sp.save_npz(two / "m.npz", 1e-6 * sp.identity(count, format="csr"))
    rows = [f"node {number},x" for number in range(1, count)] + ["tip,x"]
    (two / "unknowns.csv").write_text("\n".join(["point,direction", *rows, ""]), encoding="utf-8")
    files = "{stiffness: k.npz, mass: m.npz, unknowns: unknowns.csv, units: {length: mm, force: N}}"
    text = OWN.replace("points: holder", "points: tip").replace("points: block", "points: tip")
    whole = "{file: two.npz, unknowns: unknowns.csv, units: {length: mm, force: N}}"
    return text.replace(f"matrices: {whole}", f"matrices: {files}")


def test_large_matrices_are_reduced(two):
    text = row_of(two, 3000)
    path = two / "case.yaml"
    path.write_text(text, encoding="utf-8")
    checked = command("check", path)
    assert checked.exit_code == 0
    assert "warning: structure.retained: none, so that all 3000 unknowns are kept" in checked.stdout
    rig = rig_of(two, "structure.retained=[tip]", "structure.modes=8", text=text)
    assert rig.model.names == ("tip x", *(f"mode {number}" for number in range(1, 9)))
    # Of a row that is fixed at both ends: a spring is to the ground behind the tip, too.
    first = 2.0 * np.sqrt(1e5 / 1e-6) * np.sin(np.pi / (2.0 * 3001)) / (2.0 * np.pi)
    assert rig.free()[0] == pytest.approx(first, rel=1e-3)
    assert f"{first:.5g}" in checked.stdout


def test_more_than_the_memory_ends_before_it_begins(two, monkeypatch):
    text = row_of(two, 3000)
    (two / "case.yaml").write_text(text, encoding="utf-8")
    monkeypatch.setattr("workflow.shell.memory._available_bytes", lambda: 1.5e9)
    ended = command("check", two / "case.yaml")
    assert ended.exit_code == 4
    assert "give structure.retained and structure.modes" in ended.stderr


SHAKEN = "excitation={{forces: [{{points: {}, amplitude: 1}}]}}"


@pytest.mark.parametrize("retained", [(), ("structure.retained=[block]", "structure.modes=0")])
def test_places_are_known_before_large_matrices_are_reduced(two, monkeypatch, retained):
    """Even places that a check does not reduce are known by their names."""
    if retained:
        monkeypatch.setattr(matrix_body, "SMALL", 1)
    driven = ("forces=", "structure.driven=", *retained)
    places = [f"structure.{name}.points=block" for name in ("joints.0", "seen")]
    printed = reported(two, *driven, *places, SHAKEN.format("tip"))
    assert "excitation.forces.0.points: 'tip': no such point; allowed: block" in printed
    dashpot = "structure.damping={dashpots: [{points: block, direction: y, coefficient: 1}]}"
    assert (
        "block does not move along y; allowed: x"
        in reported(two, *places, *retained, dashpot)[:400]
    )
    parse_case(OWN, str(two / "case.yaml"), [*driven, *places, SHAKEN.format("block")])


# --- without mass -------------------------------------------------------------------------------


def test_points_without_mass_follow_the_others(two):
    """A joint there is refused, unless mass is added."""
    K = np.diag([3.0, 3.0, 2.0]) - np.eye(3, k=1) - np.eye(3, k=-1)
    np.savez(two / "two.npz", K=1e3 * K, M=np.diag([1e-3, 1e-3, 0.0]))
    (two / "unknowns.csv").write_text(f"{ROWS}tip,x\n", encoding="utf-8")
    rig = rig_of(two)
    assert rig.model.names == ("block x", "holder x")
    assert rig.model.stiffness[1, 1] == pytest.approx(1e3 * (3.0 - 0.5))
    log = (two / "run.log").read_text(encoding="utf-8")
    assert "tip x have no mass and follow the others statically" in log
    at_the_tip = "structure.joints=[{points: tip, direction: x}]"
    with pytest.raises(UserError, match=r"tip'.*no mass.*structure\.masses"):
        rig_of(two, at_the_tip)
    laden = rig_of(two, at_the_tip, "structure.masses=[{points: tip, mass: 1 g}]")
    assert np.diag(laden.model.mass) == pytest.approx([1e-3, 1e-3, 1e-6])


def test_a_joint_on_a_point_without_mass_is_in_series_with_its_spring(two):
    """Jenkins' 10 N/µm in series with 30 N/µm to the holder equals 7.5 N/µm on the holder."""
    K = np.pad(STIFF, (0, 1)) + 30e3 * np.outer([0, -1, 1], [0, -1, 1])
    np.savez(two / "two.npz", K=K, M=np.pad(MASS, (0, 1)))
    (two / "unknowns.csv").write_text(f"{ROWS}tip,x\n", encoding="utf-8")
    at_the_tip = "structure.joints=[{points: tip, direction: x}]", "structure.massless=10 MHz"
    fine = "resolution={harmonics: 20, samples: 1024}"
    own = run(two, OWN, *at_the_tip, fine)["responses"][0]
    lumped = run(two / "lumped", RIG, "joint.stiffness=7.5 N/um", fine)["responses"][0]
    # What harmonics leave, which falls by their square: 4e-4 with ten.
    for name in ("amplitude", "energy_per_cycle"):
        assert own[name] == pytest.approx(lumped[name], rel=1.5e-4), name
    assert lumped["energy_per_cycle"] > 0.0
    (two / "case.yaml").write_text(OWN, encoding="utf-8")
    checked = command("check", two / "case.yaml", overrides=["structure.massless=2 kHz"])
    assert "warning: structure.massless: 2000 Hz is too low: at 310 Hz" in checked.stdout


def test_a_mode_far_below_the_fastest_gives_a_warning(two):
    np.savez(two / "two.npz", K=np.diag([1.0, 1e7, 2e7, 1e14]), M=1e-3 * np.eye(4))
    (two / "unknowns.csv").write_text(f"{ROWS}a,x\nb,x\n", encoding="utf-8")
    rig_of(two)
    warning = "the mode of 5.03 Hz"
    assert warning in (two / "run.log").read_text(encoding="utf-8")


def test_added_masses_do_not_turn(two):
    (two / "unknowns.csv").write_text("point,direction\nblock,x\nblock,rz\n", encoding="utf-8")
    at = "structure.joints=[{points: block, direction: x}]", "structure.seen.points=block"
    rig = rig_of(two, *at, "structure.masses=[{points: block, mass: 1 kg}]")
    np.testing.assert_allclose(np.diag(rig.model.mass), [0.021, 0.001])


# --- warnings and refusals ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("structure.matrices={units: {length: mm, force: N}}", "structure.matrices.file"),
        ("structure.matrices.units={length: mm, force: mm}", "structure.matrices.units.force"),
        ("structure.matrices.stiffness=two.npz:Kred", "Kred"),
        ("structure.matrices.file=gone.mat", "gone.mat"),
        ("structure.modes=3", "structure.modes"),
        ("structure.joints.0.points=tip", "structure.joints.0.points"),
        ("structure.driven={load: 2}", "structure.driven={load: 2}"),
    ],
)
def test_wrong_entries_are_named(two, override, named):
    assert named in reported(two, override)


def test_matrices_by_other_names_are_offered(two):
    """Such as a damping D, which would be ignored silently, and loads where they are needed."""
    given = {"K": STIFF, "M": MASS, "D": 1e-4 * STIFF, "B": np.eye(2)[:, :1], "shapes": np.eye(3)}
    scipy.io.savemat(two / "plant.mat", {**given, "title": "two masses"})
    file = "structure.matrices.file=plant.mat"
    ((kind, warned),) = plausibility_warnings_of(parse_case(OWN, str(two / "case.yaml"), [file]))
    assert kind is WarningKind.DAMPING_NOT_TAKEN
    assert "plant.mat:D" in warned
    line = reported(two, file, "structure.driven={load: 1}")
    assert "no loads have a usual name, or matrices.loads: plant.mat:B" in line
    taken = [file, "structure.matrices.damping=plant.mat:D", "structure.matrices.loads=plant.mat:B"]
    assert not list(plausibility_warnings_of(parse_case(OWN, str(two / "case.yaml"), taken)))
    difference = rig_of(two, *taken).model.damping - rig_of(two, file).model.damping
    np.testing.assert_allclose(difference, 1e-4 * STIFF, rtol=1e-9)
    np.testing.assert_array_equal(rig_of(two, *taken, "structure.driven={load: 1}").driven, [1, 0])


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("point,direction\nblock,x\n", "unknowns"),
        ("point,direction\nblock,x\nblock,x\n", "block x"),
        ("point,direction\nblock,x\nholder,w\n", "unknowns.csv:3: direction"),
        ("point\nblock\nholder\n", "direction"),
        ("node,point\n1,block\n1,holder\n", "unknowns.csv:3: node"),
    ],
)
def test_wrong_unknowns_are_refused(two, text, place):
    (two / "unknowns.csv").write_text(text, encoding="utf-8")
    assert place in reported(two)


@pytest.mark.parametrize(
    ("matrices", "key"),
    [
        ({"K": STIFF}, "file"),
        ({"K": STIFF, "M": np.eye(3)}, "unknowns"),
        ({"K": np.tril(STIFF), "M": MASS}, "file"),
        ({"K": STIFF, "M": -MASS}, "file"),
        ({"K": STIFF, "M": MASS, "F": np.full((2, 1), np.inf)}, "file"),
    ],
)
def test_wrong_matrices_are_refused(two, matrices, key):
    np.savez(two / "two.npz", **matrices)
    assert f"structure.matrices.{key}: " in reported(two)


def test_a_file_that_changes_is_read_again(two):
    before = rig_of(two).model.stiffness
    np.savez(two / "two.npz", K=2.0 * STIFF, M=MASS, changed=1.0)
    np.testing.assert_array_equal(rig_of(two).model.stiffness, 2.0 * before)
