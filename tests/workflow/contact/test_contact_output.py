"""Tests of summary, results, figures and ParaView files of contact runs, from closed forms."""

import json
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
import pyvista as pv

from sa_solver.cycles.history import History
from sa_solver.reference.mindlin import ShearedSphere
from sa_solver.reference.torsion import TwistedSphere
from sa_solver.types import Grid, Material
from tests.workflow.output.shown_files import check_arrays, check_scene, total
from workflow.analyses.contact import ANALYSIS
from workflow.analyses.contact.output.layout import ContactContents
from workflow.analyses.contact.output.results import ContactOutcome, write_contact_results
from workflow.analyses.contact.output.summary import loop_summary, state_summaries
from workflow.case.text.writing import dump_case
from workflow.kinds import parse_case
from workflow.models.uncoupled.load_table import LoadTable
from workflow.pictures.drawing import write_figures, write_paraview
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.results import grid_of

MATERIAL = Material(115e3, 0.29)
FRICTION, LOAD, TANGENTIAL, RADIUS = 0.7, 400.0, 210.0, 10.0
GRID = Grid.covering((1.0, 0.9), (100, 90))
# Steps between turning points, of Q up, down and up again.
STEPS = 12
AREA = ContactContents(line=False, increments=1 + 3 * STEPS)
CASE = f"""\
title: Ball
analysis: contact
structure: {{kind: bodies, shape: sphere, radius: {RADIUS} mm}}
materials:
  body_1: {{young: 115 GPa, poisson: 0.29}}
  body_2: {{young: 115 GPa, poisson: 0.29}}
friction: {{coefficient: {FRICTION}}}
load_path:
  legs:
    - {{P: {LOAD} N}}
    - {{Qx: {TANGENTIAL} N, increments: {STEPS}}}
    - {{Qx: -{TANGENTIAL} N, increments: {STEPS}}}
    - {{Qx: {TANGENTIAL} N, increments: {STEPS}}}
contact: {{grid: [100, 90], size: [1 mm, 0.9 mm]}}
"""
MINDLIN = ShearedSphere(LOAD, RADIUS, MATERIAL, MATERIAL, FRICTION)
LUBKIN = TwistedSphere(LOAD, RADIUS, MATERIAL, MATERIAL, FRICTION)


def state(shear, resultants, rigid, energy=0.0, grid=GRID, pressure=None):
    """Return a state as the solver would; irrelevant fields are 0."""
    hertz = MINDLIN.contact.pressure(grid.x, grid.y) if pressure is None else pressure
    return SimpleNamespace(
        traction=np.stack([*shear, hertz]),
        slip=-1e-6 * np.stack(list(shear)),
        gap=np.zeros(grid.shape),
        resultants=np.array(resultants),
        rigid=np.array(rigid),
        energy=np.array([energy, 0.0]),
        sliding=False,
        residual=1e-9,
        converged=True,
        message="",
        convolutions=20,
        border_load=0.0,
        flattening=None,
        limit=None,
    )


def history(states, indices=None, method="full"):
    indices = list(range(len(states))) if indices is None else indices
    return History(states, indices, method, "a test")


def turning_points(forces):
    """Return the turning points that lead to each of ``forces``."""
    turns = []
    for before, now, after in zip(forces, forces[1:], [*forces[2:], None], strict=False):
        if after is not None and (now - before) * (after - now) < 0.0:
            turns.append(now)
    return turns


def mindlin_state(forces):
    """Return the state after Q went through ``forces``."""
    loads = [*turning_points(forces), forces[-1]] if any(forces) else []
    zero = np.zeros(GRID.shape)
    shear = MINDLIN.shear_after(GRID.x, GRID.y, loads) if loads else zero
    shift = MINDLIN.displacement_after(loads) if loads else 0.0
    return state(
        (shear, zero),
        [LOAD, forces[-1], 0.0, 0.0, 0.0, 0.0],
        [MINDLIN.contact.approach, shift, 0.0, 0.0, 0.0, 0.0],
        0.01 if len(forces) > 1 else 0.0,
    )


