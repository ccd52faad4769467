"""Tests of tangential loops of a wear run: how they are imposed, stored, written and drawn."""

from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.half_space.operator import HalfSpace
from sa_solver.reference.mindlin import ShearedSphere
from sa_solver.types import ElasticPair, Grid, Material
from tests.workflow.command_line import command
from tests.workflow.conftest import Run
from tests.workflow.shell.interruptions import ctrl_c_after_jumps
from wear.steps.stepping import ContactFailure
from workflow.analyses.wear.output.layout import LAYOUT
from workflow.analyses.wear.output.loop_table import COLUMNS
from workflow.analyses.wear.worn.contact_loops import (
    MEASURED,
    stored_loops,
    write_loops,
)
from workflow.case.fields import Quantity
from workflow.case.files.table_file import read_columns
from workflow.commands.computed_loops import report_of_loops
from workflow.models.loops import TangentialLoops, worn_loop
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.output.results import writing

BODY = Material(115e3, 0.0)
SPHERE = ShearedSphere(400.0, 10.0, BODY, BODY, 0.7)
FORCE = 0.5 * SPHERE.sliding_force

# Two balls under loads of a table: no structure to condense, whose friction would take the time.
LOADS = """\
interface, P, Qx, Qy, Mx, My, Mz, Edx, Edy
left,  400, -160, 0, 0, 0, 0, 3, 0
left,  400,  160, 0, 0, 0, 0, 3, 0
right, 300, -120, 0, 0, 0, 0, 2, 0
right, 300,  120, 0, 0, 0, 0, 2, 0
"""
BALLS = """\
title: Two balls that wear under loads of a table
analysis: wear
structure:
  kind: resultants
  file: loads.csv
  dimension: 3
  size: [1 mm, 1 mm]
  gap: {shape: paraboloid, radius_x: 10 mm, radius_y: 10 mm}
materials:
  body_1: {young: 115 GPa, poisson: 0.29}
  body_2: {young: 115 GPa, poisson: 0.29}
friction: {coefficient: 0.4}
contact: {grid: [16, 16]}
wear:
  law: energy
  body_1: {coefficient: 1e4 um^3/J}
  body_2: {coefficient: 1e4 um^3/J}
  cycles: 3e4
  step: {kind: implicit, cycles: 1e4}
stress: {section: none, life: {parameter: none}}
output: {paraview: false, figures: false}
"""
AMPLITUDE = 0.01
# Coarse loops, because only their storage is tested, not their accuracy.
ASKED = f"loops.amplitude={AMPLITUDE} mm", "loops.increments=3"


def state(P=400.0, Mx=0.0, My=0.0, grid=None):
    """Return an interface before wear, with its peak load in the second of two increments."""
    loads = SimpleNamespace(
        **{k: np.array([0.0, v]) for k, v in (("P", P), ("Mx", Mx), ("My", My))}
    )
    gap = None if grid is None else SPHERE.contact.gap(grid.x, grid.y)
    return SimpleNamespace(loads=loads, surfaces=SimpleNamespace(gap=gap), energy=1500.0)


@pytest.fixture(scope="module")
def sphere():
    """Return a loop of a sphere in partial slip."""
    size = 2.2 * SPHERE.contact.contact_radius
    grid = Grid.covering((size, size), (32, 32))
    contact = FrictionalContact(HalfSpace(grid, ElasticPair(BODY, BODY)), SPHERE.friction)
    return worn_loop(contact, TangentialLoops(force=FORCE), "sphere", state(grid=grid), 1)


# --- what is imposed ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("every", "jump", "ended", "due"),
    [
        ("jump", 0, False, True),
        ("jump", 3, False, True),
        ("end", 0, False, True),
        ("end", 3, False, False),
        ("end", 3, True, True),
    ],
)
def test_loops_are_due(every, jump, ended, due):
    assert TangentialLoops(amplitude=5e-3, every=every).due(jump, ended) is due


def test_path_is_that_of_the_peak_load():
    path = TangentialLoops(amplitude=5e-3, axis="y", increments=7).path("face", state(My=-80.0), 1)
    assert (path.P, path.moments, path.amplitude, path.by) == (400.0, (0.0, -80.0), 5e-3, "motion")
    assert (path.axis, path.increments) == ("y", 7)


