"""Tests of contact cases from the command line: their files, failures and references."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from sa_solver import (
    ContactLoad,
    ElasticPair,
    FrictionalContact,
    Grid,
    HalfSpace,
    Layer,
    Material,
)
from sa_solver.cycles.history import History
from tests.workflow.command_line import invoke
from tests.workflow.conftest import manifest_has_all
from workflow.analyses.contact import run as contact_run
from workflow.messages.warning_kinds import WarningKind, kinds_in

SMALL = """\
title: Ball
analysis: contact
structure: {kind: bodies, shape: sphere, radius: 10 mm}
materials:
  body_1: {young: 115 GPa, poisson: 0.29, yield_stress: 900 MPa}
  body_2: {young: 115 GPa, poisson: 0.29}
friction: {coefficient: 0.7}
load_path:
  legs:
    - {P: 400 N}
    - {Qx: 210 N, increments: 3}
    - {Qx: -210 N, increments: 4}
    - {Qx: 210 N, increments: 4}
contact: {grid: [32, 32], size: [1 mm, 1 mm], history: full}
output: {paraview: false, figures: false}
"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(SMALL, encoding="utf-8")
    return path


def summary_of(folder):
    text = (folder / "summary.json").read_text(encoding="utf-8")
    assert "NaN" not in text
    assert "Infinity" not in text
    return json.loads(text)


# --- what the run does with what the solver says ------------------------------------------------


def states(count, **last):
    """Return states of an idle contact, the last one with changes."""
    nothing = {
        "traction": np.zeros((3, 32, 32)),
        "slip": np.zeros((2, 32, 32)),
        "gap": np.zeros((32, 32)),
        "resultants": np.zeros(6),
        "rigid": np.zeros(6),
        "energy": np.zeros(2),
        "sliding": False,
        "residual": 1e-9,
        "converged": True,
        "message": "",
        "convolutions": 1,
        "border_load": 0.0,
        "flattening": None,
        "limit": None,
    }
    return [SimpleNamespace(**(nothing | (last if k == count - 1 else {}))) for k in range(count)]


@pytest.fixture
def solver(monkeypatch):
    """Replace the solver by one that returns these states."""

    def stand_in(computed):
        history = History(computed, list(range(len(computed))), "full", "asked for")
        monkeypatch.setattr(contact_run, "march_history", lambda *given, **settings: history)

    return stand_in


def test_increment_that_does_not_converge_ends_the_run_and_keeps_the_others(
    solver, small, tmp_path
):
    solver(states(3, converged=False, message="residual 1e-3 after 300; raise the tolerance"))
    out = tmp_path / "out"
    done = invoke("run", small, "--out", out)
    assert done.exit_code == 3
    line = done.stderr.splitlines()[-1]
    assert "increment 3 of 12 did not converge: residual 1e-3 after 300; raise the tol" in line
    assert str(out / "results.h5") in line
    with h5py.File(out / "results.h5") as file:
        assert list(file["history/increment"]) == [1, 2, 3]
    assert not (out / "summary.json").exists()
    resumed = invoke("resume", out)
    assert resumed.exit_code == 2
    (line,) = resumed.stderr.splitlines()
    assert f"start it again with `fretscale run {out / 'case.yaml'} --out {out}`" in line
    # As told; the folder is this case's own.
    solver(states(12))
    again = invoke("run", out / "case.yaml", "--out", out)
    assert again.exit_code == 0, again.stderr
    assert invoke("resume", out).exit_code == 0


UNLIKE = """\
title: Rigid ball on rubber
analysis: contact
structure: {kind: bodies, shape: sphere, radius: 10 mm}
materials: {body_1: rigid, body_2: {young: 115 GPa, poisson: 0}}
friction: {coefficient: 0.5}
load_path: {legs: [{P: 400 N}]}
contact: {grid: [20, 20], size: [0.8 mm, 0.8 mm]}
output: {paraview: false, figures: false}
"""