@pytest.fixture(scope="module")
def outcome():
    """Return Cattaneo and Mindlin's cycle with all its increments."""
    case = parse_case(CASE, "case.yaml")
    table = case.load_path.table()
    forces = table["Qx"].tolist()
    states = [mindlin_state(forces[: k + 1]) for k in range(len(table))]
    height, strain = (GRID.x**2 + GRID.y**2) / 20.0, np.zeros(len(table))
    return ContactOutcome(case, GRID, height, table, strain, history(states), 40)


@pytest.fixture(scope="module")
def folder(outcome, tmp_path_factory):
    folder = OutputFolder(tmp_path_factory.mktemp("contact") / "out")
    folder.claim(outcome.case, force=False, resumable=False)
    write_contact_results(outcome, SimpleNamespace(kind="bodies", folder=folder))
    return folder


# --- summary ------------------------------------------------------------------------------------


def test_state_has_the_measures_of_the_closed_form(outcome):
    """Radii from counted cells are within 0.5 % at 36 cells per radius."""
    summaries = state_summaries(GRID, FRICTION, outcome.history)
    assert json.loads(json.dumps(summaries, allow_nan=False)) == summaries
    last, contact = summaries[-1], MINDLIN.contact
    assert last["increment"] == 1 + 3 * STEPS
    assert (last["P"], last["Qx"]) == (LOAD, TANGENTIAL)
    assert last["contact_radius"] == pytest.approx(contact.contact_radius, rel=5e-3)
    assert last["stick_radius"] == pytest.approx(MINDLIN.stick_radius(TANGENTIAL), rel=1e-2)
    assert last["stick_centre"] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert last["central_pressure"] == pytest.approx(contact.peak_pressure, rel=1e-3)
    assert last["peak_pressure"] >= last["central_pressure"]
    assert last["full_slip_force"] == pytest.approx(FRICTION * LOAD, rel=2e-3)
    assert last["full_slip_moment"] == pytest.approx(LUBKIN.sliding_moment, rel=2e-3)
    assert last["cumulative_energy"] == pytest.approx(0.01 * 3 * STEPS)
    assert summaries[0]["stick_radius"] == summaries[0]["contact_radius"]


def test_torsion_has_no_radial_shear():
    radius = np.hypot(GRID.x, GRID.y)
    shear = LUBKIN.shear(radius, 10.0) / radius
    twisted = state((-shear * GRID.y, shear * GRID.x), [LOAD, 0, 0, 0, 0, 10.0], [0.0] * 6)
    (summary,) = state_summaries(GRID, FRICTION, history([twisted]))
    assert summary["radial_shear_share"] < 1e-9
    assert summary["stick_radius"] == pytest.approx(LUBKIN.stick_radius(10.0), rel=1e-2)


def test_line_has_half_widths_and_the_centre_of_its_stick_zone():
    grid = Grid.line_contact(2.0, 400)
    pressure = 100.0 * np.sqrt(np.maximum(0.0, 1.0 - (grid.x / 0.8) ** 2))
    stuck = np.abs(grid.x - 0.1) < 0.3
    shear = np.where(stuck, 0.0, FRICTION * pressure)
    line = state((shear, 0.0 * shear), [1.0] * 6, [0.0] * 6, grid=grid, pressure=pressure)
    (summary,) = state_summaries(grid, FRICTION, history([line]))
    assert summary["contact_half_width"] == pytest.approx(0.8, abs=0.005)
    assert summary["stick_half_width"] == pytest.approx(0.3, abs=0.005)
    assert summary["stick_centre"] == pytest.approx([0.1, 0.0], abs=0.005)
    assert "contact_radius" not in summary
    assert "full_slip_moment" not in summary


def test_gross_slip_has_no_stick_zone():
    pressure = MINDLIN.contact.pressure(GRID.x, GRID.y)
    slides = state((FRICTION * pressure, 0.0 * pressure), [LOAD] * 6, [0.0] * 6)
    (summary,) = state_summaries(GRID, FRICTION, history([slides]))
    assert (summary["stick_area"], summary["stick_centre"]) == (0.0, None)
    assert summary["sliding"]


