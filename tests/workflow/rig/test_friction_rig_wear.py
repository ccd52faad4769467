"""Tests of specimens that wear in a vibrating rig: balances, limits, rates, and a run."""

import csv
import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
import pyvista
import yaml

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.rig import modal_damping, natural_frequencies
from tests.workflow.conftest import invoke, manifest_has_all
from tests.workflow.output.figure_checks import problems_of_run
from tests.workflow.output.shown_files import check_arrays, check_scene, total
from tests.workflow.rig.test_friction_rig import NODES, RIG, SPECIMENS
from wear.evolution import EnergyTable
from wear.laws import ArchardLaw, EnergyAmplitudeLaw, EnergyLaw, EvolvingLaw
from wear.steps.marching import advance_cycles
from wear.steps.step_errors import step_errors
from wear.steps.steppers import ExplicitStepper, HeunStepper
from workflow.analyses.vibration.model import structure_numbers, vibration_model
from workflow.analyses.vibration_wear.body import body_model
from workflow.analyses.vibration_wear.case import FrictionRigWearCase
from workflow.analyses.vibration_wear.output.quantities import main_results
from workflow.analyses.vibration_wear.pads import WearingPads
from workflow.kinds import parse_case
from workflow.runs.run import run_case
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.terminal.reporter import Reporter

# What changes of the rig that does not wear.
WORN = {
    "wear": {"force": "75 N", "frequency": "100 Hz", "cycles": [5e5]},
    "forces": ["2 N", "20 N"],
    "frequencies": ["100 Hz", "200 Hz"],
    "resolution": {"harmonics": 1, "samples": 32},
    "continuation": {"longest_step": 0.4},
}
# Of both bodies, unlike each other so that they are not taken for each other [1/MPa].
COEFFICIENTS = 1e-9, 2e-9
LAWS = EnergyLaw(COEFFICIENTS[0]), EnergyLaw(COEFFICIENTS[1])
FRICTION, STUCK_FORCE = 0.88, 1e-4
# Cycles after which the pad is flat, and its wear even.
FLAT = 2e6
ROUNDING = 1e-12


def case_in(folder):
    """Return the case as read from a file; its specimens are in the folder."""
    (folder / "specimens.yaml").write_text(SPECIMENS, encoding="utf-8")
    given = yaml.safe_load(RIG) | WORN
    # The numbers of cycles below lie between those after which a further node of such pads touches.
    specimens = {"specimens": str(folder / "specimens.yaml"), "sharing": "even"}
    given["structure"] = given["structure"] | specimens
    return FrictionRigWearCase(**given)


@pytest.fixture(scope="module")
def pads(tmp_path_factory):
    """Return the unworn pads under 75 N at 100 Hz, which makes all of them slide."""
    folder = tmp_path_factory.mktemp("pads")
    reporter = Reporter(folder / "log")
    unworn = vibration_model(case_in(folder).unworn, reporter).structure
    reporter.close()
    return WearingPads(unworn, LAWS, 75.0, 100.0)


def with_laws(pads, *laws, force=75.0):
    """Return the same pads with other laws."""
    return WearingPads(pads.unworn, laws or LAWS, force, 100.0)


def worn(pads, state, cycles, tolerance):
    """Wear the pads by further cycles, in steps chosen by the tolerance."""
    return advance_cycles(HeunStepper(tolerance), state, cycles, cycles, pads.contact_at)


@pytest.fixture(scope="module")
def unworn(pads):
    return pads.begin()


@pytest.fixture(scope="module")
def flat(pads, unworn):
    """Return pads that have worn flat."""
    return worn(pads, unworn, FLAT, 0.1).state


# --- balances -----------------------------------------------------------------------------------


def test_the_volume_is_that_of_the_dissipated_energy(pads, flat):
    cycle = pads.at(flat)
    volumes = [float(depth @ cycle.areas) for depth in flat.surfaces.depths]
    np.testing.assert_allclose(volumes, np.multiply(COEFFICIENTS, flat.energy), rtol=ROUNDING)
    gap = pads.unworn.rig.gap + flat.surfaces.depth
    np.testing.assert_allclose(cycle.law.gap, gap, rtol=ROUNDING)


