"""Tests of the output of a vibration case: datasets, tables, figures and ParaView files."""

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import pyvista as pv

from sa_solver.types import Array
from tests.workflow.conftest import invoke, manifest_has_all
from tests.workflow.output.figure_checks import problems_of_run
from tests.workflow.output.shown_files import check_arrays, check_scene
from tests.workflow.vibration.vibration_pad import LOAD, ROWS, places, run_block
from wear.joints.periodic.march import SEPARATED, SLIP
from workflow.analyses.vibration.case.pad_nodes import rows_and_columns
from workflow.analyses.vibration.figures import loops as vibration_loops
from workflow.analyses.vibration.figures import response as vibration
from workflow.analyses.vibration.figures import states as vibration_states
from workflow.analyses.vibration.output.outcome import VibrationContents
from workflow.analyses.vibration.output.paraview import MOST_STEPS, shown_samples, write_vibration
from workflow.shell.output.results import own

FRICTION = 0.5
SINGLE = 2e-7  # rounding of single precision
BACKBONE = {
    "force": "N",
    "frequency": "Hz",
    "amplitude": "mm",
    "damping": "1",
    "energy_per_cycle": "N mm",
    "slip": "1",
}
CONTENTS = VibrationContents(
    ("00000", "00001"), ("00000", "00001"), places=True, backbone=True, joints=ROWS**2
)
NAMES = {"frequency_response", "resonance", "loops", "node_shares", "pad_states"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the output of a run, which tests must not change."""
    scene = tmp_path_factory.mktemp("block")
    result = run_block(scene)
    assert result.exit_code == 0, result.output
    return scene / "out"


@pytest.fixture(scope="module")
def summary(folder: Path) -> dict[str, Any]:
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return summary


@pytest.fixture
def results(folder: Path) -> Iterator[h5py.File]:
    with h5py.File(folder / "results.h5") as file:
        yield file


@pytest.fixture
def changed(folder: Path, tmp_path: Path) -> Iterator[h5py.File]:
    """Return a copy that tests may change."""
    copy = tmp_path / "results.h5"
    copy.write_bytes((folder / "results.h5").read_bytes())
    with h5py.File(copy, "a") as file:
        yield file


def table(path: Path) -> dict[str, Array]:
    """Return the columns of a CSV file by their headings."""
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, np.array(rows, dtype=float).T, strict=True))


# --- results and tables -------------------------------------------------------------------------


def test_every_dataset_has_its_unit_and_description(results: h5py.File) -> None:
    def check(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            assert item.attrs["unit"], name
            assert item.attrs["description"], name

    results.visititems(check)
    assert set(own(results["backbone"])) == set(BACKBONE)
    assert list(results.attrs["seen"]) == ["block y", "block x"]


def test_the_pad_at_rest_balances_the_load(results: h5py.File) -> None:
    contact = results["contact"]
    assert contact["normal_force"][()].sum() == pytest.approx(LOAD, rel=1e-9)
    stiffness = 58500.0 / ROWS**2
    closed = np.maximum(contact["normal_displacement"][()] - contact["gap"][()], 0.0)
    np.testing.assert_allclose(contact["normal_force"], stiffness * closed, atol=1e-9 * LOAD)


def test_tables_are_those_of_the_results(folder: Path, results: h5py.File) -> None:
    response = table(folder / "frf_00001.csv")
    np.testing.assert_allclose(
        response["amplitude_2 [mm]"], results["responses/00001/amplitude"][:, 1], rtol=1e-8
    )
    np.testing.assert_allclose(
        response["damping [1]"], results["responses/00001/damping"], rtol=1e-8
    )
    backbone = table(folder / "backbone.csv")
    assert list(backbone) == [f"{name} [{unit}]" for name, unit in BACKBONE.items()]
    np.testing.assert_allclose(backbone["frequency [Hz]"], results["backbone/frequency"], rtol=1e-8)


def test_loops_can_be_measured_again(folder: Path, summary: dict[str, Any], tmp_path: Path) -> None:
    """``fretscale loops`` finds in the table what the run has found in the loop."""
    result = invoke("loops", folder / "loop_00001.csv", "--out", tmp_path / "loops")
    assert result.exit_code == 0, result.output
    columns = table(tmp_path / "loops" / "loops.csv")
    finest = summary["responses"][1]["loops"][-1]
    energy, stiffness = (
        next(values[0] for name, values in columns.items() if name.startswith(word))
        for word in ("energy_per_loop", "kt")
    )
    # Of the loop the table has nine digits; its area is the part of the energy lost along x.
    with h5py.File(folder / "results.h5") as file:
        loop = file["responses/00001/loops/00001"]
        area = np.trapezoid(loop["force"][()], loop["displacement"][()])
    assert energy == pytest.approx(area, rel=1e-6)
    assert 0.8 * finest["energy"] < energy < finest["energy"]
    assert stiffness == pytest.approx(finest["stiffness"], rel=1e-6)


def test_rising_branch_starts_where_the_motion_turns() -> None:
    turns = 2.0 * np.pi * np.arange(101) / 100
    moved, gained = vibration_loops.rising_branch(np.cos(turns), np.cos(turns - 0.4))
    assert len(moved) == 51
    np.testing.assert_allclose([moved[0], moved[-1]], [0.0, 2.0])
    np.testing.assert_allclose(gained, np.cos(turns[50:] - 0.4) - np.cos(np.pi - 0.4), atol=1e-14)


# --- figures ------------------------------------------------------------------------------------


def test_every_figure_is_written_and_legible(folder: Path) -> None:
    assert manifest_has_all(folder)
    assert {path.stem for path in (folder / "figures").iterdir()} == NAMES
    assert problems_of_run(folder) == []


def test_responses_are_drawn_per_force(results, summary):
    axis, _ = vibration.frequency_response(results, CONTENTS).axes
    assert axis.get_ylabel() == "amplitude of block x / force [µm/N]"
    lines = {str(line.get_label()): line for line in axis.lines}
    response = results["responses/00001"]
    label = f"25 N: {summary['responses'][1]['resonance']:.4g} Hz"
    np.testing.assert_allclose(lines[label].get_ydata(), 1e3 * response["amplitude"][:, 1] / 25.0)


def test_states_have_the_symmetry_of_the_block(results: h5py.File) -> None:
    """Nodes at y and -y move equally; those at -x do so half a cycle later."""
    numbers = rows_and_columns(*places().T)
    assert numbers is not None
    for response in results["responses"].values():
        kinds = vibration_states.kinds_of(response)[:, numbers]
        np.testing.assert_array_equal(kinds, kinds[:, :, ::-1])
    # Without harmonics of even order nothing tells x from -x; one sample in two cycles may.
    assert (kinds != kinds[:, ::-1]).mean() < 0.02


def test_states_are_those_of_the_forces(results: h5py.File) -> None:
    """They follow Coulomb's law, from the forces of the cycle at resonance."""
    for response in results["responses"].values():
        force, state = response["resonance/force"][()], response["resonance/state"][()]
        pressed, pulled = force[..., 2], np.hypot(force[..., 0], force[..., 1])
        np.testing.assert_array_equal(state == SEPARATED, pressed == 0.0)
        on_circle = (pressed > 0.0) & (pulled >= (1.0 - 1e-9) * FRICTION * pressed)
        np.testing.assert_array_equal(state == SLIP, on_circle)
        assert (pulled <= FRICTION * pressed * (1.0 + 1e-9)).all()


def test_low_forces_stick_and_high_ones_slip(results: h5py.File) -> None:
    low, high = (vibration_states.kinds_of(response) for response in results["responses"].values())
    open_kind, sticks = vibration_states.OPEN, vibration_states.STICKS
    # Far below resonance all that touches sticks under the small force.
    assert set(low[0].tolist()) == {open_kind, sticks}
    corners = [0, ROWS - 1, -ROWS, -1]
    assert (low[0, corners] == open_kind).all()
    assert (high == sticks).sum(axis=1).min() == 0


# --- ParaView -----------------------------------------------------------------------------------


def series(folder: Path, number: int = 1) -> tuple[list[float], list[Any]]:
    """Return times and meshes of a cycle."""
    reader = pv.PVDReader(folder / "paraview" / f"cycle_{number:05d}.pvd")
    meshes = []
    for time in reader.time_values:
        reader.set_active_time_value(time)
        meshes.append(reader.read()[0])
    return reader.time_values, meshes


def test_paraview_plays_a_cycle(folder: Path, results: h5py.File) -> None:
    times, meshes = series(folder)
    response = results["responses/00001"]
    steps = len(response["resonance/state"])
    np.testing.assert_allclose(times, np.arange(steps) / steps / response.attrs["resonance"])
    for step, mesh in enumerate(meshes):
        np.testing.assert_allclose(mesh.points[:, :2], places(), atol=1e-5)
        quads = mesh.cells_dict[pv.CellType.QUAD]
        assert quads.shape == ((ROWS - 1) ** 2, 4)
        data, cycle = mesh.point_data, response["resonance"]
        np.testing.assert_array_equal(data["state [1]"], cycle["state"][step])
        moved, pulled = cycle["displacement"][step], cycle["force"][step]
        np.testing.assert_allclose(data["displacement [mm]"], moved * [1, 1, -1], rtol=SINGLE)
        np.testing.assert_allclose(data["force [N]"], pulled * [-1, -1, 1], rtol=SINGLE)
        assert data["pressure [MPa]"] @ results["contact/area"] == pytest.approx(pulled[:, 2].sum())
        np.testing.assert_array_equal(data["gap [mm]"] < 0.0, pulled[:, 2] > 0.0)
    assert mesh.compute_cell_sizes().cell_data["Area"].sum() == pytest.approx(100.0)
    vibration_ = np.mean([mesh.point_data["vibration [mm]"] for mesh in meshes], axis=0)
    np.testing.assert_allclose(vibration_, 0.0, atol=1e-9)


@pytest.mark.parametrize("count", [1, 32, 48, 49, 64, 97, 128, 256, 360, 1000])
def test_a_cycle_is_played_evenly(count: int) -> None:
    """All samples or every nth are shown, with an equal last step where possible."""
    shown = shown_samples(count)
    assert shown[0] == 0
    assert min(count, MOST_STEPS) / 2 < len(shown) <= MOST_STEPS
    assert shown.step == 1 or count > MOST_STEPS
    whole = [n for n in range(1, count + 1) if count % n == 0 and count / n <= MOST_STEPS]
    assert count % shown.step == 0 or whole[0] >= 2 * -(-count // MOST_STEPS)


def test_friction_takes_energy_from_the_upper_body(folder: Path, results: h5py.File) -> None:
    """Work of the force on body 2 is what the nodes lose, within the sampling error."""
    _, meshes = series(folder)
    moved, pulled = (
        np.array([mesh.point_data[name] for mesh in meshes], dtype=float)
        for name in ("displacement [mm]", "force [N]")
    )
    step = np.roll(moved, -1, axis=0) - moved
    work = float((0.5 * (np.roll(pulled, -1, axis=0) + pulled) * step).sum())
    # By trapezoids of 32 samples: of second order, within (2π/32)²/2.
    lost = results["responses/00001"].attrs["energy_per_cycle"]
    assert -work == pytest.approx(lost, rel=0.02)


def test_arrays_have_units_and_the_script_shows_them(folder: Path) -> None:
    check_arrays(folder / "paraview")
    scene = check_scene(folder / "paraview" / "view.py")
    assert scene["views"][0]["shown"][0]["file"] == "cycle_00001.pvd"  # of the largest force


def test_nodes_out_of_rows_are_shown_as_points(changed: h5py.File, tmp_path: Path) -> None:
    x = changed["contact/x"]
    x[...] = x[()] * (1.0 + 0.05 * np.arange(len(x)))
    assert rows_and_columns(x[()], changed["contact/y"][()]) is None
    written = write_vibration(CONTENTS, changed, tmp_path / "paraview")
    mesh = pv.read(written[0])
    assert mesh.n_cells == mesh.n_points == ROWS**2
    axis = vibration_states.pad_states(changed, CONTENTS).axes[0]
    assert len(axis.collections[0].get_offsets()) == ROWS**2


# --- rows and columns ---------------------------------------------------------------------------