def loop(outcome, **changes):
    given = SimpleNamespace(**(vars(outcome.history) | changes))
    strain = np.zeros(len(outcome.table))
    return loop_summary(GRID, FRICTION, outcome.table, given, strain)


def test_loop_is_the_last_closed_cycle(outcome):
    """Trapezoids between 12 points from end to end give the area within 2 %."""
    summary = loop(outcome)
    assert (summary["from_increment"], summary["to_increment"]) == (1 + STEPS, 1 + 3 * STEPS)
    assert (summary["force"], summary["motion"]) == ("Qx", "shift_x")
    assert summary["amplitude"] == pytest.approx(MINDLIN.displacement(TANGENTIAL), rel=1e-12)
    assert summary["force_amplitude"] == TANGENTIAL
    assert summary["area"] == pytest.approx(MINDLIN.loop_energy(TANGENTIAL), rel=2e-2)
    assert summary["energy"] == pytest.approx(0.01 * 2 * STEPS)
    assert summary["closure"] < 1e-12


def test_loop_of_turning_points_has_no_area(outcome):
    indices = [0, STEPS, 2 * STEPS, 3 * STEPS]
    summary = loop(
        outcome,
        states=[outcome.history.states[index] for index in indices],
        indices=indices,
        method="reversals",
    )
    assert (summary["from_increment"], summary["to_increment"]) == (1 + STEPS, 1 + 3 * STEPS)
    assert summary["amplitude"] == pytest.approx(MINDLIN.displacement(TANGENTIAL), rel=1e-12)
    assert "area" not in summary


def test_path_that_does_not_come_back_has_no_loop(outcome):
    """Q = 0 on the way down is not the unloaded state, since shear is locked in."""
    count = 1 + STEPS + STEPS // 2
    states, indices = outcome.history.states[:count], outcome.history.indices[:count]
    assert outcome.table["Qx"][count - 1] == 0.0
    assert loop(outcome, states=states, indices=indices) is None
    assert loop(outcome, states=states[:2], indices=indices[:2]) is None


def test_bulk_strain_does_work_on_the_shear_it_stretches():
    """Under a cycling bulk strain alone the work is -∮ Σ qx x S dε."""
    strain = np.array([0.0, 1.0, 0.0, -1.0, 0.0, 1.0]) * 1e-3
    senses = np.array([0.0, 1.0, -1.0, -1.0, 1.0, 1.0])  # of the friction that opposes it
    pressure = MINDLIN.contact.pressure(GRID.x, GRID.y)
    states = [
        state((-FRICTION * k * pressure * np.sign(GRID.x), 0 * pressure), [LOAD] + [0.0] * 5,
              [0.0] * 6)
        for k in senses
    ]  # fmt: skip
    table = LoadTable({"P": np.full(6, LOAD), "bulk_stress_2": strain * 1e5})
    summary = loop_summary(GRID, FRICTION, table, history(states), strain)
    assert (summary["from_increment"], summary["to_increment"]) == (2, 6)
    stretching = FRICTION * np.sum(pressure * np.abs(GRID.x)) * GRID.cell_area
    # The rectangle of the loop, less its two corners that the trapezoids cut.
    assert summary["area"] == pytest.approx(2.0 * 1e-3 * stretching)


# --- files --------------------------------------------------------------------------------------


def test_results_hold_states_path_and_case(outcome, folder):
    with h5py.File(folder.results) as file:
        assert grid_of(file["grid/bodies"]) == GRID
        assert file["case"].attrs["text"] == dump_case(outcome.case)
        np.testing.assert_array_equal(file["path/Qx"], outcome.table["Qx"])
        np.testing.assert_array_equal(
            file["history/shift_x"][-1], outcome.history.states[-1].rigid[1]
        )
        assert list(file["contact/bodies"]) == [f"{k:05d}" for k in range(1, 2 + 3 * STEPS)]
        last = outcome.history.states[-1]
        np.testing.assert_array_equal(file["contact/bodies/00037/shear"], last.traction[:2])
        lacking = []

        def look(name, item):
            if isinstance(item, h5py.Dataset) and not (
                item.attrs.get("unit") and item.attrs.get("description")
            ):
                lacking.append(name)

        file.visititems(look)
        assert lacking == []