def test_a_normal_force_of_ones_own_acts_along_the_same_line():
    path = TangentialLoops(force=3.0, normal_force=100.0).path("face", state(Mx=40.0, My=-80.0), 1)
    assert (path.P, path.moments, path.amplitude, path.by) == (100.0, (10.0, -20.0), 3.0, "force")
    open_face = TangentialLoops(force=3.0, normal_force=100.0).path("face", state(P=0.0), 1)
    assert (open_face.P, open_face.moments) == (100.0, (0.0, 0.0))


def test_values_are_those_of_the_loop(sphere):
    """The values are Mindlin's within the error of 32 cells."""
    values = sphere.values
    assert tuple(values) == MEASURED
    assert values["energy"] == 1500.0
    assert values["P"] == 400.0
    assert values["kt"] == pytest.approx(1.0 / SPHERE.tangential_compliance, rel=0.01)
    assert values["energy_per_loop"] == pytest.approx(SPHERE.loop_energy(FORCE), rel=0.01)
    assert values["amplitude"] == pytest.approx(SPHERE.displacement(FORCE), rel=0.01)
    assert values["force"] == pytest.approx(FORCE)
    assert values["mu"] == pytest.approx(0.35)
    assert values["area"] == pytest.approx(np.pi * SPHERE.contact.contact_radius**2, rel=0.03)
    off = abs(values["kt"] - 1.0 / SPHERE.tangential_compliance)
    assert off < values["kt_error"] < 0.05 * values["kt"]
    assert values["mu_error"] < 1e-6  # the force is imposed


def test_force_beyond_friction_ends_the_run_in_one_line():
    grid = Grid.covering((1.0, 1.0), (8, 8))
    contact = FrictionalContact(HalfSpace(grid, ElasticPair(BODY, BODY)), SPHERE.friction)
    with pytest.raises(ContactFailure, match="tangential loop"):
        worn_loop(contact, TangentialLoops(force=1e4), "sphere", state(grid=grid), 1)


# --- kept and written ---------------------------------------------------------------------------


def with_loops(root, loop, line=False):
    """Return results with loops of jumps 0 and 2, as after ``every: end``."""
    folder = OutputFolder(root)
    kept = [{"cycles": 100.0 * jump} for jump in range(3)]
    for jump in (0, 2):
        kept[jump] |= stored_loops(["sphere"], [loop])
    with writing(folder.results, LAYOUT, line) as writer:
        write_loops(writer, kept)
        writer.put_grid("grid/sphere", Grid((32, 32), (0.1, 0.1)))
    return folder


@pytest.fixture
def written(sphere, tmp_path):
    return with_loops(tmp_path, sphere)


@pytest.mark.parametrize(("line", "unit"), [(False, "N"), (True, "N/mm")])
def test_forces_of_line_contacts_are_per_length(sphere, tmp_path, line, unit):
    with h5py.File(with_loops(tmp_path, sphere, line).results) as file:
        assert file["loops/sphere/00000/force"].attrs["unit"] == unit
        assert file["loops/sphere/00000/displacement"].attrs["unit"] == "mm"


def test_results_have_the_loops_of_their_jumps(written, sphere):
    with h5py.File(written.results) as file:
        group = file["loops/sphere"]
        assert list(group) == ["00000", "00002"]
        np.testing.assert_array_equal(group["00002/force"], sphere.force)
        np.testing.assert_array_equal(group["00002/displacement"], sphere.displacement)
        assert group["00002"].attrs["cycles"] == 200.0
        assert {name: group["00002"].attrs[name] for name in MEASURED} == sphere.values
        assert all(
            dataset.attrs[attribute]
            for dataset in group["00002"].values()
            for attribute in ("unit", "description")
        )


def test_computed_loops_are_read_as_measured_ones(tmp_path):
    """The slope after reversals is Mindlin's within the parabola's 0.4 % and 16 cells."""
    size = 2.2 * SPHERE.contact.contact_radius
    grid = Grid.covering((size, size), (16, 16))
    contact = FrictionalContact(HalfSpace(grid, ElasticPair(BODY, BODY)), SPHERE.friction)
    amplitude = 3.0 * SPHERE.displacement(SPHERE.sliding_force)
    asked = TangentialLoops(amplitude=amplitude, increments=48)
    loop = worn_loop(contact, asked, "sphere", state(grid=grid), 1)
    with h5py.File(with_loops(tmp_path, loop).results) as file:
        name, headings, unworn, worn, *_ = report_of_loops(file["loops"])
    assert (name, headings.split()[-1]) == ("sphere", "mu")
    _, energy, kt, stuck, _, mu = map(float, worn.split())
    assert (energy, stuck) == (1.5, pytest.approx(1e-3 * loop.values["kt"], rel=1e-3))
    assert kt == pytest.approx(1e-3 / SPHERE.tangential_compliance, rel=0.02)
    assert mu == pytest.approx(0.7, rel=2e-3)
    assert unworn.split()[1:] == worn.split()[1:]