def test_dissimilar_bodies_pressed_in_one_increment_are_followed_or_warned_of(tmp_path):
    path = tmp_path / "unlike.yaml"
    path.write_text(UNLIKE, encoding="utf-8")
    summaries = []
    for history in ("auto", "full"):
        out = tmp_path / history
        done = invoke("run", path, "--out", out, "--set", f"contact.history={history}")
        assert done.exit_code == 0, done.stderr
        summaries.append(summary_of(out))
    split, given = summaries
    assert split["warnings"] == []
    assert split["history"]["parts"] > 4
    assert split["history"]["error"] <= 0.02
    # Passes that were too coarse count too, though their states are not kept.
    kept = [sum(state["convolutions"] for state in found["states"]) for found in summaries]
    assert split["convolutions"] > 1.2 * kept[0]
    logged = re.findall(r"(\d+) convolutions", (tmp_path / "auto" / "run.log").read_text())
    assert split["convolutions"] == sum(map(int, logged[:-1])) == int(logged[-1])
    assert given["convolutions"] > kept[1]
    assert "shear within" in done.output
    radii = [found["states"][0]["stick_radius"] for found in summaries]
    assert radii[1] < 0.7 * radii[0]
    (warning,) = given["warnings"]
    assert "contact.history: auto" in warning
    assert "load_path.legs.0.increments" in warning


def test_too_many_cells_are_refused_before_anything_is_done(monkeypatch, small, tmp_path):
    from workflow.shell import memory

    monkeypatch.setattr(memory, "_available_bytes", lambda: 2e9)
    done = invoke("run", small, "--out", tmp_path / "out", "--set", "contact.grid=[4096, 4096]")
    assert done.exit_code == 4
    (line,) = done.stderr.splitlines()
    assert "lower contact.grid" in line
    assert not (tmp_path / "out").exists()


# --- runs ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return a run of the small case with every file, which tests must not change."""
    folder = tmp_path_factory.mktemp("whole")
    path = folder / "small.yaml"
    path.write_text(SMALL, encoding="utf-8")
    pictures = ["--set", "output.paraview=true", "--set", "output.figures=true"]
    done = invoke("run", path, "--out", folder / "out", *pictures)
    assert done.exit_code == 0, done.stderr
    return folder / "out"


def test_folder_holds_what_it_promises(whole):
    names = {path.name for path in whole.iterdir()}
    assert names == {
        *("case.yaml", "summary.json", "results.h5", "run.log", "paraview", "figures"),
        *("manifest.json", "report.html"),
    }
    assert manifest_has_all(whole)
    assert {path.stem for path in (whole / "figures").iterdir()} == {"profiles", "maps", "forces"}
    assert len(list((whole / "paraview" / "contact").iterdir())) == 12


def test_summary_has_states_and_the_loop(whole):
    summary = summary_of(whole)
    assert [state["increment"] for state in summary["states"]] == list(range(1, 13))
    assert summary["history"]["method"] == "full"
    for state in summary["states"]:
        assert state["P"] == pytest.approx(400.0, rel=1e-6)
        assert state["residual"] <= 1e-8
        assert state["energy"] >= -1e-9
    loop = summary["loop"]
    assert (loop["from_increment"], loop["to_increment"]) == (4, 12)
    # Eight steps around the loop: the trapezoids' area to a few per cent.
    assert loop["area"] == pytest.approx(loop["energy"], rel=0.1)
    assert WarningKind.PRESSURE_ABOVE_YIELD in kinds_in(summary["warnings"])


def test_path_from_a_file_is_the_same_run(whole, small, tmp_path):
    forces = [0, 70, 140, 210, 105, 0, -105, -210, -105, 0, 105, 210]
    rows = "".join(f"400,{force}\n" for force in forces)
    (tmp_path / "history.csv").write_text(f"P,Qx\n{rows}", encoding="utf-8")
    done = invoke("run", small, "--out", tmp_path / "out", "--set", "load_path={file: history.csv}")
    assert done.exit_code == 0, done.stderr
    assert summary_of(tmp_path / "out")["states"] == summary_of(whole)["states"]