def test_energy_is_that_of_the_motions_on_the_way(pads, unworn):
    """Simpson's rule over the energies of cycles gives the sum over many steps."""
    cycles, state = np.linspace(0.0, 1e5, 5), unworn
    energies = [float(pads.at(unworn).energy.sum())]
    for stretch in np.diff(cycles):
        state = worn(pads, state, float(stretch), 0.01).state
        energies.append(float(pads.at(state).energy.sum()))
    weights = np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 3.0 * cycles[1]
    assert state.energy == pytest.approx(float(weights @ energies), rel=1e-4)


def test_what_a_node_dissipates_is_its_force_along_its_path(pads, unworn):
    """It is µ ∮ N |ds|; N hardly changes, except at two sides of a pad that rocks a little."""
    cycle = pads.at(unworn)
    pressed = cycle.motion.cycle.samples[:, :, 2].mean(axis=0)
    np.testing.assert_allclose(FRICTION * pressed * cycle.path, cycle.energy, rtol=1e-4, atol=1e-15)
    np.testing.assert_allclose(
        cycle.pressure[0] * cycle.areas, pressed, rtol=1e-4, atol=1e-9 * pressed.max()
    )


# --- the same rig as own matrices ---------------------------------------------------------------

OWN = """\
title: The rig as matrices
analysis: vibration
structure:
  kind: matrices
  matrices: {file: rig.npz, units: {length: mm, force: N}}
  joints: [{points: upper pad, against: lower pad, direction: -z}]
  damping_ratio: 0.01
  driven: {points: m1, direction: x}
  seen: {points: m2, direction: x}
joint:
  law: friction_contact
  normal_load: 60 N
  friction: 0.88
  stiffness: 45 N/um
  normal_stiffness: 58.5 N/um
  pressed: {points: m2, direction: -z}
  nodes: nodes.csv
  sharing: even
wear: {force: 75 N, frequency: 100 Hz, cycles: [5e5], law: energy,
       body_1: {coefficient: 1000 um^3/J}, body_2: {coefficient: 2000 um^3/J}}
forces: [2 N]
frequencies: [100 Hz, 200 Hz]
resolution: {harmonics: 1, samples: 32}
"""


def reordered(pads, order):
    """Return the same pads with the rows of the rig reordered and its matrices symmetric."""
    rig, problem = pads.unworn.rig, pads.unworn.problem
    mass, stiffness = (
        0.5 * (matrix + matrix.T)[np.ix_(order, order)]
        for matrix in (rig.model.mass, rig.model.stiffness)
    )
    model = replace(
        rig.model,
        mass=mass,
        stiffness=stiffness,
        damping=modal_damping(mass, stiffness, 0.01),
        connection=rig.model.connection[:, order],
        names=tuple(rig.model.names[k] for k in order),
    )
    moved = {name: getattr(rig, name)[order] for name in ("driven", "pressing", "stretch")}
    waves = {1: problem.load.waves[1][order]}
    load = replace(problem.load, waves=waves, static=problem.load.static[order])
    problem = HarmonicBalance(model, problem.joints, load, problem.resolution)
    rig = replace(rig, model=model, seen=rig.seen[:, order], **moved)
    unworn = replace(pads.unworn, rig=rig, problem=problem)
    return WearingPads(unworn, pads.laws, pads.force, pads.frequency)


