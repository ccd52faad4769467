"""Tests of a rig that wears its own contact: limits, balances, independent checks, files."""

import csv
import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
import pyvista

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from tests.workflow.command_line import command
from tests.workflow.output.figure_checks import problems_of_run
from tests.workflow.output.shown_files import check_arrays, check_scene, total
from tests.workflow.scenes import RIG_OF_THESIS
from wear.joints.periodic.march import PeriodicMarch
from wear.steps.implicit import ImplicitStepper
from wear.steps.marching import advance_cycles
from wear.steps.step_errors import ErrorControl
from wear.steps.steppers import first_cycles
from workflow.analyses.rig.building import row_of_masses
from workflow.analyses.rig.structure import Rig
from workflow.analyses.vibration_wear.vibrating_contact import VibratingContact
from workflow.kinds import load_case
from workflow.models.vibration.excitation import Driving

WEAR = """\
title: Ball that wears
analysis: wear
structure: {kind: bodies, shape: sphere, radius: 47.619 mm}
materials:
  body_1: {young: 200 GPa, poisson: 0.3}
  body_2: {young: 200 GPa, poisson: 0.3}
friction:
  coefficient: 0.4
  evolution: {energy: [0 J, 10 J], factor: [1, 2]}
load_path: {P: 60 N, stroke: 14 um, increments: 2}
contact: {grid: [16, 16], size: [0.9 mm, 0.9 mm]}
wear:
  law: energy
  body_1: {coefficient: 500 um^3/J}
  body_2: {coefficient: 1000 um^3/J}
  cycles: 2e4
  tolerance: 10 %
output: {paraview: false, figures: false}
"""
RIG = (
    RIG_OF_THESIS
    + """\
title: Rig that wears its contact
analysis: vibration
contact: {file: wear.yaml}
wear: {force: 75 N, frequency: 100 Hz, cycles: [100, 2e4]}
forces: [5 N, 40 N]
frequencies: [60 Hz, 350 Hz]
resolution: {harmonics: 3, samples: 64}
output: {paraview: false, figures: false}
"""
)
MASSES, SPRINGS, DAMPING = (21.152e-3, 1.189e-3), (1346.9, 273e3), 0.001
RESOLUTION = Resolution((1, 3, 5, 7, 9), 256)
# Motions found by Newton's method to 1e-10, and sums over the cells.
BALANCED = 1e-9


def run(folder, *settings, rig=RIG, wear=WEAR):
    (folder / "wear.yaml").write_text(wear, encoding="utf-8")
    (folder / "rig.yaml").write_text(rig, encoding="utf-8")
    return command("run", folder / "rig.yaml", "--out", folder / "out", overrides=settings)


def refusal(folder, *settings, wear=WEAR):
    ended = run(folder, *settings, wear=wear)
    assert ended.exit_code != 0
    return " ".join(ended.stderr.split())


def driven(rig):
    """Drive the rig by a sine of 1 N at the point of the case."""
    return Driving(PeriodicLoad({1: -1j * rig.driven}))


def contact_in_rig(folder, force=75.0, frequency=100.0, wear=WEAR):
    (folder / "wear.yaml").write_text(wear, encoding="utf-8")
    rig = row_of_masses(Rig(kind="rig", masses=MASSES, springs=SPRINGS, damping_ratio=DAMPING))
    case = load_case(folder / "wear.yaml")
    return rig, VibratingContact(case, rig, driven(rig), force, frequency, RESOLUTION)


def worn(contact, cycles, tolerance=0.1):
    state = contact.unworn()
    state = replace(state, next_cycles=first_cycles(contact.wearing(state), state, cycles))
    stepper = ImplicitStepper(ErrorControl(tolerance))
    return advance_cycles(stepper, state, cycles, cycles, contact.wearing).state


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """Return a complete run of the small case, which tests must not change."""
    folder = tmp_path_factory.mktemp("rig")
    result = run(folder)
    assert result.exit_code == 0, result.output
    return folder / "out"


