"""Tests of the error budget of wear runs: its parts, their report, and their accuracy."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fe_models.meshes.structure_mesh import MeshError
from sa_solver.load_history import LoadHistory
from sa_solver.types import Material
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import settings
from wear.coupled_state import Observer
from wear.laws import EnergyLaw
from workflow.analyses.wear import run
from workflow.analyses.wear.approximations.registry import REMEDIES
from workflow.analyses.wear.budget import finding
from workflow.analyses.wear.budget.report import (
    arrays_of,
    sentences,
    summary_of,
    warning_of,
)
from workflow.analyses.wear.checks import run_errors
from workflow.analyses.wear.model import wear_model
from workflow.kinds import load_case
from workflow.models.budget import probe_models, probe_runs
from workflow.models.budget.budget import error_budget, followed
from workflow.models.budget.names import PARTS
from workflow.models.budget.outcome import InterfaceOutcome, peak_change
from workflow.models.budget.parts import (
    ERROR_PER_TOLERANCE,
    UNCERTAIN,
    ResultError,
    peak_lowered,
)
from workflow.models.budget.probe_models import ProbeModels, late, scaled
from workflow.models.budget.probe_runs import STEPS, Numbers, probe_run
from workflow.models.contact import Contact, Wear
from workflow.models.loads import ContactFace, LoadSource
from workflow.models.uncoupled.body_pair import BodyPair
from workflow.models.uncoupled.given_loads import GivenLoads
from workflow.models.uncoupled.load_table import LoadTable
from workflow.models.wear import WearModel
from workflow.shell.folders.cache import DiskStore

CASES = Path(__file__).parents[4] / "cases"
QUIET = ("output.figures=false", "output.paraview=false", "stress.section=none")


BEGIN_PROBE_RUNS = finding.begin_probe_runs  # before the tests' runs do without


@pytest.fixture(autouse=True)
def _with_probe_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "begin_probe_runs", BEGIN_PROBE_RUNS)


# --- parts ----------------------------------------------------------------------------------------


def test_a_smooth_peak_is_all_but_what_it_is_on_cells_of_twice_the_size() -> None:
    """Hertz's p0 sqrt(1 - (x/a)²) falls by h²/8 p'' = 1 / (2 k²) halfway between two cells."""
    across = 41
    x = 2.0 * (np.arange(across) - across // 2) / across
    assert peak_lowered(np.sqrt(1.0 - x**2)[:, None]) == pytest.approx(1.0 / across**2, rel=0.02)


def test_a_peak_without_a_limit_is_found_by_its_cells() -> None:
    """Means of x^-1/2 over [0, h] and [0, 2h] have the ratio 1 : 1/√2, however small h is."""
    edges = np.linspace(0.0, 1.0, 65)
    means = np.diff(2.0 * np.sqrt(edges)) / np.diff(edges)
    assert peak_lowered(means[:, None]) == pytest.approx(1.0 - 1.0 / np.sqrt(2.0), rel=1e-12)
    in_plane = means[:, None] * np.ones((1, 7))
    assert peak_lowered(in_plane) == pytest.approx(peak_lowered(means[:, None]), rel=1e-12)


# --- report ---------------------------------------------------------------------------------------

ERROR = ResultError({"link": 0.004, "mesh": 0.03, "increments": None, "steps": 0.012})


def test_parts_add_up_and_unknown_ones_are_named() -> None:
    assert ERROR.total == pytest.approx(0.046)
    assert summary_of({"depth": ERROR})["depth"] == {**ERROR.parts, "total": ERROR.total}
    total, largest = sentences({"depth": ERROR})
    assert "depth at least 4.6 %" in total
    complete, _ = sentences({"depth": ResultError({"mesh": 0.03})})
    assert "depth 3.0 %" in complete
    assert all(part in largest for part in ("mesh 3.0 %", "steps 1.2 %", "unknown: increments"))
    (written,) = arrays_of({"depth": ERROR}).values()
    known = dict(zip([*PARTS, "total"], written, strict=True))
    assert np.isnan(known.pop("increments"))
    left = ERROR.parts | {
        "slot": 0.0,
        "grid": 0.0,
        "coupling": 0.0,
        "solver": 0.0,
        "total": ERROR.total,
    }
    assert known == {name: value for name, value in left.items() if value is not None}


def test_parts_of_opposite_sign_cancel_but_for_what_each_is_uncertain_by() -> None:
    """Half of each part remains: the root mean square for many random draws of the parts."""
    parts = {"mesh": 0.04, "increments": -0.03, "grid": 0.002}
    error = ResultError(parts, frozenset({"mesh", "increments"}))
    assert error.total == pytest.approx(np.sqrt(0.01**2 + 0.25 * 0.05**2 + 0.002**2), rel=1e-12)
    off = np.random.default_rng(1).normal(1.0, UNCERTAIN, (2, 100_000))
    drawn = off[0] * parts["mesh"] + off[1] * parts["increments"]
    assert np.sqrt(np.mean(drawn**2)) == pytest.approx(np.hypot(0.01, 0.025), rel=0.02)


def test_a_result_beyond_the_accuracy_is_a_warning_that_names_the_setting() -> None:
    errors = {"depth": ERROR, "worn_peak_pressure": ERROR}
    assert warning_of("pad", errors, 0.05, REMEDIES) is None
    warning = warning_of("pad", errors, 0.04, REMEDIES)
    assert warning is not None
    assert "depth 4.6 %" in warning.text
    assert "worn peak" not in warning.text  # edges may be farther off
    assert REMEDIES["mesh"] in warning.text


def loads_of(model: WearModel) -> LoadSource:
    return model.loads(DiskStore())


def probes_of(model: WearModel) -> ProbeModels:
    return ProbeModels.of(model, loads_of(model))


# --- peaks that wear steps leave ------------------------------------------------------------------


def test_a_peak_changes_by_its_height_and_not_by_where_it_ends() -> None:
    """A rim that only one contact has reached is no change of the peak.

    Two peaks that are equal by chance do not belong together either.
    """
    worn = np.zeros((2, 40, 1))
    worn[:, 10:30] = 80.0
    wider = worn.copy()
    wider[:, 9:31] = 78.0
    assert peak_change(worn, wider, at_rest=True) == pytest.approx(2.0 / 80.0)
    peaked, broad = worn.copy(), worn.copy()
    peaked[0, 10], broad[0, 10:13] = 120.0, 120.0
    assert peak_change(peaked, broad, at_rest=True) == pytest.approx(40.0 / 120.0)
    elsewhere = worn.copy()
    elsewhere[0, 20] = 120.0
    assert peak_change(peaked, elsewhere, at_rest=False) == 0.0
    assert peak_change(peaked, elsewhere, at_rest=True) == pytest.approx(40.0 / 120.0)
    assert peak_change(0.0 * worn, worn, at_rest=True) == 0.0


CYLINDER = CASES / "cylinder_wear.yaml"
# Of the cylinder that has worn to conformity, see its case: a closed form [MPa].
CONFORMING = 49.995
BARE = ("error_budget=known", "output={figures: false, paraview: false, report: false}")


@pytest.mark.parametrize("step", ["{kind: implicit}", "{kind: second_order}"])
def test_error_of_a_peak_due_to_steps(step, tmp_path) -> None:
    """Automatic steps of either kind leave 1.5 and 2.8 %; 44 and 27 % were once reported."""
    run = _summary_of(CYLINDER, tmp_path, *BARE, f"wear.step={step}")
    error, peak = (run["interface"][key] for key in ("step_error", "peak_pressure"))
    true = abs(peak["worn"] / CONFORMING - 1.0)
    assert 0.005 < true < 0.05
    assert true / 3.0 < error["pressure"] < 3.0 * true
    assert run["warnings"] == []


def _advice(warnings: list[str], about: str) -> str:
    """Return the setting that a warning names, as ``--set`` takes it."""
    (line,) = (line for line in warnings if about in line)
    key, value = re.search(r"(wear\.[a-z.]+): (\{[^}]*\}|[\d.e+-]+ \S+)[);]* \[", line).groups()
    return f"{key}={value}"


def test_advice_on_steps_of_given_accuracy_helps(tmp_path) -> None:
    """The setting that the budget names for the steps' error of a peak makes it smaller."""
    asked = (*BARE, "wear.step={kind: implicit}", "accuracy=0.2 %")
    first = _summary_of(CYLINDER, tmp_path / "first", *asked)
    advice = _advice(first["warnings"], "mainly due to steps")
    assert advice.startswith("wear.tolerance=")
    second = _summary_of(CYLINDER, tmp_path / "second", *asked, advice)
    errors = [
        abs(run["interface"]["peak_pressure"]["worn"] / CONFORMING - 1.0) for run in (first, second)
    ]
    assert errors[1] < 0.6 * errors[0]


# --- advice on link, mesh and coupling ------------------------------------------------------------

COARSE = ("mesh.flank_nodes=[13, 13]", "mesh.size=8 mm", "mesh.order=1", "contact.grid=[64, 64]")
FINE = ("mesh.flank_nodes=[47, 47]", "mesh.size=2 mm", "mesh.order=2", "contact.grid=[64, 64]")
BUDGET_KNOWN = ("error_budget=known", "stress.life.parameter=none", "output.report=false")


@pytest.fixture(scope="module")
def dovetail(tmp_path_factory):
    """Return the depth of a run of the section and the advice on each part, by its settings."""
    runs: dict[tuple[str, ...], tuple[float, dict[str, str]]] = {}

    def worn(*asked: str) -> tuple[float, dict[str, str]]:
        if asked not in runs:
            with pytest.MonkeyPatch.context() as patch:
                advised: dict[str, str] = {}
                patch.setattr(run_errors, "warning_of", lambda *given: advised.update(given[3]))
                folder = tmp_path_factory.mktemp("run") / "out"
                summary = _summary(folder, *BUDGET_KNOWN, *asked)
            runs[asked] = summary["intrados"]["depth_1"], advised
        return runs[asked]

    return worn


def _taken(advice: str) -> tuple[str, ...]:
    """Return the settings that an advice names, as ``--set`` takes them."""
    return tuple(setting.replace(": ", "=", 1) for setting in advice.split(" and "))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("part", "own"),
    [
        ("mesh", ()),
        ("mesh", ("mesh.order=2",)),
        ("link", ()),
        ("link", ("contact.link=half_space",)),
    ],
)
def test_advice_on_mesh_and_link_helps(part, own, dovetail) -> None:
    """The reference mesh is so fine that its error is negligible, and linked to its nodes."""
    true, _ = dovetail(*FINE)
    before, advised = dovetail(*COARSE, *own)
    taken = _taken(advised[part])
    assert not set(taken) & {*COARSE, *own}
    after, _ = dovetail(*COARSE, *own, *taken)
    assert abs(after - true) < 0.8 * abs(before - true)