def test_the_rig_as_own_matrices_wears_as_the_one_built_in(pads, tmp_path):
    """Specimens and masses are exported; gaps and areas are in a table with reordered rows.

    The modes come after the other unknowns there. As the square of the fastest frequency is 2e11
    times that of the first, the last bits of a matrix, or its order, change wear by 2e-6.
    """
    rig = pads.unworn.rig
    modal = [f"{name} modal" if " mode " in name else name for name in rig.model.names]
    np.savez(tmp_path / "rig.npz", K=rig.model.stiffness, M=rig.model.mass, names=np.array(modal))
    rows = [f"upper pad {n + 1},{rig.area[n]:.17g},{rig.gap[n]:.17g}\n" for n in range(NODES)]
    table = "point,area [mm^2],gap [mm]\n" + "".join(reversed(rows))
    (tmp_path / "nodes.csv").write_text(table, encoding="utf-8")
    case = parse_case(OWN, str(tmp_path / "own.yaml"))
    reporter = Reporter(tmp_path / "log")
    own = WearingPads(body_model(case, reporter), case.laws, 75.0, 100.0)
    reporter.close()
    behind = sorted(range(len(modal)), key=lambda k: modal[k].endswith("modal"))
    for built_in, allowed in ((reordered(pads, behind), 1e-8), (pads, 1e-5)):
        ours, theirs = (in_steps(each, each.begin(), 8e4, 2) for each in (own, built_in))
        for depth, expected in zip(ours.surfaces.depths, theirs.surfaces.depths, strict=True):
            np.testing.assert_allclose(depth, expected, atol=allowed * expected.max())
        assert ours.energy == pytest.approx(theirs.energy, rel=allowed)
        (energy, numbers), (wanted, known) = (
            (each.at(state).energy, structure_numbers(each.at(state).model))
            for each, state in ((own, ours), (built_in, theirs))
        )
        np.testing.assert_allclose(energy, wanted, atol=allowed * wanted.max())
        np.testing.assert_allclose(numbers["stuck"][:6], known["stuck"][:6], rtol=allowed)


# --- laws ---------------------------------------------------------------------------------------


def rates(pads, state, *laws):
    """Return the depths of both bodies per cycle, and the pressure and path of that cycle."""
    cycle = pads.at(state)
    wear = with_laws(pads, *laws).contact_at(state).wear(state)
    return np.array(wear), cycle.energy / cycle.areas, cycle.path


def test_every_law_takes_off_what_it_says(pads, unworn):
    """Energy, amplitude (a quarter of the path) and Archard laws match hand calculations."""
    energy, amplitude = EnergyLaw(1e-9), EnergyAmplitudeLaw(2e-9, 5e-3)
    wear, dissipated, path = rates(pads, unworn, energy, amplitude)
    np.testing.assert_allclose(wear[0], 1e-9 * dissipated, rtol=ROUNDING)
    expected = 2e-9 * dissipated * path / 4.0 / 5e-3
    np.testing.assert_allclose(wear[1], expected, rtol=ROUNDING)
    wear, dissipated, path = rates(pads, unworn, ArchardLaw(1e-6, 4000.0), energy)
    # K s p / H, and µ s p is dissipated.
    np.testing.assert_allclose(wear[0], 1e-6 / 4000.0 * dissipated / FRICTION, rtol=ROUNDING)
    assert wear.all(axis=0).any()


def test_nothing_is_lost_below_a_threshold(pads, unworn):
    """V = α (ΣEd - Ed_th) holds for any steps, and energies keep adding up."""
    cycles = 2e4
    threshold = 0.5 * cycles * float(pads.at(unworn).energy.sum())
    law = EvolvingLaw(EnergyLaw(3e-9), EnergyTable(threshold=threshold), "global")
    limited = with_laws(pads, law, law)
    done = worn(limited, unworn, cycles, 0.1)
    assert done.state.energy > 1.8 * threshold
    volume = float(done.state.surfaces.depth @ limited.at(unworn).areas)
    assert volume == pytest.approx(6e-9 * (done.state.energy - threshold), rel=1e-9)


# --- limits -------------------------------------------------------------------------------------


def test_nothing_wears_where_nothing_slips(pads):
    still = with_laws(pads, force=STUCK_FORCE)
    done = worn(still, still.begin(), 1e6, 0.1)
    assert done.cost.steps == 2
    assert done.state.energy == 0.0
    assert not done.state.surfaces.depth.any()