@pytest.fixture(scope="module")
def summary(ended):
    return json.loads((ended / "summary.json").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_friction_that_grows_within_a_few_cycles_is_followed(tmp_path):
    """The paper's friction grows fivefold in ten cycles; the reference goes cycle by cycle."""
    law = "evolution: {energy: [0 J, 1 mJ, 10 mJ, 0.1 J], factor: [1, 2, 2.5, 3]}"
    wear = WEAR.replace("evolution: {energy: [0 J, 10 J], factor: [1, 2]}", law)
    assert wear != WEAR
    ended = run(tmp_path, "wear.cycles=[20]", "forces=[5 N]", wear=wear)
    assert ended.exit_code == 0, ended.output
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    rig = row_of_masses(Rig(kind="rig", masses=MASSES, springs=SPRINGS, damping_ratio=0.01))
    resolution = Resolution((1, 3, 5), 64)
    contact = VibratingContact(
        load_case(tmp_path / "wear.yaml"), rig, driven(rig), 75.0, 100.0, resolution
    )
    state = contact.unworn()
    for _ in range(20):
        # In so few cycles the form does not change.
        state = replace(state, energy=state.energy + float(contact.at(state).by_slider.sum()))
    assert summary["states"][-1]["energy"] == pytest.approx(state.energy, rel=0.05)


# --- what the contact is to the rig -------------------------------------------------------------


def test_sliders_move_the_rig_as_so_many_joints_of_its_own_would(tmp_path):
    rig, contact = contact_in_rig(tmp_path, force=30.0, frequency=180.0)
    cycle = contact.at(contact.unworn())
    count = len(cycle.by_slider)
    rows = np.repeat(rig.model.connection, count, axis=0)
    apart = HarmonicBalance(
        replace(rig.model, connection=rows),
        PeriodicMarch(cycle.sliders),
        PeriodicLoad({1: -1j * rig.driven}),
        RESOLUTION,
    ).solve(180.0, 30.0)
    assert apart.converged
    np.testing.assert_allclose(
        cycle.motion.motion, apart.motion, atol=1e-8 * np.abs(apart.motion).max()
    )
    np.testing.assert_allclose(
        cycle.by_slider, apart.cycle.dissipated, atol=1e-8 * apart.cycle.dissipated.sum()
    )


def test_cells_dissipate_exactly_what_harmonic_balance_does(tmp_path):
    _, contact = contact_in_rig(tmp_path)
    for state in (contact.unworn(), worn(contact, 1e4)):
        cycle = contact.at(state)
        cells = float(cycle.energy.sum()) * contact.grid.cell_area
        assert cells == pytest.approx(float(cycle.motion.cycle.dissipated.sum()), rel=BALANCED)
        # By itself the slip of the half-space says the same but for the stages.
        assert cycle.adjusted == pytest.approx(1.0, abs=1e-3)


def test_the_loop_is_that_of_the_whole_tangential_problem(tmp_path):
    _, contact = contact_in_rig(tmp_path)
    cycle = contact.at(worn(contact, 1e4))
    for amplitude, allowed in ((0.5 * cycle.stroke, 1e-3), (0.5 * cycle.full_slip, 0.03)):
        loop = contact.loop(cycle, amplitude)
        by_sliders = float(cycle.sliders.loop_energy(amplitude).sum())
        assert by_sliders == pytest.approx(loop.energy, rel=allowed)


@pytest.mark.parametrize("tilt", ["held", "free"])
def test_joint_wear_and_loop_tilt_alike(tilt, tmp_path):
    """On a ball with a slope, either all three of them tilt or none."""
    x, y = np.meshgrid(*[(np.arange(16) - 7.5) * 0.9 / 16] * 2, indexing="ij")
    np.save(tmp_path / "gap.npy", (x**2 + y**2) / 80.0 + 3e-3 * np.maximum(x, 0.0))
    structure = next(line for line in WEAR.splitlines() if line.startswith("structure"))
    wear = WEAR.replace(structure, "structure: {kind: bodies, shape: heights, file: gap.npy}")
    wear = wear.replace("increments: 2}", f"increments: 2, tilt: {tilt}}}")
    _, contact = contact_in_rig(tmp_path, wear=wear)
    state = contact.unworn()
    cycle = contact.at(state)
    joint, wearing = cycle.slipping.normal, cycle.wearing.solve(state.surfaces, 0, None)
    for solved in (joint, wearing):
        assert (solved.tilt_y == 0.0) == (tilt == "held")
        assert (abs(solved.My) < 1e-6) == (tilt == "free")
    np.testing.assert_allclose(wearing.pressure, joint.pressure, atol=1e-6 * joint.pressure.max())
    loop = contact.loop(cycle, 0.5 * cycle.full_slip)
    pressed = np.count_nonzero(joint.pressure) * contact.grid.cell_area
    assert loop.area == pytest.approx(pressed, rel=1e-9)
    # The stiffness that both start with is that of the same pressed cells.
    assert loop.stiffness == pytest.approx(cycle.slipping.stiffness, rel=1e-6)


# --- wear ---------------------------------------------------------------------------------------


def test_the_volume_is_that_of_the_dissipated_energy(summary):
    # 1500 µm³/J of both bodies are 1.5e-9 1/MPa.
    assert summary["volume_per_energy"] == pytest.approx(1.5e-9, rel=BALANCED)


def test_no_warning_asks_for_a_stability_that_a_contact_does_not_have(summary):
    assert not [text for text in summary["warnings"] if "FS-W404" in text]


def test_energy_adds_up_from_cycle_to_cycle(tmp_path):
    """Wear dissipates the energy of the intermediate motions, by Simpson's rule."""
    _, contact = contact_in_rig(tmp_path)
    cycles, energies, spent = np.linspace(0.0, 4000.0, 5), [], []
    state = contact.unworn()
    state = replace(state, next_cycles=first_cycles(contact.wearing(state), state, cycles[-1]))
    stepper = ImplicitStepper(ErrorControl(0.01))
    for length in (0.0, *np.diff(cycles)):
        if length:
            state = advance_cycles(stepper, state, length, cycles[-1], contact.wearing).state
        energies.append(float(contact.at(state).by_slider.sum()))
        spent.append(state.energy)
    weights = np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 3.0 * cycles[1]
    assert spent[-1] == pytest.approx(float(weights @ energies), rel=0.01)


def test_nothing_wears_where_nothing_slips(tmp_path):
    _, contact = contact_in_rig(tmp_path, force=1e-6)
    state = worn(contact, 1e4)
    assert state.energy == 0.0
    assert not state.surfaces.depth.any()


def test_a_larger_force_wears_more_and_a_small_one_in_a_ring(tmp_path):
    _, small = contact_in_rig(tmp_path, force=10.0)
    _, large = contact_in_rig(tmp_path, force=75.0)
    slipping, sliding = (contact.at(contact.unworn()) for contact in (small, large))
    assert slipping.stroke < 2.0 * slipping.full_slip < sliding.stroke
    pressed = slipping.slipping.normal.pressure > 0.0
    assert np.all(sliding.path[pressed] > 0.0)
    middle = tuple(cells // 2 for cells in small.grid.shape)
    assert slipping.path[middle] == 0.0
    assert slipping.path[pressed].max() > 0.0


def test_wear_stiffens_the_contact_and_raises_the_resonance(summary):
    assert summary["trend"]["stiffness"] == 1.0
    assert summary["trend"]["peak_pressure"] == -1.0
    unworn, worn_out = summary["states"][0], summary["states"][-1]
    for before, after in zip(unworn["responses"], worn_out["responses"], strict=True):
        assert after["resonance"] > 1.05 * before["resonance"]
    # 8 G* a of Mindlin's stuck sphere; 16 cells over 0.9 mm leave an error of some per cent.
    assert unworn["stiffness"] == pytest.approx(48717.0, rel=0.05)
    masses = np.diag(MASSES)
    first, second = SPRINGS
    held = np.array([[first + second, -second], [-second, second + unworn["stiffness"]]])
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(masses, held)).real)
    np.testing.assert_allclose(unworn["stuck"], np.sqrt(squares) / (2.0 * np.pi), rtol=1e-9)


