"""Specimens that wear each other in a vibrating rig: balances, limits, rates, and a whole run."""

import csv
import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
import yaml

from fe_models.dynamics.rig import natural_frequencies
from tests.workflow.conftest import invoke, manifest_has_all
from tests.workflow.test_friction_rig import NODES, RIG, SPECIMENS
from tests.workflow.test_time_cases import refused
from workflow.analyses.vibration.model import VibrationModel
from workflow.analyses.vibration_wear.case import FrictionRigWearCase
from workflow.analyses.vibration_wear.pad_wear_steps import PadState, heun, taken, worn_until
from workflow.analyses.vibration_wear.pads import WearingPads
from workflow.case.writing import dump_case
from workflow.kinds import parse_case
from workflow.runs.run import run_case
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter

# What changes of the rig that does not wear.
WORN = {
    "wear": {"force": "75 N", "frequency": "100 Hz", "cycles": [5e5]},
    "forces": ["2 N", "20 N"],
    "frequencies": ["80 Hz", "240 Hz"],
    "resolution": {"harmonics": 2, "samples": 48},
    "continuation": {"longest_step": 0.4},
}
# Of both bodies, unlike each other so that they are not taken for each other [1/MPa].
COEFFICIENTS = 1e-9, 2e-9
FRICTION, STUCK_FORCE = 0.88, 1e-4
# Cycles after which the pad is flat, and its wear even.
FLAT = 2e6
ROUNDING = 1e-12


def case_in(folder):
    """The case as it is read from a file; its specimens are in the folder."""
    (folder / "specimens.yaml").write_text(SPECIMENS, encoding="utf-8")
    given = yaml.safe_load(RIG) | WORN
    # The numbers of cycles below lie between those after which a further node of such pads touches.
    specimens = {"specimens": str(folder / "specimens.yaml"), "sharing": "even"}
    given["structure"] = given["structure"] | specimens
    return FrictionRigWearCase(**given)


@pytest.fixture(scope="module")
def pads(tmp_path_factory):
    """The unworn pads under 75 N at 100 Hz, which makes all of them slide."""
    folder = tmp_path_factory.mktemp("pads")
    reporter = Reporter(folder / "log")
    unworn = VibrationModel.of(case_in(folder).unworn, reporter)
    reporter.close()
    return WearingPads(unworn, COEFFICIENTS, 75.0, 100.0)


@pytest.fixture(scope="module")
def unworn(pads):
    return PadState.new(pads)


@pytest.fixture(scope="module")
def flat(pads, unworn):
    """Pads that have worn flat."""
    return worn_until(pads, unworn, FLAT, 0.1)


# --- balances -----------------------------------------------------------------------------------


def test_the_volume_is_that_of_the_dissipated_energy(pads, flat):
    volumes = [float(depth @ flat.rubbed.area) for depth in pads.depths(flat.depth)]
    np.testing.assert_allclose(volumes, np.multiply(COEFFICIENTS, flat.energy), rtol=ROUNDING)
    np.testing.assert_allclose(flat.rubbed.law.gap, pads.unworn.rig.gap + flat.depth, rtol=ROUNDING)


def test_energy_is_that_of_the_motions_on_the_way(pads, unworn):
    """Simpson's rule over energies of a cycle, at the ends of stretches of many steps each."""
    cycles, state = np.linspace(0.0, 1e5, 5), unworn
    energies, spent = [float(unworn.rubbed.energy.sum())], 0.0
    for end in cycles[1:]:
        state = worn_until(pads, state, end, 0.01)
        energies.append(float(state.rubbed.energy.sum()))
        spent = state.energy
    weights = np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 3.0 * cycles[1]
    assert spent == pytest.approx(float(weights @ energies), rel=1e-4)


def test_what_a_node_dissipates_is_its_force_along_its_path(unworn):
    """µ ∮ N |ds|: N hardly changes in the cycle, but at two sides of a pad that rocks a little."""
    pressed = unworn.rubbed.motion.cycle.samples[:, :, 2].mean(axis=0)
    np.testing.assert_allclose(
        FRICTION * pressed * unworn.rubbed.path, unworn.rubbed.energy, rtol=1e-4, atol=1e-15
    )


# --- limits -------------------------------------------------------------------------------------