def test_gaps_grow_only_where_energy_is_dissipated(pads, unworn):
    cycle = pads.at(unworn)
    open_nodes = cycle.energy == 0.0
    assert 0 < open_nodes.sum() < NODES
    assert not cycle.model.touching[open_nodes].any()
    depth = in_steps(pads, unworn, 1e4, 1).surfaces.depth
    np.testing.assert_array_equal(depth > 0.0, ~open_nodes)


def test_flat_pads_wear_evenly_and_stick_as_pads_without_form(pads, unworn, flat):
    """In the end depths grow equally: e/A is uniform, and all nodes touch as in flat pads."""
    cycle, begun = pads.at(flat), pads.at(unworn)
    rate, first = (sum(pads.contact_at(state).wear(state)) for state in (flat, unworn))
    np.testing.assert_allclose(rate, rate.mean(), rtol=5e-3)
    assert np.ptp(first) > first.mean()
    assert begun.model.touching.sum() < cycle.model.touching.sum() == NODES
    law = cycle.law
    springs = [law.stiffness, law.stiffness, law.normal_stiffness]
    stuck = np.broadcast_to(np.column_stack(springs), (NODES, 3))[:, :, None] * np.eye(3)
    expected = natural_frequencies(pads.unworn.rig.model, stuck)[0]
    before, after = (structure_numbers(pad_cycle.model)["stuck"][0] for pad_cycle in (begun, cycle))
    assert after == pytest.approx(expected, rel=1e-9)
    assert before < 0.97 * after


# --- steps --------------------------------------------------------------------------------------


def in_steps(pads, state, cycles, count):
    """Take ``count`` equal steps of Heun's method, whatever their error."""
    stepper = HeunStepper(tolerance=np.inf, share=np.inf)
    for _ in range(count):
        state = stepper.step(state, cycles / count, cycles, pads.contact_at).state
    return state


def test_steps_converge_with_their_square(pads, unworn):
    """No further node comes into contact during the cycles, where the rate would have a kink."""
    depths = [in_steps(pads, unworn, 4e4, count).surfaces.depth for count in (1, 2, 8)]
    errors = [np.abs(depth - depths[-1]).max() for depth in depths[:-1]]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all((orders > 1.7) & (orders < 2.4)), orders


@pytest.mark.slow
def test_the_tolerance_bounds_the_error(pads, unworn):
    best = worn(pads, unworn, 2e5, 0.005)
    exact = best.state.surfaces.depth
    for tolerance in (0.2, 0.1, 0.05):
        done = worn(pads, unworn, 2e5, tolerance)
        error = np.linalg.norm(done.state.surfaces.depth - exact) / np.linalg.norm(exact)
        assert error < 0.2 * tolerance
        reported = step_errors(done.state, pads.at(done.state).areas)["depth"]
        assert error / 3.0 < reported < 3.0 * error
        assert done.cost.steps < best.cost.steps


@pytest.mark.slow
def test_explicit_steps_come_to_the_same(pads, unworn):
    """Euler's steps of a tenth of their limit are of first order only."""
    done = advance_cycles(ExplicitStepper(0.1), unworn, 1e5, 1e5, pads.contact_at)
    best = worn(pads, unworn, 1e5, 0.02).state.surfaces.depth
    error = np.linalg.norm(done.state.surfaces.depth - best) / np.linalg.norm(best)
    assert error < 0.1


@pytest.mark.parametrize("seed", [0, 1])
def test_half_the_limit_presses_roughness_away(pads, flat, seed):
    """The norm is of depths over D, in which D K is symmetric; for equal paths D ~ 1/A."""
    rough = 1e-6 * np.random.default_rng(seed).standard_normal(NODES)
    area, length = pads.at(flat).areas, 0.5 * pads.contact_at(flat).stable_cycles(flat)
    rough -= (area @ rough) / area.sum()
    disturbed = replace(flat, surfaces=flat.surfaces.worn(0.0, rough))
    smooth, other = (in_steps(pads, state, length, 1).surfaces.depth for state in (flat, disturbed))
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