def test_heights_from_a_file_are_the_same_run(whole, small, tmp_path):
    with h5py.File(whole / "results.h5") as file:
        np.save(tmp_path / "gap.npy", file["surfaces/bodies/height"][()])
    shape = "structure={kind: bodies, shape: heights, file: gap.npy}"
    done = invoke("run", small, "--out", tmp_path / "out", "--set", shape)
    assert done.exit_code == 0, done.stderr
    assert summary_of(tmp_path / "out")["states"] == summary_of(whole)["states"]


def test_force_that_no_friction_can_carry_ends_the_run(whole, small, tmp_path):
    done = invoke(
        *("run", small, "--out", tmp_path / "out"),
        *("--set", "load_path.legs=[{P: 400 N}, {Qx: 300 N}]"),
    )
    assert done.exit_code == 3
    assert "Traceback" not in done.stderr
    line = done.stderr.splitlines()[-1]
    assert "after increment 1 of 2: " in line
    assert str(tmp_path / "out" / "results.h5") in line


def test_contact_needs_no_finite_elements(whole, small, tmp_path):
    code = f"""
import sys
from pathlib import Path
from workflow.kinds import load_case
from workflow.runs.run import run_case
run_case(load_case({str(small)!r}), Path({str(tmp_path / "out")!r}), False)
assert not {{"gmsh", "skfem", "meshio"}} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


# --- shipped cases ------------------------------------------------------------------------------


def test_a_periodic_patch_has_no_border(tmp_path):
    """Heights moved by a part of the grid give the same results, and no warning of a border."""
    turns = 2.0 * np.pi * np.arange(24) / 24
    heights = 1e-3 * (np.cos(2.0 * turns)[:, None] + np.cos(3.0 * turns) + np.cos(turns))
    last = []
    for name, surface in (("own", heights), ("moved", np.roll(heights, (5, 9), (0, 1)))):
        np.save(tmp_path / f"{name}.npy", surface)
        (tmp_path / f"{name}.yaml").write_text(
            SMALL.replace("shape: sphere, radius: 10 mm", f"shape: heights, file: {name}.npy")
            .replace("[32, 32]", "[24, 24]")
            .replace("history: full", "boundary: periodic"),
            encoding="utf-8",
        )
        folder = tmp_path / name
        result = invoke("run", tmp_path / f"{name}.yaml", "--out", folder)
        assert result.exit_code == 0
        assert WarningKind.CONTACT_AT_BORDER not in kinds_in([result.output])
        last.append(summary_of(folder)["states"][-1])
    own, moved = last
    assert own["Qx"] == pytest.approx(210.0, rel=1e-7)
    assert [moved[name] for name in ("Mx", "My", "Mz")] == [0.0] * 3
    for quantity in ("peak_pressure", "approach", "shift_x", "contact_radius"):
        assert own[quantity] == pytest.approx(moved[quantity], rel=1e-5)


def test_friction_by_place_and_pressure_bounds_the_shear(tmp_path):
    factors = np.where(np.arange(32)[:, None] < 16, 0.5, 1.0) * np.ones((1, 32))
    np.save(tmp_path / "factors.npy", factors)
    case = tmp_path / "case.yaml"
    table = "by_pressure: {pressure: [0 MPa, 2 GPa], factor: [1, 0.5]}"
    varied = SMALL.replace("coefficient: 0.7", f"coefficient: 0.7, field: factors.npy, {table}")
    case.write_text(varied.replace("210 N", "120 N"), encoding="utf-8")
    assert varied != SMALL
    assert invoke("run", case, "--out", tmp_path / "out").exit_code == 0
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        fields = list(file["contact/bodies"].values())[-1]
        pressure, limit = fields["pressure"][()], fields["limit"][()]
        shear = np.hypot(*fields["shear"][()])
    expected = 0.7 * factors * pressure * np.interp(pressure, [0.0, 2000.0], [1.0, 0.5])
    assert limit == pytest.approx(expected, rel=1e-12)
    assert (shear <= limit * (1.0 + 1e-7) + 1e-9).all()
    last = summary_of(tmp_path / "out")["states"][-1]
    assert last["full_slip_force"] == pytest.approx(limit.sum() / 32**2)
    assert last["Qx"] == pytest.approx(120.0, rel=1e-6)
    np.save(tmp_path / "factors.npy", factors[:8])
    assert "friction.field" in invoke("check", case).stderr


def test_what_has_yielded_is_in_the_results(tmp_path):
    case = tmp_path / "hard.yaml"
    weak = SMALL.replace("poisson: 0.29}", "poisson: 0.29, yield_stress: 350 MPa}")
    case.write_text(weak.replace("history: full", "hardness: 1 GPa"), encoding="utf-8")
    result = invoke("run", case, "--out", tmp_path / "out")
    assert result.exit_code == 0
    # A yield that is followed is nothing to warn of.
    assert WarningKind.PRESSURE_ABOVE_YIELD not in kinds_in([result.output])
    last = summary_of(tmp_path / "out")["states"][-1]
    assert last["peak_pressure"] == pytest.approx(1000.0, rel=1e-5)
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        fields = list(file["contact/bodies"].values())[-1]
        flattening, pressure = fields["flattening"][()], fields["pressure"][()]
    assert last["flattening"] == flattening.max()
    assert last["flattened_volume"] == pytest.approx(flattening.sum() / 32**2)
    assert (pressure[flattening > 0.0] >= 1000.0 * (1.0 - 1e-9)).all()


def test_a_coated_ball_is_that_of_the_library(tmp_path):
    layer = "layers: [{thickness: 50 um, young: 20 GPa, poisson: 0.3}]"
    case = tmp_path / "coated.yaml"
    body = "  body_2: {young: 115 GPa, poisson: 0.29"
    assert body in SMALL
    case.write_text(SMALL.replace(body, f"{body}, {layer}"), encoding="utf-8")
    assert invoke("run", case, "--out", tmp_path / "out").exit_code == 0
    first = summary_of(tmp_path / "out")["states"][0]
    plain, grid = Material(115e3, 0.29), Grid.covering((1.0, 1.0), (32, 32))
    pair = ElasticPair(plain, replace(plain, layers=(Layer(0.05, 20e3, 0.3),)))
    contact = FrictionalContact(HalfSpace(grid, pair), 0.7)
    height = (grid.x**2 + grid.y**2) / 20.0
    load = ContactLoad(np.array([first["P"], 0.0, 0.0, 0.0, 0.0, 0.0]))
    state = contact.advance(contact.unloaded_state(height), height, load)
    assert first["peak_pressure"] == pytest.approx(state.pressure.max(), rel=1e-6)


def test_a_step_between_the_borders_of_a_periodic_patch_warns(tmp_path):
    np.save(tmp_path / "ramp.npy", np.tile(np.linspace(0.0, 1e-3, 24)[:, None], (1, 24)))
    case = tmp_path / "ramp.yaml"
    case.write_text(
        SMALL.replace("shape: sphere, radius: 10 mm", "shape: heights, file: ramp.npy")
        .replace("[32, 32]", "[24, 24]")
        .replace("history: full", "boundary: periodic"),
        encoding="utf-8",
    )
    assert WarningKind.UNSUITABLE_GRID in kinds_in([invoke("check", case).output])
    free = invoke("check", case, "--set", "contact.boundary=free")
    assert WarningKind.UNSUITABLE_GRID not in kinds_in([free.output])