def test_nothing_wears_where_nothing_slips(pads):
    still = replace(pads, force=STUCK_FORCE)
    state = worn_until(still, PadState.new(still), 1e6, 0.1)
    assert state.steps == 1
    assert state.energy == 0.0
    assert not state.depth.any()


def test_gaps_grow_only_where_energy_is_dissipated(pads, unworn):
    open_nodes = unworn.rubbed.energy == 0.0
    assert 0 < open_nodes.sum() < NODES
    assert not unworn.rubbed.model.touching[open_nodes].any()
    step = heun(pads, unworn, 1e4)
    np.testing.assert_array_equal(step.depth > 0.0, ~open_nodes)


def test_flat_pads_wear_evenly_and_stick_as_pads_without_form(pads, unworn, flat):
    """In the end depths grow alike: e/A is even; all nodes touch, as those of flat pads do."""
    rubbed = flat.rubbed
    np.testing.assert_allclose(rubbed.rate, rubbed.rate.mean(), rtol=5e-3)
    assert np.ptp(unworn.rubbed.rate) > unworn.rubbed.rate.mean()
    assert unworn.rubbed.model.touching.sum() < rubbed.model.touching.sum() == NODES
    law = rubbed.law
    springs = [law.stiffness, law.stiffness, law.normal_stiffness]
    stuck = np.broadcast_to(np.column_stack(springs), (NODES, 3))[:, :, None] * np.eye(3)
    expected = natural_frequencies(pads.unworn.rig.model, stuck)[0]
    before, after = (own.rubbed.model.numbers()["stuck"][0] for own in (unworn, flat))
    assert after == pytest.approx(expected, rel=1e-9)
    assert before < 0.97 * after


# --- steps --------------------------------------------------------------------------------------


def in_steps(pads, state, cycles, count):
    for _ in range(count):
        state = taken(pads, state, heun(pads, state, cycles / count))
    return state


def test_steps_converge_with_their_square(pads, unworn):
    """Over cycles in which no further node comes to touch: there the rate has a corner."""
    depths = [in_steps(pads, unworn, 4e4, count).depth for count in (1, 2, 4, 16)]
    errors = [np.abs(depth - depths[-1]).max() for depth in depths[:-1]]
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all((rates > 1.7) & (rates < 2.4)), rates


def test_the_tolerance_bounds_the_error(pads, unworn):
    best = worn_until(pads, unworn, 2e5, 0.005)
    for tolerance in (0.2, 0.1, 0.05):
        found = worn_until(pads, unworn, 2e5, tolerance)
        error = np.linalg.norm(found.depth - best.depth) / np.linalg.norm(best.depth)
        assert error < 0.2 * tolerance
        assert found.steps < best.steps


@pytest.mark.parametrize("seed", [0, 1])
def test_the_longest_step_presses_roughness_away(pads, flat, seed):
    """In the norm of depths over D, in which D K is symmetric; all paths being alike, D ~ 1/A."""
    rough = 1e-6 * np.random.default_rng(seed).standard_normal(NODES)
    area, length = flat.rubbed.area, flat.rubbed.longest_step
    rough -= (area @ rough) / area.sum()
    before = flat.depth + rough
    disturbed = replace(flat, depth=before, rubbed=pads.at(before, flat.rubbed.motion))
    smooth, other = (own.depth + heun(pads, own, length).depth for own in (flat, disturbed))
    left = other - smooth

    def size(depth):
        return float(np.sqrt(area @ depth**2))

    assert size(left) < 0.95 * size(rough)


# --- a whole run --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    folder = tmp_path_factory.mktemp("worn_rig")
    run_case(case_in(folder), folder / "out", force=False)
    assert manifest_has_all(folder / "out")
    return OutputFolder(folder / "out")


@pytest.fixture(scope="module")
def summary(ended):
    return json.loads(ended.summary.read_text(encoding="utf-8"))


def test_wear_closes_the_pad_and_raises_its_resonances(summary):
    assert summary["warnings"] == []
    # 1500 µm³/J of both bodies.
    assert summary["volume_per_energy"] == pytest.approx(3e-9, rel=ROUNDING)
    assert summary["trend"]["touching"] == 1.0
    assert summary["trend"]["resonance"] == 1.0
    first, last = summary["states"]
    assert (first["cycles"], last["cycles"]) == (0.0, 5e5)
    assert last["stuck"][0] > 1.03 * first["stuck"][0]
    assert last["stiffness"] > first["stiffness"]
    # Under a small force the resonance is near the stuck one, and moves along with it.
    for state in (first, last):
        assert state["responses"][0]["resonance"] == pytest.approx(state["stuck"][0], rel=0.1)