@pytest.mark.slow
@pytest.mark.parametrize(
    "own",
    [
        ("coupling.resultants=constant",),
        ("coupling.drift=20 %",),  # which is never reached
        (),
        ("coupling.resultants=every", "wear.step.cycles=200000"),
    ],
)
def test_advice_on_loads_that_follow_helps(own, dovetail) -> None:
    """In the reference, loads follow after every jump, of which there are many."""
    many = "coupling.resultants=every", "wear.step.cycles=20000"
    true, _ = dovetail(*COARSE, *many)
    before, advised = dovetail(*COARSE, *own)
    taken = _taken(advised["coupling"])
    assert not set(taken) & set(own)
    after, _ = dovetail(*COARSE, *own, *taken)
    assert abs(after - true) < 0.8 * abs(before - true)


# --- probe runs -----------------------------------------------------------------------------------


COARSE_SECTION = ("mesh.flank_nodes=[12, 12]", "mesh.size=8 mm", "contact.grid=[64, 64]")
COARSE_SECTION += ("mesh.order=1",)


@pytest.fixture(scope="module")
def section() -> WearModel:
    """Return the section of the default joint on a coarse mesh of first order."""
    return wear_model(load_case(CASES / "dovetail_2d.yaml", COARSE_SECTION))


def neighbour(probes: ProbeModels, part: str) -> WearModel:
    """Return the probe model with the other setting of a part."""
    return probes.neighbours[part].model