# --- what it leaves -----------------------------------------------------------------------------


def test_results_hold_fields_sliders_loops_and_responses(ended, summary):
    with h5py.File(ended / "results.h5") as file:
        assert sorted(file["worn"]) == ["00000", "00001", "00002"]
        state, numbers = file["worn/00002"], summary["states"][2]
        assert state["contact/pressure"].shape == (16, 16)
        area = float(np.prod(file["grid"].attrs["pitch"]))
        assert state["contact/energy"][()].sum() * area == pytest.approx(
            numbers["energy_per_cycle"], rel=BALANCED
        )
        depth = state["contact/depth_1"][()] + state["contact/depth_2"][()]
        assert depth.sum() * area == pytest.approx(numbers["volume"], rel=1e-12)
        assert state["sliders/normal_load"][()].sum() == pytest.approx(60.0, rel=1e-6)
        moved, force = (state[f"loop/{name}"][()] for name in ("displacement", "force"))
        assert np.trapezoid(force, moved) == pytest.approx(numbers["energy_per_cycle"], rel=0.02)
        assert state["responses/00001"].attrs["force"] == 40.0
        for dataset in state["contact"].values():
            assert dataset.attrs["unit"]


def test_tables_hold_the_evolution_and_every_response(ended, summary):
    with (ended / "evolution.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["cycles [1]"]) for row in rows] == [0.0, 100.0, 20000.0]
    assert float(rows[-1]["resonance_1 [Hz]"]) == pytest.approx(
        summary["states"][-1]["responses"][0]["resonance"], rel=1e-8
    )
    assert len(list(ended.glob("frf_*.csv"))) == 6


@pytest.mark.slow
def test_figures_are_complete_and_legible(ended):
    assert problems_of_run(ended) == []


# --- mistakes -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("body_2: {young: 200 GPa", "body_2: {young: 100 GPa"),
        ("coefficient: 0.4", "coefficient: 0"),
        ("grid: [16, 16]", "grid: [16, 2000, 1]"),
    ],
)
def test_contacts_that_cannot_be_a_joint_are_refused(tmp_path, before, after):
    assert before in WEAR
    assert "contact.file" in refusal(tmp_path, wear=WEAR.replace(before, after))