def test_results_hold_nodes_loops_and_responses(ended, summary):
    with h5py.File(ended.results) as file:
        area = file["places/area"][()]
        assert area.sum() == pytest.approx(1.0, rel=1e-9)
        state, numbers = file["worn/00001"], summary["states"][1]
        nodes = {name: state[f"nodes/{name}"][()] for name in state["nodes"]}
        assert (nodes["depth_1"] + nodes["depth_2"]) @ area == pytest.approx(
            numbers["volume"], rel=ROUNDING
        )
        assert nodes["energy"].sum() == pytest.approx(numbers["energy_per_cycle"], rel=ROUNDING)
        assert nodes["normal_force"].sum() == pytest.approx(60.0, rel=1e-8)
        gap = file["worn/00000/nodes/gap"][()] + nodes["depth_1"] + nodes["depth_2"]
        np.testing.assert_allclose(nodes["gap"], gap, rtol=ROUNDING)
        moved, force = (state[f"loop/{name}"][()] for name in ("displacement", "force"))
        assert np.abs(force).max() == pytest.approx(FRICTION * 60.0, rel=1e-2)
        assert np.ptp(moved) == pytest.approx(numbers["stroke"], rel=ROUNDING)
        assert state["responses/00001"].attrs["force"] == 20.0
    with (ended.root / "evolution.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["touching [1]"]) for row in rows] == [
        own["touching"] for own in summary["states"]
    ]
    assert len(list(ended.root.glob("frf_*.csv"))) == 4


def test_figures_are_drawn(ended, tmp_path):
    from workflow.analyses.vibration_wear.figures import figures_of
    from workflow.pictures.drawing import write_figures

    drawn = {path.stem for path in write_figures(figures_of, ended.results, tmp_path)}
    assert drawn == {"frequency_response", "evolution", "profile", "loops"}


# --- the case as a file -------------------------------------------------------------------------


@pytest.fixture
def text(tmp_path):
    """The case as a file, beside its specimens."""
    (tmp_path / "specimens.yaml").write_text(SPECIMENS, encoding="utf-8")
    return RIG + "wear: {force: 75 N, frequency: 100 Hz, cycles: [10]}\n"


def test_a_case_is_written_as_it_was_read_and_outlined(text, tmp_path):
    case = parse_case(text, str(tmp_path / "case.yaml"))
    assert isinstance(case, FrictionRigWearCase)
    assert parse_case(dump_case(case), str(tmp_path / "again.yaml")) == case
    (tmp_path / "case.yaml").write_text(text, encoding="utf-8")
    checked = invoke("check", tmp_path / "case.yaml")
    assert checked.exit_code == 0, checked.output
    assert "10 cycles of 75 N at 100 Hz" in checked.output


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("structure.kind=reduced", "allowed: rig, friction_rig"),
        ("joint.law=jenkins", "friction_contact"),
        ("joint.gap=1 um", "unknown key"),
        ("mass=1", "unknown key"),
        ("joint.normal_load=0", "above 0"),
        ("contact={file: specimens.yaml}", "unknown key"),
        ("wear.cycles=[10, 10]", "not ascending"),
        ("wear.tolerance=0", "0.01 % to 50 %"),
        ("structure.specimens=nothing.yaml", "no such file"),
    ],
)
def test_mistakes_are_told_in_one_line(text, tmp_path, override, words):
    code, message = refused(tmp_path, text, override)
    assert code == 2
    assert words in message


def test_it_runs_from_the_command_line(text, tmp_path):
    (tmp_path / "case.yaml").write_text(text, encoding="utf-8")
    settings = ("--set", "forces=[2 N]", "--set", "frequencies=[150 Hz, 160 Hz]")
    ended = invoke("run", tmp_path / "case.yaml", "--out", tmp_path / "out", *settings)
    assert ended.exit_code == 0, ended.output
    assert (tmp_path / "out" / "summary.json").exists()