def test_figures_are_wide_and_not_blank(folder, tmp_path):
    from matplotlib.image import imread

    written = write_figures(ANALYSIS.pictures, AREA, folder.results, tmp_path)
    assert {path.stem for path in written} == {"profiles", "maps", "forces"}
    for path in written:
        assert np.any(imread(path)[..., :3] < 0.95, axis=-1).mean() > 0.02, path


def test_paraview_steps_through_the_increments(outcome, folder, tmp_path):
    written = write_paraview(ANALYSIS.pictures, AREA, folder.results, tmp_path)
    assert sorted(written) == sorted(path for path in tmp_path.rglob("*") if path.is_file())
    reader = pv.PVDReader(tmp_path / "contact.pvd")
    assert reader.time_values == list(range(1, 2 + 3 * STEPS))
    reader.set_active_time_value(reader.time_values[-1])
    (face,) = reader.read()
    last = outcome.history.states[-1]
    assert face.area == pytest.approx((GRID.shape[0] - 1) * (GRID.shape[1] - 1) * GRID.cell_area)
    pressure = face.point_data["pressure [MPa]"].reshape(GRID.shape, order="F")
    np.testing.assert_allclose(pressure, last.traction[2], rtol=2e-7)
    np.testing.assert_allclose(
        face.point_data["shear [MPa]"][:, 0], last.traction[0].ravel(order="F"), rtol=2e-7
    )
    assert total(face, "pressure [MPa]") == pytest.approx(LOAD, rel=1e-2)  # of the exact pressure
    check_arrays(tmp_path)
    check_scene(tmp_path / "view.py")


def test_line_has_no_maps_and_is_a_line(tmp_path):
    text = CASE.replace("sphere", "cylinder").replace(" N,", " N/mm,").replace(" N}", " N/mm}")
    case = parse_case(text.replace("[100, 90], size: [1 mm, 0.9 mm]", "64, size: 1 mm"), "c.yaml")
    grid = Grid.line_contact(1.0, 64)
    pressure = np.maximum(0.0, 0.1 - grid.x**2)
    states = [state((pressure * k, 0 * pressure), [1.0, k, 0, 0, 0, 0], [0, k, 0, 0, 0, 0.0],
                    grid=grid, pressure=pressure) for k in (0.0, 0.5, -0.5)]  # fmt: skip
    table = case.load_path.table()
    strain = np.zeros(len(table))
    outcome = ContactOutcome(case, grid, grid.x**2, table, strain, history(states), 40)
    folder = OutputFolder(tmp_path / "out")
    folder.claim(case, force=False, resumable=False)
    write_contact_results(outcome, SimpleNamespace(kind="line", folder=folder))
    reported = ANALYSIS.pictures, ContactContents(line=True, increments=len(states)), folder.results
    shown = folder.root / "paraview"
    write_paraview(*reported, shown)
    line = pv.PVDReader(shown / "contact.pvd").read()[0]
    assert (line.n_lines, line.n_points) == (1, 64)
    np.testing.assert_allclose(line.points[:, 0], grid.x.ravel())
    assert line.length == pytest.approx(1.0 - 1.0 / 64)
    check_arrays(shown)
    assert len(check_scene(shown / "view.py")["views"]) == 3
    written = write_figures(*reported, folder.root / "figures")
    assert {path.stem for path in written} == {"profiles", "forces"}
    with h5py.File(folder.results) as file:
        assert file.attrs["kind"] == "line"
        assert grid_of(file["grid/bodies"]).line
        assert file["history/P"].attrs["unit"] == "N/mm"
        assert file["history/Edx"].attrs["unit"] == "N mm/mm"