def on_grid(model: WearModel, *cells: int) -> WearModel:
    return replace(model, contacts=replace(model.contacts, grid=cells))


def test_probe_models_differ_in_one_thing_each(section) -> None:
    probes = probes_of(section)
    own, finer, other = probes.own, neighbour(probes, "mesh"), neighbour(probes, "grid")
    assert "link" not in probes.neighbours
    assert probes.coupled
    assert replace(finer, structure=replace(finer.structure, mesh=own.structure.mesh)) == own
    assert on_grid(other, *own.contacts.grid) == own
    mesh = finer.structure.mesh
    assert (mesh.flank_nodes[0] - 1, mesh.size, mesh.order) == (2 * 12, 4.0, 2)
    assert other.contacts.grid[0] == 2 * own.contacts.grid[0]
    assert probes.neighbours["grid"].share == pytest.approx(4.0 / 3.0)


def test_few_strips_are_compared_with_those_of_a_probe_run(section) -> None:
    """At second order, 24 cells are off by 64² / (64² - 24²) of their difference from 64."""
    few = probes_of(on_grid(section, 24, 24))
    assert few.own.contacts.grid == (64, 24)
    assert neighbour(few, "grid").contacts.grid == (24, 24)
    assert few.neighbours["grid"].share == pytest.approx(-1.0 / (1.0 - (24 / 64) ** 2))
    many = probes_of(on_grid(section, 256, 24))
    assert many.own.contacts.grid == (64, 24)
    assert neighbour(many, "grid").contacts.grid == (128, 24)
    assert many.neighbours["grid"].share == pytest.approx(4.0 / 3.0 / 4**2)