@pytest.mark.slow
def test_the_worn_contact_is_shown_in_paraview(tmp_path):
    ended = run(tmp_path, "output.paraview=true", "wear.cycles=[2e4]", "forces=[5 N]")
    assert ended.exit_code == 0, ended.stderr
    folder = tmp_path / "out" / "paraview"
    check_arrays(folder)
    check_scene(folder / "view.py")
    series = pyvista.PVDReader(folder / "contact.pvd")
    assert series.time_values == [0.0, 2e4]
    face = pyvista.read(folder / "contact" / "00001.vtp")
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        contact = file["worn/00001/contact"]
        for name, shown in {"pressure": "pressure [MPa]", "path": "cycle_slip [mm]"}.items():
            expected = contact[name][()].ravel(order="F")
            np.testing.assert_allclose(face[shown], expected, rtol=1e-6)
        worn = face["worn_1 [mm]"][:, 2]
        np.testing.assert_allclose(worn, -contact["depth_1"][()].ravel(order="F"), rtol=1e-6)
    state = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))["states"][-1]
    assert total(face, "depth [mm]") == pytest.approx(state["volume"], rel=1e-6)
    assert total(face, "cycle_energy [N/mm]") == pytest.approx(state["energy_per_cycle"], rel=1e-6)


@pytest.mark.slow
def test_an_excitation_of_one_force_wears_as_that_force(tmp_path):
    """They agree at the level by which the force is divided."""
    few = ("wear.cycles=[20]", "frequencies=[60 Hz, 140 Hz]")
    by_force, by_level = tmp_path / "force", tmp_path / "level"
    wanted, found = (
        _ended(folder, *few, *more)
        for folder, more in (
            (by_force, ("forces=[5 N]",)),
            (
                by_level,
                (
                    *("forces=", "wear.force=", "wear.level=150"),
                    "excitation={levels: [10], forces: [{points: m1, amplitude: 0.5 N}]}",
                ),
            ),
        )
    )
    for name in ("energy", "volume", "depth", "stroke", "stiffness"):
        same = pytest.approx(wanted["states"][-1][name], rel=1e-9)
        assert found["states"][-1][name] == same, name
    response = found["states"][-1]["responses"][0]
    assert response["level"] == 10.0
    assert response["resonance"] == pytest.approx(
        wanted["states"][-1]["responses"][0]["resonance"], rel=1e-9
    )


def _ended(folder, *settings):
    """Return the summary of a run of the small case."""
    folder.mkdir()
    result = run(folder, *settings)
    assert result.exit_code == 0, result.output
    return json.loads((folder / "out" / "summary.json").read_text(encoding="utf-8"))