def stuck_slope(ended):
    """Return the largest slope of the unworn loop between neighbouring stuck samples."""
    with h5py.File(ended.results) as file:
        loop = file["worn/00000/loop"]
        moved, pulled = (np.diff(loop[name][()]) for name in ("displacement", "force"))
    return np.max(pulled / moved)


def test_wear_closes_the_pad_and_raises_its_resonances(ended, summary):
    assert summary["warnings"] == []
    # 1500 µm³/J of both bodies.
    assert summary["volume_per_energy"] == pytest.approx(3e-9, rel=ROUNDING)
    assert summary["trend"]["touching"] == 1.0
    assert summary["trend"]["resonance"] == 1.0
    first, last = summary["states"]
    assert (first["cycles"], last["cycles"]) == (0.0, 5e5)
    assert last["stuck"][0] > 1.03 * first["stuck"][0]
    assert last["stiffness"] > first["stiffness"]
    # Nothing wears yet: the stuck part of the loop has the slope of all that touches.
    assert first["stiffness"] == pytest.approx(stuck_slope(ended), rel=0.02)
    # Under a small force the resonance is near the stuck one, and moves along with it.
    for state in (first, last):
        assert state["responses"][0]["resonance"] == pytest.approx(state["stuck"][0], rel=0.1)


def test_the_error_of_a_depth_is_that_of_its_steps_and_of_the_motion(tmp_path, summary):
    (depth,) = (q for q in main_results(case_in(tmp_path), summary) if q.path == "states.1.depth")
    state = summary["states"][1]
    assert state["error"] > 0.0
    assert depth.error == pytest.approx(state["step_error"] + state["error"], rel=ROUNDING)


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
        state["touching"] for state in summary["states"]
    ]
    assert len(list(ended.root.glob("frf_*.csv"))) == 4


def test_pads_in_paraview_balance(ended, summary, tmp_path):
    from workflow.analyses.vibration_wear import ANALYSIS
    from workflow.analyses.vibration_wear.output.outcome import VibrationWearContents
    from workflow.pictures.drawing import write_paraview

    write_paraview(ANALYSIS.pictures, VibrationWearContents(at_nodes=True), ended.results, tmp_path)
    check_arrays(tmp_path)
    check_scene(tmp_path / "view.py")
    pad, numbers = pyvista.read(tmp_path / "contact" / "00001.vtu"), summary["states"][1]
    assert total(pad, "pressure [MPa]") == pytest.approx(60.0, rel=1e-6)
    assert total(pad, "depth [mm]") == pytest.approx(numbers["volume"], rel=1e-6)
    assert total(pad, "cycle_energy [N/mm]") == pytest.approx(numbers["energy_per_cycle"], rel=1e-6)
    assert np.all(pad["unloaded_gap [mm]"] >= pad["depth [mm]"])


@pytest.mark.slow
def test_figures_are_complete_and_legible(ended):
    assert problems_of_run(ended.root) == []


# --- the case as a file -------------------------------------------------------------------------


@pytest.fixture
def text(tmp_path):
    """Return the case as a file in the folder of its specimens."""
    (tmp_path / "specimens.yaml").write_text(SPECIMENS, encoding="utf-8")
    return RIG + "wear: {force: 75 N, frequency: 100 Hz, cycles: [10]}\n"


def test_it_runs_from_the_command_line(text, tmp_path):
    (tmp_path / "case.yaml").write_text(text, encoding="utf-8")
    settings = ("--set", "forces=[2 N]", "--set", "frequencies=[150 Hz, 160 Hz]")
    settings += ("--set", "resolution={harmonics: 1, samples: 32}")
    ended = invoke("run", tmp_path / "case.yaml", "--out", tmp_path / "out", *settings)
    assert ended.exit_code == 0, ended.output
    assert (tmp_path / "out" / "summary.json").exists()