def test_a_joint_in_space_is_judged_by_its_section() -> None:
    model = wear_model(load_case(CASES / "dovetail.yaml"))
    probes = probes_of(model)
    assert not probes.same
    assert probes.own.structure.dimension == neighbour(probes, "mesh").structure.dimension == 2
    assert probes.own.structure.mesh == model.structure.mesh


def test_a_probe_run_that_fails_leaves_its_own_part_unknown(section, monkeypatch) -> None:
    """The structure of the finer mesh fails, and the other probe runs do not."""
    begun = []

    class Run:
        states = (SimpleNamespace(drift=np.array([0.0, 0.1, 0.1, 0.1])),)

        def __init__(self) -> None:
            self.worn_and_pressed: Numbers = {"flank": {"depth": float(len(begun))}}

    def run_of(model, source, kind="constant", first=None):
        if model == failing:
            raise MeshError("no such mesh")
        begun.append((model, kind, first))
        return Run()

    monkeypatch.setattr(probe_models, "probe_run", run_of)
    cases = probes_of(section)
    failing = neighbour(cases, "mesh")
    probed = cases.probed(None, lambda model: None)
    coupling = scaled(probed.errors["coupling"]["flank"], late(probed.rate, np.ones(1)))
    assert probed.failures == {"mesh": "no such mesh"}
    # That of the case wears 1, under unworn loads 2, and so on twice as many strips 3.
    share = cases.neighbours["grid"].share
    assert probed.errors["grid"]["flank"]["depth"] == pytest.approx(-share / 3.0)
    assert coupling["depth"] == pytest.approx(STEPS / (STEPS - 1.0), rel=0.01)
    assert begun[1][:2] == (cases.own, "constant")
    assert begun[1][2] is not None

    failing = cases.own
    probed = cases.probed(None, lambda model: None)
    assert not probed.errors
    assert probed.failures == {"mesh, grid and coupling": "no such mesh"}


def deepest(model, source, kind="constant") -> float:
    """Return the largest depth of the first flank in a probe run."""
    end = probe_run(model, source, kind).states[-1]
    return float(end.interfaces[0].surfaces.depth.max())


@pytest.mark.slow
def test_probe_runs_show_what_loads_that_follow_change(section, monkeypatch) -> None:
    """The references are probe runs with four times as many steps, with and without updates."""
    cases, source = probes_of(section), loads_of(section)
    probed = replace(cases, neighbours={}).probed(source, lambda _: source)
    assert not probed.failures
    monkeypatch.setattr(probe_runs, "STEPS", 4 * STEPS)
    constant, every = (deepest(cases.own, source, kind) for kind in ("constant", "every"))
    true = constant / every - 1.0
    coupling = late(probed.rate, np.ones(1)) * probed.errors["coupling"]["intrados"]["depth"]
    assert 0.5 < coupling / true < 2.0