# --- runs ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def start_balls(tmp_path_factory):
    """Return a function that runs the two balls with overrides."""
    case = tmp_path_factory.mktemp("balls") / "balls.yaml"
    case.write_text(BALLS, encoding="utf-8")
    (case.parent / "loads.csv").write_text(LOADS, encoding="utf-8")

    def run(folder, *overrides):
        return Run(command("run", case, "--out", folder, overrides=overrides), folder)

    return run


@pytest.fixture(scope="module")
def rubbed(start_balls, tmp_path_factory):
    """Return a run of the balls with a loop after every jump, which tests must not change."""
    run = start_balls(tmp_path_factory.mktemp("rubbed") / "out", *ASKED)
    assert run.ending.exit_code == 0, run.ending.stderr
    return run


def test_run_writes_a_table_for_every_interface(rubbed):
    """Cycles, energy, load and area are those of the run; the loop slides, so µ is the case's."""
    summary = rubbed.summary
    for name in ("left", "right"):
        quantities = {name: Quantity(column.unit) for name, column in COLUMNS.items()}
        file = rubbed.folder / f"loops_{name}.csv"
        table = SimpleNamespace(**read_columns(str(file), quantities))
        kinetics = summary["kinetics"][name]
        np.testing.assert_allclose(table.cycles, summary["kinetics"]["cycles"])
        np.testing.assert_allclose(table.energy, kinetics["energy"], rtol=1e-9)
        np.testing.assert_allclose(table.area, kinetics["area"], rtol=1e-9)
        assert table.P[0] == pytest.approx(summary[name]["peak_load"]["unworn"]["P"], rel=1e-9)
        np.testing.assert_allclose(table.mu, 0.4, rtol=2e-3)
        np.testing.assert_array_equal(table.sliding, 1.0)
        with h5py.File(rubbed.folder / "results.h5") as results:
            over = results[f"loops_over_energy/{name}"]
            for column in ("energy", "kt", "kt_error", "mu"):
                np.testing.assert_allclose(over[column], getattr(table, column), rtol=1e-9)
            assert [over[column].attrs["unit"] for column in ("energy", "kt")] == ["N mm", "N/mm"]
        # Wear widens a rounded contact, which stiffens it.
        assert table.area[-1] > table.area[0]
        assert table.kt[-1] > table.kt[0]
        # Sliding as a whole costs less than a rectangle, and more than what is stuck gives back.
        largest = 4.0 * 0.4 * table.P * AMPLITUDE
        assert np.all(table.energy_per_loop < largest)
        assert np.all(table.energy_per_loop > largest - 4.0 * 1.5 * (0.4 * table.P) ** 2 / table.kt)
        assert summary[name]["loops"]["worn"]["kt"] == pytest.approx(table.kt[-1])
        assert summary[name]["area"] == kinetics["area"][-1]
        assert summary[name]["worn_area"] > 0.0


def test_loops_change_nothing_else(start_balls, rubbed, tmp_path):
    plain = start_balls(tmp_path / "out")
    for name, height in plain.heights().items():
        np.testing.assert_array_equal(rubbed.heights()[name], height, err_msg=name)
    assert rubbed.summary["kinetics"] == plain.summary["kinetics"]
    assert not list(plain.folder.glob("loops_*"))


@pytest.mark.slow
@pytest.mark.parametrize("every", ["end", "jump"])
def test_resumed_run_keeps_its_earlier_loops(start_balls, resume, rubbed, tmp_path, every):
    """The loops equal those of an uninterrupted run; with ``end`` the first and last are stored."""
    with ctrl_c_after_jumps(2):
        begun = start_balls(tmp_path / "out", *ASKED, f"loops.every={every}")
        assert begun.ending.exit_code == 130
    run = resume(tmp_path / "out")
    assert run.ending.exit_code == 0, run.ending.stderr
    for name in ("loops_left.csv", "loops_right.csv"):
        headings, *rows = (rubbed.folder / name).read_bytes().splitlines(keepends=True)
        kept = rows if every == "jump" else [rows[0], rows[-1]]
        assert (run.folder / name).read_bytes() == b"".join([headings, *kept])