@pytest.mark.parametrize(
    ("resultants", "shares"),
    [("constant", [1.0]), ("every", [0.1, 0.3, 0.6]), ("drift", [0.4, 0.6])],
)
def test_loads_are_those_of_the_last_solution(resultants, shares) -> None:
    state = SimpleNamespace(cycles=np.array([0.0, 1e3, 4e3, 1e4]), drift=np.array([0, 1, 3, 2.0]))
    wear = Wear(cycles=1e4, resultants=resultants, drift=2.0)
    np.testing.assert_allclose(followed(wear, state), shares, rtol=1e-12)


@pytest.mark.parametrize("rest", [0.5, 1.5, 2.5])
def test_the_error_of_loads_that_follow_late_is_found(rest) -> None:
    """The error of h' = 1 - z h is found, whatever the steps.

    Slow changes neglect squares of the shares of the cycles.
    """
    shares = np.array([0.2, 0.5, 0.3])
    h, three, exact = 0.0, 0.0, (1.0 - np.exp(-rest)) / rest
    for share in shares:
        h += share * (1.0 - rest * h)
    for _ in range(STEPS):
        three += (1.0 - rest * three) / STEPS
    found = late(rest, shares) * (1.0 - three)
    assert found == pytest.approx(h - exact, rel=1e-12)
    assert late(0.0, shares) == pytest.approx(1.5 * np.sum(shares**2), rel=0.01)


@pytest.mark.slow
def test_probe_runs_show_the_error_due_to_the_mesh(section) -> None:
    """Meshes of two orders and sizes are compared with one of negligible error."""
    cases = probes_of(section)
    probed = cases.probed(loads_of(section), loads_of)
    assert not probed.failures
    errors = probed.errors["mesh"]["intrados"]

    joint = cases.own.structure
    fine = replace(joint.mesh, flank_nodes=(61, 61), size=1.5, order=2)
    truth = replace(cases.own, structure=replace(joint, mesh=fine))
    own, exact = (
        probe_run(model, loads_of(model), "every").worn["intrados"] for model in (cases.own, truth)
    )
    for name in ("depth", "volume"):
        true = abs(own[name] / exact[name] - 1.0)
        assert 0.5 < errors[name] / true < 2.0, (name, errors[name], true)


def test_grids_are_compared_by_their_order() -> None:
    """For a body without a structure, the sphere's scar is computed on half as many cells."""
    model = wear_model(load_case(CASES / "sphere_wear.yaml"))
    cases = probes_of(model)
    coarser = model.contacts.grid[0] / cases.own.contacts.grid[0]
    assert cases.neighbours["grid"].share == pytest.approx(-1.0 / 3.0 / coarser**2)
    assert cases.own.contacts.grid[0] == 2 * neighbour(cases, "grid").contacts.grid[0]
    assert cases.neighbours.keys() == {"grid"}
    assert not cases.coupled


# --- models in Python ---------------------------------------------------------------------------


@pytest.mark.slow
def test_the_budget_of_a_model_is_that_of_the_run_of_its_case(tmp_path) -> None:
    """A run stores its states, and solves contacts and probe runs in processes of their own."""
    short = "wear.cycles=2e4", "wear.step={kind: implicit, cycles: 1e4}"
    case, overrides = CASES / "dovetail_2d.yaml", (*COARSE_SECTION, *short)
    summary = _summary_of(case, tmp_path / "out", *QUIET, *overrides)
    budget = error_budget(wear_model(load_case(case, [*QUIET, *overrides])))
    assert not budget.failures
    assert set(budget.contacts) == {"intrados", "extrados"}
    for name, errors in budget.contacts.items():
        of_run = summary[name]["error"]
        assert errors.keys() == of_run.keys() - {"notch_stress"}
        for result, error in errors.items():
            assert error.numbers == pytest.approx(of_run[result], rel=1e-9, abs=1e-12)
            assert error.parts["mesh"] is not None
    assert str(budget).count("unknown") == 0


def test_what_no_probe_run_judges_is_unknown() -> None:
    """The mesh behind given loads is unknown, and bodies without one have no such error."""
    zero = np.zeros(2)
    face = ContactFace.nominal("pad", (0.8, 1.0), lambda x, y: x**2 / 20.0, line=True)
    forces = LoadHistory([50.0, 50.0], [20.0, -20.0], *[zero] * 6, sliding=zero > 0.0)
    steel, law = Material(210e3, 0.3), EnergyLaw(1e-8)
    contact = Contact((48, 1), (steel, steel), (law, law), 0.6, method="full")
    model = WearModel(GivenLoads([(face, forces)]), contact, Wear(cycles=1e3))
    budget = error_budget(model)
    depth = budget.contacts["pad"]["depth"]
    assert depth.parts["mesh"] is None
    assert "mesh" in depth.unknown
    assert "coupling" not in depth.parts
    assert depth.parts["solver"] == ERROR_PER_TOLERANCE * contact.tolerance
    assert "unknown" in str(budget)


def test_the_budget_of_a_run_that_has_ended_needs_no_further_wear() -> None:
    steel, law = Material(210e3, 0.3), EnergyLaw(1e-8)
    bodies = BodyPair(lambda x, y: x**2 / 20.0, (0.8, 1.0), LoadTable.stroke(50.0, 0.02), line=True)
    model = WearModel(bodies, Contact((48, 1), (steel, steel), (law, law), 0.6), Wear(cycles=1e3))

    class Last(Observer):
        def jump_finished(self, before, after) -> None:
            self.state = after

    first, further = Last(), Last()
    budget = error_budget(model, [first])
    assert error_budget(model, [further], first.state).contacts == budget.contacts
    assert not hasattr(further, "state")


# --- wear that has stopped ------------------------------------------------------------------------


def test_wear_that_has_stopped_is_reported() -> None:
    """Depth and volume of both bodies count, and it must have lasted half of the cycles."""
    cycles = np.array([0.0, 1e3, 1e4, 1e5, 1e6])

    def stopped(*depths: float) -> float | None:
        kinetics = np.outer([0.0, *depths], [1.0, 0.5, 2.0, 1.0, 1e3])
        found = SimpleNamespace(kinetics=kinetics, cycles=cycles)
        return InterfaceOutcome.stopped.fget(found)

    assert stopped(0.5, 0.992, 0.999, 1.0) == 1e4
    assert stopped(0.5, 0.9, 0.999, 1.0) == 1e5
    assert stopped(0.5, 0.7, 0.98, 1.0) is None
    assert stopped(0.0, 0.0, 0.0, 0.0) is None


# --- runs -----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_run_estimates_its_errors(tmp_path) -> None:
    """The parts add up to the difference of depth and volume from a finer run."""
    coarse = "mesh.flank_nodes=[14, 14]", "mesh.size=7 mm", "mesh.order=1", "contact.grid=[64, 64]"
    coarse += ("load_path.increments=[4, 7]",)
    fine = "mesh.flank_nodes=[61, 61]", "mesh.size=2 mm", "mesh.order=2", "contact.grid=[128, 128]"
    fine += "load_path.increments=[16, 28]", "wear.tolerance=0.3 %"
    fine += "coupling.drift=0.5 %", "wear.step.kind=second_order", "error_budget=known"
    own, exact = (
        _summary(tmp_path / name, *overrides)["intrados"]
        for name, overrides in (("own", coarse), ("exact", fine))
    )
    for result, name in (("depth", "depth_1"), ("volume", "volume_1")):
        true = abs(own[name] / exact[name] - 1.0)
        assert 0.5 < own["error"][result]["total"] / true < 2.0
    assert exact["error"]["depth"]["mesh"] is None


def _summary(folder, *overrides):
    return _summary_of(CASES / "dovetail_2d.yaml", folder, *QUIET, *overrides)


def _summary_of(case, folder, *overrides):
    ending = invoke("run", case, "--out", folder, *settings(overrides))
    assert ending.exit_code == 0, ending.stderr
    return json.loads((folder / "summary.json").read_text("utf-8"))
